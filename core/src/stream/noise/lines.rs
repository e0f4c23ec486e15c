//! Lines in a periodogram: ordinates that stand out of their neighbourhood further than those of broad noise do.

use heapless::Vec;

use super::periodogram::{MAX_ORDINATES, Periodogram};
use crate::noise::{Line, MAX_LINES};

/// Exponent of the chance that an ordinate of noise passes for a line: below e⁻⁷ by Laurent and Massart's bound (2000, lemma
/// 1), in fact 1e-5. A line too many costs a hundredth of the bins.
const RARE: f32 = 7.0;
/// Ordinates on each side that tell the level beside a line.
const BESIDE: usize = 16;
/// A line ends where its skirt has fallen to so many times the level beside it.
const SKIRT: f32 = 3.0;
/// Thrice the standard deviation of a line's frequency, which is `FREQUENCY / √(ratio · samples³)` with the ratio of its power to
/// that of white noise as loud as what is beside it: Rife and Boorstyn's bound (1974), `√(12 / 4π²)`, times 1.3 for Hann's
/// window.
const FREQUENCY: f32 = 3.0 * 1.3 * 0.551;
/// Steps in which a frequency settles, from the edge of the main lobe by a quarter of its half at most,
const ROUNDS: usize = 8;
/// and the part of this below which a step is the last.
const SETTLED: f32 = 0.01;
/// Periods between the middles of two halves of a stretch after which a mode has decayed,
const PERIODS: f32 = 4.0;
/// if it is damped by 1 % at least: to e^(−4π · 0.01 · 4) = 0.6 of its power. What has kept more than this is steady.
const STEADY: f32 = 0.75;

/// A line of a periodogram.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    /// Cycles per sample.
    pub(super) frequency: f32,
    pub(super) uncertainty: f32,
    /// Power of white noise as loud as what is beside it.
    beside: f32,
    /// Mean square, beyond that of the noise beside it.
    pub(super) power: f32,
    /// First ordinate, and the one after the last.
    pub(super) ordinates: [usize; 2],
}

impl Peak {
    /// The same, sharpened by another stretch if it has the same power there.
    pub(super) fn sharpened_beyond(self, own: &[f32], other: &[f32]) -> Self {
        let ratio = power_at(other, self.frequency) / power_at(own, self.frequency);
        if (STEADY..1.0 / STEADY).contains(&ratio) { self.sharpened(other) } else { self }
    }

    /// The same with its frequency as exact as the whole stretch tells: where a parabola through the logarithm of three powers
    /// has its top, again and again.
    pub(super) fn sharpened(mut self, signal: &[f32]) -> Self {
        let length = signal.len() as f32;
        let step = 0.5 / length;
        for _ in 0..ROUNDS {
            let [before, here, after] = [-step, 0.0, step].map(|aside| {
                libm::logf(power_at(signal, self.frequency + aside).max(f32::MIN_POSITIVE))
            });
            let curvature = 2.0 * here - before - after;
            if curvature <= 0.0 {
                return self;
            }
            let move_by = (0.5 * step * (after - before) / curvature).clamp(-step, step);
            self.frequency += move_by;
            if move_by.abs() < SETTLED * step {
                break;
            }
        }
        let ratio = self.power / self.beside;
        self.uncertainty = FREQUENCY / libm::sqrtf(ratio * length * length * length);
        self
    }

    /// As a part of the noise, its share a mean square.
    pub(super) fn line(&self) -> Line {
        let Self { frequency, uncertainty, power, .. } = *self;
        Line { frequency, uncertainty, share: power }
    }
}

/// The strongest lines, and the ordinates that belong to one.
pub(super) fn find(periodogram: &Periodogram) -> (Vec<Peak, MAX_LINES>, [bool; MAX_ORDINATES]) {
    let mut taken = [false; MAX_ORDINATES];
    // The mean is taken out, and with it what lies near frequency 0.
    taken[..periodogram.half_lobe].fill(true);
    let mut peaks = Vec::new();
    while !peaks.is_full()
        && let Some(peak) = strongest(periodogram, &taken)
    {
        taken[peak.ordinates[0]..peak.ordinates[1]].fill(true);
        let _ = peaks.push(peak);
    }
    (peaks, taken)
}

