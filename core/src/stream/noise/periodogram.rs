//! Spectrum of a quiet stretch: sine tapers (Riedel and Sidorenko, 1995), averaged over segments (Welch, 1967).

use core::f32::consts::PI;

use heapless::Vec;

use crate::spectrum::fft::{MIN_SAMPLES, real_transform};

/// Longest segment, samples.
pub(super) const LONGEST: usize = 1024;
/// Most ordinates.
pub(super) const MAX_ORDINATES: usize = LONGEST / 2;
/// Shortest stretch that has a usable spectrum, samples.
pub(super) const SHORTEST: usize = 128;
/// Tapers of every segment: `sin(π k n / segment)`, k from 1 on.
const TAPERS: usize = 3;
/// Half the width of their common main lobe, in `1 / segment`: `(TAPERS + 1) / 2`.
const HALF_LOBE: f32 = 2.0;
/// Part of the samples that the tapers use: 1 / ∫w², where w is the mean of their squares.
const USED: f32 = 0.857;

/// Mean squares at equally spaced frequencies from 0 up to half the rate: white noise has its variance in each.
#[derive(Clone, Debug)]
pub(super) struct Periodogram {
    pub(super) power: Vec<f32, MAX_ORDINATES>,
    /// Values that are averaged in each ordinate.
    pub(super) averages: f32,
    /// Independent values that one ordinate stands for, since its neighbours share some with it.
    pub(super) freedom: f32,
    /// Samples of a segment.
    pub(super) segment: usize,
    /// Half the width of a line, ordinates.
    pub(super) half_lobe: usize,
}

impl Periodogram {
    /// Periodogram of a stretch about its mean; `None` if the stretch is too short.
    pub(super) fn of(signal: &[f32]) -> Option<Self> {
        if signal.len() < SHORTEST {
            return None;
        }
        let segment = signal.len().min(LONGEST);
        let padded = segment.next_power_of_two().max(MIN_SAMPLES);
        // The segments are spread over the whole stretch.
        let segments = signal.len().div_ceil(segment);
        let hop = if segments > 1 { (signal.len() - segment) / (segments - 1) } else { 0 };
        let mut power = Vec::new();
        let _ = power.resize(padded / 2, 0.0);
        // The sum of a taper's squares is half of the samples.
        let scale = 2.0 / (segment * segments * TAPERS) as f32;
        for taper in 1..=TAPERS {
            let mut weights = [0.0; LONGEST];
            for (n, weight) in weights[..segment].iter_mut().enumerate() {
                *weight = libm::sinf(PI * (taper as f32 * (n as f32 + 0.5) / segment as f32));
            }
            for number in 0..segments {
                let part = &signal[number * hop..][..segment];
                let mean = part.iter().sum::<f32>() / segment as f32;
                let mut buffer = [0.0; LONGEST];
                for ((value, weight), tapered) in part.iter().zip(&weights).zip(&mut buffer) {
                    *tapered = weight * (value - mean);
                }
                let transform = real_transform(&mut buffer[..padded])?;
                for (power, bin) in power.iter_mut().zip(transform) {
                    *power += scale * bin.norm_sqr();
                }
            }
        }
        let averages = signal.len() as f32 / segment as f32;
        let spacing = segment as f32 / padded as f32;
        Some(Self {
            power,
            averages: TAPERS as f32 * averages,
            freedom: USED * averages * spacing,
            segment,
            half_lobe: libm::ceilf(HALF_LOBE / spacing) as usize,
        })
    }

    /// Median of an ordinate of white noise over its mean, that of χ² (Wilson and Hilferty, 1931).
    pub(super) fn median(&self) -> f32 {
        let root = 1.0 - 1.0 / (9.0 * self.averages);
        root * root * root
    }

    /// Frequency of an ordinate, cycles per sample.
    pub(super) fn frequency(&self, ordinate: usize) -> f32 {
        0.5 * ordinate as f32 / self.power.len() as f32
    }
}
