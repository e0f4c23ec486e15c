//! The nuisances of real robots: an acceleration that comes late, and sensors' gains, an accelerometer's axes and
//! links' masses that differ from the assumed ones. If they are sought, intervals cover, theirs as well. If they are
//! not sought, the fit reports that the model is wrong, and calls no parameter identified.
//!
//! A gain that all axes share acts like a mass, a stiffness and a damping that all links share. If both are sought,
//! the priors decide between them. One error then moves nearly all intervals of a run.

use anyhow::{Result, anyhow};
use flexid_core::chain::{Chain, Joint};
use flexid_core::imperfection::{FoundImperfection, Imperfection, Sensor};
use flexid_core::verdict::Verdict;
use flexid_simulation::experiment::Cut;
use flexid_simulation::force::OVERSAMPLING;
use nalgebra::{Rotation3, Vector3};
use rayon::prelude::*;

use crate::figure::Figure;
use crate::find::{Found, Task, find};
use crate::intervals::{Intervals, percent};
use crate::linear::motion;
use crate::records::{Record, Sensors, Signals};
use crate::study::{Purpose, Study, random};

/// Delay of the acceleration, s.
const DELAY_S: f64 = 0.3e-3;
/// Error of each axis's gain, either way; together with masses, its standard deviation.
const GAIN: f64 = 0.1;
/// Error of each link's mass, either way; together with gains, its standard deviation.
const MASS: f64 = 0.05;
/// Angle by which the accelerometer is turned, about an arbitrary axis: a degree, rad.
const TURN: f64 = 0.01745;
/// Prior standard deviation of the delay, which hardly limits it, s.
const DELAY_KNOWN_S: f64 = 1e-3;
/// Largest distance from 95 % of the share of the intervals that cover, percent.
const OFF: f64 = 3.0;

/// Keys of what is sought, each with the standard deviation of its prior.
type Keys = &'static [(&'static str, f64)];

const DELAY: (&str, f64) = ("delay_s", DELAY_KNOWN_S);
const ACCELERATION_GAIN: (&str, f64) = ("acceleration_gain", GAIN);
const FORCE_GAIN: (&str, f64) = ("force_gain", GAIN);
const ANGLE: (&str, f64) = ("accelerometer_angle_rad", TURN);
const LINK_MASS: (&str, f64) = ("link_mass", MASS);

/// The nuisances, and their priors. A prior is the size of the error, except for the delay.
const CASES: [(&str, Keys); 6] = [
    ("0.3 ms delay", &[DELAY]),
    ("acceleration gains 10 % off", &[ACCELERATION_GAIN]),
    ("masses 5 % off", &[LINK_MASS]),
    ("these three together", &[DELAY, ACCELERATION_GAIN, LINK_MASS]),
    ("force gains 10 % off", &[FORCE_GAIN]),
    ("accelerometer turned by 1°", &[ANGLE]),
];

/// The nuisances of one run.
struct Wrong {
    delay_s: f64,
    acceleration_gain: Vector3<f64>,
    force_gain: Vector3<f64>,
    /// Turns from the assumed axes of the accelerometer to the true ones, about each axis after those before.
    turn: Vector3<f64>,
    mass: Vec<f64>,
}

/// The result of one run.
struct Outcome {
    /// Errors of parameters and of nuisances, in standard deviations, if the nuisances are sought.
    scores: Option<[Vec<f64>; 2]>,
    /// True if the consistency test raises its flag, if the nuisances are not sought.
    flagged: bool,
    /// Errors of the parameters that are called identified all the same, if the nuisances are not sought.
    claims: Vec<f64>,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let mut figures = Vec::new();
    for (case, (what, known)) in CASES.iter().enumerate() {
        let one = |robot: u64| {
            let number = robot + 1_000_000 * (case as u64 + 1);
            let cuts = &cuts[robot as usize % cuts.len()];
            outcome(study, cuts, known, number, details)
        };
        let all = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
        let [mut parameters, mut nuisances] = [Intervals::default(), Intervals::default()];
        for [own, beside] in all.iter().filter_map(|outcome| outcome.scores.as_ref()) {
            parameters.push(own.iter().copied());
            nuisances.push(beside.iter().copied());
        }
        let one = known.len() > 1;
        for (of, intervals) in [("parameters", parameters), ("its own", nuisances)] {
            let title = format!("{what}, sought: {of}");
            figures.push(intervals.cover(&title, OFF, one));
            figures.push(intervals.size(&title, one));
        }
        let unexplained = all.iter().filter(|outcome| outcome.scores.is_none()).count();
        figures.push(Figure::unexplained(&format!("{what}, sought"), robots, unexplained));
        figures.push(not_sought(what, &all));
    }
    Ok(figures)
}

/// The figure of fits that do not seek the nuisances. Each must flag a wrong model and identify nothing.
fn not_sought(what: &str, all: &[Outcome]) -> Figure {
    let flagged = all.iter().filter(|outcome| outcome.flagged).count();
    let claiming = all.iter().filter(|outcome| !outcome.claims.is_empty()).count();
    let claims: Vec<f64> = all.iter().flat_map(|outcome| outcome.claims.iter().copied()).collect();
    let held = flagged == all.len() && claiming == 0;
    let what = format!(
        "{what}, not sought: the consistency test objects, and nothing is called identified"
    );
    let figure = Figure::count(what, all.len(), held, flagged, "all");
    if claims.is_empty() {
        return figure;
    }
    figure.remark(format_args!(
        "{claiming} call parameters identified, {} of them, whose intervals cover in {:.1} %",
        claims.len(),
        percent(&claims)
    ))
}

