//! A measured receptance, in the axes of the robot.

use std::path::PathBuf;

use flexid_core::spectrum::{MeasuredBin, MeasuredReceptance};

/// Accelerations per force along one axis of the TCP, at one pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Receptance {
    /// File from which it was read.
    pub file: PathBuf,
    /// Joint angles, rad (m), base first.
    pub pose: Vec<f64>,
    /// Point at which the force acts, from the TCP, TCP axes, m.
    pub point: [f64; 3],
    /// Axis of the TCP along which the force acts.
    pub force_axis: usize,
    /// Distance of the frequencies, Hz.
    pub spacing_hz: f64,
    /// The first frequency, Hz.
    pub first_hz: f64,
    /// Decay of the exponential window, 1/s.
    pub decay: f64,
    /// Bins along each axis of the accelerometer. Empty along an axis that is not measured.
    pub axes: [Vec<MeasuredBin>; 3],
}

impl Receptance {
    /// The receptance as core takes it.
    pub fn measured(&self) -> MeasuredReceptance<'_> {
        let mut direction = [0.0; 3];
        direction[self.force_axis] = 1.0;
        MeasuredReceptance {
            pose: &self.pose,
            point: self.point,
            direction,
            spacing_hz: self.spacing_hz,
            first_hz: self.first_hz,
            decay: self.decay,
            axes: self.axes.each_ref().map(Vec::as_slice),
        }
    }

    /// Lowest and highest frequency, Hz.
    pub fn range_hz(&self) -> [f64; 2] {
        let bins = self.axes.iter().map(Vec::len).max().unwrap_or_default();
        [self.first_hz, self.first_hz + bins.saturating_sub(1) as f64 * self.spacing_hz]
    }
}
