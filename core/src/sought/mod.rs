//! The unknowns of a fit: the parameters of the joints, of which some may be fixed or tied to each other, and imperfections.
//!
//! There are [`MAX_UNKNOWNS`] coordinates. The first [`MAX_PARAMETERS`] are the logarithms of the parameters: joint by joint
//! six stiffnesses and six dampings. The imperfections that are sought follow in their order, each in units of its prior's
//! standard deviation. A fit has one unknown per sought coordinate; tied coordinates share one unknown. Those of the
//! imperfections come last.

mod coordinate;
mod error;
mod text;
mod values;

use heapless::Vec;

use crate::chain::{Chain, JointKind};
use crate::imperfection::{Imperfection, possible};
use crate::parameters::MAX_PARAMETERS;
use crate::{DOF, MAX_JOINTS};
pub(crate) use crate::{MAX_SOUGHT, MAX_UNKNOWNS};
pub use coordinate::Coordinate;
pub use error::SoughtError;
pub(crate) use values::{Coordinates, Expected, deviation_between};

/// Stiffness that is treated as rigid, N/m or Nm/rad. Chosen: 1 kN moves it by 0.1 µm, a tenth of what a dial gauge resolves. A larger one takes
/// digits from the single precision of the search.
pub const STIFF: f64 = 1e10;
/// Damping of such a spring, in its stiffness, s. Chosen: 0.1 % of its force at 200 Hz, `2π 200 Hz` times this.
const LOSS: f64 = 1e-6;

/// Role of a parameter in a fit.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    /// The chain does not have the parameter.
    Absent,
    /// The parameter has this value, in its own unit.
    Fixed(f64),
    /// The parameter is sought. Tied parameters share an unknown, whose number this is.
    Sought(u8),
}

impl Role {
    fn unknown(self) -> Option<usize> {
        match self {
            Self::Sought(unknown) => Some(usize::from(unknown)),
            _ => None,
        }
    }
}

/// The unknowns of the fit of a chain: the role of each coordinate, and the unknowns that follow from the roles.
#[derive(Clone, PartialEq)]
pub struct Sought {
    joints: usize,
    /// Number of unknown parameters.
    parameters: usize,
    /// Role of each parameter.
    roles: [Role; MAX_PARAMETERS],
    /// The imperfections that are sought, each with the standard deviation of its prior, in its unit.
    imperfections: Vec<(Imperfection, f64), MAX_SOUGHT>,
    /// True if the stiffnesses have a prior.
    expects_stiffnesses: bool,
}

impl Sought {
    /// The unknowns of a fit that seeks all parameters of a chain of `joints` joints, each as its own unknown.
    ///
    /// # Errors
    ///
    /// Returns an error if `joints` is not 1 to [`MAX_JOINTS`].
    pub fn new(joints: usize) -> Result<Self, SoughtError> {
        if !(1..=MAX_JOINTS).contains(&joints) {
            return Err(SoughtError::JointCount(joints));
        }
        Ok(Self::of_joints(joints))
    }

    /// The unknowns of a fit that seeks all parameters of `chain`, each as its own unknown.
    pub(crate) fn parameters_of(chain: &Chain) -> Self {
        Self::of_joints(chain.joints().len())
    }

    /// [`Sought::new`] without its check: the caller ensures that `joints` is at most [`MAX_JOINTS`].
    fn of_joints(joints: usize) -> Self {
        let parameters = 2 * DOF * joints;
        let role =
            |index| if index < parameters { Role::Sought(index as u8) } else { Role::Absent };
        let roles = core::array::from_fn(role);
        Self { joints, parameters, roles, imperfections: Vec::new(), expects_stiffnesses: false }
    }

    /// Also seeks all imperfections whose accuracy the [entry](crate::imperfection::Entry) of this key states, each with a prior of the standard
    /// deviation `prior`, in its unit. The fit then keeps no accuracy of theirs.
    ///
    /// # Errors
    ///
    /// Returns an error if there are none, if they cannot be negative, or if there is no room for them.
    pub fn seek(&mut self, key: &str, prior: f64) -> Result<(), SoughtError> {
        let before = self.imperfections.len();
        let joints = [JointKind::Revolute; MAX_JOINTS];
        let mut own = possible(&joints[..self.joints], 1).filter(|own| own.entry().key == key);
        let is_sought =
            own.all(|own| !own.is_positive() && self.imperfections.push((own, prior)).is_ok());
        if is_sought && self.imperfections.len() > before {
            return Ok(());
        }
        self.imperfections.truncate(before);
        Err(SoughtError::NoImperfections)
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
        if let Role::Sought(unknown) = self.roles[index] {
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
        if let [Role::Sought(gone), Role::Sought(shared)] = roles
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
            Role::Sought(unknown) => Some(unknown),
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
        self.parameters -= 1;
    }

    /// Number of joints of the chain.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.parameters + self.imperfections.len()
    }

    /// Returns whether some parameter is fixed, or tied to another one.
    pub fn imposes(&self) -> bool {
        self.parameters < 2 * DOF * self.joints
    }

    /// Unknown of a coordinate; `None` if the coordinate is not sought, or if the chain does not have it.
    pub fn unknown(&self, coordinate: Coordinate) -> Option<usize> {
        match coordinate {
            Coordinate::Imperfection(imperfection) => {
                let place = self.imperfections.iter().position(|(own, _)| *own == imperfection);
                Some(self.parameters + place?)
            }
            parameter => self.roles[self.parameter(parameter).ok()?].unknown(),
        }
    }

