//! Unknowns of a fit: the parameters of the joints, of which some may be fixed or tied to each other, and nuisances.
//!
//! There are [`MAX_UNKNOWNS`] coordinates. The first [`MAX_PARAMETERS`] are the logarithms of the parameters: joint by joint
//! six stiffnesses and six dampings. The others are the nuisances, in units of their prior's standard deviation. A fit has
//! one unknown per sought coordinate; tied coordinates share one unknown.

mod coordinate;

use core::error::Error;
use core::fmt;
use core::ops::Range;

use heapless::Vec;

use crate::calibration::{Calibration, Nuisances};
use crate::chain::Chain;
use crate::parameters::{Bounds, Bushings, MAX_PARAMETERS, from_logarithms, logarithms};
use crate::verdict::Covariance;
use crate::{DOF, MAX_JOINTS};
pub use crate::{MAX_NUISANCES, MAX_UNKNOWNS};
pub use coordinate::Coordinate;
use coordinate::{ACCELERATION_GAIN, DELAY, FORCE_GAIN, MASS, MISALIGNMENT};

/// One value per coordinate.
pub(crate) type Coordinates = [f64; MAX_UNKNOWNS];

/// A nuisance and its value in a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nuisance {
    /// The nuisance.
    pub coordinate: Coordinate,
    /// Value: s, rad, or a factor (gains and masses).
    pub value: f64,
    /// Standard deviation: s, rad, or relative.
    pub deviation: f64,
}

/// Reason why a choice of unknowns is invalid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SoughtError {
    /// The number of joints, which is given here, is not 1 to [`MAX_JOINTS`].
    JointCount(usize),
    /// The coordinate is not a parameter of the chain: the chain does not have it, or it is a nuisance.
    NoParameter(Coordinate),
    /// A parameter cannot be fixed at this value, which is not positive and finite.
    Value(Coordinate, f64),
    /// A stiffness and a damping cannot be tied to each other.
    NotAlike(Coordinate, Coordinate),
}

impl fmt::Display for SoughtError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointCount(count) => {
                write!(f, "{count} joints: a chain has 1 to {MAX_JOINTS}")
            }
            Self::NoParameter(parameter) => write!(f, "the chain has no parameter {parameter:?}"),
            Self::Value(parameter, value) => {
                write!(f, "{parameter:?} cannot be {value}: must be positive and finite")
            }
            Self::NotAlike(one, other) => {
                write!(f, "{one:?} cannot be tied to {other:?}: tie like to like")
            }
        }
    }
}

impl Error for SoughtError {}

/// Unknowns of a fit of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Sought {
    joints: usize,
    /// Unknown of each coordinate; `None` for a coordinate that is not sought.
    unknown: [Option<u8>; MAX_UNKNOWNS],
    /// Number of unknowns.
    unknowns: usize,
    /// Standard deviation of each nuisance's prior, in its own unit.
    width: [f64; MAX_UNKNOWNS],
    /// Value of each fixed parameter, in its own unit.
    fixed: [f64; MAX_PARAMETERS],
}

impl Sought {
    /// The unknowns of a fit that seeks all parameters of a chain of `joints` joints, each as its own unknown, and
    /// `nuisances`.
    ///
    /// # Errors
    ///
    /// Returns an error if `joints` is not 1 to [`MAX_JOINTS`].
    pub fn new(joints: usize, nuisances: &Nuisances) -> Result<Self, SoughtError> {
        if !(1..=MAX_JOINTS).contains(&joints) {
            return Err(SoughtError::JointCount(joints));
        }
        Ok(Self::of_joints(joints, nuisances))
    }

    /// The unknowns of a fit that seeks all parameters of `chain`, each as its own unknown, and no nuisances.
    pub(crate) fn parameters_of(chain: &Chain) -> Self {
        Self::of_joints(chain.joints().len(), &Nuisances::default())
    }

