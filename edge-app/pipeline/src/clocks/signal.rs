//! The signal of a sensor, at any instant.
//!
//! Samples that are no measurement are made missing first. Each axis is filled over one or two samples that are missing, by the polynomial through
//! its nearest three samples on each side. Outputs within half a period of such a sample are left out, for the stream to bridge, which knows its error. Of
//! longer gaps, nothing near is given.

use flexid_core::stream::{MAX_GAP, SPIKE_CONTEXT};

use super::kernel::Kernel;

/// Neighbours on each side by which a gap is filled. A gap is no longer than one that a stream bridges.
const NEIGHBOURS: usize = 3;
/// Samples among which they are sought: twice as many, where another gap is near.
const NEAR: usize = 2 * NEIGHBOURS;

/// A signal of three axes, by the numbers of its samples.
pub(super) struct Signal {
    pub(super) first: i64,
    /// NaN where a gap is too long to be filled.
    values: [Vec<f32>; 3],
    /// True for a sample of which an axis is missing, filled or not.
    is_missing: Vec<bool>,
}

impl Signal {
    /// Makes the signal of samples in the order of their numbers. `judge` makes those missing that are no measurement, in blocks of at most
    /// `longest` samples, and returns whether a block has too many.
    pub(super) fn of(
        samples: impl Iterator<Item = (i64, [f32; 3])> + Clone,
        longest: usize,
        judge: &mut impl FnMut(&mut [&mut [f32]; 3]) -> bool,
    ) -> Self {
        let first = samples.clone().next().map_or(0, |(number, _)| number);
        let length =
            samples.clone().last().map_or(0, |(number, _)| (number - first + 1).max(0) as usize);
        let mut values: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; length]);
        for (number, value) in samples.filter(|(_, value)| value.iter().all(|own| own.is_finite()))
        {
            let place = (number - first) as usize;
            (0..3).for_each(|axis| values[axis][place] = value[axis]);
        }
        remove_invalid(&mut values, longest, judge);
        let is_missing = |place: usize| values.iter().any(|own| !own[place].is_finite());
        let is_missing = (0..length).map(is_missing).collect();
        values.iter_mut().for_each(|own| fill(own));
        Self { first, values, is_missing }
    }

    /// Returns the signal at a place that counts samples, or `None` where it is not known.
    pub(super) fn at(&self, number: f64, kernel: &Kernel) -> Option<[f32; 3]> {
        let place = number - self.first as f64;
        if !(place.is_finite() && place >= kernel.reach - 1.0) {
            return None;
        }
        let taps = |half: f64| (place - half).ceil().max(0.0) as usize..=(place + half) as usize;
        if self.is_missing.get(taps(kernel.half))?.contains(&true) {
            return None;
        }
        let own = self.values.each_ref().map(|values| values.get(taps(kernel.reach)));
        let [Some(x), Some(y), Some(z)] = own else { return None };
        let mut value = [0.0; 3];
        for (tap, ((x, y), z)) in taps(kernel.reach).zip(x.iter().zip(y).zip(z)) {
            let h = kernel.at(place - tap as f64);
            for (sum, own) in value.iter_mut().zip([x, y, z]) {
                *sum += h * f64::from(*own);
            }
        }
        value.iter().all(|own| own.is_finite()).then_some(value.map(|own| own as f32))
    }
}

