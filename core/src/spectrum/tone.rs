//! Steady oscillations of an accelerometer that no force has caused: hum, and the lines of spindle and bearings.
//!
//! Over a record of length T, an oscillation `Re(a e^(2πi f t/T))` of f periods has the spectrum
//!
//! ```text
//! X(k) = T/2 (a E(f − k) + a* E(−f − k))          E(u) = (e^(2πiu) − 1) / 2πiu          at bin k
//! ```
//!
//! It leaks into all bins. So it is subtracted, and only the bins of its main lobe lose their weight. What sampling folds back differs
//! little from bin to bin, and is taken by the seam of the record.

use core::f64::consts::{PI, TAU};

use super::Experiment;

/// Most tones of a record. Chosen: mains and spindle with two harmonics each, and two lines of bearings.
pub const MAX_TONES: usize = 8;
/// Half the width of the main lobe, bins. The lobe of a record without a window ends one bin from its middle; another bin has the largest
/// sidelobe.
const LOBE: f64 = 2.0;
/// Step of a difference, bins. Chosen: the curvature of E changes the difference by less than 1e-5 of it.
const STEP: f64 = 1e-3;
/// Below this, E is `1 + πiu` to 1e-8.
const SMALL: f64 = 1e-4;

/// A steady oscillation along the axes of the accelerometer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// Periods in a record.
    pub periods: f64,
    /// Real and imaginary part of the amplitude along each axis, m/s².
    pub amplitude: [[f64; 2]; 3],
    /// Part of its power by which it is not steady.
    pub unsteadiness: f64,
}

impl Tone {
    /// The spectrum of an amplitude of 1 and of one of i at a bin of a record of this length, s: `[real, imaginary]` of each, s.
    pub(crate) fn basis(periods: f64, bin: usize, length: f64) -> [[f64; 2]; 2] {
        let [near, image] = [periods, -periods].map(|own| leakage(own - bin as f64));
        let half = 0.5 * length;
        [
            [half * (near[0] + image[0]), half * (near[1] + image[1])],
            [half * (image[1] - near[1]), half * (near[0] - image[0])],
        ]
    }

    /// Its spectrum at a bin of a record of this length, s: `[real, imaginary]` along each axis, m/s.
    pub(crate) fn at(&self, bin: usize, length: f64) -> [[f64; 2]; 3] {
        let [one, i] = Self::basis(self.periods, bin, length);
        self.amplitude.map(|[re, im]| core::array::from_fn(|part| re * one[part] + im * i[part]))
    }

    /// Derivative of its spectrum at a bin by a delay that grows with time, which makes it slower: −f ∂X/∂f.
    fn drift_at(&self, bin: usize, length: f64) -> [[f64; 2]; 3] {
        let near = |periods: f64| Self { periods, ..*self }.at(bin, length);
        let (above, below) = (near(self.periods + STEP), near(self.periods - STEP));
        core::array::from_fn(|axis| {
            core::array::from_fn(|part| {
                -self.periods * (above[axis][part] - below[axis][part]) / (2.0 * STEP)
            })
        })
    }

    /// Part of its power at a bin that counts as noise once the tone is subtracted: all of it in the main lobe, where the amplitude was
    /// read.
    fn uncertainty(&self, bin: usize) -> f64 {
        if (self.periods - bin as f64).abs() < LOBE { 1.0 } else { self.unsteadiness }
    }
}

impl<const B: usize> Experiment<B> {
    /// Length of the record, s.
    pub(crate) fn length(&self) -> f64 {
        TAU / self.spacing
    }

    /// Frequencies of the tones, Hz, and their largest amplitudes along an axis, m/s².
    pub fn tones_hz(&self) -> impl Iterator<Item = (f64, f64)> {
        self.tones.iter().map(|tone| {
            let largest = tone.amplitude.iter().map(|[re, im]| libm::hypot(*re, *im));
            (tone.periods / self.length(), largest.fold(0.0, f64::max))
        })
    }

