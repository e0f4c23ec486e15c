use super::*;
use crate::noise::NoiseShape;
use std::vec::Vec;

/// Smallest step of the force, N.
const STEP: f32 = 0.01;

struct Noises(u32);

impl Noises {
    /// Noise of unit variance.
    fn next(&mut self) -> f32 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += (self.0 >> 8) as f32 / (1 << 24) as f32;
        }
        sum - 6.0
    }
}

/// 8192 samples: quiet, from 400 to 6500 a cut, then quiet; the robot rings at 4 and 30 Hz from `from` on.
fn record(ringing_from: usize, cut: core::ops::Range<usize>) -> ([Vec<f32>; 3], [Vec<f32>; 3]) {
    let mut noise = Noises(5);
    let force = core::array::from_fn(|_| {
        (0..8192)
            .map(|n| {
                let cutting =
                    if cut.contains(&n) { 200.0 * libm::sinf(0.3 * n as f32) } else { 0.0 };
                cutting + 0.16 * noise.next()
            })
            .collect()
    });
    let acceleration = core::array::from_fn(|_| {
        (0..8192)
            .map(|n| {
                let t = n as f32 / 2000.0;
                let ring = libm::sinf(25.0 * t) + 0.5 * libm::sinf(190.0 * t);
                (if n >= ringing_from { ring } else { 0.0 }) + 0.0155 * noise.next()
            })
            .collect()
    });
    (force, acceleration)
}

fn of((force, acceleration): &([Vec<f32>; 3], [Vec<f32>; 3])) -> Noise {
    estimate(
        force.each_ref().map(|signal| signal.as_slice()),
        acceleration.each_ref().map(|signal| signal.as_slice()),
        STEP,
    )
}

fn deviation(noise: &AxisNoise) -> f32 {
    libm::sqrtf(noise.power)
}

#[test]
fn finds_the_noise_beside_the_cut_and_under_the_ringing() {
    let noise = of(&record(400, 400..6500));
    for axis in 0..3 {
        assert!((deviation(&noise.force[axis]) / 0.16 - 1.0).abs() < 0.06, "{:?}", noise.force);
        assert!(
            (deviation(&noise.acceleration[axis]) / 0.0155 - 1.0).abs() < 0.06,
            "{:?}",
            noise.acceleration
        );
    }
    assert!(noise.starts_at_rest);
}

#[test]
fn a_twentieth_of_quiet_is_enough() {
    let noise = of(&record(400, 400..8192));
    for axis in 0..3 {
        assert!((deviation(&noise.force[axis]) / 0.16 - 1.0).abs() < 0.12, "{:?}", noise.force);
    }
}

#[test]
fn a_ringing_start_is_no_rest() {
    let noise = of(&record(0, 400..6500));
    assert!(!noise.starts_at_rest);
    assert!((deviation(&noise.acceleration[1]) / 0.0155 - 1.0).abs() < 0.06);
}

/// A drive starts in the quiet part: the acceleration rises by 4 m/s² for 8 ms.
#[test]
fn a_start_of_the_drives_is_no_noise() {
    let (force, mut acceleration) = record(2000, 2000..8192);
    acceleration[1][1500..1516].iter_mut().for_each(|value| *value += 4.0);
    let noise = of(&(force, acceleration));
    assert!((deviation(&noise.acceleration[1]) / 0.0155 - 1.0).abs() < 0.06);
}

#[test]
fn a_record_cut_out_of_the_milling_has_no_quiet_stretch() {
    let noise = of(&record(0, 0..8192));
    assert!(!noise.quiet && !noise.starts_at_rest);
    assert!(noise.force.iter().all(|force| deviation(force) < 1.0), "{:?}", noise.force);
}

