//! Noise that only the cut has: spindle and chips shake the accelerometer.
//!
//! The noise of a record is read while nothing is cut. What a model leaves of the cut holds the noise of the cut and the error of the model.
//! The error is a response to the force; what no smooth response to the force explains is noise (`local_response`). The level of a band is
//! the median of many windows. What moves the robot but is no force that is measured, as friction does, is no smooth response either. The
//! robot's resonances amplify it, so that the windows have unlike levels: it is an error of the model (`distortion`).

use heapless::Vec;

use super::local_response::{WINDOW, Window, quantile, sorted, windows};
use super::shown::Shown;
use crate::refine::Unexplained;
use crate::search::MAX_EXPERIMENTS;
use crate::spectrum::{CutNoise, Experiment, MAX_BANDS};
use crate::verdict::FOREIGN;

/// Windows of the narrowest band. Their median scatters by `1.25 √(2 / 2 (24 − 8)) / √8` = 11 %.
const WINDOWS: usize = 8;
/// Most windows of a band.
const MAX_WINDOWS: usize = 64;
/// Median of χ² over its mean, of the 32 degrees of freedom of a window (Wilson and Hilferty, 1931).
const MEDIAN: f64 = 0.979;
/// Factor between a level and the assumed one from which on the level replaces it: it differs by four times the scatter of 11 %.
const LOUDER: f64 = 1.5;
/// Ratio of the quartiles of the windows from which on they do not have one level. Eight windows of noise have 1.4 ± 0.25, so that 2 is more than
/// two standard deviations above.
const UNEVEN: f64 = 2.0;

/// Replaces the noise of the cut in `experiments` by that shown. Returns whether that changes them.
pub(super) fn replace<const B: usize>(
    experiments: &mut [Experiment<B>],
    shown: Vec<Shown, MAX_EXPERIMENTS>,
) -> bool {
    let mut changed = false;
    for (experiment, Shown { cut_noise, .. }) in experiments.iter_mut().zip(shown) {
        if cut_noise != experiment.cut_noise {
            experiment.replace_cut_noise(cut_noise);
            changed = true;
        }
    }
    changed
}

/// Noise of the cut of a record, from what a model leaves of it.
pub(super) fn of<const B: usize>(experiment: &Experiment<B>, left: &Unexplained<B>) -> CutNoise {
    // The bins of several parts are not in the order of their frequencies.
    let most = if experiment.is_whole() { MAX_BANDS } else { 1 };
    let bands = (experiment.bins() / (WINDOW * WINDOWS)).min(most);
    let times = [0, 1, 2].map(|axis| {
        let own = &experiment.cut_noise.times[axis];
        let times: Vec<f32, MAX_BANDS> = (0..bands)
            .map(|band| {
                let before = own.get(band).copied().unwrap_or(1.0);
                changed(experiment, left, axis, band, bands, before)
            })
            .collect();
        if times.iter().all(|times| *times == 1.0) { Vec::new() } else { times }
    });
    CutNoise { times }
}

/// Noise of the cut in a band over that at rest, where it was assumed to be `before`.
fn changed<const B: usize>(
    experiment: &Experiment<B>,
    left: &Unexplained<B>,
    axis: usize,
    band: usize,
    bands: usize,
    before: f32,
) -> f32 {
    let bins = experiment.bins_of_band(band, bands);
    let windows = || windows(experiment, bins.clone());
    let level = |first: usize| Window::of(experiment, left, axis, first).incoherent;
    let levels = sorted::<MAX_WINDOWS>(windows().map(level));
    let level = quantile(&levels, 0.5) / MEDIAN;
    let is_even = quantile(&levels, 0.75) < UNEVEN * quantile(&levels, 0.25);
    if (1.0 / LOUDER..LOUDER).contains(&level) || !is_even {
        return before;
    }
    // The noise of the force, which the level includes, stays as it is.
    let both = |bin: usize| left.noise[axis][bin] / experiment.broad_noise[axis][bin];
    let share = windows().map(|bin| f64::from(both(bin)));
    let share = quantile(&sorted::<MAX_WINDOWS>(share), 0.5);
    let times = f64::from(before) * (1.0 + (level - 1.0) * share);
    if times < FOREIGN { times.max(1.0) as f32 } else { before }
}