    /// Puts back the tones that were subtracted from the acceleration, and subtracts these. Their uncertainty takes the place of the lines
    /// in the noise of the acceleration.
    pub(crate) fn replace_tones(&mut self, tones: &[Tone]) {
        let (length, first_bin) = (self.length(), self.first_bin);
        let before = core::mem::take(&mut self.tones);
        let _ = self.tones.extend_from_slice(&tones[..tones.len().min(MAX_TONES)]);
        let Self { acceleration, drift, acceleration_noise, broad_noise, tones, .. } = self;
        for index in 0..broad_noise[0].len() {
            let bin = first_bin + index;
            let [mut change, mut change_of_drift] = [[[0.0; 2]; 3]; 2];
            let mut noise: [f64; 3] =
                core::array::from_fn(|axis| f64::from(broad_noise[axis][index]));
            let mut add = |tone: &Tone, sign: f64| {
                let [spectrum, of_drift] = [tone.at(bin, length), tone.drift_at(bin, length)];
                for axis in 0..3 {
                    let [re, im] = spectrum[axis];
                    for part in 0..2 {
                        change[axis][part] += sign * spectrum[axis][part];
                        change_of_drift[axis][part] += sign * of_drift[axis][part];
                    }
                    if sign < 0.0 {
                        noise[axis] += tone.uncertainty(bin) * (re * re + im * im);
                    }
                }
            };
            before.iter().for_each(|tone| add(tone, 1.0));
            tones.iter().for_each(|tone| add(tone, -1.0));
            for axis in 0..3 {
                for (spectrum, change) in
                    [(&mut *acceleration, &change), (&mut *drift, &change_of_drift)]
                {
                    let [re, im] = [&mut spectrum.re[axis][index], &mut spectrum.im[axis][index]];
                    *re = (f64::from(*re) + change[axis][0]) as f32;
                    *im = (f64::from(*im) + change[axis][1]) as f32;
                }
                acceleration_noise[axis][index] = noise[axis] as f32;
            }
        }
    }

    /// By how much χ² changes at most if these tones take the place of those that are subtracted, outside the main lobes.
    pub(crate) fn change_by_tones(&self, tones: &[Tone]) -> f64 {
        let length = self.length();
        let mut sum = 0.0;
        for index in 0..self.bins() {
            let bin = self.first_bin + index;
            let all = || {
                self.tones
                    .iter()
                    .map(|tone| (tone, 1.0))
                    .chain(tones.iter().map(|tone| (tone, -1.0)))
            };
            if all().any(|(tone, _)| tone.uncertainty(bin) == 1.0) {
                continue;
            }
            let mut change = [[0.0; 2]; 3];
            for (tone, sign) in all() {
                let spectrum = tone.at(bin, length);
                for (change, own) in
                    change.as_flattened_mut().iter_mut().zip(spectrum.as_flattened())
                {
                    *change += sign * own;
                }
            }
            for (axis, [re, im]) in change.into_iter().enumerate() {
                let noise = f64::from(self.broad_noise[axis][index]);
                sum += 2.0 * (re * re + im * im) / noise.max(f64::MIN_POSITIVE);
            }
        }
        sum
    }
}

