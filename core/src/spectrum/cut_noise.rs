//! Noise of the acceleration that only the cut has.

use heapless::Vec;

/// Most bands of a record.
pub const MAX_BANDS: usize = 8;

/// Noise of the acceleration in the cut, over that at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CutNoise {
    /// Mean square in the cut over that at rest, at least 1, per axis of the accelerometer and band. The bands share the bins evenly.
    /// Empty where the cut is as quiet as the rest.
    pub times: [Vec<f32, MAX_BANDS>; 3],
}

impl CutNoise {
    /// Returns whether the cut has more noise than the rest.
    pub fn is_louder(&self) -> bool {
        self.times.iter().flatten().any(|times| *times > 1.0)
    }

    /// Mean square in the cut over that at rest, along an axis, in one of so many bins.
    pub(super) fn at(&self, axis: usize, bin: usize, bins: usize) -> f32 {
        let bands = &self.times[axis];
        bands.get(bin * bands.len() / bins).copied().unwrap_or(1.0)
    }
}