fn outcome(
    study: &Study,
    cuts: &[Cut],
    known: Keys,
    number: u64,
    details: bool,
) -> Result<Outcome> {
    let truth = study.robot(number);
    let wrong = Wrong::draw(known, study.chain.joints().len(), number);
    let chain = heavier(&study.chain, &wrong.mass)?;
    let mut sensors = Sensors::new(study, random(Purpose::Noise, number))?;
    let mut record = |cut: &Cut| -> Result<Record> {
        let acceleration = motion(&chain, &truth, &wrong.late(cut)).acceleration;
        let turn = |axis: usize| Rotation3::new(Vector3::ith(axis, wrong.turn[axis]));
        let back = (turn(0) * turn(1) * turn(2)).inverse();
        let read = |value: &Vector3<f64>| (back * value).component_mul(&wrong.acceleration_gain);
        let acceleration: Vec<_> = acceleration.iter().map(read).collect();
        let force = cut.force.iter().step_by(OVERSAMPLING);
        let force: Vec<_> = force.map(|value| value.component_mul(&wrong.force_gain)).collect();
        sensors.measure(&Signals {
            pose: &cut.pose,
            force: &force,
            acceleration: &acceleration,
            struck: None,
        })
    };
    let records = cuts.iter().map(&mut record).collect::<Result<Vec<_>>>()?;
    let search = || random(Purpose::Search, number).0;
    let found = find(&Task { sought: known, ..study.task() }, &records, search())?;
    let ignorant = find(&study.task(), &records, search())?;
    if details {
        print(number, "sought", &found);
        print(number, "not sought", &ignorant);
    }
    let determined = |index: &usize| found.verdicts[*index] != Verdict::NotObservable;
    let errors = found.errors(&truth);
    let own =
        (0..errors.len()).filter(determined).map(|index| errors[index] / found.deviations[index]);
    let own: Vec<f64> = own.collect();
    let wrong_errors = ignorant.errors(&truth);
    let claims = (0..errors.len()).filter(|index| ignorant.identifies(*index));
    let claims = claims.map(|index| wrong_errors[index] / ignorant.deviations[index]).collect();
    let beside = found.estimate.imperfections.iter().map(|own| wrong.score(own)).collect();
    Ok(Outcome {
        scores: found.is_consistent().then_some([own, beside]),
        flagged: ignorant.estimate.size_objects || ignorant.estimate.structure_objects,
        claims,
    })
}

/// The true robot, with the mass of every link scaled. It is made by other means than those by which a fit corrects
/// masses.
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
        "robot {number}, {how}: {:?}, χ²/dof {:.3}, structure {:.3}, {} starts, {} identified",
        estimate.acceptance,
        estimate.consistency,
        estimate.structure.size,
        found.starts,
        found.identified()
    );
}

impl Wrong {
    fn draw(known: Keys, joints: usize, number: u64) -> Self {
        let mut draw = random(Purpose::Draw, number);
        let together = known.len() > 1;
        let prior =
            |(key, prior): (&str, f64)| known.iter().any(|own| own.0 == key).then_some(prior);
        let mut factor = |own| match prior(own) {
            None => 1.0,
            // The records do not determine the factor, so that intervals are as right as the prior. It is therefore
            // drawn from the prior.
            Some(off) if together => (off * draw.normal()).exp(),
            Some(off) if draw.uniform(0.0, 1.0) < 0.5 => 1.0 - off,
            Some(off) => 1.0 + off,
        };
        Self {
            delay_s: prior(DELAY).map_or(0.0, |_| DELAY_S),
            acceleration_gain: [0, 1, 2].map(|_| factor(ACCELERATION_GAIN)).into(),
            mass: (0..joints).map(|_| factor(LINK_MASS)).collect(),
            force_gain: [0, 1, 2].map(|_| factor(FORCE_GAIN)).into(),
            turn: prior(ANGLE).map_or_else(Vector3::zeros, |angle| {
                Vector3::from_fn(|_, _| draw.normal()).normalize() * angle
            }),
        }
    }

    /// The cut with a delay. The response of a linear robot has the same delay, however fine.
    fn late(&self, cut: &Cut) -> Cut {
        let steps = (self.delay_s * cut.rate_hz * OVERSAMPLING as f64).round() as usize;
        let before = std::iter::repeat_n(Vector3::zeros(), steps);
        let force = before.chain(cut.force.iter().copied()).take(cut.force.len()).collect();
        Cut { force, ..cut.clone() }
    }

    /// Error of a nuisance in its standard deviations.
    fn score(&self, found: &FoundImperfection) -> f64 {
        let truth = match found.imperfection {
            Imperfection::Delay => self.delay_s,
            Imperfection::Gain(Sensor::Accelerometer, axis) => self.acceleration_gain[axis].ln(),
            Imperfection::Gain(Sensor::Force, axis) => self.force_gain[axis].ln(),
            Imperfection::Turn(Sensor::Accelerometer, axis) => self.turn[axis],
            Imperfection::Mass(link) => self.mass[link].ln(),
            _ => f64::NAN,
        };
        (found.value - truth) / found.deviation
    }
}
