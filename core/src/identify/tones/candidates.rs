//! Peaks in the residuals of one record that may be tones.

use core::f64::consts::LN_2;
use core::ops::Range;

use heapless::Vec;

use crate::chi_square::rarely_exceeded;
use crate::refine::Unexplained;
use crate::spectrum::{MAX_TONES, Tone};

/// Exponent of the chance that noise has a peak anywhere in the records: the power of a bin over its mean exceeds x with the chance e^(−x),
/// so that the largest of n exceeds `ln n + 10` with a chance below e⁻¹⁰ (Bonferroni).
const RARE: f64 = 10.0;
/// Bins on each side from which the level beside a peak is read. Chosen: the median of sixteen powers scatters by `1/(ln 2 √16)`, 36 %.
const BESIDE: usize = 16;
/// Bins on each side of a peak to which a tone is fitted. Chosen: beyond them a tone has less than a hundredth of its power.
const REACH: usize = 4;
/// Steps of a frequency before it is sharpened, bins. Chosen: an eighth of the half width of the main lobe.
const STEP: f64 = 0.125;
/// Halvings by which a frequency is sharpened. Chosen: from [`STEP`] to 1e-6 bins.
const HALVINGS: usize = 17;
/// Part of a tone's power that the shape of a steady one may leave in its neighbourhood. Chosen: the seam takes that much of the leakage of
/// tones that have not been subtracted yet.
const STEADY: f64 = 0.003;
/// Part of a tone's power that the shape may leave of one that recurs in another record. Chosen: a tone that begins or ends within the record
/// leaves more, for its leakage is another one.
const VARYING: f64 = 0.03;
/// Factor by which the square of the response falls over [`REACH`] bins at a narrow mode: `1 + 4²/w²`, w half the width of the mode. Such a mode
/// rings as long as the record, and its residual looks like a tone. Chosen: w is 2 bins.
const RESONANCE: f32 = 5.0;
/// Rounds in which the tones of a record are fitted again. Chosen: each tone leaks into the others, and a round reduces that by the factor of the
/// leakage.
const ROUNDS: usize = 2;
/// Most peaks that are refused before the search ends. Chosen: twice as many as there may be tones.
const MAX_REFUSED: usize = 2 * MAX_TONES;
/// Least number of bins for each tone. Chosen: its main lobe, of four bins, then is a twentieth of them.
const BINS: usize = 80;

/// A peak that may be a tone.
#[derive(Clone, Copy, Debug)]
pub(in crate::identify) struct Candidate {
    pub(in crate::identify) tone: Tone,
    /// It has the shape of a tone, beyond its highest bin.
    pub(in crate::identify) is_proved: bool,
}

/// Finds and subtracts the candidates of a record. The records have `chances` values for a peak by chance.
pub(super) fn of<const B: usize>(
    left: &mut Unexplained<B>,
    chances: usize,
) -> Vec<Candidate, MAX_TONES> {
    let rare = libm::log(chances as f64) + RARE;
    let most = MAX_TONES.min(left.bins() / BINS);
    let mut tones: Vec<Tone, MAX_TONES> = Vec::new();
    let mut refused: Vec<usize, MAX_REFUSED> = Vec::new();
    while tones.len() < most
        && !refused.is_full()
        && let Some(peak) = left.highest(rare, &tones, &refused)
    {
        let tone = left.fit(peak);
        left.add(&tone, -1.0);
        if left.judge(tone, rare).is_some() {
            let _ = tones.push(tone);
        } else {
            left.add(&tone, 1.0);
            let _ = refused.push(peak);
        }
    }
    for _ in 0..ROUNDS {
        for tone in &mut tones {
            left.add(tone, 1.0);
            *tone = left.fit(left.nearest(tone));
            left.add(tone, -1.0);
        }
    }
    tones.iter().filter_map(|tone| left.judge(*tone, rare)).collect()
}

impl<const B: usize> Unexplained<B> {
    fn bins(&self) -> usize {
        self.noise[0].len()
    }

    /// Adds a tone so many times.
    pub(super) fn add(&mut self, tone: &Tone, times: f64) {
        for index in 0..self.bins() {
            let spectrum = tone.at(self.first_bin + index, self.length);
            for (axis, [re, im]) in spectrum.into_iter().enumerate() {
                self.residual.re[axis][index] += (times * re) as f32;
                self.residual.im[axis][index] += (times * im) as f32;
            }
        }
    }

    fn value(&self, axis: usize, index: usize) -> [f64; 2] {
        let Self { residual, .. } = self;
        [&residual.re, &residual.im].map(|part| f64::from(part[axis][index]))
    }

    fn mean_square(&self, axis: usize, index: usize) -> f64 {
        f64::from(self.noise[axis][index]).max(f64::MIN_POSITIVE)
    }

    /// Power of a bin, in that of the noise.
    fn power(&self, axis: usize, index: usize) -> f64 {
        let [re, im] = self.value(axis, index);
        (re * re + im * im) / self.mean_square(axis, index)
    }

    /// The bin that stands out most of the level beside it, by more than `rare`, where no tone has been found or refused. Several tones
    /// side by side would explain anything.
    fn highest(&self, rare: f64, tones: &[Tone], refused: &[usize]) -> Option<usize> {
        let stands_alone = |index: &usize| {
            let is_far = |tone: &Tone| self.nearest(tone).abs_diff(*index) > 2 * REACH;
            tones.iter().all(is_far) && refused.iter().all(|it| it.abs_diff(*index) > REACH / 2)
        };
        let mut highest = (None, rare);
        for index in (0..self.bins()).filter(stands_alone) {
            for axis in 0..3 {
                let power = self.power(axis, index);
                // The level is at least 1.
                if power > highest.1 && power / self.level(axis, index) > highest.1 {
                    highest = (Some(index), power / self.level(axis, index));
                }
            }
        }
        highest.0
    }

