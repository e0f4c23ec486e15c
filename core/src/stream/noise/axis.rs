//! Noise of one axis.

use heapless::Vec;

use crate::noise::{Level, Line, MAX_LEVELS, MAX_LINES, NoiseShape};

/// Noise of one axis.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::stream) struct AxisNoise {
    /// Mean square of one sample.
    pub(in crate::stream) power: f32,
    pub(in crate::stream) shape: NoiseShape,
}

impl AxisNoise {
    pub(super) fn white(power: f32) -> Self {
        Self { power, shape: NoiseShape::WHITE }
    }

    /// Makes the noise from levels and lines; their densities and shares are mean squares of a sample.
    pub(super) fn new(mut levels: Vec<Level, MAX_LEVELS>, mut lines: Vec<Line, MAX_LINES>) -> Self {
        let (mut power, mut start) = (0.0, 0.0);
        for level in &levels {
            power += 2.0 * (level.end - start) * level.density;
            start = level.end;
        }
        power += lines.iter().map(|line| line.share).sum::<f32>();
        let parts = levels.iter_mut().map(|level| &mut level.density);
        for part in parts.chain(lines.iter_mut().map(|line| &mut line.share)) {
            *part /= power.max(f32::MIN_POSITIVE);
        }
        Self { power, shape: NoiseShape { levels, lines } }
    }

    /// This noise with white noise of the power `added`, and at no frequency quieter than white noise of the power `least`.
    pub(in crate::stream) fn raised(&self, least: f32, added: f32) -> Self {
        let Self { power, shape } = self;
        if shape.levels.is_empty() {
            return Self::white(power.max(least) + added);
        }
        let NoiseShape { mut levels, mut lines } = shape.clone();
        for level in &mut levels {
            level.density = (power * level.density).max(least) + added;
        }
        for line in &mut lines {
            line.share *= power;
        }
        Self::new(levels, lines)
    }
}
