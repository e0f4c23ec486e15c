//! A delay that grows with time: the clocks of two sensors do not run alike.
//!
//! With the time `t = uT` from the start of a record of length T, the derivative of the spectrum A of `a(t − εt)` by ε is, at bin k,
//!
//! ```text
//! −F(t ȧ) = A − 2πik F(u a)          t ȧ = (t a)˙ − a
//! ```
//!
//! but for a constant: the record is periodic, and t a jumps at its seam. A fit takes such a constant for a part of the seam. Bin k of one
//! of P parts has the frequency kP/T, while u goes on from part to part.

use core::f32::consts::TAU;
use core::ops::Range;

use super::Spectrum;

/// Derivative of the spectrum of three signals. `spectrum` and `by_time`, which is `F(u a)`, have the bins of the `band` in each of so many
/// `parts`. The delay is zero so many lengths of a part `before` the start of the record.
pub(super) fn of<const B: usize>(
    spectrum: &Spectrum<B>,
    by_time: &Spectrum<B>,
    band: &Range<usize>,
    parts: usize,
    before: f64,
) -> Spectrum<B> {
    let mut drift = Spectrum::EMPTY;
    for axis in 0..3 {
        let by_time = by_time.re[axis].iter().zip(&by_time.im[axis]);
        let own = spectrum.re[axis].iter().zip(&spectrum.im[axis]);
        let bins = band.clone().cycle();
        for (bin, ((re, im), (timed_re, timed_im))) in bins.zip(own.zip(by_time)) {
            let turn = TAU * (parts * bin) as f32;
            // By the delay at the start: −iω A.
            let first = TAU * bin as f32 * before as f32;
            // As many as the spectrum has.
            let _ = drift.re[axis].push(re + turn * timed_im + first * im);
            let _ = drift.im[axis].push(im - turn * timed_re - first * re);
        }
    }
    drift
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{PI, TAU};

    use heapless::Vec;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::{Spectrum, of};
    use crate::spectrum::fft;

    const SAMPLES: usize = 1024;
    const RATE_HZ: f64 = 500.0;
    /// Bins of all parts together.
    const BINS: usize = 200;
    const FIRST: usize = 4;
    /// Step of a difference. The delay of the end then changes by a fifth of a millisecond at most.
    const STEP: f64 = 3e-5;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(5), ..ProptestConfig::with_cases(16) })]

        /// Holds for oscillations that begin and end in each part of the record, so that nothing jumps at its seam. The delay is zero so many
        /// lengths of a part before the record.
        #[test]
        fn drift_equals_differences_of_late_readings(
            hz in 5.0_f64..30.0,
            rate in -2.0_f64..2.0,
            phase in 0.0_f64..6.0,
            parts in prop_oneof![Just(1_usize), Just(2), Just(4)],
            before in prop_oneof![Just(0.0), 0.0_f64..2.0],
        ) {
            let length = SAMPLES / parts;
            let each = BINS / parts;
            let reading = |drift: f64, axis: usize| -> Vec<f32, SAMPLES> {
                (0..SAMPLES).map(|n| {
                    let delayed = n as f64 + before * length as f64;
                    let t = (n as f64 - drift * delayed) / RATE_HZ;
                    let own = 1.0 + axis as f64;
                    let swelling = libm::sin(PI * t * RATE_HZ / length as f64);
                    let size = swelling * swelling * libm::exp(rate * t);
                    (size * libm::cos(own * TAU * hz * t + phase)) as f32
                }).collect()
            };
            let transformed = |signal: &[f32], axis: usize, spectrum: &mut Spectrum<BINS>| {
                let mut buffer = [0.0; SAMPLES];
                buffer.copy_from_slice(signal);
                for part in buffer.chunks_exact_mut(length) {
                    for bin in &fft::real_transform(part).unwrap()[FIRST..FIRST + each] {
                        spectrum.re[axis].push(bin.re / RATE_HZ as f32).unwrap();
                        spectrum.im[axis].push(bin.im / RATE_HZ as f32).unwrap();
                    }
                }
            };
            let [mut plain, mut timed, mut late, mut early] = [const { Spectrum::EMPTY }; 4];
            for axis in 0..3 {
                let own = reading(0.0, axis);
                let weighted: Vec<f32, SAMPLES> = own
                    .iter()
                    .enumerate()
                    .map(|(n, value)| value * (n as f32 / SAMPLES as f32))
                    .collect();
                transformed(&own, axis, &mut plain);
                transformed(&weighted, axis, &mut timed);
                transformed(&reading(STEP, axis), axis, &mut late);
                transformed(&reading(-STEP, axis), axis, &mut early);
            }
            let found = of(&plain, &timed, &(FIRST..FIRST + each), parts, before);
            for axis in 0..3 {
                let [mut apart, mut all] = [0.0; 2];
                let parts = [[&found.re, &late.re, &early.re], [&found.im, &late.im, &early.im]];
                for [found, late, early] in parts.map(|part| part.map(|own| &own[axis])) {
                    for bin in 0..BINS {
                        let expected = (late[bin] - early[bin]) / (2.0 * STEP as f32);
                        apart += (found[bin] - expected).powi(2);
                        all += expected * expected;
                    }
                }
                prop_assert!(apart < 1e-4 * all, "{axis}: {apart} of {all}");
            }
        }
    }
}
