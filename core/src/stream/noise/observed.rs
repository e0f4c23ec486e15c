//! One axis in a quiet stretch: what of it is noise, and what is the robot that still rings.

use heapless::Vec;

use super::AxisNoise;
use super::levels::levels;
use super::lines::{self, Peak};
use super::periodogram::{MAX_ORDINATES, Periodogram};
use crate::noise::{Level, MAX_LINES};

/// A robot that does not rest rings where its motion has more than this many times the power of the noise: in noise, of
/// which an ordinate is the mean of three values, one of a hundred million has.
const RINGS: f32 = 10.0;
/// Upper quartile of an ordinate of noise over its mean. A filter that leaves half of the spectrum, or a robot that rings in half
/// of it, does not move the upper quartile by much.
const UPPER_QUARTILE: f32 = 1.3;

/// The spectrum of one axis.
pub(super) struct Observed {
    periodogram: Periodogram,
    /// Each line, and whether it keeps its power throughout.
    lines: Vec<(Peak, bool), MAX_LINES>,
    /// Ordinates that belong to a line, or to the mean.
    taken: [bool; MAX_ORDINATES],
}

impl Observed {
    /// In a stretch; none if it is too short for a spectrum.
    pub(super) fn of(signal: &[f32]) -> Option<Self> {
        let periodogram = Periodogram::of(signal)?;
        let (peaks, taken) = lines::find(&periodogram);
        let sharpened = peaks.iter().map(|peak| peak.sharpened(signal));
        let lines = sharpened.map(|peak| (peak, lines::is_steady(signal, &peak))).collect();
        Some(Self { periodogram, lines, taken })
    }

    /// Sharpens the frequencies of lines by a longer stretch: `own` is the one that it was made of.
    pub(super) fn sharpen(&mut self, own: &[f32], longer: &[f32]) {
        for (peak, _) in &mut self.lines {
            *peak = peak.sharpened_beyond(own, longer);
        }
    }

    /// Power of white noise as loud as the louder half of the spectrum, lines apart.
    pub(super) fn background(&self) -> f32 {
        let mut sorted = self.periodogram.power.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        sorted[sorted.len() / 4 * 3] / UPPER_QUARTILE
    }

    /// Those that are noise: all while the robot `rests`, else those that are steady.
    fn lines(&self, rests: bool) -> Vec<Peak, MAX_LINES> {
        self.lines.iter().filter(|(_, steady)| rests || *steady).map(|(peak, _)| *peak).collect()
    }

    /// Power of the lines that are noise.
    pub(super) fn lines_power(&self, rests: bool) -> f32 {
        self.lines(rests).iter().map(|line| line.power).sum()
    }

    /// The noise, which has the power `white` beside the lines if it is white. None if the robot rings in most of the
    /// spectrum.
    pub(super) fn noise(&self, white: f32, rests: bool) -> Option<AxisNoise> {
        let mut left_out = self.taken;
        if !rests {
            let ordinates = self.periodogram.power.len();
            let rung = self.rings_up_to();
            if rung > ordinates / 2 {
                return None;
            }
            left_out[..rung].fill(true);
        }
        let lines = self.lines(rests);
        let mut levels = levels(&self.periodogram, &left_out, white);
        if levels.is_empty() {
            if lines.is_empty() {
                return Some(AxisNoise::white(white));
            }
            let _ = levels.push(Level { end: 0.5, density: white });
        }
        Some(AxisNoise::new(levels, lines.iter().map(Peak::line).collect()))
    }

    /// The ordinate after the highest in which the robot rings.
    fn rings_up_to(&self) -> usize {
        let limit = RINGS * self.background();
        let is_hum = |ordinate: &usize| {
            let holds = |line: &Peak| (line.ordinates[0]..line.ordinates[1]).contains(ordinate);
            self.lines(false).iter().any(holds)
        };
        let rings =
            |ordinate: &usize| self.periodogram.power[*ordinate] > limit && !is_hum(ordinate);
        (0..self.periodogram.power.len()).rev().find(rings).map_or(0, |last| last + 1)
    }
}
