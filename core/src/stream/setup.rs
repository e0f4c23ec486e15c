//! Setup of a measurement: what the readings of a cut or a blow are of.

/// Where the force acts, and along which axes of the sensors something is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Point of the tool at which the force acts, from the TCP, TCP axes, m.
    pub point: [f64; 3],
    /// True for each axis of the force that is measured. Along another one it is exactly 0.
    pub force: [bool; 3],
    /// True for each axis of the acceleration that is measured. The readings along another one are 0, and have no weight.
    pub acceleration: [bool; 3],
}

impl Default for Setup {
    fn default() -> Self {
        Self { point: [0.0; 3], force: [true; 3], acceleration: [true; 3] }
    }
}