    /// As [`Sought::new`]. The caller ensures that `joints` is at most [`MAX_JOINTS`].
    fn of_joints(joints: usize, nuisances: &Nuisances) -> Self {
        let mut sought = Self {
            joints,
            unknown: [None; MAX_UNKNOWNS],
            unknowns: 0,
            width: [0.0; MAX_UNKNOWNS],
            fixed: [0.0; MAX_PARAMETERS],
        };
        sought.unknown[..2 * DOF * joints].fill(Some(0));
        let kinds: [(Range<usize>, Option<f64>); 5] = [
            (DELAY..ACCELERATION_GAIN, nuisances.delay),
            (ACCELERATION_GAIN..FORCE_GAIN, nuisances.acceleration_gain),
            (FORCE_GAIN..MISALIGNMENT, nuisances.force_gain),
            (MISALIGNMENT..MASS, nuisances.misalignment),
            (MASS..MASS + joints, nuisances.mass),
        ];
        for (range, width) in kinds {
            if let Some(width) = width {
                sought.unknown[range.clone()].fill(Some(0));
                sought.width[range].fill(width);
            }
        }
        sought.number();
        sought
    }

    /// Makes each sought coordinate an unknown of its own.
    fn number(&mut self) {
        self.unknowns = 0;
        for unknown in self.unknown.iter_mut().flatten() {
            *unknown = self.unknowns as u8;
            self.unknowns += 1;
        }
    }

    /// Number of joints of the chain.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Fixes a parameter at `value`, in its own unit.
    ///
    /// # Errors
    ///
    /// Returns an error if the value is not positive and finite, or if the chain does not have this parameter.
    pub fn fix(&mut self, parameter: Coordinate, value: f64) -> Result<(), SoughtError> {
        if !(value > 0.0 && value.is_finite()) {
            return Err(SoughtError::Value(parameter, value));
        }
        let index = self.parameter(parameter)?;
        if let Some(gone) = self.unknown[index] {
            self.fixed[index] = value;
            self.unknown[index] = None;
            self.close(gone);
        }
        Ok(())
    }

    /// Ties a parameter to `other`, so that both have one value: a stiffness to a stiffness, or a damping to a damping. The
    /// call has no effect if one of them is fixed.
    ///
    /// # Errors
    ///
    /// Returns an error if one is a stiffness and the other a damping, or if the chain does not have one of these parameters.
    pub fn tie(&mut self, parameter: Coordinate, other: Coordinate) -> Result<(), SoughtError> {
        let stiffness = |each| matches!(each, Coordinate::Stiffness { .. });
        let places = (self.parameter(parameter)?, self.parameter(other)?);
        if stiffness(parameter) != stiffness(other) {
            return Err(SoughtError::NotAlike(parameter, other));
        }
        if let (Some(gone), Some(unknown)) = (self.unknown[places.0], self.unknown[places.1])
            && gone != unknown
        {
            for each in self.unknown.iter_mut().filter(|each| **each == Some(gone)) {
                *each = Some(unknown);
            }
            self.close(gone);
        }
        Ok(())
    }

    /// Index of a parameter of the chain.
    fn parameter(&self, parameter: Coordinate) -> Result<usize, SoughtError> {
        let known = matches!(
            parameter,
            Coordinate::Stiffness { joint, dof } | Coordinate::Damping { joint, dof }
                if joint < self.joints && dof < DOF
        );
        if known { Ok(parameter.index()) } else { Err(SoughtError::NoParameter(parameter)) }
    }

