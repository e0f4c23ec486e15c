//! The frequency at which a dynamic stiffness is evaluated.

use nalgebra::Complex;

/// The frequency at which a dynamic stiffness is evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// At this complex frequency, rad/s.
    At(Complex<f64>),
    /// At rest, with the stiffnesses that the bushings have at this frequency, rad/s.
    Static(f64),
}
