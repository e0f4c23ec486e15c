//! What a fit seeks: the joints' parameters, some of them perhaps fixed or tied to each other, and nuisances.
//!
//! All of it has a place among [`MAX_UNKNOWNS`] coordinates: the logarithms of the parameters, joint by joint six
//! stiffnesses and six dampings, and behind [`MAX_PARAMETERS`] the nuisances in units of their prior's standard
//! deviation. A fit has one unknown per coordinate that is sought; coordinates that are tied share one.

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
pub use coordinate::Coordinate;
use coordinate::{ACCELERATION_GAIN, DELAY, FORCE_GAIN, MASS, MISALIGNMENT};

/// Most nuisances: a delay, two sensors' gains, a misalignment, and the masses.
pub const MAX_NUISANCES: usize = 10 + MAX_JOINTS;
/// Most coordinates, and most unknowns of a fit.
pub const MAX_UNKNOWNS: usize = MAX_PARAMETERS + MAX_NUISANCES;

/// One value per coordinate.
pub(crate) type Coordinates = [f64; MAX_UNKNOWNS];

/// A nuisance as a fit has found it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nuisance {
    /// What.
    pub coordinate: Coordinate,
    /// s, rad, or a factor (gains and masses).
    pub value: f64,
    /// Standard deviation: s, rad, or relative.
    pub deviation: f64,
}

/// Why something cannot be sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SoughtError {
    /// A chain has 1 to [`MAX_JOINTS`] joints, not so many.
    JointCount(usize),
    /// The chain has no such parameter, or it is a nuisance.
    NoParameter(Coordinate),
    /// A parameter cannot be held at this value, which is not positive and finite.
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

/// What a fit of a chain of some joints seeks.
#[derive(Clone, Debug, PartialEq)]
pub struct Sought {
    joints: usize,
    /// The unknown that moves each coordinate; none where it stays.
    unknown: [Option<u8>; MAX_UNKNOWNS],
    /// How many.
    unknowns: usize,
    /// Standard deviation of each nuisance's prior, in its own unit.
    width: [f64; MAX_UNKNOWNS],
    /// Each parameter that is fixed, in its own unit.
    fixed: [f64; MAX_PARAMETERS],
}

impl Sought {
    /// All parameters of a chain of `joints`, each for itself, and `nuisances`.
    ///
    /// # Errors
    ///
    /// If no chain has so many joints.
    pub fn new(joints: usize, nuisances: &Nuisances) -> Result<Self, SoughtError> {
        if !(1..=MAX_JOINTS).contains(&joints) {
            return Err(SoughtError::JointCount(joints));
        }
        Ok(Self::of_joints(joints, nuisances))
    }

    /// All parameters of a chain, each for itself, and nothing beside.
    pub(crate) fn parameters_of(chain: &Chain) -> Self {
        Self::of_joints(chain.joints().len(), &Nuisances::default())
    }

    /// Of no more than [`MAX_JOINTS`].
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

    /// Every coordinate that is sought becomes an unknown of its own.
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

    /// Holds a parameter at `value` (its own unit).
    ///
    /// # Errors
    ///
    /// If the value is not positive and finite, or there is no such parameter.
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

    /// Lets a parameter have the value of `other`, a stiffness that of a stiffness and a damping that of a damping. Nothing
    /// happens where one of them is fixed.
    ///
    /// # Errors
    ///
    /// If they are not alike, or there is no such parameter.
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

    /// Where a parameter stands.
    fn parameter(&self, parameter: Coordinate) -> Result<usize, SoughtError> {
        let known = matches!(
            parameter,
            Coordinate::Stiffness { joint, dof } | Coordinate::Damping { joint, dof }
                if joint < self.joints && dof < DOF
        );
        if known { Ok(parameter.index()) } else { Err(SoughtError::NoParameter(parameter)) }
    }

    /// Closes the gap that an unknown leaves which no coordinate has any more.
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

    /// The unknown that moves a coordinate; none where it stays, or where the chain has no such coordinate.
    pub fn unknown(&self, coordinate: Coordinate) -> Option<usize> {
        self.unknown.get(coordinate.place()?).copied().flatten().map(usize::from)
    }

    /// The first coordinate that an unknown moves: its name.
    pub fn coordinate(&self, unknown: usize) -> Option<Coordinate> {
        self.sought().find(|(_, own)| *own == unknown).map(|(index, _)| Coordinate::of(index))
    }

    /// Prior standard deviation of a nuisance: s, rad, or of a logarithm; 0 of a parameter, and of what is not sought.
    pub fn width(&self, coordinate: Coordinate) -> f64 {
        coordinate.place().map_or(0.0, |place| self.width[place])
    }

    /// Sets parameters that are fixed, and those that are tied to the first of them.
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

    /// Coordinates of a guess, the nuisances at their prior.
    pub(crate) fn coordinates(&self, guess: &Bushings) -> Coordinates {
        let mut coordinates = [0.0; MAX_UNKNOWNS];
        coordinates[..MAX_PARAMETERS].copy_from_slice(&logarithms(guess));
        self.impose_on(&mut coordinates);
        coordinates
    }

    /// The parameters at some coordinates; those that are fixed have their value to the last bit.
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

    /// The nuisances at some coordinates.
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

    /// Coordinates that are sought, each with its unknown.
    pub(crate) fn sought(&self) -> impl Iterator<Item = (usize, usize)> {
        let with = |(index, unknown): (usize, &Option<u8>)| Some((index, usize::from((*unknown)?)));
        self.unknown.iter().enumerate().filter_map(with)
    }

    /// Parameters that are sought, each with its unknown.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = (usize, usize)> {
        self.sought().take_while(|(index, _)| *index < MAX_PARAMETERS)
    }

    /// Nuisances that are sought, each with its unknown.
    pub(crate) fn nuisances(&self) -> impl Iterator<Item = (usize, usize)> {
        self.sought().filter(|(index, _)| *index >= MAX_PARAMETERS)
    }

    /// The nuisances that are sought, at some coordinates.
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

    /// Whether any link's mass is sought.
    pub(crate) fn seeks_masses(&self) -> bool {
        self.unknown[MASS..].iter().any(Option::is_some)
    }

    /// Whether this is the first coordinate that its unknown moves.
    pub(crate) fn leads(&self, index: usize) -> bool {
        !self.unknown[..index].contains(&self.unknown[index])
    }

    /// Of each unknown: the value, and the least and the most that it may have; nuisances have no bounds.
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

    /// Unknowns that have a prior, each with where it stands, in units of its standard deviation.
    pub(crate) fn priors(&self, coordinates: &Coordinates) -> impl Iterator<Item = (usize, f64)> {
        self.nuisances().map(|(index, unknown)| (unknown, coordinates[index]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Bushing;

    /// Eight joints would have the parameters of the last among the nuisances.
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
        // exp(ln(x)) is neither.
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
