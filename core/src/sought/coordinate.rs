//! Coordinates: the parameters joint by joint, and imperfections.

use core::fmt;

use crate::imperfection::Imperfection;
use crate::{DOF, DOF_NAMES, MAX_UNKNOWNS};

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
    /// An imperfection, in its prior's standard deviations.
    Imperfection(Imperfection),
}

/// Joints are numbered from 1, base first.
impl fmt::Display for Coordinate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (joint, dof, what) = match self {
            Self::Stiffness { joint, dof } => (joint, dof, "stiffness"),
            Self::Damping { joint, dof } => (joint, dof, "damping"),
            Self::Imperfection(own) => return write!(f, "{own:?}"),
        };
        let name = DOF_NAMES.get(*dof).copied().unwrap_or("?");
        write!(f, "joint {} {name} {what}", joint.saturating_add(1))
    }
}

impl Coordinate {
    /// Index among all coordinates of a parameter, which must exist. [`MAX_UNKNOWNS`], which is none, of an imperfection.
    pub(crate) const fn index(self) -> usize {
        match self {
            Self::Stiffness { joint, dof } => 2 * DOF * joint + dof,
            Self::Damping { joint, dof } => 2 * DOF * joint + DOF + dof,
            Self::Imperfection(_) => MAX_UNKNOWNS,
        }
    }

    /// The parameter of this index.
    pub(crate) const fn of(index: usize) -> Self {
        let (joint, dof) = (index / (2 * DOF), index % (2 * DOF));
        match dof {
            ..DOF => Self::Stiffness { joint, dof },
            _ => Self::Damping { joint, dof: dof - DOF },
        }
    }
}
