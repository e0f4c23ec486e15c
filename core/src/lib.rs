//! Identification of the joint stiffness and damping of a robot that bends while it mills.
//!
//! The crate holds the mathematics of flexid and the stream from samples to estimate. It needs neither the standard library
//! nor an allocator: the daemon, the offline tool and a microcontroller run the same code.
//!
//! All quantities are in SI units and all angles in rad; only quantities whose names end in `_hz` are in Hz. The degrees of
//! freedom of a joint have the order `tx ty tz rx ry rz`: along and about the axes of the joint frame.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod calibration;
pub mod chain;
pub(crate) mod continuation;
pub mod identify;
pub(crate) mod linear;
pub mod loss;
pub mod motion;
pub mod mounting;
pub mod noise;
pub mod parameters;
pub mod receptance;
pub mod refine;
pub mod search;
pub mod sensors;
pub mod spectrum;
pub mod statics;
pub mod stream;
pub mod unknowns;
pub mod verdict;

/// Largest number of joints of a chain.
pub const MAX_JOINTS: usize = 7;
/// Largest number of nuisances: a delay, three gains of each of two sensors, three misalignment angles, and a mass per link.
pub const MAX_NUISANCES: usize = 10 + MAX_JOINTS;
/// Largest number of coordinates, and of unknowns of a fit.
pub const MAX_UNKNOWNS: usize = parameters::MAX_PARAMETERS + MAX_NUISANCES;
/// Number of degrees of freedom of a bushing: `tx ty tz rx ry rz`.
pub const DOF: usize = 6;
/// Names of these degrees of freedom.
pub const DOF_NAMES: [&str; DOF] = ["tx", "ty", "tz", "rx", "ry", "rz"];