    /// First coordinate of an unknown, which names it; `None` if the unknown does not exist.
    pub fn coordinate(&self, unknown: usize) -> Option<Coordinate> {
        if let Some((imperfection, _)) =
            self.imperfections.get(unknown.wrapping_sub(self.parameters))
        {
            return Some(Coordinate::Imperfection(*imperfection));
        }
        self.parameters().find(|(_, own)| *own == unknown).map(|(index, _)| Coordinate::of(index))
    }

    /// The imperfections that are sought, each with the standard deviation of its prior, in its unit.
    pub fn imperfections(&self) -> &[(Imperfection, f64)] {
        &self.imperfections
    }

    /// Sought coordinates by index, each with its unknown.
    pub(crate) fn sought(&self) -> impl Iterator<Item = (usize, usize)> {
        let imperfections = 0..self.imperfections.len();
        let place = |own| (MAX_PARAMETERS + own, self.parameters + own);
        self.parameters().chain(imperfections.map(place))
    }

    /// Sought parameters by index, each with its unknown.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = (usize, usize)> {
        self.roles.iter().enumerate().filter_map(|(index, role)| Some((index, role.unknown()?)))
    }

    /// Unknown of the first imperfection that is sought.
    pub(crate) fn first_imperfection(&self) -> usize {
        self.parameters
    }

    /// Returns whether no parameter before this sought one has its unknown.
    pub(crate) fn leads(&self, index: usize) -> bool {
        let unknown = self.roles[index].unknown();
        self.roles[..index].iter().all(|role| role.unknown() != unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The indices of an eighth joint's parameters would be those of imperfections.
    #[test]
    fn what_no_chain_has_cannot_be_sought() {
        for joints in [0, 8, usize::MAX] {
            let refused = Sought::new(joints).err();
            assert_eq!(refused, Some(SoughtError::JointCount(joints)));
        }
        let mut sought = Sought::new(2).unwrap();
        let all = sought.clone();
        let own = Coordinate::Stiffness { joint: 0, dof: 0 };
        let damping = Coordinate::Damping { joint: 0, dof: 0 };
        for other in [
            Coordinate::Stiffness { joint: 2, dof: 0 },
            Coordinate::Stiffness { joint: 0, dof: 6 },
            Coordinate::Damping { joint: usize::MAX, dof: 0 },
            Coordinate::Imperfection(Imperfection::Delay),
        ] {
            assert_eq!(sought.fix(other, 1.0), Err(SoughtError::NoParameter(other)));
            assert_eq!(sought.tie(own, other), Err(SoughtError::NoParameter(other)));
            assert_eq!(sought.unknown(other), None);
        }
        assert_eq!(sought.tie(own, damping), Err(SoughtError::NotAlike(own, damping)));
        for value in [0.0, -1.0, f64::INFINITY] {
            assert_eq!(sought.fix(own, value), Err(SoughtError::Value(own, value)));
        }
        assert_eq!(sought, all);
        for key in ["no_such_key", "hose_n_per_m", "centre_of_mass_m"] {
            assert_eq!(Sought::new(7).unwrap().seek(key, 1.0), Err(SoughtError::NoImperfections));
            let refused = sought.seek(key, 1.0).is_err();
            assert_eq!(
                refused,
                key != "centre_of_mass_m",
                "{key}: there is room for those of two links"
            );
        }
    }

    /// The unknowns are numbered without a gap.
    #[test]
    fn tied_coordinates_share_one_unknown() {
        let mut sought = Sought::new(2).unwrap();
        sought.seek("delay_s", 1e-3).unwrap();
        sought.seek("link_mass", 0.1).unwrap();
        let (delay, mass) = (Imperfection::Delay, Imperfection::Mass);
        assert_eq!(sought.unknowns(), 24 + 1 + 2);
        let of = |joint| Coordinate::Stiffness { joint, dof: 2 };
        sought.fix(Coordinate::Damping { joint: 0, dof: 0 }, 1e3).unwrap();
        sought.tie(of(1), of(0)).unwrap();
        assert_eq!(sought.unknowns(), 24 + 1 + 2 - 2);
        assert_eq!((sought.unknown(of(0)), sought.unknown(of(1))), (Some(2), Some(2)));
        assert!(sought.leads(of(0).index()) && !sought.leads(of(1).index()));
        assert_eq!(sought.coordinate(2), Some(of(0)));
        assert_eq!(sought.unknown(Coordinate::Imperfection(delay)), Some(22));
        assert_eq!(sought.unknown(Coordinate::Imperfection(mass(1))), Some(24));
        assert_eq!(sought.coordinate(24), Some(Coordinate::Imperfection(mass(1))));
        assert_eq!(sought.unknown(Coordinate::Imperfection(mass(2))), None);
        assert_eq!(sought.coordinate(25), None);
        assert_eq!(sought.imperfections(), [(delay, 1e-3), (mass(0), 0.1), (mass(1), 0.1)]);
        // The other one of a tied pair keeps the unknown when one is fixed.
        sought.fix(of(0), 1e7).unwrap();
        assert_eq!((sought.unknowns(), sought.unknown(of(0))), (25, None));
        assert!(sought.unknown(of(1)).is_some() && sought.leads(of(1).index()));
    }
}
