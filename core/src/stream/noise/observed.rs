//! One axis in a quiet stretch: its noise, and the ringing of the robot.

use heapless::Vec;

use super::axis::AxisNoise;
use super::levels::levels;
use super::lines::{self, Peak, Windowed};
use super::periodogram::{LONGEST, MAX_ORDINATES, Periodogram};
use crate::noise::{Level, MAX_LEVELS, MAX_LINES};

/// A robot that does not rest rings at an ordinate that has more than this many times the power of the noise. In noise, of which
/// an ordinate is the mean of three values, fewer than one ordinate in ten billion have as much.
const RINGS: f32 = 10.0;
/// Upper quartile of an ordinate of noise over its mean. A filter that leaves half of the spectrum, or a robot that rings in half
/// of it, does not move the upper quartile by much.
const UPPER_QUARTILE: f32 = 1.3;
/// Mean of an ordinate of noise that is clipped at its mean, over that mean: `1 − 3³e⁻³ / 3!` for the mean of three values.
const CLIPPED: f32 = 0.78;
/// Number of bands in which the plateau of a filter is sought. A filter with its corner at a tenth of the rate leaves six of them.
const BANDS: usize = 32;
/// Ordinates of the narrowest band, of which some five are independent.
const NARROWEST: usize = 8;
/// A plateau counts if it is louder than the level of the upper quartile by more than this factor. In noise of one level, one
/// narrowest band in a thousand is as loud. For a quieter plateau, [`RINGS`] times the upper quartile serves as well.
const LOUDER: f32 = 3.0;
/// A band has peaks, and is no noise, if its mean is more than this many times the mean that its median gives. In noise the ratio
/// is 1.0 ± 0.2, or ± 0.35 in the narrowest band.
const PEAKED: f32 = 2.0;
/// Periods between the middles of two halves of a stretch after which a mode, damped by 1 %, has kept `e^(−4π · 0.01 · 12)` = 0.22
/// of its power.
const DECAYED: f32 = 12.0;
/// A band that keeps less than this part of its power after [`DECAYED`] periods is no noise. This is half-way in decibels; for
/// noise the part is 1 within a factor of 1.5.
const KEPT: f32 = 0.5;
/// Beyond the corner of a filter, the two bands of noise of the lowest frequencies differ by more than this factor. A filter of
/// eighth order falls by this in a tenth of its corner, and chance makes 4 of 1 once in a hundred narrowest bands.
const FALLS: f32 = 4.0;

/// Course of a line through a stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    /// The line keeps its power.
    Steady,
    /// The line does not keep its power.
    Decays,
    /// The stretch is too short to decide.
    Unknown,
    /// The stretch is too short to decide, but another stretch has the line with the same power.
    Recurs,
}

/// The spectrum of one axis.
pub(super) struct Observed {
    periodogram: Periodogram,
    lines: Vec<(Peak, Course), MAX_LINES>,
    /// Ordinates that belong to a line, or to the mean.
    taken: [bool; MAX_ORDINATES],
    /// Density below the corner of a filter that leaves less than a quarter of the spectrum.
    plateau: Option<f32>,
    /// Density of the noise where no filter reduces it.
    background: f32,
}

impl Observed {
    /// Observes an axis in a stretch; `None` if the stretch is too short for a spectrum.
    pub(super) fn of(signal: &[f32]) -> Option<Self> {
        let periodogram = Periodogram::of(signal)?;
        let (peaks, mut taken) = lines::find(&periodogram);
        let [segment, whole] = [&signal[..signal.len().min(LONGEST)], signal].map(Windowed::new);
        let sharpened = peaks.iter().map(|peak| {
            // Half of the main lobe of the whole stretch may be narrower than the distance of the ordinates.
            let is_long = signal.len() > 2 * LONGEST;
            let peak = if is_long { peak.sharpened(&segment) } else { *peak };
            peak.sharpened(&whole)
        });
        let course = |peak: &Peak| match lines::is_steady(signal, peak) {
            Some(true) => Course::Steady,
            Some(false) => Course::Decays,
            None => Course::Unknown,
        };
        let mut lines: Vec<_, MAX_LINES> = sharpened.map(|peak| (peak, course(&peak))).collect();
        let quartile = upper_quartile(&periodogram);
        let plateau = plateau(signal, &periodogram, &taken, quartile);
        let background = plateau.unwrap_or(0.0).max(quartile);
        for (peak, _) in lines.iter_mut().filter(|(_, course)| *course == Course::Steady) {
            *peak = peak.widened(&periodogram, background);
            taken[peak.ordinates[0]..peak.ordinates[1]].fill(true);
        }
        Some(Self { periodogram, lines, taken, plateau, background })
    }

    /// Sharpens the frequencies of lines that a longer stretch has too. `own` is the stretch that was observed.
    pub(super) fn sharpen(&mut self, own: &[f32], longer: &[f32]) {
        if self.lines.is_empty() {
            return;
        }
        let [own, longer] = [own, longer].map(Windowed::new);
        for (peak, course) in &mut self.lines {
            if !peak.recurs(&own, &longer) {
                continue;
            }
            *peak = peak.sharpened(&longer);
            if *course == Course::Unknown {
                *course = Course::Recurs;
            }
        }
    }

    /// Mean square of a sample of the noise, without lines and ringing.
    pub(super) fn broad_power(&self) -> f32 {
        let power = &self.periodogram.power;
        let clipped = power.iter().map(|power| power.min(self.background)).sum::<f32>();
        clipped / (CLIPPED * power.len() as f32)
    }

