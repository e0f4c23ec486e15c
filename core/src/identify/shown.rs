//! Noise that the residuals of a record show.

use heapless::Vec;

use super::tones::Candidate;
use crate::spectrum::{CutNoise, MAX_TONES};

/// Noise that the residuals of a record show.
#[derive(Debug, Default)]
pub(super) struct Shown {
    pub(super) tones: Vec<Candidate, MAX_TONES>,
    pub(super) cut_noise: CutNoise,
}
