//! Static tests beside one cut, on the plausible plants of `plants`: the robot that gives way to a load at rest has its imperfections, too.
//!
//! A test's displacement follows from the potential energy V of the true robot at rest, over the elongations q of its bushings, whose
//! derivatives are differences. It shares no code with the identification:
//!
//! ```text
//! V = ½ Σ k q² − Σ m gᵀ p(q) + ½ k_hose |x(q) − x₀|²        d = J (∂²V/∂q²)⁻¹ Jᵀ w        J = ∂(x, θ)/∂q
//! ```

use std::f64::consts::{PI, TAU};

use anyhow::{Context, Result, ensure};
use flexid_core::imperfection::Accuracies;
use flexid_core::mounting::Mounting;
use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::statics::{Gauge, Reading, StaticTest};
use flexid_simulation::plant::Plant;
use flexid_simulation::plant::chain::TrueChain;
use nalgebra::{DMatrix, DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::common::Random;
use crate::figure::Figure;
use crate::find::{Found, Task, find_on_plant};
use crate::intervals::Intervals;
use crate::plants::{COVER, GROSS, drawn_robot, records, standing};
use crate::study::{Purpose, Study, random};

/// Poses, and loads in each.
const TESTS: [usize; 2] = [8, 3];
/// Standard deviation of a reading, m: a laser tracker's.
const NOISE: f64 = 5e-6;
/// Largest force along an axis, N, and largest torque about one, Nm.
const LOAD: [f64; 2] = [2e3, 2e2];
/// Frequency of a load that rests for some seconds, and that at which hysteresis leaves stiffness and damping what they are, Hz.
const REST_HZ: f64 = 0.1;
/// Step of a difference, m and rad.
const STEP: f64 = 1e-5;

/// Errors of the identified stiffnesses in standard deviations, by the cut alone and with static tests.
struct Outcome {
    by_cut: usize,
    scores: Vec<f64>,
}

/// The first robots of this scenario that do not give way.
pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let numbers = standing(study, robots);
    let one = |robot: &u64| outcome(study, *robot, details);
    let all = numbers.par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let mut intervals = Intervals::default();
    for Outcome { scores, .. } in &all {
        intervals.push(scores.iter().copied());
    }
    let identified: usize = all.iter().map(|one| one.scores.len()).sum();
    let by_cut: usize = all.iter().map(|one| one.by_cut).sum();
    let scores = all.iter().flat_map(|one| one.scores.iter().map(|score| score.abs()));
    Ok(vec![
        Figure::count(
            "static tests beside one cut: stiffnesses that are identified, more than by the cut alone",
            robots,
            identified > by_cut,
            identified,
            &format!("> {by_cut}"),
        ),
        intervals.cover_on_plants("static tests beside one cut, stiffnesses", COVER),
        Figure::at_most(
            "static tests beside one cut: largest error of an identified stiffness",
            robots,
            GROSS,
            scores.fold(0.0, f64::max),
            " σ",
        ),
    ])
}

fn outcome(study: &Study, robot: u64, details: bool) -> Result<Outcome> {
    let accuracies = Accuracies::typical();
    let (plant, simulated) =
        drawn_robot(study, &accuracies, robot).context("a robot that gives way")?;
    let truth = study.robot(robot);
    let cuts = study.cuts();
    let cuts = &cuts[robot as usize % cuts.len()][..1];
    let records = records(study, cuts, &plant, &simulated, robot)?;
    ensure!(records.len() == cuts.len(), "{} records of {} cuts", records.len(), cuts.len());
    let statics = tests(study, &plant, &simulated, &mut random(Purpose::Draw, 1_000_000 + robot))?;
    let search = || random(Purpose::Search, robot).0;
    let alone = find_on_plant(&study.task(), &accuracies, &records, search())?;
    let task = Task { statics, ..study.task() };
    let found = find_on_plant(&task, &accuracies, &records, search())?;
    let is_stiffness = |index: &usize| index % 12 < 6;
    let scores = |found: &Found| -> Vec<f64> {
        let errors = found.errors(&truth);
        let identified = (0..errors.len()).filter(|index| found.identifies(*index));
        let stiffnesses = identified.filter(is_stiffness);
        stiffnesses.map(|index| errors[index] / found.deviations[index]).collect()
    };
    let [by_cut, scores] = [scores(&alone), scores(&found)];
    if details {
        let worst = |scores: &[f64]| scores.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
        let estimate = &found.estimate;
        eprintln!(
            "robot {robot}: {:?}, static χ² {:.2}, {} stiffnesses, {:.1} σ; by the cut alone {}, {:.1} σ",
            estimate.acceptance,
            estimate.static_consistency.unwrap_or_default(),
            scores.len(),
            worst(&scores),
            by_cut.len(),
            worst(&by_cut)
        );
    }
    Ok(Outcome { by_cut: by_cut.len(), scores })
}

