//! A signal at other instants than it was sampled: the windowed sinc.
//!
//! ```text
//! y(x) = Σ_k x_k h(x − k)        h(x) = c sinc(c x) w(x / 32)
//! ```
//!
//! x counts the samples of the input, w is Kaiser's window of β = 8 (Kaiser and Schafer, On the use of the I0-sinh window for spectrum
//! analysis, 1980). Its 64 taps are flat to 1e-4 up to 0.42 of the input's rate, and attenuate by 80 dB from 0.58 on. Where the output is
//! the slower one, c and the number of taps scale with its period, so that the low-pass ends at its own Nyquist frequency: what would fold
//! is gone.
//!
//! One or two samples that were lost are filled by the polynomial through three neighbours on each side. The outputs next to them are left
//! out, for the stream to bridge, which knows its error. Of longer gaps, nothing near is given.

use std::f64::consts::PI;

use crate::record::SAMPLES;

/// Taps on each side.
const REACH: f64 = 32.0;
/// Kaiser's β.
const BETA: f64 = 8.0;
/// Steps of the table for each tap. Between them it is linear: off by (π/512)²/8, 5e-6.
const STEPS: usize = 512;
/// An output is slower from this ratio of the periods on. Crystals differ by much less, and rates that are configured by more.
const SLOWER: f64 = 1.02;
/// Cutoff over the output's Nyquist frequency: the transition of the window ends there.
const CUTOFF: f64 = 0.92;
/// Longest gap that is filled, samples, and neighbours on each side by which it is. A stream bridges no longer ones.
const FILLED: usize = 2;
const NEIGHBOURS: usize = 3;
/// Samples on each side of a block that are judged with it: a spike shows in seven differences.
const BESIDE: usize = 8;

/// The kernel for one ratio of periods.
pub(super) struct Kernel {
    /// Samples of the input on each side.
    reach: f64,
    table: Vec<f64>,
    /// Steps of the table for each sample of the input.
    steps: f64,
}

/// Samples of a sensor's axes that are judged together.
pub(super) type Block = [heapless::Vec<f32, SAMPLES>; 3];

/// A signal of three axes, by the numbers of its samples. What was lost is NaN.
pub(super) struct Signal {
    pub(super) first: i64,
    values: [Vec<f32>; 3],
    /// True for samples that were lost, and filled or not.
    is_lost: Vec<bool>,
}

impl Kernel {
    /// Makes the kernel for outputs of a period that is so many times the input's.
    pub(super) fn of(ratio: f64) -> Self {
        let (cutoff, reach) =
            if ratio > SLOWER { (CUTOFF / ratio, REACH * ratio) } else { (1.0, REACH) };
        let steps = STEPS as f64 * REACH / reach;
        let at = |step: usize| {
            let x = step as f64 / steps;
            let angle = PI * cutoff * x;
            let sinc = if angle == 0.0 { 1.0 } else { angle.sin() / angle };
            let window = bessel(BETA * (1.0 - (x / reach).powi(2)).max(0.0).sqrt()) / bessel(BETA);
            cutoff * sinc * window
        };
        let size = (STEPS as f64 * REACH) as usize;
        Self { reach, table: (0..=size + 1).map(at).collect(), steps }
    }

    fn at(&self, x: f64) -> f64 {
        let step = x.abs() * self.steps;
        let index = step as usize;
        match (self.table.get(index), self.table.get(index + 1)) {
            (Some(one), Some(next)) => one + (step - index as f64) * (next - one),
            _ => 0.0,
        }
    }
}

impl Signal {
    /// Makes the signal of samples in the order of their numbers. `judge` makes those missing that are no measurement, in blocks of about
    /// `block` samples, and returns whether they are too many to be filled.
    pub(super) fn of(
        samples: impl Iterator<Item = (i64, [f32; 3])> + Clone,
        block: usize,
        judge: &mut impl FnMut(&mut Block) -> bool,
    ) -> Self {
        let first = samples.clone().next().map_or(0, |(number, _)| number);
        let length =
            samples.clone().last().map_or(0, |(number, _)| (number - first + 1).max(0) as usize);
        let mut signal = Self {
            first,
            values: std::array::from_fn(|_| vec![f32::NAN; length]),
            is_lost: Vec::new(),
        };
        for (number, value) in samples.filter(|(_, value)| value.iter().all(|own| own.is_finite()))
        {
            let place = (number - first) as usize;
            (0..3).for_each(|axis| signal.values[axis][place] = value[axis]);
        }
        signal.judge(block, judge);
        let is_lost = |place: usize| signal.values.iter().any(|own| !own[place].is_finite());
        signal.is_lost = (0..length).map(is_lost).collect();
        signal.fill();
        signal
    }