/// `E(u) = (e^(2πiu) − 1) / 2πiu`, real and imaginary part.
fn leakage(u: f64) -> [f64; 2] {
    let angle = PI * u;
    if u.abs() < SMALL {
        return [1.0, angle];
    }
    let size = libm::sin(angle) / angle;
    [size * libm::cos(angle), size * libm::sin(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mounting::Mounting;
    use crate::refine::tests::{BINS, SAMPLES, chain, record};
    use crate::sensors::Accelerometer;
    use crate::spectrum::{Measurement, Spectrum};
    use heapless::Vec;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng as _;

    fn experiments(tone: &Tone) -> [Experiment<BINS>; 2] {
        let measurement = Measurement {
            band_hz: [5.0, 60.0],
            gravity: [0.0; 3],
            accelerometer: Accelerometer::Inertial,
            mounting: Mounting::AT_TCP,
        };
        let plain = record(&mut Xoshiro256PlusPlus::seed_from_u64(1));
        let mut with = plain.clone();
        for (signal, [re, im]) in with.acceleration.iter_mut().zip(tone.amplitude) {
            for (n, value) in signal.iter_mut().enumerate() {
                let angle = TAU * tone.periods * n as f64 / SAMPLES as f64;
                *value += (re * libm::cos(angle) - im * libm::sin(angle)) as f32;
            }
        }
        [plain, with].map(|record| {
            Experiment::new(&chain(), &measurement, &record, &mut [0.0; SAMPLES]).unwrap()
        })
    }

    /// Its drift is left but for a constant, which the seam of a record takes.
    #[test]
    fn a_tone_takes_its_drift_with_it() {
        for periods in [40.0, 40.3, 77.5] {
            let tone = Tone { periods, amplitude: [[30.0, 10.0]; 3], unsteadiness: 0.0 };
            let [plain, mut with] = experiments(&tone);
            let all = with.drift.power();
            with.replace_tones(&[tone]);
            let gap = |part: fn(&Spectrum<BINS>) -> &[Vec<f32, BINS>; 3]| -> std::vec::Vec<f32> {
                let (with, plain) = (&part(&with.drift)[0], &part(&plain.drift)[0]);
                with.iter().zip(plain).map(|(with, plain)| with - plain).collect()
            };
            let constant = |gap: &[f32]| gap.iter().sum::<f32>() / gap.len() as f32;
            let left: f32 = [gap(|own| &own.re), gap(|own| &own.im)]
                .iter()
                .flat_map(|gap| gap.iter().map(|own| (own - constant(gap)).powi(2)))
                .sum();
            assert!(f64::from(left) < 1e-3 * all, "{periods}: {left} of {all}");
        }
    }

    /// A tone leaves no more than sampling folds back.
    #[test]
    fn a_tone_is_taken_out_of_all_bins() {
        for periods in [40.0, 40.3, 77.5, 99.99] {
            let amplitude = [[30.0, 10.0], [-5.0, 20.0], [0.0, 1.0]];
            let tone = Tone { periods, amplitude, unsteadiness: 0.0 };
            let [plain, mut with] = experiments(&tone);
            with.replace_tones(&[tone]);
            for axis in 0..3 {
                let peak =
                    0.5 * with.length() * libm::hypot(amplitude[axis][0], amplitude[axis][1]);
                for bin in 0..plain.bins() {
                    let left = (with.acceleration.re[axis][bin] - plain.acceleration.re[axis][bin])
                        .hypot(with.acceleration.im[axis][bin] - plain.acceleration.im[axis][bin]);
                    assert!(
                        f64::from(left) < 2e-3 * peak,
                        "{periods}: bin {bin}, {left} of {peak}"
                    );
                }
            }
        }
    }

    /// The main lobe has no weight left, the other bins have theirs; without the tone all is as before.
    #[test]
    fn what_is_subtracted_is_put_back() {
        let tone = Tone { periods: 60.25, amplitude: [[20.0, 3.0]; 3], unsteadiness: 0.0 };
        let [_, before] = experiments(&tone);
        let mut after = before.clone();
        after.replace_tones(&[tone]);
        for bin in 0..before.bins() {
            let raised = after.acceleration_noise[1][bin] / before.acceleration_noise[1][bin];
            let is_near = (59..=62).contains(&(bin + before.first_bin));
            assert_eq!(raised > 1.0, is_near, "{bin}: {raised}");
        }
        assert!(after.change_by_tones(&[tone]) == 0.0 && after.change_by_tones(&[]) > 1e3);
        after.replace_tones(&[]);
        assert!(after.tones.is_empty() && after.acceleration_noise == before.acceleration_noise);
        for (was, is) in
            before.acceleration.re.iter().flatten().zip(after.acceleration.re.iter().flatten())
        {
            assert!((was - is).abs() < 1e-4, "{was} {is}");
        }
    }
}
