//! Receptance of the chain and its exact gradient, by one articulated-body recursion on the dynamic
//! stiffness; one frequency bin per SIMD lane.

pub mod complex;
pub mod gradient;
pub mod lanes;
pub mod recursion;
pub mod symmetric;
pub mod terms;

pub use complex::Complex;
pub use gradient::{Response, response};
pub use recursion::receptance;
pub use terms::Terms;
