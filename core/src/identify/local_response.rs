//! Residuals that no smooth response to the force explains.
//!
//! An error of a linear model leaves a response to the force. Within a few bins it is nearly
//!
//! ```text
//! E(k) = (G₀ + k G₁) F(k) + T₀ + k T₁
//! ```
//!
//! with the force F at bin k. What differs from the best such response is noise, or the response of what is not linear (local polynomial
//! method: Pintelon and Schoukens, _System Identification_, 2nd edition, 2012, chapter 7). At a narrow resonance an error of the model is
//! not smooth either, so that the median of many windows counts.

use core::ops::Range;

use heapless::Vec;

use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::refine::Unexplained;
use crate::spectrum::{Experiment, Part};

/// Bins of a window. Chosen: three times the unknowns of the response.
pub(super) const WINDOW: usize = 24;
/// Complex unknowns of the response along one axis: `G₀`, `G₁`, `T₀`, `T₁`.
const UNKNOWNS: usize = 8;
/// Those of a measured receptance, whose force is one and the same in each bin: `T₀`, `T₁`.
const UNKNOWNS_OF_RECEPTANCE: usize = 2;

/// Mean squares in a window of bins along an axis, over that of the noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Mean square of the residuals.
    pub(super) left: f64,
    /// Mean square of the part that no smooth response to the force explains. Noise has 1.
    pub(super) incoherent: f64,
}

/// First bins of the windows that lie in one part of a record and in these of its bins.
pub(super) fn windows<const B: usize>(
    experiment: &Experiment<B>,
    bins: Range<usize>,
) -> impl Iterator<Item = usize> {
    let in_part = move |part: Part<'_>| {
        let (first, end) = (part.bins.start.max(bins.start), part.bins.end.min(bins.end));
        (first..end).step_by(WINDOW).filter(move |first| first + WINDOW <= end)
    };
    experiment.parts().flat_map(in_part)
}

impl Window {
    /// The window that begins at bin `first`.
    pub(super) fn of<const B: usize>(
        experiment: &Experiment<B>,
        left: &Unexplained<B>,
        axis: usize,
        first: usize,
    ) -> Self {
        const COLUMNS: usize = 2 * UNKNOWNS + 1;
        let mut normal = Normal::<{ packed(COLUMNS) }>::new();
        normal.reset(2 * UNKNOWNS);
        let force = experiment.force.parts();
        let mut rows = [[0.0; COLUMNS]; 6];
        for (place, bin) in (first..first + WINDOW).enumerate() {
            let noise = f64::from(left.noise[axis][bin]).max(f64::MIN_POSITIVE);
            let weight = 1.0 / libm::sqrt(noise);
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
        let left = normal.sum_of_squares() / WINDOW as f64;
        normal.eliminate(2 * UNKNOWNS);
        let unknowns = if experiment.is_record() { UNKNOWNS } else { UNKNOWNS_OF_RECEPTANCE };
        Self { left, incoherent: normal.sum_of_squares() / (WINDOW - unknowns) as f64 }
    }
}

/// The values in ascending order, at most N of them.
pub(super) fn sorted<const N: usize>(values: impl Iterator<Item = f64>) -> Vec<f64, N> {
    let mut sorted: Vec<f64, N> = values.take(N).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// Returns the value below which this part of the values lies; NaN of nothing.
pub(super) fn quantile(sorted: &[f64], part: f64) -> f64 {
    let place = part * sorted.len().saturating_sub(1) as f64;
    let (lower, rest) = (place as usize, place - libm::floor(place));
    match (sorted.get(lower), sorted.get(lower + 1)) {
        (Some(below), Some(above)) => below + rest * (above - below),
        (Some(last), None) => *last,
        _ => f64::NAN,
    }
}
