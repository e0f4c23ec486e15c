//! Noise of the acceleration that only the cut has.

use heapless::Vec;

use super::Experiment;

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
    fn at(&self, axis: usize, bin: usize, bins: usize) -> f32 {
        let bands = &self.times[axis];
        bands.get(bin * bands.len() / bins).copied().unwrap_or(1.0)
    }
}

impl<const B: usize> Experiment<B> {
    /// Bins of one of so many bands.
    pub(crate) fn bins_of_band(&self, band: usize, bands: usize) -> core::ops::Range<usize> {
        let first = |band: usize| (band * self.bins()).div_ceil(bands);
        first(band)..first(band + 1)
    }

    /// Raises the noise of the acceleration to that of the cut.
    pub(crate) fn replace_cut_noise(&mut self, cut_noise: CutNoise) {
        let bins = self.bins();
        for axis in 0..3 {
            for bin in 0..bins {
                let [new, old] = [&cut_noise, &self.cut_noise].map(|own| own.at(axis, bin, bins));
                self.acceleration_noise[axis][bin] *= new / old;
                self.broad_noise[axis][bin] *= new / old;
            }
        }
        self.cut_noise = cut_noise;
    }

    /// Bands in which the cut has more noise than the rest: axis, lower and upper frequency, Hz, and mean square over that at rest.
    pub fn louder_bands(&self) -> impl Iterator<Item = (usize, [f64; 2], f64)> {
        self.cut_noise.times.iter().enumerate().flat_map(move |(axis, bands)| {
            let louder = bands.iter().enumerate().filter(|(_, times)| **times > 1.0);
            louder.map(move |(band, times)| {
                let bins = self.bins_of_band(band, bands.len());
                let hz = |bin: usize| self.omega(bin) / core::f64::consts::TAU;
                (axis, [hz(bins.start), hz(bins.end - 1)], f64::from(*times))
            })
        })
    }
}