    /// Renumbers the unknowns above `gone` if no coordinate has the unknown `gone` any more.
    fn close(&mut self, gone: u8) {
        if self.unknown.contains(&Some(gone)) {
            return;
        }
        for unknown in self.unknown.iter_mut().flatten().filter(|unknown| **unknown > gone) {
            *unknown -= 1;
        }
        self.unknowns -= 1;
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Unknown of a coordinate; `None` if the coordinate is not sought, or if the chain does not have it.
    pub fn unknown(&self, coordinate: Coordinate) -> Option<usize> {
        self.unknown.get(coordinate.place()?).copied().flatten().map(usize::from)
    }

    /// First coordinate of an unknown, which names it; `None` if the unknown does not exist.
    pub fn coordinate(&self, unknown: usize) -> Option<Coordinate> {
        self.sought().find(|(_, own)| *own == unknown).map(|(index, _)| Coordinate::of(index))
    }

    /// Prior standard deviation of a nuisance: s, rad, or of a logarithm. It is 0 for parameters, and for nuisances that are
    /// not sought.
    pub fn width(&self, coordinate: Coordinate) -> f64 {
        coordinate.place().map_or(0.0, |place| self.width[place])
    }

    /// Sets fixed parameters to their values, and tied parameters to the value of the first of them.
    pub fn impose(&self, bushings: &mut Bushings) {
        let mut coordinates = [0.0; MAX_UNKNOWNS];
        coordinates[..MAX_PARAMETERS].copy_from_slice(&logarithms(bushings));
        self.impose_on(&mut coordinates);
        *bushings = self.bushings(&coordinates);
    }

    fn impose_on(&self, coordinates: &mut Coordinates) {
        let mut value = [None; MAX_UNKNOWNS];
        for index in 0..2 * DOF * self.joints {
            coordinates[index] = match self.unknown[index] {
                None => libm::log(self.fixed[index]),
                Some(unknown) => *value[usize::from(unknown)].get_or_insert(coordinates[index]),
            };
        }
    }

    /// Coordinates of a guess, with the nuisances at their prior.
    pub(crate) fn coordinates(&self, guess: &Bushings) -> Coordinates {
        let mut coordinates = [0.0; MAX_UNKNOWNS];
        coordinates[..MAX_PARAMETERS].copy_from_slice(&logarithms(guess));
        self.impose_on(&mut coordinates);
        coordinates
    }

    /// Parameters at `coordinates`. Fixed parameters have exactly the value at which they are fixed.
    pub(crate) fn bushings(&self, coordinates: &Coordinates) -> Bushings {
        let logarithms = coordinates.first_chunk().unwrap_or(&[0.0; MAX_PARAMETERS]);
        let mut bushings = from_logarithms(logarithms, self.joints);
        let values = bushings.iter_mut().flat_map(|b| b.stiffness.iter_mut().chain(&mut b.damping));
        for ((value, unknown), fixed) in values.zip(&self.unknown).zip(&self.fixed) {
            if unknown.is_none() {
                *value = *fixed;
            }
        }
        bushings
    }

    /// Nuisances at `coordinates`.
    pub(crate) fn calibration(&self, coordinates: &Coordinates) -> Calibration {
        let scaled = |index: usize| coordinates[index] * self.width[index];
        Calibration {
            delay: scaled(DELAY),
            acceleration_gain: core::array::from_fn(|a| libm::exp(scaled(ACCELERATION_GAIN + a))),
            force_gain: core::array::from_fn(|axis| libm::exp(scaled(FORCE_GAIN + axis))),
            misalignment: core::array::from_fn(|axis| scaled(MISALIGNMENT + axis)),
            mass: core::array::from_fn(|link| libm::exp(scaled(MASS + link))),
        }
    }

    /// Sought coordinates by index, each with its unknown.
    pub(crate) fn sought(&self) -> impl Iterator<Item = (usize, usize)> {
        let with = |(index, unknown): (usize, &Option<u8>)| Some((index, usize::from((*unknown)?)));
        self.unknown.iter().enumerate().filter_map(with)
    }

    /// Sought parameters by index, each with its unknown.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = (usize, usize)> {
        self.sought().take_while(|(index, _)| *index < MAX_PARAMETERS)
    }

    /// Sought nuisances by index, each with its unknown.
    pub(crate) fn nuisances(&self) -> impl Iterator<Item = (usize, usize)> {
        self.sought().filter(|(index, _)| *index >= MAX_PARAMETERS)
    }

    /// Values and standard deviations of the sought nuisances at `coordinates`.
    pub(crate) fn found(
        &self,
        coordinates: &Coordinates,
        covariance: &Covariance,
    ) -> Vec<Nuisance, MAX_NUISANCES> {
        let nuisance = |(index, unknown)| {
            let scaled = self.width[index] * coordinates[index];
            let coordinate = Coordinate::of(index);
            let value = match coordinate {
                Coordinate::Delay | Coordinate::Misalignment(_) => scaled,
                _ => libm::exp(scaled),
            };
            let deviation = self.width[index] * covariance.deviation(unknown);
            Nuisance { coordinate, value, deviation }
        };
        self.nuisances().map(nuisance).collect()
    }

    /// Value of each unknown.
    pub(crate) fn values(&self, coordinates: &Coordinates) -> [f64; MAX_UNKNOWNS] {
        let mut values = [0.0; MAX_UNKNOWNS];
        for (index, unknown) in self.sought() {
            values[unknown] = coordinates[index];
        }
        values
    }

