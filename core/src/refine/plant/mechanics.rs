//! The mechanics of a robot as a fit has found it, without its sensors: what predicts how it moves.

use nalgebra::Vector3;

use super::imperfect::Imperfect;
use super::places::Places;
use crate::DOF;
use crate::chain::Chain;
use crate::chain::linearise::{LinearChain, LinearisationError};
use crate::imperfection::{Imperfection, REFERENCE_HZ};
use crate::parameters::Bushings;
use crate::receptance::{Complex, JointTerms, Rates, Terms, bushing};
use crate::sensors::Sensors;

/// A robot at a pose, linearised about its static equilibrium, with bushings whose impedance depends on the frequency.
#[derive(Clone, Debug)]
pub struct Mechanics {
    chain: LinearChain,
    terms: Terms<f64>,
}

impl Mechanics {
    /// Number of the record that is predicted.
    pub const RECORD: usize = 0;

    /// A robot of these bushings, one per joint, at joint angles `pose`, one per driven joint (rad, m), under `gravity` (base axes, m/s²).
    /// `imperfections` have the unit of each; those of sensors have no effect, nor have those of records other than
    /// [`RECORD`](Mechanics::RECORD). Stiffnesses
    /// and dampings that depend on the frequency are those at `reference_hz`.
    ///
    /// # Errors
    /// There is not one angle per driven joint and one bushing per joint, or the bushings are too soft for gravity.
    ///
    /// # Panics
    /// If an imperfection is [of another robot](Imperfection::is_of).
    pub fn new(
        chain: &Chain,
        gravity: Vector3<f64>,
        reference_hz: f64,
        pose: &[f64],
        bushings: &Bushings,
        imperfections: &[(Imperfection, f64)],
    ) -> Result<Self, LinearisationError> {
        if pose.len() != chain.driven() {
            return Err(LinearisationError::Angles(pose.len()));
        }
        let robot = imperfect(chain, reference_hz, pose, imperfections);
        let chain = robot.linearise_under(gravity, bushings)?;
        let terms = robot.terms(&chain, &robot.loaded(&chain, bushings), &Sensors::default())?;
        Ok(Self { chain, terms })
    }

    /// Returns the places of the parts of a robot with these imperfections at joint angles `pose`, one per driven joint, rad (m).
    ///
    /// # Errors
    /// There is not one angle per driven joint.
    ///
    /// # Panics
    /// If an imperfection is [of another robot](Imperfection::is_of).
    pub fn places(
        chain: &Chain,
        pose: &[f64],
        imperfections: &[(Imperfection, f64)],
    ) -> Result<Places, LinearisationError> {
        if pose.len() != chain.driven() {
            return Err(LinearisationError::Angles(pose.len()));
        }
        Ok(imperfect(chain, REFERENCE_HZ, pose, imperfections).into_places())
    }

    /// The chain, linearised about its static equilibrium.
    pub fn chain(&self) -> &LinearChain {
        &self.chain
    }

    /// Displacement of the base per load on it, along and about each of its axes at its origin, m/N and rad/Nm, at the complex frequency
    /// `s`, rad/s. `None` if the ground is rigid.
    pub fn ground(&self, s: Complex<f64>) -> Option<[Complex<f64>; DOF]> {
        let ground = self.terms.ground?;
        Some(core::array::from_fn(|dof| ground.at(s, dof)))
    }

    /// Mass of the base, a point on the ground, kg. `None` if the ground is rigid.
    pub fn base_mass(&self) -> Option<f64> {
        Some(self.terms.ground?.mass)
    }

    /// Stiffness, N/m, and damping, Ns/m, of what hangs on the tool, along each axis at its centre point.
    pub fn hose(&self) -> [f64; 2] {
        self.terms.hose.map_or([0.0; 2], |hose| [hose.stiffness, hose.damping])
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.terms.joints.len()
    }

    /// Load per elongation of a joint, from 0, along each of its degrees of freedom, N/m and Nm/rad, at the complex frequency `s`, rad/s: that
    /// of the spring, k apart from a drive that stiffens, and that of the damper, `s d` apart from hysteresis. Hysteresis has no value at
    /// 0.
    ///
    /// # Panics
    /// If there is no such joint.
    pub fn impedance(&self, joint: usize, s: Complex<f64>) -> [[Complex<f64>; DOF]; 2] {
        let whole = self.terms.joints[joint];
        let springs = JointTerms { damping: [0.0; DOF], ..whole };
        let rates = Rates::new(&self.terms.hysteresis, whole.growth.is_some(), s);
        let (whole, springs) = (bushing(&whole, &rates), bushing(&springs, &rates));
        [springs, core::array::from_fn(|dof| whole[dof] - springs[dof])]
    }
}

/// A chain at a pose with these imperfections, in the record that is predicted.
fn imperfect(
    chain: &Chain,
    reference_hz: f64,
    pose: &[f64],
    imperfections: &[(Imperfection, f64)],
) -> Imperfect {
    let sensors = Sensors::default();
    let mut robot = Imperfect::of(chain.clone(), sensors, reference_hz, pose, Mechanics::RECORD);
    for (imperfection, value) in imperfections {
        assert!(imperfection.is_of(chain), "{imperfection:?} of another robot");
        robot.add(*imperfection, *value);
    }
    robot
}
