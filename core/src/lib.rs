//! Identification of the joint stiffness and damping of a robot that bends while it mills.
//!
//! The mathematics of flexid, and the stream from samples to estimate, without the standard library
//! and without an allocator: the daemon, the offline tool and a microcontroller run these same lines.
//!
//! SI units everywhere, angles in rad; only names that end in `_hz` are in Hz. Degrees of freedom of a
//! joint come in the order `tx ty tz rx ry rz`, along and about the axes of the joint frame.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod calibration;
pub mod chain;
pub(crate) mod continuation;
pub mod identify;
pub mod loss;
pub mod motion;
pub mod mounting;
pub mod noise;
pub mod parameters;
pub mod receptance;
pub mod refine;
pub mod search;
pub mod spectrum;
pub mod statics;
pub mod stream;
pub mod unknowns;
pub mod verdict;

/// Most joints a chain may have.
pub const MAX_JOINTS: usize = 7;
/// Degrees of freedom of a bushing joint: `tx ty tz rx ry rz`.
pub const DOF: usize = 6;