    /// Level beside a bin, in the power of the noise, but at least 1: the larger of those on either side, from the median of an exponential
    /// distribution, which is ln 2 times its mean.
    fn level(&self, axis: usize, index: usize) -> f64 {
        let median = |bins: Range<usize>| {
            let mut powers: Vec<f64, BESIDE> = bins.map(|bin| self.power(axis, bin)).collect();
            powers.sort_unstable_by(f64::total_cmp);
            if powers.len() < BESIDE / 4 { 0.0 } else { powers[powers.len() / 2] }
        };
        let below = index.saturating_sub(REACH);
        let above = (index + REACH + 1).min(self.bins());
        let lower = median(below.saturating_sub(BESIDE)..below);
        let upper = median(above..(above + BESIDE).min(self.bins()));
        (lower.max(upper) / LN_2).max(1.0)
    }

    /// The bin nearest to a tone.
    fn nearest(&self, tone: &Tone) -> usize {
        let index = libm::round(tone.periods) as usize;
        index.saturating_sub(self.first_bin).min(self.bins() - 1)
    }

    /// The bins about one of them to which a tone is fitted.
    fn window(&self, index: usize) -> Range<usize> {
        index.saturating_sub(REACH)..(index + REACH + 1).min(self.bins())
    }

    /// The tone that explains most of the residuals about a bin.
    fn fit(&self, index: usize) -> Tone {
        let middle = (self.first_bin + index) as f64;
        let explained = |periods: f64| self.amplitudes(periods, index).1;
        let (mut best, mut most) = (middle, 0.0);
        let steps = (1.0 / STEP) as i32;
        for step in -steps..=steps {
            let periods = middle + f64::from(step) * STEP;
            let own = explained(periods);
            if own > most {
                (best, most) = (periods, own);
            }
        }
        let mut step = STEP;
        for _ in 0..HALVINGS {
            step *= 0.5;
            for periods in [best - step, best + step] {
                let own = explained(periods);
                if own > most {
                    (best, most) = (periods, own);
                }
            }
        }
        Tone { periods: best, amplitude: self.amplitudes(best, index).0, unsteadiness: 0.0 }
    }

    /// Amplitudes of a tone of so many periods about a bin, by weighted least squares, and by how much they lower the sum of squares.
    fn amplitudes(&self, periods: f64, index: usize) -> ([[f64; 2]; 3], f64) {
        let (mut amplitude, mut explained) = ([[0.0; 2]; 3], 0.0);
        for (axis, amplitude) in amplitude.iter_mut().enumerate() {
            let (mut normal, mut right) = ([0.0; 3], [0.0; 2]);
            for bin in self.window(index) {
                let [one, i] = Tone::basis(periods, self.first_bin + bin, self.length);
                let (own, weight) = (self.value(axis, bin), 1.0 / self.mean_square(axis, bin));
                for part in 0..2 {
                    normal[0] += weight * one[part] * one[part];
                    normal[1] += weight * one[part] * i[part];
                    normal[2] += weight * i[part] * i[part];
                    right[0] += weight * one[part] * own[part];
                    right[1] += weight * i[part] * own[part];
                }
            }
            let determinant = normal[0] * normal[2] - normal[1] * normal[1];
            if determinant > 0.0 {
                let re = (normal[2] * right[0] - normal[1] * right[1]) / determinant;
                let im = (normal[0] * right[1] - normal[1] * right[0]) / determinant;
                *amplitude = [re, im];
                explained += re * right[0] + im * right[1];
            }
        }
        (amplitude, explained)
    }

    /// Returns whether the robot has a narrow resonance about a bin.
    fn resonates(&self, index: usize) -> bool {
        let about = &self.response[self.window(index)];
        let least = about.iter().copied().fold(f32::INFINITY, f32::min);
        about.iter().any(|own| *own > RESONANCE * least)
    }

    /// Judges a tone that has been subtracted; `None` if the residuals about it do not have its shape.
    fn judge(&self, tone: Tone, rare: f64) -> Option<Candidate> {
        let index = self.nearest(&tone);
        if self.resonates(index) {
            return None;
        }
        let (mut explained, mut skirts, mut unexplained, mut residuals) = (0.0, 0.0, 0.0, 0.0);
        for axis in 0..3 {
            let level = self.level(axis, index);
            for bin in self.window(index) {
                let [re, im] = tone.at(self.first_bin + bin, self.length)[axis];
                let power = (re * re + im * im) / self.mean_square(axis, bin) / level;
                explained += power;
                skirts += if bin == index { 0.0 } else { power };
                unexplained += self.power(axis, bin) / level;
                residuals += 2.0;
            }
        }
        let is_noise = 2.0 * unexplained <= rarely_exceeded(residuals);
        let is_steady = is_noise || unexplained <= STEADY * explained;
        if !(is_steady || unexplained <= VARYING * explained) {
            return None;
        }
        let unsteadiness = if is_noise { 0.0 } else { unexplained / explained };
        Some(Candidate {
            tone: Tone { unsteadiness, ..tone },
            is_proved: is_steady && skirts > rare,
        })
    }
}

#[cfg(test)]
mod tests;
