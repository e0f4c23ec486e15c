//! Receptance of the chain and its exact gradient, by an articulated-body recursion on the dynamic stiffness. Each SIMD lane
//! holds one frequency bin.
//!
//! `seq!` unrolls the loops over the six degrees of freedom. A loop that the compiler leaves rolled keeps its matrices in
//! memory instead of registers, and takes twice the time.
#![allow(
    clippy::absurd_extreme_comparisons,
    clippy::eq_op,
    clippy::identity_op,
    clippy::reversed_empty_ranges,
    reason = "unrolled loops have constants for indices"
)]

mod accelerance;
mod complex;
mod elimination;
mod filter;
mod gradient;
pub mod lanes;
mod law;
mod observation;
mod recursion;
mod symmetric;
mod terms;
mod to_parent;
mod tool;

pub use accelerance::accelerance;
pub use complex::Complex;
pub(crate) use elimination::bushing;
pub(crate) use filter::Filter;
pub use gradient::{PerDof, Response};
pub(crate) use law::{Hysteresis, Rates, per_growth, per_hysteretic_part};
pub(crate) use observation::{Loads, Observation};
pub use recursion::receptance;
pub(crate) use symmetric::{PACKED, at};
pub use terms::Terms;
pub(crate) use terms::{Ground, Growth, Hose, JointTerms};
pub(crate) use tool::ToolTerms;