/// The ordinate that stands out most, with its skirts.
fn strongest(periodogram: &Periodogram, taken: &[bool; MAX_ORDINATES]) -> Option<Peak> {
    let Periodogram { power, averages, half_lobe, .. } = periodogram;
    let rarely = 1.0 + libm::sqrtf(2.0 * RARE / averages) + RARE / averages;
    let mut best: Option<(usize, f32, f32)> = None;
    for (ordinate, &own) in power.iter().enumerate().filter(|(ordinate, _)| !taken[*ordinate]) {
        // A maximum; of the window's lobe one ordinate is.
        let lobe = &power[ordinate.saturating_sub(*half_lobe)..];
        if lobe.iter().take(2 * half_lobe + 1).any(|other| *other > own) {
            continue;
        }
        let beside = beside(periodogram, taken, ordinate).max(f32::MIN_POSITIVE);
        let ratio = own / beside;
        if ratio > rarely && best.is_none_or(|(_, _, largest)| ratio > largest) {
            best = Some((ordinate, beside, ratio));
        }
    }
    let (ordinate, beside, _) = best?;
    let ends = |step: isize| {
        let reaches = |distance: &usize| {
            let at = ordinate.checked_add_signed(step * *distance as isize);
            let own = at.and_then(|at| power.get(at));
            own.is_some_and(|own| *distance <= *half_lobe || *own > SKIRT * beside)
        };
        (1..=BESIDE).take_while(reaches).count()
    };
    let ordinates = [ordinate - ends(-1), ordinate + ends(1) + 1];
    let excess = power[ordinates[0]..ordinates[1]].iter().map(|own| (own - beside).max(0.0));
    Some(Peak {
        frequency: periodogram.frequency(ordinate),
        uncertainty: periodogram.frequency(*half_lobe),
        beside,
        power: excess.sum::<f32>() / power.len() as f32,
        ordinates,
    })
}

/// Level beside an ordinate: the larger of the medians on either side, so that neither the foot of a steep filter nor a line
/// beside it counts.
fn beside(periodogram: &Periodogram, taken: &[bool; MAX_ORDINATES], ordinate: usize) -> f32 {
    let Periodogram { power, averages, half_lobe, .. } = periodogram;
    let level = |ordinates: &mut dyn Iterator<Item = usize>| {
        let free = ordinates.filter(|at| !taken[*at]).take(BESIDE).map(|at| power[at]);
        let mut values: Vec<f32, BESIDE> = free.collect();
        values.sort_unstable_by(f32::total_cmp);
        if values.len() < BESIDE / 4 { 0.0 } else { values[values.len() / 2] }
    };
    let below = level(&mut (0..ordinate.saturating_sub(*half_lobe)).rev());
    let above = level(&mut (ordinate + half_lobe + 1..power.len()));
    // Median over mean of χ² (Wilson and Hilferty, 1931).
    let median = 1.0 - 1.0 / (9.0 * averages);
    below.max(above) / (median * median * median)
}

/// Whether an oscillation keeps its power through a stretch, as no mode of a robot does that is left to itself.
pub(super) fn is_steady(signal: &[f32], peak: &Peak) -> bool {
    let (first, second) = signal.split_at(signal.len() / 2);
    let periods = peak.frequency * first.len() as f32;
    periods >= PERIODS
        && power_at(second, peak.frequency) >= STEADY * power_at(first, peak.frequency)
}

/// Of Hann's window, at one frequency; in no unit.
fn power_at(signal: &[f32], frequency: f32) -> f32 {
    let length = signal.len() as f32;
    let mean = signal.iter().sum::<f32>() / length;
    let (mut re, mut im) = (0.0, 0.0);
    for (n, value) in signal.iter().enumerate() {
        let turns = n as f32 * frequency;
        let angle = core::f32::consts::TAU * (turns - libm::floorf(turns));
        let window = 1.0 - libm::cosf(core::f32::consts::TAU * (n as f32 + 0.5) / length);
        let weighted = window * (value - mean) / length;
        re += weighted * libm::cosf(angle);
        im += weighted * libm::sinf(angle);
    }
    re * re + im * im
}
