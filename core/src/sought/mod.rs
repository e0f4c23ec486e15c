//! The unknowns of a fit: the parameters of the joints, of which some may be fixed or tied to each other, and nuisances.
//!
//! There are [`MAX_UNKNOWNS`] coordinates. The first [`MAX_PARAMETERS`] are the logarithms of the parameters: joint by joint
//! six stiffnesses and six dampings. The others are the nuisances, in units of their prior's standard deviation. A fit has
//! one unknown per sought coordinate; tied coordinates share one unknown.

mod coordinate;
mod error;
mod values;

use core::ops::Range;

use crate::calibration::Nuisances;
use crate::chain::Chain;
use crate::parameters::MAX_PARAMETERS;
use crate::{DOF, MAX_JOINTS};
pub(crate) use crate::{MAX_NUISANCES, MAX_UNKNOWNS};
pub use coordinate::Coordinate;
use coordinate::{ACCELERATION_GAIN, DELAY, FORCE_GAIN, MASS, MISALIGNMENT};
pub use error::SoughtError;
pub use values::Nuisance;
pub(crate) use values::{Coordinates, Expected, deviation_between};

/// Stiffness that is treated as rigid, N/m or Nm/rad. Chosen: 1 kN moves it by 0.1 µm, a tenth of what a dial gauge resolves. A larger one takes
/// digits from the single precision of the search.
pub const STIFF: f64 = 1e10;
/// Damping of such a spring, in its stiffness, s. Chosen: 0.1 % of its force at 200 Hz, `2π 200 Hz` times this.
const LOSS: f64 = 1e-6;

/// Role of a coordinate in a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Role {
    /// The chain does not have the coordinate, or it is a nuisance that is not sought.
    Absent,
    /// The parameter has this value, in its own unit.
    Fixed(f64),
    /// The coordinate is sought.
    Free {
        /// Number of its unknown, which tied coordinates share.
        unknown: u8,
        /// Standard deviation of a nuisance's prior, in its own unit. A parameter has no prior.
        prior: Option<f64>,
    },
}

impl Role {
    fn unknown(self) -> Option<usize> {
        match self {
            Self::Free { unknown, .. } => Some(usize::from(unknown)),
            _ => None,
        }
    }

    /// Standard deviation of the prior; 0 without a prior.
    fn width(self) -> f64 {
        match self {
            Self::Free { prior: Some(width), .. } => width,
            _ => 0.0,
        }
    }
}

/// The unknowns of the fit of a chain: the role of each coordinate, and the unknowns that follow from the roles.
#[derive(Clone, Debug, PartialEq)]
pub struct Sought {
    joints: usize,
    /// Number of unknowns.
    unknowns: usize,
    /// Role of each coordinate.
    roles: [Role; MAX_UNKNOWNS],
    /// True if the stiffnesses have a prior.
    expects_stiffnesses: bool,
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

    /// [`Sought::new`] without its check: the caller ensures that `joints` is at most [`MAX_JOINTS`].
    fn of_joints(joints: usize, nuisances: &Nuisances) -> Self {
        let roles = [Role::Absent; MAX_UNKNOWNS];
        let mut sought = Self { joints, unknowns: 0, roles, expects_stiffnesses: false };
        sought.seek(0..2 * DOF * joints, None);
        for (range, width) in [
            (DELAY..ACCELERATION_GAIN, nuisances.delay),
            (ACCELERATION_GAIN..FORCE_GAIN, nuisances.acceleration_gain),
            (FORCE_GAIN..MISALIGNMENT, nuisances.force_gain),
            (MISALIGNMENT..MASS, nuisances.misalignment),
            (MASS..MASS + joints, nuisances.mass),
        ] {
            if width.is_some() {
                sought.seek(range, width);
            }
        }
        sought
    }

    /// Makes each of these coordinates an unknown of its own.
    fn seek(&mut self, range: Range<usize>, prior: Option<f64>) {
        for role in &mut self.roles[range] {
            *role = Role::Free { unknown: self.unknowns as u8, prior };
            self.unknowns += 1;
        }
    }

