//! Published arms of six and seven joints, identified within bounds that follow from their masses.

use std::f64::consts::TAU;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use flexid::urdf::{Base, import};
use flexid_core::chain::Chain;
use flexid_core::parameters::{Bounds, Bushing, Bushings, DAMPING_RATIO};
use flexid_core::sensors::Accelerometer;
use flexid_core::spectrum::Measurement;
use flexid_core::verdict::Verdict;
use flexid_simulation::experiment::Cut;
use flexid_simulation::force::OVERSAMPLING;
use flexid_simulation::scenario::Experiment;
use nalgebra::{Matrix3, Point3, Translation3, Vector3};
use rayon::prelude::*;

use crate::common::Random;
use crate::figure::{Figure, median};
use crate::find::{Found, Task, find};
use crate::intervals::Intervals;
use crate::linear::motion;
use crate::records::{Sensors, Signals};
use crate::spread;
use crate::study::{Purpose, Study, random};

/// A published URDF.
struct Arm {
    name: &'static str,
    file: &'static str,
    tcp: &'static str,
    /// Factor on the masses of the file. The KR210's masses in the file are four times those of the robot.
    mass: f64,
}

const ARMS: [Arm; 5] = [
    Arm { name: "KR210", file: "kuka_kr210l150.urdf", tcp: "tool0", mass: 0.25 },
    Arm { name: "IRB6640", file: "abb_irb6640_185_280.urdf", tcp: "tool0", mass: 1.0 },
    Arm { name: "M-20iA", file: "fanuc_m20ia.urdf", tcp: "tool0", mass: 1.0 },
    Arm { name: "UR10e", file: "universal_ur10e.urdf", tcp: "tool0", mass: 1.0 },
    Arm { name: "iiwa", file: "kuka_iiwa14.urdf", tcp: "iiwa_link_ee", mass: 1.0 },
];

/// Number of cuts of a run, smallest share of robots that must be right, and largest share of robots that may be
/// wrong although a parameter is called identified. The causes are a wrong minimum that noise explains, and intervals
/// that are too narrow.
const SHARES: [(usize, f64, f64); 3] = [(8, 0.97, 0.01), (3, 0.98, 0.0), (1, 0.6, 0.02)];
/// Number of cuts of a few robots.
const FEW_POSES: usize = 3;
/// Numbers of the few robots, one of each arm.
const FEW: [usize; 5] = [4, 5, 6, 7, 33];
/// χ² per degree of freedom below which a run is right.
const EXPLAINED: f64 = 1.1;
/// Largest error of an identified parameter in a right run, in standard deviations.
const FARTHEST: f64 = 5.0;
/// Largest distance from 95 % of the share of the intervals that cover, in per cent.
const OFF: f64 = 2.0;
/// Natural frequencies of each bushing with all that it carries, Hz: four of the bounds' six decades of stiffness.
/// With the softest bushings of the bounds a robot sags by decimetres.
const NATURAL_HZ: [f64; 2] = [6.3, 630.0];
/// Corner of the filters before sampling, over the sampling rate. The filters remove resonances where they would fold
/// back into the band.
const CORNER: f64 = 0.5;
/// Half the length of the filters, samples.
const HALF_LENGTH: usize = 4;

/// The result of one robot.
struct Run {
    arm: &'static str,
    found: Found,
    errors: Vec<f64>,
    seconds: f64,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let arms = ARMS.iter().map(|arm| Ok((arm.name, arm.chain()?))).collect::<Result<Vec<_>>>()?;
    let run = |robots: &[usize], poses: usize| {
        let one = |&number: &usize| {
            let (name, chain) = &arms[number % arms.len()];
            let run = Run::new(study, name, chain, poses, number as u64)?;
            if details {
                run.print(poses, number);
            }
            Ok(run)
        };
        robots.par_iter().map(one).collect::<Result<Vec<_>>>()
    };
    if robots <= FEW.len() {
        return Ok(figures(&run(&FEW, FEW_POSES)?, FEW_POSES, FEW.len(), 0));
    }
    let mut all = Vec::new();
    let drawn: Vec<usize> = (0..robots).collect();
    for (poses, right, wrong) in SHARES {
        let [least, most] = [spread::counts(robots, right)[0], spread::counts(robots, wrong)[1]];
        all.extend(figures(&run(&drawn, poses)?, poses, least, most));
    }
    Ok(all)
}