/// The sensor has a filter, so that neighbouring samples are correlated.
#[test]
fn coloured_noise_is_found_by_contrast() {
    let (mut force, acceleration) = record(400, 400..6500);
    for signal in &mut force {
        let mut state = 0.0;
        for value in signal {
            state += 0.2 * (*value - state);
            *value = state;
        }
    }
    let noise = of(&(force, acceleration));
    // 0.16 N through a first-order filter: sqrt(0.2 / 1.8).
    assert!(noise.quiet);
    assert!(
        noise.force.iter().all(|f| (deviation(f) / 0.0533 - 1.0).abs() < 0.15),
        "{:?}",
        noise.force
    );
}

#[test]
fn a_stuck_block_does_not_hide_the_noise() {
    let (mut force, acceleration) = record(400, 400..6500);
    for signal in &mut force {
        signal[..192].fill(0.0);
    }
    let noise = of(&(force, acceleration));
    assert!(
        noise.force.iter().all(|f| (deviation(f) / 0.16 - 1.0).abs() < 0.1),
        "{:?}",
        noise.force
    );
}

/// Mean density of an axis' noise over `bins` of 8192 samples, over that of white noise of the deviation `of`.
fn density(noise: &AxisNoise, of: f32, bins: core::ops::Range<usize>) -> f32 {
    let count = bins.len() as f32;
    let density = bins.map(|bin| noise.shape.density(bin as f32 / 8192.0, 8192)).sum::<f32>();
    noise.power / (of * of) * density / count
}

/// Mean density in the fitted band, 2 to 200 Hz at 2 kHz.
fn in_band(noise: &AxisNoise, of: f32) -> f32 {
    density(noise, of, 8..820)
}

/// Mean density in the fitted band, over what [`anti_alias`] leaves there.
fn in_filtered_band(noise: &AxisNoise, of: f32, corner: f32) -> f32 {
    let tan = |frequency: f32| libm::tanf(core::f32::consts::PI * frequency);
    let passes = |bin: usize| {
        libm::powf(1.0 + libm::powf(tan(bin as f32 / 8192.0) / tan(corner), 4.0), -4.0)
    };
    in_band(noise, of) * 812.0 / (8..820).map(passes).sum::<f32>()
}

