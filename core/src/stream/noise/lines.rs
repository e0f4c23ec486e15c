//! Lines in a periodogram: ordinates that stand out of their neighbourhood further than those of broad noise do.

use core::f32::consts::{PI, TAU};

use heapless::Vec;

use super::periodogram::{MAX_ORDINATES, Periodogram};
use crate::noise::{Line, MAX_LINES};

/// Exponent of the chance that an ordinate of noise passes for a line. The chance is below e⁻⁷ by Laurent and Massart's bound
/// (2000, lemma 1), in fact 1e-5. A false line costs a hundredth of the bins.
const RARE: f32 = 7.0;
/// Ordinates on each side from which the level beside a line is read.
const BESIDE: usize = 16;
/// A line ends where its skirt has fallen to this many times the level beside it.
const SKIRT: f32 = 3.0;
/// A line of power P is, beyond the main lobe, `Σk² / (2 TAPERS π²) P n / d⁴` at a distance of d / n, in n samples under sine tapers of the
/// orders k = 1 to 3.
const LEAKAGE: f32 = 14.0 / (6.0 * PI * PI);
/// A line's leakage counts as far as it is louder than this part of the noise.
const FAINT: f32 = 0.1;
/// Three standard deviations of a line's frequency are
///
/// ```text
/// FREQUENCY / √(ratio · samples³)
/// ```
///
/// with the ratio of the line's power to that of white noise as loud as the level beside it: Rife and Boorstyn's bound (1974),
/// `√(12 / 4π²)`, times 1.3 for Hann's window.
const FREQUENCY: f32 = 3.0 * 1.3 * 0.551;
/// Most steps in which a frequency settles. It starts at the edge of the main lobe at worst, and a step is at most a quarter of
/// half the lobe.
const ROUNDS: usize = 8;
/// A step smaller than this part of the largest one is the last.
const SETTLED: f32 = 0.01;
/// Periods between the middles of two halves of a stretch after which a mode with a damping ratio of [`DAMPING`] has decayed.
const PERIODS: f32 = 4.0;
/// Least damping ratio of a mode that decays, that of the lowest mode of the reference scenario.
const DAMPING: f32 = 0.01;
/// An oscillation is steady if it keeps more of its power than `√e^(−4π · DAMPING · periods)`, half-way in decibels between a mode
/// and a steady oscillation. This is the upper limit of that part, its value at [`PERIODS`].
const STEADY: f32 = 0.75;
/// Lower limit of that part. It leaves time to decay to a mode of a third of [`DAMPING`], and room for chance to a weak hum.
const LEAST_STEADY: f32 = 0.5;
/// Samples after which a rotating phasor is computed anew: rounding has moved it by 64 · 2⁻²⁴ = 4e-6 at most.
const RENEWED: usize = 64;

/// A line of a periodogram.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    /// Frequency, cycles per sample.
    pub(super) frequency: f32,
    pub(super) uncertainty: f32,
    /// Power of white noise as loud as the level beside the line.
    beside: f32,
    /// Mean square of the line, beyond that of the noise beside it.
    pub(super) power: f32,
    /// First ordinate, and the one after the last.
    pub(super) ordinates: [usize; 2],
}

impl Peak {
    /// Returns whether another stretch has the line with the same power.
    pub(super) fn recurs(&self, own: &Windowed, other: &Windowed) -> bool {
        let [[before], [after]] = [own, other].map(|signal| signal.powers([self.frequency]));
        (STEADY..1.0 / STEADY).contains(&(after / before))
    }

