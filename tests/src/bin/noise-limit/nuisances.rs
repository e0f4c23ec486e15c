//! What real robots have besides: an acceleration that comes late, sensors' gains and links' masses that are not what they
//! are taken for. Sought, intervals cover, theirs as well; not sought, the fit says that something is wrong.
//!
//! A gain that all axes share looks like a mass, a stiffness and a damping that all links share: if both are sought, what is
//! known beforehand decides. One error then moves nearly all intervals of a run.

use anyhow::{Result, anyhow};
use flexid::simulation::experiment::Cut;
use flexid::simulation::force::OVERSAMPLING;
use flexid_core::calibration::Nuisances;
use flexid_core::chain::{Chain, Joint};
use flexid_core::unknowns::{Coordinate, Nuisance};
use flexid_core::verdict::Verdict;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::figure::Figure;
use crate::find::{Found, Task, find};
use crate::intervals::Intervals;
use crate::linear::motion;
use crate::records::{Record, Sensors, Signals};
use crate::study::{Purpose, Study, random};

/// By how much the acceleration comes late, s.
const DELAY_S: f64 = 0.3e-3;
/// How far each axis's gain is off, either way; together with masses, its standard deviation.
const GAIN: f64 = 0.1;
/// How far each link's mass is off, either way; together with gains, its standard deviation.
const MASS: f64 = 0.05;
/// What is known of them beforehand, as standard deviations: of the delay hardly anything, of the others their size.
const KNOWN: Nuisances = Nuisances {
    delay: Some(1e-3),
    acceleration_gain: Some(GAIN),
    force_gain: None,
    misalignment: None,
    mass: Some(MASS),
};
/// How far from 95 % the share of the intervals that cover may be, percent.
const OFF: f64 = 3.0;

/// What is off, of delay, gains and masses.
const CASES: [(&str, [bool; 3]); 4] = [
    ("0.3 ms delay", [true, false, false]),
    ("gains 10 % off", [false, true, false]),
    ("masses 5 % off", [false, false, true]),
    ("all three", [true, true, true]),
];

/// What is off in one run.
struct Wrong {
    delay_s: f64,
    gain: [f64; 3],
    mass: Vec<f64>,
}

/// What came of one run.
struct Outcome {
    /// Errors of parameters and of nuisances, in standard deviations, if what is off is sought.
    scores: Option<[Vec<f64>; 2]>,
    /// If it is not sought: whether the consistency test raises its flag, and how many parameters it calls identified.
    flagged: bool,
    claims: usize,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let mut figures = Vec::new();
    for (case, (what, off)) in CASES.into_iter().enumerate() {
        let one = |robot: u64| {
            let number = robot + 1_000_000 * (case as u64 + 1);
            let cuts = &cuts[robot as usize % cuts.len()];
            outcome(study, cuts, off, number, details)
        };
        let all = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
        let [mut parameters, mut nuisances] = [Intervals::default(), Intervals::default()];
        for [own, beside] in all.iter().filter_map(|outcome| outcome.scores.as_ref()) {
            parameters.push(own.iter().copied());
            nuisances.push(beside.iter().copied());
        }
        let one = off[1] && off[2];
        for (of, intervals) in [("parameters", parameters), ("its own", nuisances)] {
            let title = format!("{what}, sought: {of}");
            figures.push(intervals.cover(&title, OFF, one));
            figures.push(intervals.size(&title, one));
        }
        let unexplained = all.iter().filter(|outcome| outcome.scores.is_none()).count();
        figures.push(Figure::unexplained(&format!("{what}, sought"), robots, unexplained));
        let flagged = all.iter().filter(|outcome| outcome.flagged).count();
        let claims = all.iter().filter(|outcome| outcome.claims > 0).count();
        let title = format!("{what}, not sought: the consistency test raises its flag");
        figures.push(
            Figure::count(title, robots, flagged == robots, flagged, "all")
                .remark(format_args!("{claims} with a parameter called identified")),
        );
    }
    Ok(figures)
}

