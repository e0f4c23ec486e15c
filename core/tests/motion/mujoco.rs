//! The equation of motion against MuJoCo: accelerations at large angles, and where a second of motion ends.

use flexid_core::chain::{self, Chain, JointKind};
use flexid_core::motion::radau::Radau;
use flexid_core::motion::{Coordinates, EquationOfMotion, State};
use flexid_core::parameters::{Bushing, Bushings};
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

use super::mechanics::poses;
use super::reference::{ACCELERATIONS, GRAVITY, MOTIONS};

/// A drive, its bushing and its link; quaternions are w x y z.
pub(crate) struct Joint {
    pub(crate) origin: [f64; 3],
    pub(crate) turn: [f64; 4],
    pub(crate) axis: [f64; 3],
    pub(crate) revolute: bool,
    pub(crate) angle: f64,
    pub(crate) mass: f64,
    pub(crate) centre: [f64; 3],
    pub(crate) inertia: [f64; 9],
    pub(crate) stiffness: [f64; 6],
    pub(crate) damping: [f64; 6],
}

pub(crate) struct Robot {
    pub(crate) joints: &'static [Joint],
    pub(crate) tcp: [f64; 3],
    pub(crate) tcp_turn: [f64; 4],
}

/// q̈ at q, q̇ under a force in base axes.
pub(crate) struct Acceleration {
    pub(crate) robot: Robot,
    pub(crate) elongation: &'static [f64],
    pub(crate) rate: &'static [f64],
    pub(crate) force: [f64; 3],
    pub(crate) acceleration: &'static [f64],
}

/// The place at which a robot ends that starts so and is pushed with a `peak` in base axes, and how far its TCP is then
/// from where it started, base axes.
pub(crate) struct Motion {
    pub(crate) robot: Robot,
    pub(crate) elongation: &'static [f64],
    pub(crate) rate: &'static [f64],
    pub(crate) peak: [f64; 3],
    pub(crate) end: &'static [f64],
    pub(crate) end_rate: &'static [f64],
    pub(crate) tcp: [f64; 3],
}

/// A robot, built here.
struct Built {
    equation: EquationOfMotion,
    /// From base axes to those of the TCP at rest.
    to_rest: UnitQuaternion<f64>,
}

impl Robot {
    fn build(&self) -> Built {
        let pose = |at: [f64; 3], [w, x, y, z]: [f64; 4]| {
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            Isometry3::from_parts(Translation3::from(Vector3::from(at)), turn)
        };
        let joint = |joint: &Joint| chain::Joint {
            origin: pose(joint.origin, joint.turn),
            axis: Unit::new_normalize(joint.axis.into()),
            kind: if joint.revolute { JointKind::Revolute } else { JointKind::Prismatic },
            link: chain::Link {
                mass: joint.mass,
                centre_of_mass: joint.centre.into(),
                inertia: Matrix3::from_row_slice(&joint.inertia),
            },
        };
        let joints: Vec<_> = self.joints.iter().map(joint).collect();
        let chain = Chain::new(&joints, pose(self.tcp, self.tcp_turn)).unwrap();
        let angles: Vec<_> = self.joints.iter().map(|joint| joint.angle).collect();
        let bushing = |j: &Joint| Bushing { stiffness: j.stiffness, damping: j.damping };
        let bushings: Bushings = self.joints.iter().map(bushing).collect();
        let equation = EquationOfMotion::about(
            &chain,
            &angles,
            GRAVITY.into(),
            &bushings,
            Coordinates::default(),
        )
        .unwrap();
        let rest = poses(&chain, &angles, &equation.rest().elongation);
        Built { equation, to_rest: rest[self.joints.len()].rotation.inverse() }
    }
}

fn coordinates(flat: &[f64]) -> Coordinates {
    let mut all = Coordinates::default();
    for (dof, &value) in flat.iter().enumerate() {
        all[dof / 6][dof % 6] = value;
    }
    all
}

/// Largest difference over the largest number.
fn apart(ours: &Coordinates, theirs: &[f64]) -> f64 {
    let theirs = coordinates(theirs);
    let size = theirs.iter().map(|one| one.amax()).fold(0.0, f64::max);
    ours.iter().zip(&theirs).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max) / size
}

#[test]
fn accelerations_are_those_of_mujoco() {
    let mut worst = 0.0_f64;
    for case in ACCELERATIONS {
        let Built { equation, to_rest } = case.robot.build();
        let state =
            State { elongation: coordinates(case.elongation), rate: coordinates(case.rate) };
        let force = to_rest * Vector3::from(case.force);
        let acceleration = equation.forward_dynamics(&state, &force);
        worst = worst.max(apart(&acceleration, case.acceleration));
    }
    println!("accelerations against MuJoCo: {worst:.1e}");
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn a_second_of_motion_ends_where_mujoco_does() {
    for case in MOTIONS {
        let Built { equation, to_rest } = case.robot.build();
        let start =
            State { elongation: coordinates(case.elongation), rate: coordinates(case.rate) };
        let peak = to_rest * Vector3::from(case.peak);
        let steps = 16000;
        let step = 1.0 / f64::from(steps);
        let mut radau = Radau::new(equation, start, step);
        for n in 0..steps {
            radau
                .step(|part| {
                    let t = (f64::from(n) + part) * step;
                    peak * (std::f64::consts::PI * t).sin().powi(2) * (1.0 + (20.0 * t).sin())
                })
                .unwrap();
        }
        let (equation, end) = (radau.equation(), radau.state());
        let errors = [apart(&end.elongation, case.end), apart(&end.rate, case.end_rate)];
        let moved = equation.tcp_displacement(end) - equation.tcp_displacement(&start);
        let theirs = to_rest * Vector3::from(case.tcp);
        println!("a second of motion against MuJoCo: {:.1e}, {:.1e}", errors[0], errors[1]);
        assert!(errors.iter().all(|&error| error < 1e-8), "{errors:?}");
        assert!((moved - theirs).norm() < 1e-8 * theirs.norm(), "{moved} is not {theirs}");
    }
}