    /// Sharpens the frequency by the whole stretch: moves it repeatedly to the top of a parabola through the logarithms of three
    /// powers.
    pub(super) fn sharpened(mut self, signal: &Windowed) -> Self {
        let length = signal.samples.len() as f32;
        let step = 0.5 / length;
        for _ in 0..ROUNDS {
            let powers = signal.powers([-step, 0.0, step].map(|aside| self.frequency + aside));
            let [before, here, after] =
                powers.map(|power| libm::logf(power.max(f32::MIN_POSITIVE)));
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

    /// Takes the ordinates into which the line leaks, beside noise of this level.
    pub(super) fn widened(mut self, periodogram: &Periodogram, level: f32) -> Self {
        let Periodogram { power, segment, .. } = periodogram;
        let ratio = LEAKAGE * self.power * *segment as f32 / (FAINT * level.max(f32::MIN_POSITIVE));
        // The segment is padded.
        let spacing = 2.0 * power.len() as f32 / *segment as f32;
        let leaks = (libm::sqrtf(libm::sqrtf(ratio)) * spacing) as usize;
        let middle = usize::midpoint(self.ordinates[0], self.ordinates[1]);
        self.ordinates[0] = self.ordinates[0].min(middle.saturating_sub(leaks));
        self.ordinates[1] = self.ordinates[1].max((middle + leaks).min(power.len()));
        self
    }

    /// The line as a part of the noise; its share is a mean square.
    pub(super) fn line(&self) -> Line {
        let Self { frequency, uncertainty, power, .. } = *self;
        Line { frequency, uncertainty, share: power }
    }
}

/// The strongest lines, and the ordinates that belong to one.
pub(super) fn find(periodogram: &Periodogram) -> (Vec<Peak, MAX_LINES>, [bool; MAX_ORDINATES]) {
    let mut taken = [false; MAX_ORDINATES];
    // The mean is removed, and with it the ordinates near frequency 0.
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

/// The ordinate that stands out most, together with its skirts.
fn strongest(periodogram: &Periodogram, taken: &[bool; MAX_ORDINATES]) -> Option<Peak> {
    let Periodogram { power, averages, half_lobe, .. } = periodogram;
    let rarely = 1.0 + libm::sqrtf(2.0 * RARE / averages) + RARE / averages;
    let mut best: Option<(usize, f32, f32)> = None;
    for (ordinate, &own) in power.iter().enumerate().filter(|(ordinate, _)| !taken[*ordinate]) {
        // Only the highest ordinate of the window's lobe is a maximum.
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
    let Periodogram { power, half_lobe, .. } = periodogram;
    let level = |ordinates: &mut dyn Iterator<Item = usize>| {
        let free = ordinates.filter(|at| !taken[*at]).take(BESIDE).map(|at| power[at]);
        let mut values: Vec<f32, BESIDE> = free.collect();
        values.sort_unstable_by(f32::total_cmp);
        if values.len() < BESIDE / 4 { 0.0 } else { values[values.len() / 2] }
    };
    let below = level(&mut (0..ordinate.saturating_sub(*half_lobe)).rev());
    let above = level(&mut (ordinate + half_lobe + 1..power.len()));
    below.max(above) / periodogram.median()
}

/// Returns whether an oscillation keeps its power through a stretch, which no freely ringing mode of a robot does. `None` if the stretch is
/// too short to decide.
pub(super) fn is_steady(signal: &[f32], peak: &Peak) -> Option<bool> {
    let (first, second) = signal.split_at(signal.len() / 2);
    let periods = peak.frequency * first.len() as f32;
    if periods < PERIODS {
        return None;
    }
    let [[before], [after]] =
        [first, second].map(|half| Windowed::new(half).powers([peak.frequency]));
    // Square root of the part of its power that a mode keeps.
    let kept = libm::expf(-2.0 * PI * DAMPING * periods);
    Some(after >= kept.clamp(LEAST_STEADY, STEADY) * before)
}

/// A stretch about its mean, under Hann's window.
pub(super) struct Windowed<'a> {
    samples: &'a [f32],
    mean: f32,
}

impl<'a> Windowed<'a> {
    pub(super) fn new(samples: &'a [f32]) -> Self {
        Self { samples, mean: samples.iter().sum::<f32>() / samples.len() as f32 }
    }

    /// Powers at some frequencies, in an arbitrary unit.
    fn powers<const F: usize>(&self, frequencies: [f32; F]) -> [f32; F] {
        let length = self.samples.len() as f32;
        let [hann_cos, hann_sin] = phasor(1.0 / length, 1.0);
        let steps = frequencies.map(|frequency| phasor(frequency, 1.0));
        let (cos, sin) = (steps.map(|step| step[0]), steps.map(|step| step[1]));
        let (mut re_sum, mut im_sum) = ([0.0; F], [0.0; F]);
        for (number, part) in self.samples.chunks(RENEWED).enumerate() {
            let first = (number * RENEWED) as f32;
            let mut hann = phasor(1.0 / length, first + 0.5);
            let phasors = frequencies.map(|frequency| phasor(frequency, first));
            let (mut re, mut im) = (phasors.map(|own| own[0]), phasors.map(|own| own[1]));
            let (mut re_part, mut im_part) = ([0.0; F], [0.0; F]);
            for value in part {
                let weighted = (1.0 - hann[0]) * (value - self.mean);
                hann = [
                    hann[0] * hann_cos - hann[1] * hann_sin,
                    hann[0] * hann_sin + hann[1] * hann_cos,
                ];
                for k in 0..F {
                    re_part[k] += weighted * re[k];
                    im_part[k] += weighted * im[k];
                    (re[k], im[k]) =
                        (re[k] * cos[k] - im[k] * sin[k], re[k] * sin[k] + im[k] * cos[k]);
                }
            }
            for k in 0..F {
                re_sum[k] += re_part[k];
                im_sum[k] += im_part[k];
            }
        }
        core::array::from_fn(|k| {
            (re_sum[k] * re_sum[k] + im_sum[k] * im_sum[k]) / (length * length)
        })
    }
}

/// Cosine and sine of an oscillation at a sample.
fn phasor(frequency: f32, sample: f32) -> [f32; 2] {
    // Many turns leave too few digits of an f32 for the angle.
    let turns = f64::from(sample) * f64::from(frequency);
    let angle = TAU * (turns - libm::floor(turns)) as f32;
    [libm::cosf(angle), libm::sinf(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frequencies from the first ordinates to half the rate, in a stretch of many renewals.
    #[test]
    fn powers_are_those_of_the_transform() {
        let signal: std::vec::Vec<f32> =
            (0..5000).map(|n| libm::sinf(0.157 * n as f32) + ((n * 7919) % 13) as f32).collect();
        let length = signal.len() as f64;
        let mean = signal.iter().map(|value| f64::from(*value)).sum::<f64>() / length;
        for frequency in [0.002_f32, 0.157 / TAU, 0.0251, 3.0 / 13.0, 6.0 / 13.0] {
            let (mut re, mut im) = (0.0, 0.0);
            for (n, value) in signal.iter().enumerate() {
                let angle = std::f64::consts::TAU * n as f64;
                let window = 1.0 - libm::cos(std::f64::consts::TAU * (n as f64 + 0.5) / length);
                let weighted = window * (f64::from(*value) - mean) / length;
                re += weighted * libm::cos(angle * f64::from(frequency));
                im += weighted * libm::sin(angle * f64::from(frequency));
            }
            let expected = (re * re + im * im) as f32;
            let [power] = Windowed::new(&signal).powers([frequency]);
            assert!((power - expected).abs() < 4e-6 * expected + 1e-7, "{power}, not {expected}");
        }
    }
}
