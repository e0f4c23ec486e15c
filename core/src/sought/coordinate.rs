//! Order of the coordinates: parameters joint by joint, then the nuisances.

use core::fmt;

use crate::parameters::MAX_PARAMETERS;
use crate::{DOF, DOF_NAMES, MAX_JOINTS};

/// Index of the delay, the first nuisance.
pub(super) const DELAY: usize = MAX_PARAMETERS;
/// Index of the first of three acceleration gains.
pub(super) const ACCELERATION_GAIN: usize = DELAY + 1;
/// Index of the first of three force gains.
pub(super) const FORCE_GAIN: usize = ACCELERATION_GAIN + 3;
/// Index of the first of three misalignment angles.
pub(super) const MISALIGNMENT: usize = FORCE_GAIN + 3;
/// Index of the mass of the first link.
pub(super) const MASS: usize = MISALIGNMENT + 3;

/// Meaning of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinate {
    /// Logarithm of a stiffness.
    Stiffness {
        /// Joint, from 0, base first.
        joint: usize,
        /// Degree of freedom, 0..6.
        dof: usize,
    },
    /// Logarithm of a damping.
    Damping {
        /// Joint, from 0, base first.
        joint: usize,
        /// Degree of freedom, 0..6.
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

/// Joints and links are numbered from 1, base first.
impl fmt::Display for Coordinate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const AXES: [&str; 3] = ["x", "y", "z"];
        let name = |names: &[&'static str], index: usize| names.get(index).copied().unwrap_or("?");
        match *self {
            Self::Stiffness { joint, dof } => {
                write!(f, "joint {} {} stiffness", joint.saturating_add(1), name(&DOF_NAMES, dof))
            }
            Self::Damping { joint, dof } => {
                write!(f, "joint {} {} damping", joint.saturating_add(1), name(&DOF_NAMES, dof))
            }
            Self::Delay => f.write_str("delay"),
            Self::AccelerationGain(axis) => write!(f, "acceleration gain {}", name(&AXES, axis)),
            Self::ForceGain(axis) => write!(f, "force gain {}", name(&AXES, axis)),
            Self::Misalignment(axis) => write!(f, "misalignment about {}", name(&AXES, axis)),
            Self::Mass(link) => write!(f, "mass of link {}", link.saturating_add(1)),
        }
    }
}

impl Coordinate {
    /// [`Coordinate::index`]; `None` if the chain cannot have this joint, degree of freedom, axis or link.
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

    /// Index among all coordinates. The coordinate must exist.
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