    /// Makes samples missing that are no measurement, in blocks of one length. Where they are too many, so is what lies between them.
    fn judge(&mut self, block: usize, judge: &mut impl FnMut(&mut Block) -> bool) {
        let samples = self.values[0].len();
        let most = block.clamp(1, SAMPLES - 2 * BESIDE);
        let length = samples.div_ceil(samples.div_ceil(most).max(1)).max(1);
        let mut block: Box<Block> = Box::default();
        for first in (0..samples).step_by(length) {
            let own = first.saturating_sub(BESIDE)..samples.min(first + length + BESIDE);
            // Where many were found, others are sought once more beside them.
            for _ in 0..2 {
                for (judged, values) in block.iter_mut().zip(&self.values) {
                    judged.clear();
                    judged.extend(values[own.clone()].iter().copied());
                }
                let are_many = judge(&mut block);
                let mut removed = None;
                for (judged, values) in block.iter().zip(&mut self.values) {
                    for (place, (value, judged)) in
                        values[own.clone()].iter_mut().zip(judged).enumerate()
                    {
                        if judged.is_nan() && !value.is_nan() {
                            *value = *judged;
                            let (from, to) = removed.unwrap_or((place, place));
                            removed = Some((place.min(from), place.max(to)));
                        }
                    }
                }
                let Some((from, to)) = removed.filter(|_| are_many) else { break };
                for values in &mut self.values {
                    values[own.clone()][from..=to].fill(f32::NAN);
                }
            }
        }
    }

    /// Fills gaps that are short.
    fn fill(&mut self) {
        let mut next = 0;
        while let Some(offset) = self.is_lost[next..].iter().position(|lost| *lost) {
            let first = next + offset;
            let length = self.is_lost[first..].iter().take_while(|lost| **lost).count();
            next = first + length;
            let before = first.checked_sub(NEIGHBOURS).map(|from| from..first);
            let after = next..next + NEIGHBOURS;
            let nodes: Vec<usize> = before.into_iter().flatten().chain(after).collect();
            let are_known = |own: &usize| self.is_lost.get(*own) == Some(&false);
            if length > FILLED || nodes.len() < 2 * NEIGHBOURS || !nodes.iter().all(are_known) {
                continue;
            }
            for place in first..next {
                for values in self.values.iter_mut().filter(|values| !values[place].is_finite()) {
                    values[place] = lagrange(values, &nodes, place);
                }
            }
        }
    }

    /// Returns the signal at a place that counts samples, or `None` where it is not known.
    pub(super) fn at(&self, number: f64, kernel: &Kernel) -> Option<[f32; 3]> {
        let place = number - self.first as f64;
        if !(place.is_finite() && place >= kernel.reach - 1.0) {
            return None;
        }
        if *self.is_lost.get(place.round() as usize)? {
            return None;
        }
        let from = (place - kernel.reach).ceil().max(0.0) as usize;
        let to = (place + kernel.reach).floor() as usize;
        let taps: Vec<f64> = (from..=to).map(|tap| kernel.at(place - tap as f64)).collect();
        let mut value = [0.0; 3];
        for (axis, values) in self.values.iter().enumerate() {
            let own = values.get(from..=to)?;
            let sum: f64 = own.iter().zip(&taps).map(|(own, tap)| f64::from(*own) * tap).sum();
            value[axis] = sum as f32;
        }
        value.iter().all(|own| own.is_finite()).then_some(value)
    }
}

/// Returns the polynomial through some nodes at a place.
fn lagrange(values: &[f32], nodes: &[usize], place: usize) -> f32 {
    let weight = |own: usize| -> f64 {
        let others = nodes.iter().filter(|other| **other != own);
        others.map(|other| (place as f64 - *other as f64) / (own as f64 - *other as f64)).product()
    };
    nodes.iter().map(|own| weight(*own) * f64::from(values[*own])).sum::<f64>() as f32
}

