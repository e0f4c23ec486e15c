//! Reasons why a choice of unknowns is invalid.

use core::error::Error;
use core::fmt;

use super::Coordinate;
use crate::MAX_JOINTS;

/// Reason why a choice of unknowns is invalid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SoughtError {
    /// The number of joints, which is given here, is not 1 to [`MAX_JOINTS`].
    JointCount(usize),
    /// The coordinate is not a parameter of the chain.
    NoParameter(Coordinate),
    /// No imperfections have this key, they cannot be negative, or there is no room for them.
    NoImperfections,
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
            Self::NoParameter(coordinate) => {
                write!(f, "{coordinate}: the chain has no such parameter")
            }
            Self::NoImperfections => {
                write!(f, "no imperfections can be sought so: seek fewer of them")
            }
            Self::Value(parameter, value) => {
                write!(f, "{parameter} is fixed at {value}: must be positive and finite")
            }
            Self::NotAlike(one, other) => {
                write!(f, "{one} is tied to {other}: tie like to like")
            }
        }
    }
}

impl Error for SoughtError {}
