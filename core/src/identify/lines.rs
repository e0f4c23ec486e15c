//! Lines in a divided record: frequencies at which the cut has more noise than the rest, as those of a spindle that is out of balance.
//!
//! The parts of a record are too short for a tone to have a shape (`tones`). But each bin comes as often as there are parts, at nearly one pose, so
//! that what a linear model leaves there is one response to the force, and noise:
//!
//! ```text
//! E_p = G F_p + N_p
//! ```
//!
//! The mean square of what no G explains is the level of the noise (as in `local_response`). Where noise at rest would hardly ever reach it, the bin
//! has this level.

use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::refine::Unexplained;
use crate::spectrum::Experiment;
use crate::stream::LEAST_EVEN;

/// Real unknowns of the response along one axis: G.
const UNKNOWNS: usize = 6;
/// Standard deviations of the deviate that noise exceeds once in 10,000 bins.
const RARE: f64 = 3.72;
/// Least growth of a level for which the fit is made again. Chosen: it changes no standard deviation by more than 5 %.
const GROWTH: f64 = 1.1;

/// Raises the noise of the acceleration at the lines of a divided record, of which a model leaves `left`. Returns whether that changes it.
pub(super) fn raise<const B: usize>(experiment: &mut Experiment<B>, left: &Unexplained<B>) -> bool {
    let parts = experiment.path.len();
    if parts < LEAST_EVEN {
        return false;
    }
    let bins = experiment.bins() / parts;
    let mut is_raised = false;
    for axis in 0..3 {
        if !experiment.measures(axis) {
            continue;
        }
        for bin in 0..bins {
            let places = || (0..parts).map(|part| part * bins + bin);
            let level = level(experiment, left, axis, places());
            if level < most_of_noise(parts) {
                continue;
            }
            for place in places() {
                // The noise of the force, which the level includes, stays as it is.
                let broad = experiment.broad_noise[axis][place];
                let raised = broad + (level as f32 - 1.0) * left.noise[axis][place];
                let own = &mut experiment.acceleration_noise[axis][place];
                is_raised |= raised > GROWTH as f32 * *own;
                *own = own.max(raised);
            }
        }
    }
    is_raised
}

/// Mean square of what no response to the force explains at some places of the spectra, over that of the noise.
fn level<const B: usize>(
    experiment: &Experiment<B>,
    left: &Unexplained<B>,
    axis: usize,
    places: impl Iterator<Item = usize> + Clone,
) -> f64 {
    let mut normal = Normal::<{ packed(UNKNOWNS + 1) }>::new();
    normal.reset(UNKNOWNS);
    let force = experiment.force.parts();
    for place in places.clone() {
        let noise = f64::from(left.noise[axis][place]).max(f64::MIN_POSITIVE);
        let weight = 1.0 / libm::sqrt(noise);
        let terms = |turn: [[f64; 2]; 2]| {
            let mut terms = [(0, 0.0); UNKNOWNS];
            for (index, [re, im]) in force.iter().enumerate() {
                let own = [re[place], im[place]].map(|own| weight * f64::from(own));
                for (column, [of_re, of_im]) in turn.into_iter().enumerate() {
                    let column = 2 * index + column;
                    terms[column] = (column, of_re * own[0] + of_im * own[1]);
                }
            }
            terms
        };
        let [re, im] = [&left.residual.re, &left.residual.im]
            .map(|part| weight * f64::from(part[axis][place]));
        normal.add_sparse(&terms([[1.0, 0.0], [0.0, -1.0]]), re);
        normal.add_sparse(&terms([[0.0, 1.0], [1.0, 0.0]]), im);
    }
    normal.eliminate(UNKNOWNS);
    normal.sum_of_squares() / (places.count() - UNKNOWNS / 2) as f64
}

/// Level that noise of so many parts exceeds once in 10,000 bins (Wilson and Hilferty, 1931).
fn most_of_noise(parts: usize) -> f64 {
    let part = 2.0 / (9.0 * (2 * parts - UNKNOWNS) as f64);
    libm::pow(1.0 - part + RARE * libm::sqrt(part), 3.0)
}

#[cfg(test)]
mod tests;