    /// Lines that are noise: the steady ones, and those that recur if the robot is `silent`.
    fn lines(&self, silent: bool) -> Vec<Peak, MAX_LINES> {
        let is_noise = |(_, course): &&(Peak, Course)| {
            *course == Course::Steady || silent && *course == Course::Recurs
        };
        self.lines.iter().filter(is_noise).map(|(peak, _)| *peak).collect()
    }

    /// Power of the lines that are noise, each times the `gain` at its frequency.
    pub(super) fn lines_power(&self, silent: bool, gain: fn(f32) -> f32) -> f32 {
        self.lines(silent).iter().map(|line| gain(line.frequency) * line.power).sum()
    }

    /// The noise; `white` is its power beside the lines if it is white. `None` if the robot rings in the upper half of the
    /// spectrum.
    pub(super) fn noise(&self, white: f32, silent: bool) -> Option<AxisNoise> {
        let mut left_out = self.taken;
        let mut rung = 0;
        if !silent {
            rung = self.rings_up_to();
            if rung > self.periodogram.power.len() / 2 {
                return None;
            }
            left_out[..rung].fill(true);
        }
        let lines = self.lines(silent);
        let mut levels = levels(&self.periodogram, &left_out, white);
        if let Some(plateau) = self.plateau {
            raise(&mut levels, self.periodogram.frequency(rung), plateau);
        }
        if levels.is_empty() {
            if lines.is_empty() {
                return Some(AxisNoise::white(white));
            }
            let _ = levels.push(Level { end: 0.5, density: white });
        }
        Some(AxisNoise::new(levels, lines.iter().map(Peak::line).collect()))
    }

    /// The ordinate after the highest one in which the robot rings.
    fn rings_up_to(&self) -> usize {
        let limit = RINGS * self.background;
        let hum = self.lines(false);
        let is_hum = |ordinate: &usize| {
            hum.iter().any(|line| (line.ordinates[0]..line.ordinates[1]).contains(ordinate))
        };
        let rings =
            |ordinate: &usize| self.periodogram.power[*ordinate] > limit && !is_hum(ordinate);
        (0..self.periodogram.power.len()).rev().find(rings).map_or(0, |last| last + 1)
    }
}

/// Raises the levels below a frequency to a density, since a level that is extended from above may lie beyond the corner of a
/// filter.
fn raise(levels: &mut Vec<Level, MAX_LEVELS>, below: f32, density: f32) {
    let Some(first) = levels.first().copied().filter(|first| first.density < density) else {
        return;
    };
    if below > 0.0 && (first.end <= below || levels.is_full()) {
        levels[0].density = density;
    } else if below > 0.0 {
        let _ = levels.insert(0, Level { end: below, density });
    }
}

/// Power of white noise as loud as the louder half of the spectrum, without the lines.
fn upper_quartile(periodogram: &Periodogram) -> f32 {
    let mut sorted = periodogram.power.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    sorted[sorted.len() / 4 * 3] / UPPER_QUARTILE
}

/// Density of the noise in the lowest band that is flat and keeps its power, as ringing does not. `None` if it is hardly louder
/// than the level of the upper quartile of the spectrum.
fn plateau(
    signal: &[f32],
    periodogram: &Periodogram,
    taken: &[bool; MAX_ORDINATES],
    quartile: f32,
) -> Option<f32> {
    let ordinates = periodogram.power.len();
    let width = (ordinates / BANDS).max(NARROWEST);
    let (first, second) = signal.split_at(signal.len() / 2);
    let free = |of: &Periodogram, band: usize| -> Vec<f32, MAX_ORDINATES> {
        // The periodogram of a half has fewer ordinates, or as many.
        let ratio = ordinates / of.power.len();
        let own = band * width / ratio..(band + 1) * width / ratio;
        own.filter(|ordinate| !taken[ordinate * ratio]).map(|ordinate| of.power[ordinate]).collect()
    };
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len().max(1) as f32;
    let decays = |band: &usize| {
        let periods = periodogram.frequency(band * width + width / 2) * first.len() as f32;
        periods >= DECAYED
    };
    let bands = (1..ordinates / width).filter(decays);
    if !bands.clone().any(|band| mean(&free(periodogram, band)) > LOUDER * quartile) {
        return None;
    }
    let [first, second] = [Periodogram::of(first)?, Periodogram::of(second)?];
    let is_noise = |band: &usize| {
        let mut values = free(periodogram, *band);
        values.sort_unstable_by(f32::total_cmp);
        let kept = mean(&free(&second, *band)) / mean(&free(&first, *band));
        values.len() >= width / 2
            && mean(&values) <= PEAKED * values[values.len() / 2] / periodogram.median()
            && kept >= KEPT
    };
    let mut noise = bands.filter(is_noise);
    let lowest = noise.next()?;
    let own = mean(&free(periodogram, lowest));
    let above = noise.next().map_or(own, |band| mean(&free(periodogram, band)));
    if own <= FALLS * above {
        let level = own.max(above);
        return (level > LOUDER * quartile).then_some(level);
    }
    // The robot rings up to the corner. Below the corner the noise is no louder than the quietest band there.
    let below = (1..lowest).map(|band| mean(&free(periodogram, band)));
    Some(below.filter(|level| *level > 0.0).reduce(f32::min).unwrap_or(own).max(own))
}
