//! The places of what may be sought: parameters joint by joint, then the nuisances.

use crate::parameters::MAX_PARAMETERS;
use crate::{DOF, MAX_JOINTS};

/// Where the nuisances stand.
pub(super) const DELAY: usize = MAX_PARAMETERS;
pub(super) const ACCELERATION_GAIN: usize = DELAY + 1;
pub(super) const FORCE_GAIN: usize = ACCELERATION_GAIN + 3;
pub(super) const MISALIGNMENT: usize = FORCE_GAIN + 3;
pub(super) const MASS: usize = MISALIGNMENT + 3;

/// What a coordinate is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinate {
    /// Logarithm of a stiffness.
    Stiffness {
        /// From 0, base first.
        joint: usize,
        /// 0..6.
        dof: usize,
    },
    /// Logarithm of a damping.
    Damping {
        /// From 0, base first.
        joint: usize,
        /// 0..6.
        dof: usize,
    },
    /// [`Calibration::delay`](crate::calibration::Calibration::delay).
    Delay,
    /// Logarithm of [`Calibration::acceleration_gain`](crate::calibration::Calibration::acceleration_gain) of an axis.
    AccelerationGain(usize),
    /// Logarithm of [`Calibration::force_gain`](crate::calibration::Calibration::force_gain) of an axis.
    ForceGain(usize),
    /// [`Calibration::misalignment`](crate::calibration::Calibration::misalignment) about an axis.
    Misalignment(usize),
    /// Logarithm of [`Calibration::mass`](crate::calibration::Calibration::mass) of a link, from 0.
    Mass(usize),
}

impl Coordinate {
    /// [`Coordinate::index`], if there is one: callers may name any joint, axis or link.
    pub(super) fn place(self) -> Option<usize> {
        let exists = match self {
            Self::Stiffness { joint, dof } | Self::Damping { joint, dof } => {
                joint < MAX_JOINTS && dof < DOF
            }
            Self::Delay => true,
            Self::AccelerationGain(axis) | Self::ForceGain(axis) | Self::Misalignment(axis) => {
                axis < 3
            }
            Self::Mass(link) => link < MAX_JOINTS,
        };
        exists.then(|| self.index())
    }

    /// Place among all coordinates, of one that exists.
    pub(crate) const fn index(self) -> usize {
        match self {
            Self::Stiffness { joint, dof } => 2 * DOF * joint + dof,
            Self::Damping { joint, dof } => 2 * DOF * joint + DOF + dof,
            Self::Delay => DELAY,
            Self::AccelerationGain(axis) => ACCELERATION_GAIN + axis,
            Self::ForceGain(axis) => FORCE_GAIN + axis,
            Self::Misalignment(axis) => MISALIGNMENT + axis,
            Self::Mass(link) => MASS + link,
        }
    }

    pub(crate) const fn of(index: usize) -> Self {
        let (joint, dof) = (index / (2 * DOF), index % (2 * DOF));
        match index {
            0..DELAY if dof < DOF => Self::Stiffness { joint, dof },
            0..DELAY => Self::Damping { joint, dof: dof - DOF },
            DELAY => Self::Delay,
            ACCELERATION_GAIN..FORCE_GAIN => Self::AccelerationGain(index - ACCELERATION_GAIN),
            FORCE_GAIN..MISALIGNMENT => Self::ForceGain(index - FORCE_GAIN),
            MISALIGNMENT..MASS => Self::Misalignment(index - MISALIGNMENT),
            _ => Self::Mass(index - MASS),
        }
    }
}
