//! The acceleration without tones, and its noise as it is in the cut.

use super::cut_noise::CutNoise;
use super::experiment::Experiment;
use super::movement::Movement;
use super::tone::{MAX_TONES, Tone};

impl<const B: usize> Experiment<B> {
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

    /// Takes the movement in the parts as told by the model, as the fit to the record will: nothing is left of it.
    pub fn tell_movement(&mut self) {
        self.movement.left.iter_mut().for_each(|left| left.fill(0.0));
    }

    /// Puts back the movement that was subtracted from the acceleration, and subtracts this.
    pub(crate) fn replace_movement(&mut self, movement: Movement<B>) {
        for bin in 0..self.bins() {
            let before = self.movement.order.re[0].get(bin).map(|_| self.movement.order.at(bin));
            let [before, after] = [before.unwrap_or_default(), movement.order.at(bin)];
            for axis in 0..3 {
                let own = [&mut self.acceleration.re, &mut self.acceleration.im];
                for (part, own) in own.into_iter().enumerate() {
                    own[axis][bin] -= (after[axis][part] - before[axis][part]) as f32;
                }
            }
        }
        self.movement = movement;
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

    /// Bins of one of so many bands.
    pub(crate) fn bins_of_band(&self, band: usize, bands: usize) -> core::ops::Range<usize> {
        let first = |band: usize| (band * self.bins()).div_ceil(bands);
        first(band)..first(band + 1)
    }

    /// Raises the noise of the acceleration to that of the cut.
    pub(crate) fn replace_cut_noise(&mut self, cut_noise: CutNoise) {
        let bins = self.bins();
        for axis in 0..3 {
            for bin in 0..bins {
                let [new, old] = [&cut_noise, &self.cut_noise].map(|own| own.at(axis, bin, bins));
                self.acceleration_noise[axis][bin] *= new / old;
                self.broad_noise[axis][bin] *= new / old;
            }
        }
        self.cut_noise = cut_noise;
    }

    /// Bands in which the cut has more noise than the rest: axis, lower and upper frequency, Hz, and mean square over that at rest.
    pub fn louder_bands(&self) -> impl Iterator<Item = (usize, [f64; 2], f64)> {
        self.cut_noise.times.iter().enumerate().flat_map(move |(axis, bands)| {
            let louder = bands.iter().enumerate().filter(|(_, times)| **times > 1.0);
            louder.map(move |(band, times)| {
                let bins = self.bins_of_band(band, bands.len());
                let hz = |bin: usize| self.omega(bin) / core::f64::consts::TAU;
                (axis, [hz(bins.start), hz(bins.end - 1)], f64::from(*times))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

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