/// Static tests of the robot on its plant.
fn tests(
    study: &Study,
    plant: &Plant,
    bushings: &Bushings,
    random: &mut Random,
) -> Result<Vec<StaticTest>> {
    let poses = study.unseen_poses(0..TESTS[0] as u64);
    let mut tests = Vec::new();
    for pose in &poses {
        let rest = AtRest::new(study, plant, bushings, pose)?;
        for _ in 0..TESTS[1] {
            let [force, torque] = LOAD;
            let wrench = [force, force, force, torque, torque, torque]
                .map(|most| random.uniform(-most, most));
            let read = |exact: f64| Some(Reading::stated(exact + NOISE * random.normal(), NOISE));
            let displacement = rest.displacement(&wrench).map(read);
            let pose = pose.iter().copied().collect();
            tests.push(StaticTest { pose, wrench, gauge: Gauge::default(), displacement });
        }
    }
    Ok(tests)
}

/// The true robot at rest at one pose.
struct AtRest {
    robot: TrueChain,
    gravity: Vector3<f64>,
    hose: f64,
    /// Elongations, six per bushing.
    rest: DVector<f64>,
    /// Place of the tool there.
    tool: Isometry3<f64>,
}

impl AtRest {
    fn new(study: &Study, plant: &Plant, bushings: &[Bushing], pose: &[f64]) -> Result<Self> {
        let pose = plant.true_pose(pose, 0.0);
        let resting: Vec<Bushing> = bushings.iter().map(|own| resting(plant, own)).collect();
        let robot = plant.robot(&study.chain, &pose, &resting, &Mounting::AT_TCP)?;
        let count = 6 * robot.bushings.len();
        let hose = plant.hose.as_ref().map_or(0.0, |hose| hose.stiffness_n_per_m);
        let tool = Isometry3::identity();
        let gravity = study.measurement.gravity.into();
        let mut own = Self { robot, gravity, hose: 0.0, rest: DVector::zeros(count), tool };
        // Newton's method, without the hose, which is put on at rest.
        for _ in 0..5 {
            let step = own.stiffness().cholesky().context("no equilibrium")?.solve(&own.slope());
            own.rest -= step;
        }
        // Drives stiffen with the load of gravity on them.
        for (joint, index) in study.chain.joints().iter().zip(own.robot.index.clone()) {
            if let Some(drive) = joint.drive() {
                let stiffness = &mut own.robot.bushings[index].stiffness[drive];
                let load = *stiffness * own.rest[6 * index + drive];
                *stiffness *= 1.0 + plant.joints.loaded_per_knm * load.abs() / 1e3;
            }
        }
        (own.tool, own.hose) = (own.place(&own.rest), hose);
        Ok(own)
    }