/// The figures: the number of right runs, at least `least`; the number of other runs that call a parameter
/// identified, at most `most`; and the coverage of the right runs' intervals.
fn figures(runs: &[Run], poses: usize, least: usize, most: usize) -> Vec<Figure> {
    let robots = runs.len();
    let right = runs.iter().filter(|run| run.is_right()).count();
    let wrong = runs.iter().filter(|run| !run.is_right());
    let claimed = wrong.filter(|run| run.found.identified() > 0).count();
    let seconds = median(runs.iter().map(|run| run.seconds).collect());
    let mut intervals = Intervals::default();
    runs.iter()
        .filter(|run| run.is_right())
        .for_each(|run| intervals.push(run.scores().into_iter()));
    let cuts = if poses == 1 { "1 pose".to_owned() } else { format!("{poses} poses") };
    let found = format!("{cuts}: robots found, no identified parameter off by {FARTHEST} σ");
    let others = format!("{cuts}: others of which a parameter is called identified");
    vec![
        Figure::count(found, robots, right >= least, right, &format!("≥ {least}"))
            .remark(format_args!("median {seconds:.2} s")),
        Figure::count(others, robots, claimed <= most, claimed, &format!("≤ {most}")),
        intervals.cover(&format!("{cuts}: identified parameters of the found"), OFF, false),
    ]
}

impl Arm {
    fn chain(&self) -> Result<Chain> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("arms").join(self.file);
        let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
        let model = import(&text, self.tcp, Base::Rigid).with_context(|| self.name)?.model;
        let bare = model.chain()?.weighing(&[self.mass; 7]);
        with_spindle(&bare)
    }
}

/// The arm with a spindle at the flange, a sphere of 0.1 m radius and a twentieth of the robot's mass. Its centre
/// lies 0.1 m beyond the flange, its tool 0.2 m. A published last link alone weighs 0.3 kg: a cutting force shakes it
/// by thousands of m/s².
fn with_spindle(bare: &Chain) -> Result<Chain> {
    let mass = 0.05 * bare.joints().iter().map(|joint| joint.link.mass).sum::<f64>();
    let mut joints = bare.joints().to_vec();
    let link = &mut joints.last_mut().context("no joint")?.link;
    let place = bare.tcp() * Point3::new(0.0, 0.0, 0.1);
    let whole = link.mass + mass;
    let centre = (link.centre_of_mass * link.mass + place.coords * mass) / whole;
    let about = |mass: f64, off: Vector3<f64>| {
        (Matrix3::identity() * off.norm_squared() - off * off.transpose()) * mass
    };
    link.inertia += about(link.mass, link.centre_of_mass - centre)
        + about(mass, place.coords - centre)
        + Matrix3::identity() * (0.4 * mass * 0.01);
    (link.mass, link.centre_of_mass) = (whole, centre);
    let tcp = bare.tcp() * Translation3::new(0.0, 0.0, 0.2);
    Chain::new(&joints, tcp).map_err(|error| anyhow!("{error:?}"))
}

