use core::f64::consts::TAU;

use super::*;
use crate::spectrum::Spectrum;

const BINS: usize = 800;
const FIRST: usize = 9;
const LENGTH: f64 = 4.096;
/// Values for a peak by chance.
const CHANCES: usize = 9 * BINS;

struct Normal(u64);

impl Normal {
    /// Complex noise of unit mean square.
    fn next(&mut self) -> [f64; 2] {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        let radius = libm::sqrt(-libm::log(uniform()));
        let angle = TAU * uniform();
        [radius * libm::cos(angle), radius * libm::sin(angle)]
    }
}

/// Noise of unit mean square, and what `further` adds at a bin.
fn residuals(seed: u64, further: impl Fn(usize) -> [[f64; 2]; 3]) -> Unexplained<BINS> {
    let mut normal = Normal(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    let mut left = Unexplained {
        first_bin: FIRST,
        length: LENGTH,
        residual: Spectrum::EMPTY,
        noise: core::array::from_fn(|_| (0..BINS).map(|_| 1.0).collect()),
        response: (0..BINS).map(|_| 1.0).collect(),
    };
    for bin in FIRST..FIRST + BINS {
        for (axis, further) in further(bin).into_iter().enumerate() {
            let noise = normal.next();
            left.residual.re[axis].push((noise[0] + further[0]) as f32).unwrap();
            left.residual.im[axis].push((noise[1] + further[1]) as f32).unwrap();
        }
    }
    left
}

/// A tone whose peak in the middle of a bin would have these amplitudes, in the noise.
fn tone(periods: f64, peaks: [f64; 3]) -> Tone {
    let amplitude = peaks.map(|peak| [1.6 * peak / LENGTH, 1.2 * peak / LENGTH]);
    Tone { periods, amplitude, unsteadiness: 0.0 }
}

#[test]
fn noise_has_none() {
    for seed in 1..200 {
        assert!(of(&mut residuals(seed, |_| [[0.0; 2]; 3]), CHANCES).is_empty(), "{seed}");
    }
}

/// The frequency is as far off as by Rife and Boorstyn's bound, `√(6 / 4π² ratio)` bins of a tone of that signal-to-noise ratio.
#[test]
fn tones_are_found_with_frequency_and_amplitude() {
    for seed in 1..30 {
        let place = 0.37 * seed as f64;
        let given =
            [tone(190.0 + place, [300.0, -20.0, 5.0]), tone(640.3 - place, [0.0, 40.0, 30.0])];
        let mut left = residuals(seed, |bin| {
            let [a, b] = given.map(|tone| tone.at(bin, LENGTH));
            core::array::from_fn(|axis| core::array::from_fn(|part| a[axis][part] + b[axis][part]))
        });
        let mut found = of(&mut left, CHANCES);
        assert_eq!(found.len(), 2, "{seed}: {found:?}");
        found.sort_unstable_by(|a, b| a.tone.periods.total_cmp(&b.tone.periods));
        for (found, given) in found.iter().zip(&given) {
            // In the middle of a bin a tone does not leak.
            let part = given.periods - libm::floor(given.periods);
            assert!(found.is_proved || (part - 0.5).abs() > 0.3, "{seed}: {found:?}");
            let peak = given.amplitude.as_flattened().iter().map(|part| part * part).sum::<f64>();
            let ratio = peak * LENGTH * LENGTH / 4.0;
            let bound = libm::sqrt(1.5 / ratio) / core::f64::consts::PI;
            let error = (found.tone.periods - given.periods).abs();
            assert!(error < 5.0 * bound, "{seed}: {error}, bound {bound}");
            for (own, other) in
                found.tone.amplitude.as_flattened().iter().zip(given.amplitude.as_flattened())
            {
                assert!((own - other).abs() < 5.0 * 2.0 / LENGTH, "{seed}: {own}, not {other}");
            }
        }
        // Noise is left.
        for axis in 0..3 {
            assert!((0..BINS).all(|index| left.power(axis, index) < 20.0), "{seed}");
        }
    }
}

/// At a resonance four bins wide the model leaves a part of the response to a force that differs from bin to bin.
#[test]
fn an_error_of_the_model_is_no_tone() {
    let mut found = 0;
    for seed in 1..200 {
        let mut force = Normal(seed);
        let force: std::vec::Vec<[f64; 2]> = (0..FIRST + BINS).map(|_| force.next()).collect();
        let mut left = residuals(seed + 500, |bin| {
            // A simple pole at bin 400.3.
            let away = (bin as f64 - 400.3) / 2.0;
            let scale = 100.0 / (1.0 + away * away);
            let [re, im] = force[bin];
            let value = [scale * (re - away * im), scale * (im + away * re)];
            [value, [0.5 * value[0], 0.5 * value[1]], [0.0; 2]]
        });
        found += of(&mut left, CHANCES).iter().filter(|one| one.is_proved).count();
    }
    assert!(found <= 4, "{found} of 199");
}

/// A narrow mode rings as long as the record, as a tone does.
#[test]
fn nothing_at_a_narrow_resonance_is_a_tone() {
    let given = tone(190.3, [300.0, -20.0, 5.0]);
    for (width, tones) in [(1.0, 0), (4.0, 1)] {
        let mut left = residuals(3, |bin| given.at(bin, LENGTH));
        for (index, response) in left.response.iter_mut().enumerate() {
            let away = ((FIRST + index) as f64 - 190.0) / width;
            *response = (1.0 / (1.0 + away * away)) as f32;
        }
        assert_eq!(of(&mut left, CHANCES).len(), tones, "width {width}");
    }
}

/// A weak line of one bin may be anything; one that is not quite steady may be, too.
#[test]
fn what_has_no_shape_must_recur() {
    let weak = tone(190.0, [6.0, 0.0, 0.0]);
    let found = of(&mut residuals(7, |bin| weak.at(bin, LENGTH)), CHANCES);
    assert!(found.len() == 1 && !found[0].is_proved, "{found:?}");
    let [strong, beside] = [tone(190.3, [300.0, 0.0, 0.0]), tone(191.8, [45.0, 0.0, 0.0])];
    let varies = |bin| {
        let [a, b] = [strong, beside].map(|tone| tone.at(bin, LENGTH));
        core::array::from_fn(|axis| [a[axis][0] + b[axis][1], a[axis][1] - b[axis][0]])
    };
    let found = of(&mut residuals(8, varies), CHANCES);
    assert!(found.len() == 1 && !found[0].is_proved, "{found:?}");
}