/// Butterworth's low-pass filter of second order, with its corner in cycles per sample.
fn low_pass(signal: &mut [f32], corner: f32) {
    let k = libm::tanf(core::f32::consts::PI * corner);
    let a0 = 1.0 + core::f32::consts::SQRT_2 * k + k * k;
    let (b0, a1, a2) =
        (k * k / a0, 2.0 * (k * k - 1.0) / a0, (1.0 - core::f32::consts::SQRT_2 * k + k * k) / a0);
    let (mut x, mut y) = ([0.0; 2], [0.0; 2]);
    for value in signal {
        let filtered = b0 * (*value + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
        (x, y) = ([*value, x[0]], [filtered, y[0]]);
        *value = filtered;
    }
}

/// Applies the low-pass filter four times, as steep as an anti-aliasing filter.
fn anti_alias(signals: &mut [Vec<f32>; 3], corner: f32) {
    for signal in signals {
        (0..4).for_each(|_| low_pass(signal, corner));
    }
}

#[test]
fn white_noise_is_white() {
    let noise = of(&record(400, 400..6500));
    assert!(noise.at_rest);
    for axis in noise.force.iter().chain(&noise.acceleration) {
        assert_eq!(axis.shape, NoiseShape::WHITE);
    }
}

/// Adds motion at 4 and 30 Hz from a sample on.
fn move_from(acceleration: &mut [Vec<f32>; 3], from: usize, size: f32) {
    for signal in acceleration {
        for (n, value) in signal.iter_mut().enumerate().skip(from) {
            let t = n as f32 / 2000.0;
            *value += size * (libm::sinf(25.0 * t) + 0.5 * libm::sinf(190.0 * t));
        }
    }
}

/// In the band the noise is that of the sensor before its filter. It has 2 or 8 % of the amplitude of the motion.
#[test]
fn behind_a_filter_the_noise_is_read_in_the_band() {
    for corner in [0.1, 0.125, 0.2, 0.3, 0.4] {
        for motion in [1.0, 0.25] {
            let (mut force, mut acceleration) = record(8192, 1600..6500);
            move_from(&mut acceleration, 1600, motion);
            anti_alias(&mut force, corner);
            anti_alias(&mut acceleration, corner);
            let noise = of(&(force, acceleration));
            assert!(noise.at_rest && noise.starts_at_rest, "{corner}, {motion}");
            let ratios = [0, 1, 2].map(|axis| {
                [(&noise.force[axis], 0.16), (&noise.acceleration[axis], 0.0155)]
                    .map(|(noise, of)| in_filtered_band(noise, of, corner))
            });
            // 1,600 samples have 160 independent values in the band.
            for ratio in ratios.as_flattened() {
                assert!((0.75..1.3).contains(ratio), "{corner}, {motion}: {ratios:?}");
            }
        }
    }
}

/// Adds modes of 4 and 30 Hz, damped by 1 %.
fn ring(acceleration: &mut [Vec<f32>; 3], sizes: [f32; 2]) {
    for signal in acceleration {
        for (n, value) in signal.iter_mut().enumerate() {
            let t = n as f32 / 2000.0;
            let mode = |omega: f32| libm::expf(-0.01 * omega * t) * libm::sinf(omega * t);
            *value += sizes[0] * mode(25.0) + sizes[1] * mode(190.0);
        }
    }
}

/// The noise is also read while the robot rings, except where it rings.
#[test]
fn behind_a_filter_the_noise_is_read_beside_the_ringing() {
    for (corner, limits) in [(0.1, 0.7..2.0), (0.125, 0.7..2.0), (0.3, 0.7..1.4)] {
        let (mut force, mut acceleration) = record(1600, 1600..6500);
        ring(&mut acceleration, [0.5, 0.5]);
        anti_alias(&mut force, corner);
        anti_alias(&mut acceleration, corner);
        let noise = of(&(force, acceleration));
        assert!(!noise.at_rest);
        for axis in &noise.acceleration {
            let ratio = in_filtered_band(axis, 0.0155, corner);
            assert!(limits.contains(&ratio), "{corner}: {ratio}");
        }
    }
}

/// The rest of an earlier motion, 1 % of the motion in the record, is no hum, whether the robot seems to rest or the noise hides
/// it.
#[test]
fn what_decays_at_rest_is_no_noise() {
    for motion in [1.0, 8.0] {
        let (force, mut acceleration) = record(8192, 1600..6500);
        move_from(&mut acceleration, 1600, motion);
        ring(&mut acceleration, [0.011 * motion, 0.011 * motion]);
        let noise = of(&(force, acceleration));
        assert!(noise.starts_at_rest, "{motion}");
        assert_eq!(noise.at_rest, motion == 1.0);
        for axis in &noise.acceleration {
            for bins in [13..21, 118..130] {
                let ratio = density(axis, 0.0155, bins);
                assert!((0.7..1.4).contains(&ratio), "{motion}: {ratio}");
            }
        }
    }
}

/// Sixth differences pass a line at two fifths of the rate with 2.4 times its power.
#[test]
fn a_line_at_a_high_frequency_is_counted_once() {
    let (force, mut acceleration) = record(400, 400..6500);
    let size = libm::sqrtf(2.0 * 0.2) * 0.0155;
    for signal in &mut acceleration {
        for (n, value) in signal.iter_mut().enumerate() {
            *value += size * libm::sinf(core::f32::consts::TAU * 0.4 * n as f32);
        }
    }
    let noise = of(&(force, acceleration));
    for axis in &noise.acceleration {
        assert_eq!(axis.shape.lines.len(), 1, "{:?}", axis.shape);
        let ratio = in_band(axis, 0.0155);
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
    }
}

/// Mains hum becomes a line of the right frequency and power, and the rest of the noise stays the same.
#[test]
fn hum_is_a_line() {
    for (samples, uncertainty) in [(400, 2.5e-4), (1600, 3e-5)] {
        let (force, mut acceleration) = record(samples, samples..6500);
        for signal in &mut acceleration {
            for (n, value) in signal.iter_mut().enumerate() {
                *value +=
                    0.05 * libm::sinf(core::f32::consts::TAU * 50.1 / 2000.0 * n as f32 + 1.0);
            }
        }
        let noise = of(&(force, acceleration));
        assert!(noise.starts_at_rest && noise.at_rest, "{samples}");
        for axis in &noise.acceleration {
            assert_eq!(axis.shape.lines.len(), 1, "{samples}: {:?}", axis.shape);
            let line = axis.shape.lines[0];
            assert!((line.frequency - 0.02505).abs() < line.uncertainty, "{samples}: {line:?}");
            assert!(line.uncertainty < uncertainty, "{samples}: {line:?}");
            let power = line.share * axis.power;
            assert!((power / 0.00125 - 1.0).abs() < 0.2, "{samples}: {power}");
            let between = axis.power / (0.0155 * 0.0155) * axis.shape.density(0.0625, 8192);
            assert!((0.7..1.3).contains(&between), "{samples}: {between}");
        }
    }
}

/// Lines a hundred thousand times as loud as the noise leak into the whole band; the noise beside them stays what it is.
#[test]
fn strong_lines_leave_the_noise_beside_them() {
    for frequency in [0.0235, 0.0239] {
        let (force, mut acceleration) = record(2000, 2000..6500);
        for signal in &mut acceleration {
            for (n, value) in signal.iter_mut().enumerate() {
                let turned = core::f32::consts::TAU * frequency * (n % 8000) as f32;
                *value += 0.3 * (libm::sinf(turned) + libm::sinf(3.57 * turned + 1.0));
            }
        }
        let noise = of(&(force, acceleration));
        for axis in &noise.acceleration {
            assert_eq!(axis.shape.lines.len(), 2, "{:?}", axis.shape);
            for frequency in [0.005, 0.015, 0.032, 0.05, 0.07, 0.1, 0.2, 0.4] {
                let white = axis.power / (0.0155 * 0.0155);
                let ratio = white * axis.shape.broad_density(frequency);
                assert!((0.6..1.5).contains(&ratio), "{frequency}: {ratio}, {:?}", axis.shape);
            }
        }
    }
}

/// A cut whose force lies above the band, at 700 Hz of 2 kHz. Sixth differences take it for white noise.
fn chattering(from: usize) -> ([Vec<f32>; 3], [Vec<f32>; 3]) {
    let (mut force, acceleration) = record(400, 400..400);
    for (axis, signal) in force.iter_mut().enumerate() {
        for (n, value) in signal.iter_mut().enumerate().skip(from) {
            *value += 200.0 * libm::sinf(core::f32::consts::TAU * 0.35 * n as f32 + axis as f32);
        }
    }
    (force, acceleration)
}

#[test]
fn chatter_above_the_band_is_no_noise() {
    let noise = of(&chattering(400));
    assert!(noise.quiet);
    assert!(
        noise.force.iter().all(|f| (deviation(f) / 0.16 - 1.0).abs() < 0.12),
        "{:?}",
        noise.force
    );
    let noise = of(&chattering(0));
    assert!(!noise.quiet, "{:?}", noise.force);
}

/// The sensor gives zeros at first, and then an offset.
#[test]
fn a_start_up_is_no_noise() {
    let (mut force, mut acceleration) = record(1600, 1600..6500);
    for signal in force.iter_mut().chain(&mut acceleration) {
        signal[..410].fill(0.0);
        signal[410..].iter_mut().for_each(|value| *value += 5.0);
    }
    let noise = of(&(force, acceleration));
    for axis in 0..3 {
        assert!((deviation(&noise.force[axis]) / 0.16 - 1.0).abs() < 0.1, "{:?}", noise.force);
        let ratio = in_band(&noise.acceleration[axis], 0.0155);
        assert!((0.85..1.2).contains(&ratio), "{ratio}");
    }
}