impl Run {
    fn new(
        study: &Study,
        arm: &'static str,
        chain: &Chain,
        poses: usize,
        number: u64,
    ) -> Result<Self> {
        let mut draw = random(Purpose::Robot, number);
        let truth = robot(chain, &mut draw);
        let gravity = [0.0, 0.0, -9.80665];
        let accelerometer = Accelerometer::Strapdown;
        let measurement = Measurement { gravity, accelerometer, ..study.measurement };
        let joints = chain.joints().len();
        let mut sensors = Sensors::with_joints(study, joints, random(Purpose::Noise, number))?;
        let mut records = Vec::new();
        let Study { scenario, .. } = study;
        for template in scenario.experiments.iter().cycle().take(poses) {
            let pose = (0..joints).map(|_| draw.uniform(-1.0, 1.0)).collect();
            let experiment = Experiment { pose, ..template.clone() };
            let cut = Cut::new(&experiment, &scenario.cutting, &scenario.measurement, &mut draw.0);
            let force = filtered(&cut.force);
            let cut = Cut { force, gravity: Vector3::from(gravity), accelerometer, ..cut };
            let motion = motion(chain, &truth, &cut);
            records.push(sensors.measure(&Signals::new(&cut.pose, &motion))?);
        }
        let bounds = Bounds::of(chain);
        let task = Task { chain, bounds, measurement, sought: &[], statics: Vec::new() };
        let begun = Instant::now();
        let found = find(&task, &records, random(Purpose::Search, number).0)?;
        let seconds = begun.elapsed().as_secs_f64();
        Ok(Self { arm, errors: found.errors(&truth), found, seconds })
    }

    /// Errors of the identified parameters, in their standard deviations.
    fn scores(&self) -> Vec<f64> {
        let Self { errors, found, .. } = self;
        let identified = (0..errors.len()).filter(|index| found.identifies(*index));
        identified.map(|index| errors[index] / found.deviations[index]).collect()
    }

    fn is_right(&self) -> bool {
        self.found.estimate.consistency < EXPLAINED
            && self.found.identified() > 0
            && self.scores().iter().all(|score| score.abs() < FARTHEST)
    }

    fn print(&self, poses: usize, robot: usize) {
        let Self { arm, found, seconds, .. } = self;
        let farthest = self.scores().iter().fold(0.0_f64, |most, score| most.max(score.abs()));
        eprintln!(
            "{arm}, {poses} poses, robot {robot}: {}, {:?}, χ²/dof {:.3}, structure {:.3}, {} starts, by {:?}, {} of {} identified, {} not observable, the farthest off by {farthest:.1} σ, {seconds:.2} s",
            if self.is_right() { "right" } else { "wrong" },
            found.estimate.acceptance,
            found.estimate.consistency,
            found.estimate.structure.size,
            found.starts,
            found.estimate.found_by,
            found.identified(),
            found.verdicts.len(),
            found.count(Verdict::NotObservable),
        );
    }
}

/// A robot whose natural frequencies and damping ratios are drawn independently, uniform on the logarithmic scale.
fn robot(chain: &Chain, random: &mut Random) -> Bushings {
    let mut draw =
        |[lower, upper]: [f64; 2]| lower * (upper / lower).powf(random.uniform(0.0, 1.0));
    let mut bushing = |inertia: &[f64; 6]| {
        let mut bushing = Bushing::default();
        for (dof, m) in inertia.iter().enumerate() {
            let omega = TAU * draw(NATURAL_HZ);
            bushing.stiffness[dof] = m * omega * omega;
            bushing.damping[dof] = 2.0 * draw(DAMPING_RATIO) * m * omega;
        }
        bushing
    };
    chain.carried().iter().map(&mut bushing).collect()
}

/// The force after the anti-aliasing filters, a sinc in Hann's window. They are the same for force and acceleration.
/// The robot is linear, so that the filters may stand before it instead of after its sensors.
fn filtered(force: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let half = HALF_LENGTH * OVERSAMPLING;
    let tap = |k: usize| {
        let samples = (k as f64 - half as f64) / OVERSAMPLING as f64;
        let x = TAU * CORNER * samples;
        let sinc = if k == half { 1.0 } else { x.sin() / x };
        sinc * (0.5 + 0.5 * (0.5 * TAU * samples / HALF_LENGTH as f64).cos())
    };
    let taps: Vec<f64> = (0..=2 * half).map(tap).collect();
    let sum: f64 = taps.iter().sum();
    let at = |n: usize| {
        let first = half.saturating_sub(n);
        let end = taps.len().min(force.len() + half - n);
        let terms = (first..end).map(|k| force[n + k - half] * taps[k]);
        terms.sum::<Vector3<f64>>() / sum
    };
    (0..force.len()).map(at).collect()
}