/// Makes samples missing that are no measurement, in blocks of one length, each judged with [`SPIKE_CONTEXT`] more on each side. As long as a block has too
/// many, everything from its first to its last one becomes missing, and the rest of it is judged again.
fn remove_invalid(
    values: &mut [Vec<f32>; 3],
    longest: usize,
    judge: &mut impl FnMut(&mut [&mut [f32]; 3]) -> bool,
) {
    let samples = values[0].len();
    let length = samples.div_ceil(samples.div_ceil(longest.max(1)).max(1)).max(1);
    for first in (0..samples).step_by(length) {
        let judged =
            first.saturating_sub(SPIKE_CONTEXT)..samples.min(first + length + SPIKE_CONTEXT);
        let block = first - judged.start..samples.min(first + length) - judged.start;
        let mut own = values.each_mut().map(|own| &mut own[judged.clone()]);
        let copies = |own: &[&mut [f32]; 3]| own.each_ref().map(|own| own.to_vec());
        let mut before = copies(&own);
        while judge(&mut own) {
            let is_removed = |place: &usize| {
                (0..3).any(|axis| own[axis][*place].is_nan() && !before[axis][*place].is_nan())
            };
            let ends = block.clone().find(is_removed).zip(block.clone().rev().find(is_removed));
            let Some((from, to)) = ends else { break };
            own.iter_mut().for_each(|own| own[from..=to].fill(f32::NAN));
            before = copies(&own);
        }
    }
}

/// Fills the gaps of an axis that are short, by the nearest neighbours that are known.
fn fill(values: &mut [f32]) {
    let is_known: Vec<bool> = values.iter().map(|own| own.is_finite()).collect();
    let known = |place: &usize| is_known[*place];
    let mut next = 0;
    while let Some(offset) = is_known[next..].iter().position(|known| !known) {
        let first = next + offset;
        let length = is_known[first..].iter().take_while(|known| !**known).count();
        next = first + length;
        let before = (first.saturating_sub(NEAR)..first).rev().filter(known).take(NEIGHBOURS);
        let behind = next..is_known.len().min(next + NEAR);
        let nodes: Vec<usize> = before.chain(behind.filter(known).take(NEIGHBOURS)).collect();
        if length <= MAX_GAP && nodes.len() == 2 * NEIGHBOURS {
            for place in first..next {
                values[place] = lagrange(values, &nodes, place);
            }
        }
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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

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

    /// One value that is removed costs no other axis anything but its instant.
    #[test]
    fn few_values_are_filled_along_their_own_axis() {
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
        let twice = Signal::of(samples.clone(), 3000, &mut |block| {
            [500, 502].into_iter().for_each(|place| block[0][place] = f32::NAN);
            false
        });
        assert!(twice.at(499.3, &kernel).is_some() && twice.at(502.6, &kernel).is_some());
        // Each is beside the other, and no gap of its own axis is longer than two.
        for [one, other] in [[500..501, 502..503], [500..502, 501..503]] {
            let both = Signal::of(samples.clone(), 3000, &mut |block| {
                block[0][one.clone()].fill(f32::NAN);
                block[1][other.clone()].fill(f32::NAN);
                false
            });
            assert!(both.at(499.3, &kernel).is_some() && both.at(503.6, &kernel).is_some());
            assert_eq!(both.at(500.4, &kernel), None);
        }
    }

    /// Nothing between many values is known, and the rest of the block is judged again.
    #[test]
    fn many_values_cost_the_time_between_them() {
        let samples = (0..3000).map(|number| (number, [1.0, 2.0, 0.0]));
        let kernel = Kernel::of(1.0);
        let many = Signal::of(samples, 1000, &mut |block| {
            let next =
                [[500, 600], [700, 800]].into_iter().find(|own| block[0][own[0]].is_finite());
            next.into_iter().flatten().for_each(|place| block[0][place] = f32::NAN);
            next.is_some()
        });
        let known = |from: i64, to: i64| {
            (from..to).all(|number| many.at(number as f64 + 0.4, &kernel).is_some())
        };
        assert!(known(40, 460) && known(640, 660) && known(840, 960));
        assert!(many.at(550.4, &kernel).is_none() && many.at(750.4, &kernel).is_none());
    }

    /// Seven samples for one.
    #[test]
    fn of_a_slower_output_the_nearest_is_left_out() {
        let samples = (0..3000).map(|number| (number, [number as f32, 0.0, 0.0]));
        let kernel = Kernel::of(7.0);
        let signal = Signal::of(samples, 3000, &mut |block| {
            block[0][1500] = f32::NAN;
            false
        });
        let given = |number: f64| signal.at(number, &kernel).is_some();
        assert!(!given(1497.0) && !given(1503.0) && given(1496.0) && given(1504.0));
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
