//! Static tests: a load is put on the TCP of the robot at rest, and a laser tracker or a dial gauge measures how far it gives way.
//!
//! This is the receptance at s = 0. The derivative of a displacement by the logarithm of each stiffness k is
//!
//! ```text
//! −k e_out q
//! ```
//!
//! with the elongations e_out of a unit force along each measured direction, and the elongations q under the load. The dampings
//! have no part in it. Gravity's stiffness, and the sag at which it acts, are those of the records. The load keeps its direction
//! while the robot gives way. The effect of the load on the stiffness is of the order of the rotation, and left out.

use core::error::Error;
use core::fmt;

use heapless::Vec;

use crate::chain::linearise::{LinearChain, LinearisationError};
use crate::parameters::Bushing;
use crate::receptance::{Complex, Response, Terms};
use crate::{DOF, MAX_JOINTS};

/// Most static tests of one robot.
pub const MAX_STATIC_TESTS: usize = 64;

/// One load at one pose, and the displacement of the TCP under it.
#[derive(Clone, Debug, PartialEq)]
pub struct StaticTest {
    /// Joint angles (or strokes), base first, rad (or m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Force on the TCP and torque about it, N and Nm, along the TCP's axes in the unloaded robot.
    pub wrench: [f64; 6],
    /// Displacement of the TCP, loaded less unloaded, along the same axes; `None` where it was not measured.
    pub displacement: [Option<Reading>; 3],
}

/// A measured displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Displacement, m.
    pub value: f64,
    /// Standard deviation of its noise, m.
    pub deviation: f64,
}

/// Why static tests are refused; tests count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StaticTestError {
    /// There are this many tests, more than [`MAX_STATIC_TESTS`].
    Count(usize),
    /// The pose of this test has another number of angles than the chain has joints.
    Pose(usize),
    /// A number of this test is not finite.
    NotFinite(usize),
    /// A standard deviation of this test is not positive.
    Deviation(usize),
}

impl fmt::Display for StaticTestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => {
                write!(f, "{count} static tests: give at most {MAX_STATIC_TESTS}")
            }
            Self::Pose(test) => {
                write!(f, "pose of static test {}: give one angle per joint", test + 1)
            }
            Self::NotFinite(test) => {
                write!(f, "numbers of static test {}: must be finite", test + 1)
            }
            Self::Deviation(test) => {
                write!(f, "standard deviations of static test {}: must be positive", test + 1)
            }
        }
    }
}

impl Error for StaticTestError {}

impl StaticTest {
    /// Measured displacements, each with its axis.
    pub fn readings(&self) -> impl Iterator<Item = (usize, Reading)> {
        self.displacement.iter().enumerate().filter_map(|(axis, reading)| Some((axis, (*reading)?)))
    }
}

/// Checks that a fit of a chain of `joints` can take these tests.
///
/// # Errors
///
/// Returns an error if there are more tests than [`MAX_STATIC_TESTS`], or for the first test whose pose does not have one angle
/// per joint, whose numbers are not finite or whose standard deviations are not positive.
pub fn check(tests: &[StaticTest], joints: usize) -> Result<(), StaticTestError> {
    if tests.len() > MAX_STATIC_TESTS {
        return Err(StaticTestError::Count(tests.len()));
    }
    for (index, test) in tests.iter().enumerate() {
        if test.pose.len() != joints {
            return Err(StaticTestError::Pose(index));
        }
        let numbers = test.pose.iter().chain(&test.wrench).copied();
        let readings = test.readings().flat_map(|(_, reading)| [reading.value, reading.deviation]);
        if !numbers.chain(readings).all(f64::is_finite) {
            return Err(StaticTestError::NotFinite(index));
        }
        if test.readings().any(|(_, reading)| reading.deviation <= 0.0) {
            return Err(StaticTestError::Deviation(index));
        }
    }
    Ok(())
}

/// Displacement of the TCP under a load, by the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Deflection {
    /// Displacement of the TCP along its axes, m.
    pub displacement: [f64; 3],
    /// Derivatives of the displacement by the logarithm of each stiffness, `[axis][joint][dof]`, m, at the same sag.
    pub gradient: [[[f64; DOF]; MAX_JOINTS]; 3],
}

impl Deflection {
    /// Displacement of a chain that is linearised at the test's pose, under a wrench (N and Nm on the TCP, along its axes).
    ///
    /// # Errors
    ///
    /// Returns an error if there is not one bushing per joint.
    pub fn new(
        chain: &LinearChain,
        bushings: &[Bushing],
        wrench: &[f64; 6],
    ) -> Result<Self, LinearisationError> {
        let terms = Terms::static_test(chain, bushings, wrench)?;
        let rest = Complex::zero(0.0);
        let full = Complex::new(1.0, 0.0);
        let mut response = Response::new(0.0);
        response.evaluate(&terms, rest, &[full, rest, rest], None);
        let mut gradient = [[[0.0; DOF]; MAX_JOINTS]; 3];
        for joint in 0..bushings.len() {
            for dof in 0..DOF {
                let derivatives = response.derivatives(&terms, joint, dof);
                for (axis, [stiffness, _]) in derivatives.into_iter().enumerate() {
                    gradient[axis][joint][dof] = stiffness.re;
                }
            }
        }
        Ok(Self { displacement: response.observed.map(|displacement| displacement.re), gradient })
    }
}