    /// Whether the mass of any link is sought.
    pub(crate) fn seeks_masses(&self) -> bool {
        self.unknown[MASS..].iter().any(Option::is_some)
    }

    /// Whether this is the first coordinate of its unknown.
    pub(crate) fn leads(&self, index: usize) -> bool {
        !self.unknown[..index].contains(&self.unknown[index])
    }

    /// Value, lower bound and upper bound of each unknown. Nuisances have no bounds.
    pub(crate) fn ranges(
        &self,
        coordinates: &Coordinates,
        bounds: &Bounds,
    ) -> [[f64; 3]; MAX_UNKNOWNS] {
        let (lower, upper) = bounds.logarithms(self.joints);
        let mut ranges = [[0.0, f64::NEG_INFINITY, f64::INFINITY]; MAX_UNKNOWNS];
        for (index, unknown) in self.sought() {
            let range = &mut ranges[unknown];
            range[0] = coordinates[index];
            if index < MAX_PARAMETERS {
                range[1] = range[1].max(lower[index]);
                range[2] = range[2].min(upper[index]);
            }
        }
        ranges
    }

    /// Moves coordinates by a step of the unknowns.
    pub(crate) fn advance(&self, coordinates: &mut Coordinates, step: &[f64]) {
        for (index, unknown) in self.sought() {
            coordinates[index] += step[unknown];
        }
    }

    /// Unknowns with a prior, each with its value in units of the prior's standard deviation.
    pub(crate) fn priors(&self, coordinates: &Coordinates) -> impl Iterator<Item = (usize, f64)> {
        self.nuisances().map(|(index, unknown)| (unknown, coordinates[index]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Bushing;

    /// The indices of an eighth joint's parameters would be those of nuisances.
    #[test]
    fn what_no_chain_has_cannot_be_sought() {
        for joints in [0, 8, usize::MAX] {
            let refused = Sought::new(joints, &Nuisances::default()).err();
            assert_eq!(refused, Some(SoughtError::JointCount(joints)));
        }
        let mut sought = Sought::new(2, &Nuisances::default()).unwrap();
        let all = sought.clone();
        let own = Coordinate::Stiffness { joint: 0, dof: 0 };
        let damping = Coordinate::Damping { joint: 0, dof: 0 };
        for other in [
            Coordinate::Stiffness { joint: 2, dof: 0 },
            Coordinate::Stiffness { joint: 0, dof: 6 },
            Coordinate::Damping { joint: usize::MAX, dof: 0 },
            Coordinate::Delay,
            Coordinate::Mass(9),
        ] {
            assert_eq!(sought.fix(other, 1.0), Err(SoughtError::NoParameter(other)));
            assert_eq!(sought.tie(own, other), Err(SoughtError::NoParameter(other)));
            assert_eq!((sought.unknown(other), sought.width(other)), (None, 0.0));
        }
        assert_eq!(sought.tie(own, damping), Err(SoughtError::NotAlike(own, damping)));
        for value in [0.0, -1.0, f64::INFINITY] {
            assert_eq!(sought.fix(own, value), Err(SoughtError::Value(own, value)));
        }
        assert_eq!(sought, all);
    }

    #[test]
    fn what_is_fixed_comes_back_as_it_was_given() {
        let mut sought = Sought::new(2, &Nuisances::default()).unwrap();
        let (stiffness, damping) =
            (Coordinate::Stiffness { joint: 1, dof: 3 }, Coordinate::Damping { joint: 0, dof: 5 });
        // exp(ln(x)) differs from x for both values.
        sought.fix(stiffness, 6.0e7).unwrap();
        sought.fix(damping, 1.9e3).unwrap();
        let guess = Bushing { stiffness: [1e7; DOF], damping: [1e4; DOF] };
        let mut bushings = Bushings::from_iter([guess; 2]);
        sought.impose(&mut bushings);
        let found = sought.bushings(&sought.coordinates(&bushings));
        for bushings in [bushings, found] {
            assert_eq!((bushings[1].stiffness[3], bushings[0].damping[5]), (6.0e7, 1.9e3));
            assert!((bushings[0].stiffness[3] / 1e7 - 1.0).abs() < 1e-14);
        }
    }
}