/// The modified Bessel function of the first kind, of order 0.
fn bessel(x: f64) -> f64 {
    let square = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    // At 8 the terms beyond are less than 1e-16 of the sum.
    for order in 1..40 {
        term *= square / f64::from(order * order);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Amplitude, Hz, phase.
    const WAVES: [[f64; 3]; 4] =
        [[100.0, 2.0, 0.3], [30.0, 63.0, 1.0], [10.0, 133.7, 2.0], [5.0, 200.0, -1.0]];

    fn wave(t: f64) -> f64 {
        WAVES
            .iter()
            .map(|[amplitude, hz, phase]| amplitude * (2.0 * PI * hz * t + phase).sin())
            .sum()
    }

    fn signal(rate_hz: f64, count: i64, lost: &[i64], also: impl Fn(f64) -> f64) -> Signal {
        let numbers: Vec<i64> = (0..count).filter(|number| !lost.contains(number)).collect();
        let value = |number: i64| {
            let t = number as f64 / rate_hz;
            [(wave(t) + also(t)) as f32, 1.0, 0.0]
        };
        Signal::of(numbers.iter().map(|&number| (number, value(number))), 512, &mut |_| false)
    }

    /// Largest amplitude error over the amplitude, and largest phase error, rad, at 200 Hz of outputs at `rate_hz`.
    fn errors(signal: &Signal, own_hz: f64, rate_hz: f64) -> [f64; 2] {
        let kernel = Kernel::of(own_hz / rate_hz);
        let from = 300.37;
        // Whole periods of 200 Hz.
        let count = (2.0 * rate_hz) as usize;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for step in 0..count {
            let number = from + step as f64 * own_hz / rate_hz;
            let t = number / own_hz;
            let [amplitude, hz, phase] = WAVES[3];
            let others = wave(t) - amplitude * (2.0 * PI * hz * t + phase).sin();
            let own = f64::from(signal.at(number, &kernel).unwrap()[0]) - others;
            sine += own * (2.0 * PI * hz * t + phase).sin();
            cosine += own * (2.0 * PI * hz * t + phase).cos();
        }
        let [sine, cosine] = [sine, cosine].map(|sum| 2.0 * sum / count as f64 / WAVES[3][0]);
        [(sine.hypot(cosine) - 1.0).abs(), cosine.atan2(sine).abs()]
    }

    #[test]
    fn the_band_is_kept_at_other_instants_and_rates() {
        for (own_hz, rate_hz) in [
            (2000.0, 2000.04),
            (2000.0, 2000.0),
            (1000.0, 1000.0),
            (500.0, 2000.0),
            (7000.0, 1000.0),
            (2000.0, 500.0),
        ] {
            let signal = signal(own_hz, (own_hz * 3.5) as i64, &[], |_| 0.0);
            let [amplitude, phase] = errors(&signal, own_hz, rate_hz);
            assert!(
                amplitude < 2e-4 && phase < 2e-4,
                "{own_hz} {rate_hz}: {amplitude:e} {phase:e}"
            );
        }
    }

    /// Few values that are left out are filled along their own axis; of many, nothing between them is known.
    #[test]
    fn what_is_left_out_costs_its_own_axis_and_its_own_time() {
        let fast = |number: i64| (0.6 * PI * number as f64).sin() as f32;
        let samples = (0..3000).map(|number| (number, [1.0, fast(number), 0.0]));
        let kernel = Kernel::of(1.0);
        let whole = Signal::of(samples.clone(), 1000, &mut |_| false);
        let mut blocks = 0;
        let few = Signal::of(samples.clone(), 1000, &mut |block| {
            blocks += 1;
            block[0][500] = f32::NAN;
            false
        });
        assert_eq!(blocks, 3);
        assert_eq!(few.at(500.0, &kernel), None);
        assert_eq!(few.at(501.4, &kernel).unwrap()[1], whole.at(501.4, &kernel).unwrap()[1]);
        let many = Signal::of(samples, 1000, &mut |block| {
            let are_many = block[0][500].is_finite();
            [500, 600].into_iter().for_each(|place| block[0][place] = f32::NAN);
            are_many
        });
        let known = |from: i64, to: i64| {
            (from..to).all(|number| many.at(number as f64 + 0.4, &kernel).is_some())
        };
        assert!(known(40, 460) && known(640, 1450) && many.at(550.4, &kernel).is_none());
    }

    /// 890 Hz at 500 Hz would be 110 Hz.
    #[test]
    fn what_would_fold_is_gone() {
        let also = |t: f64| 1000.0 * (2.0 * PI * 890.0 * t).sin();
        let with = signal(2000.0, 4000, &[], also);
        let kernel = Kernel::of(4.0);
        for step in 0..100 {
            let number = 1000.25 + 4.0 * f64::from(step);
            let off = f64::from(with.at(number, &kernel).unwrap()[0]) - wave(number / 2000.0);
            assert!(off.abs() < 0.3, "{off}");
        }
    }

    #[test]
    fn what_was_lost_is_left_out_and_what_is_near_is_right() {
        let signal = signal(2000.0, 4000, &[1000, 2000, 2001, 3000, 3001, 3002], |_| 0.0);
        let kernel = Kernel::of(1.0);
        let at = |number: f64| signal.at(number, &kernel);
        assert!(at(1000.2).is_none() && at(999.7).is_none() && at(2001.4).is_none());
        for number in [998.9, 1000.8, 2002.3, 1500.0] {
            let off = f64::from(at(number).unwrap()[0]) - wave(number / 2000.0);
            assert!(off.abs() < 0.5, "{number}: {off} of 145");
        }
        assert!(at(3020.0).is_none() && at(2980.0).is_none() && at(3040.0).is_some());
        assert!(at(10.0).is_none() && at(3990.0).is_none());
    }
}