fn outcome(
    study: &Study,
    cuts: &[Cut],
    [delay, gain, mass]: [bool; 3],
    number: u64,
    details: bool,
) -> Result<Outcome> {
    let truth = study.robot(number);
    let mut draw = random(Purpose::Draw, number);
    let mut factor = |yes: bool, off: f64| match (yes, gain && mass) {
        (false, _) => 1.0,
        (true, false) if draw.uniform(0.0, 1.0) < 0.5 => 1.0 - off,
        (true, false) => 1.0 + off,
        // The records do not tell: intervals are as honest as what is known beforehand.
        (true, true) => (off * draw.normal()).exp(),
    };
    let wrong = Wrong {
        delay_s: if delay { DELAY_S } else { 0.0 },
        gain: [0, 1, 2].map(|_| factor(gain, GAIN)),
        mass: study.chain.joints().iter().map(|_| factor(mass, MASS)).collect(),
    };
    let chain = heavier(&study.chain, &wrong.mass)?;
    let mut sensors = Sensors::new(study, random(Purpose::Noise, number))?;
    let record = |cut: &Cut| -> Result<Record> {
        let acceleration: Vec<Vector3<f64>> = motion(&chain, &truth, &wrong.late(cut)).acceleration;
        let read = |value: &Vector3<f64>| value.component_mul(&Vector3::from(wrong.gain));
        let acceleration: Vec<_> = acceleration.iter().map(read).collect();
        let force: Vec<_> = cut.force.iter().step_by(OVERSAMPLING).copied().collect();
        sensors.measure(&Signals { pose: &cut.pose, force: &force, acceleration: &acceleration })
    };
    let records = cuts.iter().map(record).collect::<Result<Vec<_>>>()?;
    let nuisances = Nuisances {
        delay: KNOWN.delay.filter(|_| delay),
        acceleration_gain: KNOWN.acceleration_gain.filter(|_| gain),
        mass: KNOWN.mass.filter(|_| mass),
        ..Nuisances::default()
    };
    let search = || random(Purpose::Search, number).0;
    let found = find(&Task { nuisances, ..study.task() }, &records, search())?;
    let ignorant = find(&study.task(), &records, search())?;
    if details {
        print(number, "sought", &found);
        print(number, "not sought", &ignorant);
    }
    let told = |index: &usize| found.verdicts[*index] != Verdict::NotObservable;
    let errors = found.errors(&truth);
    let own = (0..errors.len()).filter(told).map(|index| errors[index] / found.deviations[index]);
    let own: Vec<f64> = own.collect();
    let beside = found.estimate.nuisances.iter().map(|nuisance| wrong.score(nuisance)).collect();
    Ok(Outcome {
        scores: found.is_consistent().then_some([own, beside]),
        flagged: ignorant.estimate.size_objects || ignorant.estimate.whiteness_objects,
        claims: ignorant.identified(),
    })
}

/// The robot as it is: every link as many times as heavy. By other means than those by which a fit undoes it.
fn heavier(chain: &Chain, mass: &[f64]) -> Result<Chain> {
    let heavier = |(joint, scale): (&Joint, &f64)| {
        let mut joint = *joint;
        joint.link.mass *= scale;
        joint.link.inertia *= *scale;
        joint
    };
    let joints: Vec<Joint> = chain.joints().iter().zip(mass).map(heavier).collect();
    Chain::new(&joints, *chain.tcp()).map_err(|error| anyhow!("no robot: {error:?}"))
}

fn print(number: u64, how: &str, found: &Found) {
    let estimate = &found.estimate;
    eprintln!(
        "robot {number}, {how}: {:?}, χ²/dof {:.3}, whiteness {:.1}, {} starts, {} identified",
        estimate.acceptance,
        estimate.consistency,
        estimate.whiteness,
        found.starts,
        found.identified()
    );
}

impl Wrong {
    /// The same cut, later: what it does to a linear robot comes as much later, however fine the delay.
    fn late(&self, cut: &Cut) -> Cut {
        let steps = (self.delay_s * cut.rate_hz * OVERSAMPLING as f64).round() as usize;
        let before = std::iter::repeat_n(Vector3::zeros(), steps);
        let force = before.chain(cut.force.iter().copied()).take(cut.force.len()).collect();
        Cut { force, ..cut.clone() }
    }

    /// Error of a nuisance in its standard deviations.
    fn score(&self, found: &Nuisance) -> f64 {
        let error = match found.coordinate {
            Coordinate::Delay => found.value - self.delay_s,
            Coordinate::AccelerationGain(axis) => (found.value / self.gain[axis]).ln(),
            Coordinate::Mass(link) => (found.value / self.mass[link]).ln(),
            _ => f64::NAN,
        };
        error / found.deviation
    }
}
