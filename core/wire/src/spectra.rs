//! The newest record beside the model: spectra of the acceleration along the band.
//!
//! An amplitude spectral density is that of one side, over the record of length T, as a root mean square over the bins of a band, so
//! that a resonance stays visible however few bands there are:
//!
//! ```text
//! √( 2/T · mean |X|² )        X the DFT times the sample period
//! ```

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::report::MAX_JOINTS;

/// Most bands of a record. Chosen: a terminal of 80 columns has two dots for each.
pub const MAX_BANDS: usize = 60;

/// Spectra of the newest record that the estimate rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Spectra {
    /// Number of the record among all that came, from 1.
    pub record: u64,
    /// Joint angles of its pose, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Ends of the band that is fitted, Hz.
    pub band_hz: [f32; 2],
    /// Parts of it of equal ratios, by ascending frequency. Those without a bin are left out.
    pub bands: Vec<Band, MAX_BANDS>,
}

/// Amplitude spectral densities in one part of the band, along each axis of the accelerometer, (m/s²)/√Hz.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Band {
    /// Geometric mean of the frequencies of its bins, Hz.
    pub frequency_hz: f32,
    /// Measured acceleration, without the lines that no force causes.
    pub measured: [f32; 3],
    /// Modelled acceleration.
    pub modelled: [f32; 3],
    /// The share that the noise of both sensors leaves of measured less modelled, that of the force through the robot.
    pub noise: [f32; 3],
}
