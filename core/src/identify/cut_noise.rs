//! Noise that only the cut has: spindle and chips shake the accelerometer.
//!
//! The noise of a record is read while nothing is cut. What a model leaves of the cut holds the noise of the cut and the error of the model.
//! The error is a response to the force. Within a few bins it is nearly
//!
//! ```text
//! E(k) = (G₀ + k G₁) F(k) + T₀ + k T₁
//! ```
//!
//! with the force F at bin k. What differs from the best such response is noise, since no smooth response to the force explains it (local
//! polynomial method: Pintelon and Schoukens, _System Identification_, 2nd edition, 2012, chapter 7). At a narrow resonance an error of the
//! model is not smooth. So the level of a band is the median of many windows. What moves the robot but is no force that is measured, as
//! friction does, is no smooth response either. Its resonances amplify it, so that the windows have unlike levels: it is an error of the model.

use heapless::Vec;

use super::noise::Shown;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::refine::Unexplained;
use crate::search::MAX_EXPERIMENTS;
use crate::spectrum::{CutNoise, Experiment, MAX_BANDS};
use crate::verdict::FOREIGN;

/// Bins of a window. Chosen: three times the unknowns of the response.
const WINDOW: usize = 24;
/// Complex unknowns of the response along one axis: `G₀`, `G₁`, `T₀`, `T₁`.
const UNKNOWNS: usize = 8;
/// Windows of the narrowest band. Their median scatters by `1.25 √(2 / 2 (24 − 8)) / √8` = 11 %.
const WINDOWS: usize = 8;
/// Most windows of a band.
const MAX_WINDOWS: usize = 64;
/// Median of χ² over its mean, of the 32 degrees of freedom of a window (Wilson and Hilferty, 1931).
const MEDIAN: f64 = 0.979;
/// Factor by which a level differs from what is assumed before that is replaced: four times the scatter.
const LOUDER: f64 = 1.5;
/// Ratio of the quartiles of the windows from which on they do not have one level. That of eight windows of noise is 1.4 ± 0.25.
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
    let bands = (experiment.bins() / (WINDOW * WINDOWS)).min(MAX_BANDS);
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
    let windows = || bins.clone().step_by(WINDOW).filter(|first| first + WINDOW <= bins.end);
    let levels = sorted(windows().map(|first| incoherent(experiment, left, axis, first)));
    let level = quantile(&levels, 0.5) / MEDIAN;
    let is_even = quantile(&levels, 0.75) < UNEVEN * quantile(&levels, 0.25);
    if (1.0 / LOUDER..LOUDER).contains(&level) || !is_even {
        return before;
    }
    // The noise of the force, which the level includes, stays as it is.
    let both = |bin: usize| left.noise[axis][bin] / experiment.broad_noise[axis][bin];
    let share = quantile(&sorted(windows().map(|bin| f64::from(both(bin)))), 0.5);
    let times = f64::from(before) * (1.0 + (level - 1.0) * share);
    if times < FOREIGN { times.max(1.0) as f32 } else { before }
}

/// Mean square of what no smooth response to the force explains in the window from `first` on, over that of the noise.
fn incoherent<const B: usize>(
    experiment: &Experiment<B>,
    left: &Unexplained<B>,
    axis: usize,
    first: usize,
) -> f64 {
    const COLUMNS: usize = 2 * UNKNOWNS + 1;
    let mut normal = Normal::<{ packed(COLUMNS) }>::new();
    normal.reset(2 * UNKNOWNS);
    let force = experiment.force.parts();
    let mut rows = [[0.0; COLUMNS]; 6];
    for (place, bin) in (first..first + WINDOW).enumerate() {
        let weight = 1.0 / libm::sqrt(f64::from(left.noise[axis][bin]).max(f64::MIN_POSITIVE));
        let along = (2 * place + 1) as f64 / WINDOW as f64 - 1.0;
        let [mut real, mut imaginary] = [[0.0; COLUMNS]; 2];
        let regressors = force.map(|[re, im]| [re[bin], im[bin]].map(f64::from));
        for (index, [re, im]) in regressors.into_iter().chain([[1.0, 0.0]]).enumerate() {
            for (order, times) in [weight, weight * along].into_iter().enumerate() {
                let column = 2 * (2 * index + order);
                [real[column], real[column + 1]] = [times * re, -times * im];
                [imaginary[column], imaginary[column + 1]] = [times * im, times * re];
            }
        }
        real[COLUMNS - 1] = weight * f64::from(left.residual.re[axis][bin]);
        imaginary[COLUMNS - 1] = weight * f64::from(left.residual.im[axis][bin]);
        let row = 2 * place % rows.len();
        (rows[row], rows[row + 1]) = (real, imaginary);
        if row + 2 == rows.len() {
            normal.add(&rows);
        }
    }
    normal.eliminate(2 * UNKNOWNS);
    normal.sum_of_squares() / (WINDOW - UNKNOWNS) as f64
}

/// The values in ascending order.
fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64, MAX_WINDOWS> {
    let mut sorted: Vec<f64, MAX_WINDOWS> = values.take(MAX_WINDOWS).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// What a part of the values lies below; NaN of nothing.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let place = part * sorted.len().saturating_sub(1) as f64;
    let (lower, rest) = (place as usize, place - libm::floor(place));
    match (sorted.get(lower), sorted.get(lower + 1)) {
        (Some(below), Some(above)) => below + rest * (above - below),
        (Some(last), None) => *last,
        _ => f64::NAN,
    }
}
