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
//!
//! A gauge that touches the tool at g from the TCP measures `d + θ × g`, with the displacement d and the turn θ of the tool there.
//! A force f at the point p is the force f at the TCP and the torque `p × f` about it.

use core::error::Error;
use core::fmt;

use heapless::Vec;
use nalgebra::Vector3;

use crate::chain::linearise::{LinearChain, LinearisationError};
pub use crate::mounting::Gauge;
use crate::parameters::Bushing;
use crate::receptance::{Complex, Response, Terms};
use crate::{DOF, MAX_JOINTS};

/// Most static tests of one robot.
pub const MAX_STATIC_TESTS: usize = 64;

/// Standard deviation that is assumed where the residuals are too few to tell it, m: the scale interval of a dial gauge (ISO 463).
pub const DIAL_GAUGE: f64 = 1e-5;
/// Smallest displacement that a gauge resolves, m. A laser interferometer does.
pub const RESOLVED: f64 = 1e-9;
/// Chance below which a test is not as the others are. Chosen: as usual.
const RARE: f64 = 0.05;

/// How far the length of a unit vector may be from 1: rounding leaves 1e-15.
const UNIT: f64 = 1e-6;

/// One load at one pose, and the displacement of the TCP under it.
#[derive(Clone, Debug, PartialEq)]
pub struct StaticTest {
    /// Joint angles (or strokes), base first, rad (or m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Force on the TCP and torque about it, N and Nm, along the TCP's axes in the unloaded robot.
    pub wrench: [f64; 6],
    /// Place and axes of the measured displacement.
    pub gauge: Gauge,
    /// Displacement at the gauge, loaded less unloaded, along the axes of the gauge; `None` where it was not measured.
    pub displacement: [Option<Reading>; 3],
}

/// A measured displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Displacement, m.
    pub value: f64,
    /// Standard deviation of its noise, m.
    pub deviation: f64,
    /// True if the deviation is known. If not, it is a first guess, which
    /// [`Identifier::estimate_static_deviation`](crate::identify::Identifier::estimate_static_deviation) replaces.
    pub is_stated: bool,
}

/// Residuals of a static test in its standard deviations, measured less model, along the axes of its gauge; `None` where nothing was
/// measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// Residual of the fit to all.
    pub residual: [Option<f64>; 3],
    /// Residual of a fit to all else; `None` where nothing else predicts the test.
    pub left_out: [Option<f64>; 3],
    /// Part of each reading that the fit does not follow: `1 − h` of its hat value, 0 where nothing was measured.
    pub redundancy: [f64; 3],
    /// How far the test lies from its prediction by all else, by the scatter of the others: root mean square over its readings. Where one
    /// was read it is the externally studentised residual. `None` where the others are too few to tell.
    pub deviations: Option<f64>,
    /// Largest probability that noise alone puts any of the tests as far out; `None` as above.
    pub chance: Option<f64>,
}

impl LeftOut {
    /// Returns whether the test is not as the others are. A table without an error has such a test once in twenty.
    pub fn is_outlier(&self) -> bool {
        self.chance.is_some_and(|chance| chance < RARE)
    }
}

/// Why static tests are refused; tests count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StaticTestError {
    /// There are this many tests, more than [`MAX_STATIC_TESTS`].
    Count(usize),
    /// The pose of this test has another number of angles than the chain has driven joints.
    Pose(usize),
    /// A number of this test is not finite.
    NotFinite(usize),
    /// A standard deviation of this test is not positive.
    Deviation(usize),
    /// An axis of the gauge of this test is no unit vector.
    Axes(usize),
}

impl fmt::Display for StaticTestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => {
                write!(f, "{count} static tests: give at most {MAX_STATIC_TESTS}")
            }
            Self::Pose(test) => {
                write!(f, "pose of static test {}: give one angle per driven joint", test + 1)
            }
            Self::NotFinite(test) => {
                write!(f, "numbers of static test {}: must be finite", test + 1)
            }
            Self::Deviation(test) => {
                write!(f, "standard deviations of static test {}: must be positive", test + 1)
            }
            Self::Axes(test) => {
                write!(f, "axes of the gauge of static test {}: must be unit vectors", test + 1)
            }
        }
    }
}

