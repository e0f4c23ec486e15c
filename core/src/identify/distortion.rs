//! Part of the residuals that is no response to the force.
//!
//! Any error of a linear model leaves a response to the force: masses, axes, filters, a body that the model lacks. Joints that are not linear, a
//! clock that wanders or a sensor at its limit leave residuals that no linear response explains (nonlinear distortion: Pintelon and Schoukens,
//! _System Identification_, 2nd edition, 2012, chapter 3). Let m be the mean square of the residuals in units of the noise, and i that of the
//! part which no smooth response to the force explains. The distortion is
//!
//! ```text
//! (i − 1)/(m − 1)
//! ```
//!
//! Resonances amplify both, but at a narrow one a response is not smooth. So the part is the median over records and axes of the medians over windows.

use heapless::Vec;

use super::local_response::{Window, quantile, sorted, windows};
use crate::refine::Unexplained;
use crate::search::MAX_EXPERIMENTS;
use crate::spectrum::Experiment;

/// Mean square of the residuals, in units of the noise, from which on a window counts. A window of noise exceeds 2 once in twenty thousand; from
/// 3 on the part scatters by less than 0.1.
const CLEAR: f64 = 3.0;
/// Least windows of a record along an axis. Chosen: the median of eight scatters by `1.25/√8`, 44 % of the scatter of one.
const WINDOWS: usize = 8;
/// Most windows of a record along an axis: those of a band of 4608 bins.
const MAX_WINDOWS: usize = 192;
/// Least part. Chosen: a low-pass and a link that bends, of three and six joints, leave 0.01; friction, backlash, springs that stiffen and a
/// clock that runs away 0.09 to 0.6.
const LEAST: f64 = 0.05;

/// The part of each record along each axis that leaves something in many windows.
#[derive(Clone, Debug, Default)]
pub(super) struct Distortion(Vec<f64, { 3 * MAX_EXPERIMENTS }>);

impl Distortion {
    /// Adds what a model leaves of a record.
    pub(super) fn add<const B: usize>(
        &mut self,
        experiment: &Experiment<B>,
        left: &Unexplained<B>,
    ) {
        for axis in 0..3 {
            let all = windows(experiment, 0..experiment.bins());
            let windows = all.map(|first| Window::of(experiment, left, axis, first));
            let clear = windows.filter(|window| window.left > CLEAR);
            let parts: Vec<f64, MAX_WINDOWS> = sorted(clear.map(part));
            if parts.len() >= WINDOWS {
                // There is room for every record.
                let _ = self.0.push(quantile(&parts, 0.5));
            }
        }
    }

    /// The median part, if it is more than an error of a linear model leaves.
    pub(super) fn part(&self) -> Option<f64> {
        let parts: Vec<f64, { 3 * MAX_EXPERIMENTS }> = sorted(self.0.iter().copied());
        Some(quantile(&parts, 0.5)).filter(|part| *part >= LEAST)
    }
}

/// The part of a window that is no response to the force.
fn part(window: Window) -> f64 {
    ((window.incoherent - 1.0) / (window.left - 1.0)).clamp(0.0, 1.0)
}
