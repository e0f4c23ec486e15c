//! The shape of the spectrum of a sensor's noise, beside its power.

use core::f32::consts::PI;

use heapless::Vec;

/// Most levels of a shape.
pub const MAX_LEVELS: usize = 16;
/// Most lines of a shape.
pub const MAX_LINES: usize = 8;

/// Power spectral density of noise, over that of white noise of the same power. It has steps of constant density, and lines (mains
/// hum) that are narrower than the reading could resolve. Frequencies are in cycles per sample, 0 to 0.5.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NoiseShape {
    /// Levels from frequency 0 on, each up to its end; without levels the noise is white.
    pub levels: Vec<Level, MAX_LEVELS>,
    /// Lines, in no order.
    pub lines: Vec<Line, MAX_LINES>,
}

/// A part of the spectrum where the density is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Level {
    /// End of this level and start of the next one, cycles per sample.
    pub end: f32,
    /// Density over that of white noise of the same power.
    pub density: f32,
}

/// A steady oscillation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Line {
    /// Frequency, cycles per sample.
    pub frequency: f32,
    /// Most by which the frequency may be off, cycles per sample.
    pub uncertainty: f32,
    /// Part of the noise's power that this line has.
    pub share: f32,
}

impl NoiseShape {
    /// White noise: constant density.
    pub const WHITE: Self = Self { levels: Vec::new(), lines: Vec::new() };

    /// Mean square of the discrete Fourier transform of `samples` samples at a frequency in cycles per sample, over that of white
    /// noise of the same power.
    pub fn density(&self, frequency: f32, samples: usize) -> f32 {
        self.broad_density(frequency)
            + self.lines.iter().map(|line| line.density(frequency, samples)).sum::<f32>()
    }

    /// The density without the lines.
    pub fn broad_density(&self, frequency: f32) -> f32 {
        let level = self.levels.iter().find(|level| frequency < level.end);
        level.or(self.levels.last()).map_or(1.0, |level| level.density)
    }
}

impl Line {
    /// Density of a line. At a distance of d bins a line of power P has `P N²/2 sinc²(d)`, where white noise of that power has
    /// `P N`.
    ///
    /// If the frequency may be off by u bins, the peak is spread over `1 + 2u` bins. The sine of `sinc² = sin²(πd) / (πd)²` is then
    /// the mean over where the line may be, and d is the least distance.
    fn density(&self, frequency: f32, samples: usize) -> f32 {
        let samples = samples as f32;
        let uncertainty = self.uncertainty * samples;
        let turns = 2.0 * PI * uncertainty;
        let known = if turns > 0.0 { libm::sinf(turns) / turns } else { 1.0 };
        let sine = 0.5 - 0.5 * known * libm::cosf(2.0 * PI * self.frequency * samples);
        let distance = (frequency - self.frequency).abs() * samples - uncertainty;
        let beyond = PI * distance.max(0.0);
        let most = 1.0 / (1.0 + 2.0 * uncertainty);
        let part = if most * beyond * beyond > sine { sine / (beyond * beyond) } else { most };
        0.5 * samples * self.share * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::fft::real_transform;

    const SAMPLES: usize = 2048;

    /// A sine between two bins.
    #[test]
    fn a_line_leaks_as_a_sine_does() {
        let frequency = 100.2 / SAMPLES as f32;
        let mut samples: std::vec::Vec<f32> =
            (0..SAMPLES).map(|n| libm::sinf(2.0 * PI * frequency * n as f32)).collect();
        let transform = real_transform(&mut samples).expect("a power of two");
        let mut shape = NoiseShape::WHITE;
        let line = Line { frequency, uncertainty: 0.0, share: 1.0 };
        shape.levels.push(Level { end: 0.5, density: 0.0 }).expect("room");
        shape.lines.push(line).expect("room");
        for bin in 90..112 {
            // The sine has the power 0.5.
            let measured = transform[bin].norm_sqr() / (0.5 * SAMPLES as f32);
            let density = shape.density(bin as f32 / SAMPLES as f32, SAMPLES);
            let part = measured / density;
            assert!((0.85..1.15).contains(&part), "bin {bin}: {measured} of {density}");
        }
    }

    #[test]
    fn levels_end_where_they_say() {
        let mut shape = NoiseShape::WHITE;
        assert_eq!(shape.density(0.3, SAMPLES), 1.0);
        shape.levels.push(Level { end: 0.2, density: 2.0 }).expect("room");
        shape.levels.push(Level { end: 0.5, density: 1.0 / 3.0 }).expect("room");
        assert_eq!(
            [0.0, 0.19, 0.2, 0.5].map(|f| shape.density(f, SAMPLES)),
            [2.0, 2.0, 1.0 / 3.0, 1.0 / 3.0]
        );
    }
}