    /// Displacement of the tool under a wrench on it, along its axes, m.
    fn displacement(&self, wrench: &[f64; 6]) -> [f64; 3] {
        let count = self.rest.len();
        let mut motion = DMatrix::zeros(6, count);
        for column in 0..count {
            let [up, down] = [STEP, -STEP].map(|by| {
                let mut moved = self.rest.clone();
                moved[column] += by;
                self.tool.inverse() * self.place(&moved)
            });
            let shift = (up.translation.vector - down.translation.vector) / (2.0 * STEP);
            let turn = (down.rotation.inverse() * up.rotation).scaled_axis() / (2.0 * STEP);
            motion.view_mut((0, column), (3, 1)).copy_from(&shift);
            motion.view_mut((3, column), (3, 1)).copy_from(&turn);
        }
        let load = motion.transpose() * DVector::from_row_slice(wrench);
        let moved = motion * self.stiffness().lu().solve(&load).expect("a robot that stands");
        [moved[0], moved[1], moved[2]]
    }

    /// Place of the tool at these elongations.
    fn place(&self, elongations: &DVector<f64>) -> Isometry3<f64> {
        self.links(elongations).last().expect("a robot has links") * self.robot.chain.tcp()
    }

    /// Place of each link.
    fn links(&self, elongations: &DVector<f64>) -> Vec<Isometry3<f64>> {
        let mut place = Isometry3::identity();
        let joints = self.robot.chain.joints().iter().zip(elongations.as_slice().chunks(6));
        joints
            .map(|(joint, q)| {
                let shift = Translation3::new(q[0], q[1], q[2]);
                let turn = UnitQuaternion::new(Vector3::new(q[3], q[4], q[5]));
                place *= joint.frame(0.0) * Isometry3::from_parts(shift, turn);
                place
            })
            .collect()
    }

    /// V.
    fn energy(&self, elongations: &DVector<f64>) -> f64 {
        let bushings = self.robot.bushings.iter().flat_map(|own| own.stiffness);
        let springs: f64 = bushings.zip(elongations).map(|(k, q)| 0.5 * k * q * q).sum();
        let links = self.links(elongations);
        let weights = self.robot.chain.joints().iter().zip(&links).map(|(joint, place)| {
            let centre = place * Point3::from(joint.link.centre_of_mass);
            joint.link.mass * self.gravity.dot(&centre.coords)
        });
        let pulled = (self.place(elongations).translation.vector - self.tool.translation.vector)
            .norm_squared();
        springs - weights.sum::<f64>() + 0.5 * self.hose * pulled
    }

    fn slope(&self) -> DVector<f64> {
        DVector::from_fn(self.rest.len(), |i, _| {
            let [up, down] = [STEP, -STEP].map(|by| self.energy(&self.moved(&[(i, by)])));
            (up - down) / (2.0 * STEP)
        })
    }

    /// `∂²V/∂q²`.
    fn stiffness(&self) -> DMatrix<f64> {
        let count = self.rest.len();
        let mut stiffness = DMatrix::zeros(count, count);
        for i in 0..count {
            for j in 0..=i {
                let at = |a: f64, b: f64| self.energy(&self.moved(&[(i, a * STEP), (j, b * STEP)]));
                let mixed = at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0);
                stiffness[(i, j)] = mixed / (4.0 * STEP * STEP);
                stiffness[(j, i)] = stiffness[(i, j)];
            }
        }
        stiffness
    }

    fn moved(&self, by: &[(usize, f64)]) -> DVector<f64> {
        let mut moved = self.rest.clone();
        by.iter().for_each(|(index, step)| moved[*index] += step);
        moved
    }
}

/// A bushing as soft as hysteresis makes it at rest: its stiffness grows by `2/π h d ω_r` with each factor of e of the frequency.
fn resting(plant: &Plant, bushing: &Bushing) -> Bushing {
    let reference_hz = plant.joints.hysteretic_at_hz;
    let per_damping =
        plant.joints.hysteretic * TAU * reference_hz * 2.0 / PI * (REST_HZ / reference_hz).ln();
    let mut own = *bushing;
    for (stiffness, damping) in own.stiffness.iter_mut().zip(bushing.damping) {
        *stiffness += per_damping * damping;
    }
    own
}