impl Error for StaticTestError {}

impl Reading {
    /// A displacement whose standard deviation is known, m.
    pub fn stated(value: f64, deviation: f64) -> Self {
        Self { value, deviation, is_stated: true }
    }
}

impl StaticTest {
    /// Measured displacements, each with its axis.
    pub fn readings(&self) -> impl Iterator<Item = (usize, Reading)> {
        self.displacement.iter().enumerate().filter_map(|(axis, reading)| Some((axis, (*reading)?)))
    }
}

/// Checks that a fit of a chain with so many `driven` joints can take these tests.
///
/// # Errors
///
/// Returns an error if there are more tests than [`MAX_STATIC_TESTS`], or for the first test whose pose does not have one angle
/// per driven joint, whose numbers are not finite, whose standard deviations are not positive or whose gauge has axes that are no unit
/// vectors.
pub fn check(tests: &[StaticTest], driven: usize) -> Result<(), StaticTestError> {
    if tests.len() > MAX_STATIC_TESTS {
        return Err(StaticTestError::Count(tests.len()));
    }
    for (index, test) in tests.iter().enumerate() {
        if test.pose.len() != driven {
            return Err(StaticTestError::Pose(index));
        }
        let numbers = test.pose.iter().chain(&test.wrench).copied();
        let readings = test.readings().flat_map(|(_, reading)| [reading.value, reading.deviation]);
        let Gauge { place, axes } = test.gauge;
        let gauge = place.iter().chain(axes.as_flattened()).copied();
        if !numbers.chain(readings).chain(gauge).all(f64::is_finite) {
            return Err(StaticTestError::NotFinite(index));
        }
        if axes.iter().any(|axis| (Vector3::from(*axis).norm() - 1.0).abs() > UNIT) {
            return Err(StaticTestError::Axes(index));
        }
        if test.readings().any(|(_, reading)| reading.deviation <= 0.0) {
            return Err(StaticTestError::Deviation(index));
        }
    }
    Ok(())
}

/// Displacement at a gauge under a load, by the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Deflection {
    /// Displacement along the axes of the gauge, m.
    pub displacement: [f64; 3],
    /// Derivatives of the displacement by the logarithm of each stiffness, `[axis][joint][dof]`, m, at the same sag.
    pub gradient: [[[f64; DOF]; MAX_JOINTS]; 3],
}

impl Deflection {
    /// Displacement at `gauge` of a chain that is linearised at the test's pose, under a wrench (N and Nm on the TCP, along its axes).
    ///
    /// # Errors
    ///
    /// Returns an error if there is not one bushing per joint.
    pub fn new(
        chain: &LinearChain,
        bushings: &[Bushing],
        wrench: &[f64; 6],
        gauge: &Gauge,
    ) -> Result<Self, LinearisationError> {
        Ok(Self::of(&Terms::static_test(chain, bushings, wrench, gauge)?))
    }

    /// Displacement of a static test with these [terms](Terms::static_test).
    pub(crate) fn of(terms: &Terms<f64>) -> Self {
        let rest = Complex::zero(0.0);
        let full = Complex::new(1.0, 0.0);
        let mut response = Response::new(0.0);
        response.evaluate(terms, rest, &[full, rest, rest], None);
        let mut gradient = [[[0.0; DOF]; MAX_JOINTS]; 3];
        for joint in 0..terms.joints.len() {
            for dof in 0..DOF {
                let derivatives = response.derivatives(terms, joint, dof);
                for (axis, [stiffness, _]) in derivatives.into_iter().enumerate() {
                    gradient[axis][joint][dof] = stiffness.re;
                }
            }
        }
        Self { displacement: response.observed.map(|displacement| displacement.re), gradient }
    }
}