    /// Fixes a parameter at `value`, in its own unit. The call has no effect if the parameter is fixed already.
    ///
    /// # Errors
    ///
    /// Returns an error if the value is not positive and finite, or if the chain does not have this parameter.
    pub fn fix(&mut self, parameter: Coordinate, value: f64) -> Result<(), SoughtError> {
        if !(value > 0.0 && value.is_finite()) {
            return Err(SoughtError::Value(parameter, value));
        }
        let index = self.parameter(parameter)?;
        if let Role::Free { unknown, .. } = self.roles[index] {
            self.roles[index] = Role::Fixed(value);
            self.close(unknown);
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
        let roles = [self.parameter(parameter)?, self.parameter(other)?].map(|i| self.roles[i]);
        if stiffness(parameter) != stiffness(other) {
            return Err(SoughtError::NotAlike(parameter, other));
        }
        if let [Role::Free { unknown: gone, .. }, Role::Free { unknown: shared, .. }] = roles
            && gone != shared
        {
            for unknown in self.free().filter(|unknown| **unknown == gone) {
                *unknown = shared;
            }
            self.close(gone);
        }
        Ok(())
    }

    /// Gives each sought stiffness a weak prior: its logarithm lies about the middle of its bounds, as widely as what may be anywhere
    /// between them, and by no less than 1. A fit of few static tests then has a value for what they do not determine, and what they
    /// determine badly does not go to a bound.
    pub fn expect_stiffnesses(&mut self) {
        self.expects_stiffnesses = true;
    }

    /// Seeks one stiffness per driven joint, that along or about the axis of its drive; all else of the joint is fixed, as [`STIFF`] as can
    /// be and with as little damping as makes no difference. Dampings of the drives are sought. Fixed joints keep what is sought of them.
    ///
    /// # Errors
    ///
    /// Returns an error if `chain` has another number of joints.
    pub fn seek_drives(&mut self, chain: &Chain) -> Result<(), SoughtError> {
        if chain.joints().len() != self.joints {
            return Err(SoughtError::JointCount(chain.joints().len()));
        }
        for (joint, own) in chain.joints().iter().enumerate() {
            let Some(drive) = own.drive() else { continue };
            for dof in (0..DOF).filter(|dof| *dof != drive) {
                self.fix(Coordinate::Stiffness { joint, dof }, STIFF)?;
                self.fix(Coordinate::Damping { joint, dof }, STIFF * LOSS)?;
            }
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

    /// Unknown of each sought coordinate.
    fn free(&mut self) -> impl Iterator<Item = &mut u8> {
        self.roles.iter_mut().filter_map(|role| match role {
            Role::Free { unknown, .. } => Some(unknown),
            _ => None,
        })
    }

    /// Renumbers the unknowns above `gone` if no coordinate has the unknown `gone` any more.
    fn close(&mut self, gone: u8) {
        if self.free().any(|unknown| *unknown == gone) {
            return;
        }
        for unknown in self.free().filter(|unknown| **unknown > gone) {
            *unknown -= 1;
        }
        self.unknowns -= 1;
    }

    /// Number of joints of the chain.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Returns whether some parameter is fixed, or tied to another one.
    pub fn imposes(&self) -> bool {
        let is_parameter = |unknown: &usize| {
            let coordinate = self.coordinate(*unknown);
            matches!(coordinate, Some(Coordinate::Stiffness { .. } | Coordinate::Damping { .. }))
        };
        (0..self.unknowns).filter(is_parameter).count() < 2 * DOF * self.joints
    }

    /// Unknown of a coordinate; `None` if the coordinate is not sought, or if the chain does not have it.
    pub fn unknown(&self, coordinate: Coordinate) -> Option<usize> {
        self.roles[coordinate.place()?].unknown()
    }

    /// First coordinate of an unknown, which names it; `None` if the unknown does not exist.
    pub fn coordinate(&self, unknown: usize) -> Option<Coordinate> {
        self.sought().find(|(_, own)| *own == unknown).map(|(index, _)| Coordinate::of(index))
    }

    /// Prior standard deviation of a nuisance: s, rad, or of a logarithm. It is 0 for parameters, and for nuisances that are
    /// not sought.
    pub fn width(&self, coordinate: Coordinate) -> f64 {
        coordinate.place().map_or(0.0, |place| self.roles[place].width())
    }

    /// Sought coordinates by index, each with its unknown.
    pub(crate) fn sought(&self) -> impl Iterator<Item = (usize, usize)> {
        self.roles.iter().enumerate().filter_map(|(index, role)| Some((index, role.unknown()?)))
    }

    /// Sought parameters by index, each with its unknown.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = (usize, usize)> {
        self.sought().take_while(|(index, _)| *index < MAX_PARAMETERS)
    }

    /// Sought nuisances by index, each with its unknown.
    pub(crate) fn nuisances(&self) -> impl Iterator<Item = (usize, usize)> {
        self.sought().filter(|(index, _)| *index >= MAX_PARAMETERS)
    }

    /// Returns whether the mass of any link is sought.
    pub(crate) fn seeks_masses(&self) -> bool {
        self.nuisances().any(|(index, _)| index >= MASS)
    }

    /// Returns whether no coordinate before this sought one has its unknown.
    pub(crate) fn leads(&self, index: usize) -> bool {
        let unknown = self.roles[index].unknown();
        self.roles[..index].iter().all(|role| role.unknown() != unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// The unknowns are numbered without a gap.
    #[test]
    fn tied_coordinates_share_one_unknown() {
        let widths = Nuisances { delay: Some(1e-3), mass: Some(0.1), ..Nuisances::default() };
        let mut sought = Sought::new(2, &widths).unwrap();
        assert_eq!(sought.unknowns(), 24 + 1 + 2);
        let of = |joint| Coordinate::Stiffness { joint, dof: 2 };
        sought.fix(Coordinate::Damping { joint: 0, dof: 0 }, 1e3).unwrap();
        sought.tie(of(1), of(0)).unwrap();
        assert_eq!(sought.unknowns(), 24 + 1 + 2 - 2);
        assert_eq!((sought.unknown(of(0)), sought.unknown(of(1))), (Some(2), Some(2)));
        assert!(sought.leads(of(0).index()) && !sought.leads(of(1).index()));
        assert_eq!(sought.coordinate(2), Some(of(0)));
        assert_eq!(sought.unknown(Coordinate::Delay), Some(22));
        assert_eq!(sought.unknown(Coordinate::Mass(1)), Some(24));
        assert_eq!(sought.coordinate(24), Some(Coordinate::Mass(1)));
        assert_eq!((sought.coordinate(25), sought.unknown(Coordinate::Mass(2))), (None, None));
        // The other one of a tied pair keeps the unknown when one is fixed.
        sought.fix(of(0), 1e7).unwrap();
        assert_eq!((sought.unknowns(), sought.unknown(of(0))), (25, None));
        assert!(sought.unknown(of(1)).is_some() && sought.leads(of(1).index()));
    }
}
