//! Tones: steady oscillations that the residuals show where noise does not explain them.
//!
//! The noise of a record is read while nothing is cut. Lines of hum, spindle and bearings are not known well enough from there: they leak
//! into the whole band of a record. They are no response to the measured force. An error of the model leaves much at a resonance, too. A
//! tone is told from it by its shape: it leaks into the bins beside it as a steady oscillation does, while the error is a part of the
//! response to a force that differs from bin to bin. Where the peak is too weak to have a shape, or is not quite steady, it must stand in
//! two records at the same frequency. At a narrow resonance of the model, what the model leaves looks like a tone, and nothing is taken for
//! one.
//!
//! Tones are subtracted from the records (Rife and Boorstyn, "Single-tone parameter estimation from discrete-time observations", IEEE
//! Transactions on Information Theory 20, 1974), and the fit is made again.

mod candidates;

use heapless::Vec;

use super::shown::Shown;
use crate::refine::Unexplained;
use crate::spectrum::{Experiment, MAX_TONES, Tone};
pub(super) use candidates::Candidate;

/// Most candidates of all records. Chosen: sixteen records with four each.
const MAX_CANDIDATES: usize = 64;
/// Change of χ² below which the fit is not made again. A change of 1 moves no parameter by more than its standard deviation.
const SAME: f64 = 1.0;
/// Most bins by which the frequency of a tone differs between two records. Chosen: half a bin of the shorter record is half of the half width of
/// the main lobe.
const APART: f64 = 0.5;

/// Subtracts from `experiments` the tones shown that have the shape of one, or recur in another record. Returns whether that changes the
/// experiments.
pub(super) fn subtract<const B: usize>(experiments: &mut [Experiment<B>], shown: &[Shown]) -> bool {
    let mut found: Vec<(usize, f64, Candidate), MAX_CANDIDATES> = Vec::new();
    for (record, (experiment, own)) in experiments.iter().zip(shown).enumerate() {
        for candidate in &own.tones {
            let _ = found.push((record, experiment.length(), *candidate));
        }
    }
    let recurs = |record: usize, own: f64, length: f64| {
        found.iter().any(|(other, its_length, it)| {
            let apart = (it.tone.periods / its_length - own / length).abs();
            *other != record && apart * length.min(*its_length) < APART
        })
    };
    let mut changed = false;
    for (record, experiment) in experiments.iter_mut().enumerate() {
        let own = found.iter().filter(|(of, length, it)| {
            *of == record && (it.is_proved || recurs(record, it.tone.periods, *length))
        });
        let tones: Vec<Tone, MAX_TONES> = own.map(|(.., it)| it.tone).collect();
        if tones.len() != experiment.tones.len() || experiment.change_by_tones(&tones) > SAME {
            experiment.replace_tones(&tones);
            changed = true;
        }
    }
    changed
}

/// Peaks that may be tones in what a model leaves of one record, its tones put back, of all records' `bins`. They are subtracted. In short parts
/// a tone has no shape, and in a measured receptance there is none.
pub(super) fn candidates<const B: usize>(
    experiment: &Experiment<B>,
    left: &mut Unexplained<B>,
    bins: usize,
) -> Vec<Candidate, MAX_TONES> {
    if !experiment.is_whole() || !experiment.is_record() {
        return Vec::new();
    }
    experiment.tones.iter().for_each(|tone| left.add(tone, 1.0));
    candidates::of(left, 3 * bins)
}
