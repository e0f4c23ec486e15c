//! The receptance of a pose from its records alone: the H₁ estimate of a system of three inputs, with its coherence.
//!
//! Segments of the records with a Hann window and half an overlap (Welch, "The use of fast Fourier transform for the estimation of
//! power spectra", IEEE Transactions on Audio and Electroacoustics 15, 1967) give the spectra of the forces f and of a reading a
//! (Bendat and Piersol, _Random Data_, 4th edition, 2010, section 7.4):
//!
//! ```text
//! H₁ = S_af S_ff⁻¹        γ²_a = (H₁ S_ff H₁ᴴ)_aa / S_aa        receptance = −H₁/ω²
//! ```
//!
//! γ² is the multiple coherence: the part of a reading that all three forces explain linearly. Where the forces go together, S_ff has
//! hardly an inverse, and H₁ is uncertain. With n independent segments the variance of an entry is (the same, section 9.3; Goodman,
//! "Measurement of matrix frequency response functions and multiple coherence functions", AFFDL-TR-65-56, 1965)
//!
//! ```text
//! σ²_af = (1 − γ²_a) S_aa (S_ff⁻¹)_ff / (n − 3)
//! ```
//!
//! An entry with σ above [`MOST_ERROR`] of its size is left out. What one cut always shows is the response to the force that was there:
//! the first principal component p = uᴴ f of the forces, u the eigenvector of the largest eigenvalue σ₁ of S_ff,
//!
//! ```text
//! H_ap = (S_af u)_a / σ₁
//! ```
//!
//! A modal test has measured its entries; they are taken as they are.
//!
//! A window widens every resonance, and leaves what rings on from before the segment. The acceleration that the fit gives for the same
//! records goes through the same estimate, so that the two compare like with like.

use std::f64::consts::{PI, TAU};

use flexid_pipeline::solver::FittedRecord;
use nalgebra::{Complex, Matrix3, Vector3};
use realfft::RealFftPlanner;
use serde::{Deserialize, Serialize};

use super::curve::{rounded, thinned};

/// Largest standard deviation of an entry, in parts of its size. Chosen: beyond, three standard deviations are the entry itself.
const MOST_ERROR: f64 = 1.0 / 3.0;
/// Forces.
const INPUTS: f64 = 3.0;
/// Size to which rounding may raise a spectrum that is zero, in parts of the forces' own: it keeps S_ff invertible.
const ROUNDING: f64 = 1e-9;
/// Fewest segments. Chosen: without any relation, the coherence of three forces reads 3 of the number of segments, here a fifth.
const FEWEST_SEGMENTS: usize = 15;
/// Correlation of segments with a Hann window that overlap by a half (Welch, 1967).
const OVERLAP: f64 = 1.0 / 6.0;
/// Longest and shortest segment, as parts of a record. An eighth gives a single record [`FEWEST_SEGMENTS`].
const PARTS: [usize; 2] = [4, 8];

/// The receptance of a pose from its records alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredReceptance {
    /// True if the entries are those of modal tests.
    #[serde(default)]
    pub is_of_test: bool,
    /// Joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Numbers of the records.
    pub records: Vec<u64>,
    /// Number of segments, overlapping by a half.
    pub segments: usize,
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Points along the band.
    pub points: Vec<MeasuredPoint>,
}

/// Receptance at one frequency. Rows are displacements along the accelerometer's axes, columns forces along the force sensor's, real and
/// imaginary part, m/N. An entry is `None` where it is too uncertain, as where the forces go together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredPoint {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// From the measured acceleration.
    pub measured: [[Option<[f64; 2]>; 3]; 3],
    /// From the acceleration that the fit gives for the same records.
    pub modelled: [[Option<[f64; 2]>; 3]; 3],
    /// Direction u of the force that was there, complex, of length 1. Its largest component is real.
    pub direction: [[f64; 2]; 3],
    /// Displacement per force along this direction, m/N, from the measured acceleration.
    pub measured_along: [[f64; 2]; 3],
    /// Displacement per force along this direction from the acceleration that the fit gives for the same records.
    pub modelled_along: [[f64; 2]; 3],
    /// Multiple coherence of each axis of the measured acceleration, 0 to 1; of a modal test the least that a single blow with such errors would have.
    pub coherence: [f64; 3],
}

/// Forces and readings of one record, sampled alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Force along each axis, N.
    pub force: [Vec<f64>; 3],
    /// Reading along each axis.
    pub reading: [Vec<f64>; 3],
}

/// H₁ at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Reading (row) per force (column).
    pub h: Matrix3<Complex<f64>>,
    /// Standard deviation of each entry.
    pub deviation: Matrix3<f64>,
    /// Direction of the force that was there, of length 1.
    pub direction: Vector3<Complex<f64>>,
    /// Reading per force along this direction.
    pub along: Vector3<Complex<f64>>,
    /// Multiple coherence of each reading, 0 to 1.
    pub coherence: [f64; 3],
}

impl MeasuredReceptance {
    /// The receptance that the modal tests of one pose have measured, at the frequencies of the first. `None` without such a test.
    pub(super) fn of_tests(records: &[&FittedRecord]) -> Option<Self> {
        let tests = || records.iter().filter_map(|own| Some((*own, own.decay?)));
        let (first, _) = tests().next()?;
        let is_alike = |own: &FittedRecord| {
            own.bins.len() == first.bins.len()
                && own.bins[0].frequency_hz == first.bins[0].frequency_hz
        };
        let tests: Vec<(&FittedRecord, f64)> = tests().filter(|(own, _)| is_alike(own)).collect();
        let frequencies: Vec<f64> = first.bins.iter().map(|bin| bin.frequency_hz).collect();
        let point = |index: usize| {
            let mut entries = [[[None; 3]; 3]; 2];
            let mut coherence = [1.0_f64; 3];
            for (own, decay) in &tests {
                let bin = &own.bins[index];
                let s = Complex::new(*decay, TAU * bin.frequency_hz);
                let Some(column) = (0..3).find(|axis| bin.force[*axis][0] != 0.0) else { continue };
                for row in (0..3).filter(|row| bin.noise[*row] > 0.0) {
                    let [re, im] = bin.measured[row];
                    if re * re + im * im <= bin.noise[row] {
                        continue;
                    }
                    let [left_re, left_im] = bin.left[row];
                    for (entries, a) in
                        entries.iter_mut().zip([[re, im], [re - left_re, im - left_im]])
                    {
                        let size = Complex::new(a[0], a[1]) / (s * s * bin.force[column][0]);
                        entries[row][column] = Some(parts(size));
                    }
                    let power = re * re + im * im;
                    coherence[row] = coherence[row].min(power / (power + bin.noise[row]));
                }
            }
            let [measured, modelled] = entries;
            let force = first.bins[index].force;
            let column = (0..3).find(|axis| force[*axis][0] != 0.0).unwrap_or(0);
            let mut direction = [[0.0; 2]; 3];
            direction[column][0] = 1.0;
            let along = |of: &[[Option<[f64; 2]>; 3]; 3]| {
                [0, 1, 2].map(|row| of[row][column].unwrap_or_default())
            };
            MeasuredPoint {
                frequency_hz: rounded(frequencies[index]),
                measured_along: along(&measured),
                modelled_along: along(&modelled),
                measured,
                modelled,
                direction,
                coherence: coherence.map(rounded),
            }
        };
        Some(Self {
            is_of_test: true,
            pose: first.pose.clone(),
            records: tests.iter().map(|(own, _)| own.number).collect(),
            segments: 1,
            segment_s: first.samples as f64 / first.rate_hz,
            points: thinned(&frequencies).into_iter().map(point).collect(),
        })
    }

    /// The receptance from the records of one pose, those that are as long as the first. `None` if their band is too narrow for an estimate.
    pub(super) fn of(records: &[&FittedRecord]) -> Option<Self> {
        let spacing = |record: &FittedRecord| record.rate_hz / record.samples as f64;
        let first = *records.first()?;
        let alike: Vec<&FittedRecord> = records
            .iter()
            .copied()
            .filter(|own| own.bins.len() == first.bins.len())
            .filter(|own| (spacing(own) / spacing(first) - 1.0).abs() < 1e-3)
            .collect();
        let seconds = 1.0 / spacing(first);
        let first_bin = (first.bins.first()?.frequency_hz * seconds).round() as usize;
        let last_bin = first_bin + first.bins.len() - 1;
        let samples = (2 * last_bin + 2).next_power_of_two();
        let [longest, shortest] = PARTS;
        let is_enough = alike.len() * (2 * longest - 1) >= FEWEST_SEGMENTS;
        let part = if is_enough { longest } else { shortest };
        let segment = samples / part;
        if segment < 2 {
            return None;
        }
        let of = |left: f64| -> Vec<Signals> {
            alike.iter().map(|own| Signals::of(own, first_bin, samples, left)).collect()
        };
        let rate_hz = samples as f64 / seconds;
        let measured = estimate(&of(0.0), rate_hz, segment);
        let modelled = estimate(&of(1.0), rate_hz, segment);
        // A line less at both ends: its window reaches beyond the band.
        let line = rate_hz / segment as f64;
        let [from, to] = [first_bin, last_bin].map(|bin| bin as f64 / seconds);
        let inside = |hz: f64| hz >= from + line && hz <= to - line;
        let both: Vec<(Estimated, Estimated)> = measured
            .into_iter()
            .zip(modelled)
            .filter(|(own, _)| inside(own.frequency_hz))
            .collect();
        let frequencies: Vec<f64> = both.iter().map(|(own, _)| own.frequency_hz).collect();
        let points = thinned(&frequencies).into_iter().map(|index| {
            let (measured, modelled) = &both[index];
            // Both are shown where the measured one is certain.
            let is_sound = |row: usize, column: usize| {
                measured.deviation[(row, column)] <= MOST_ERROR * measured.h[(row, column)].norm()
            };
            let entries = |own: &Estimated| {
                let entry = |row: usize, column: usize| {
                    is_sound(row, column).then(|| own.displacement(own.h[(row, column)]))
                };
                std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column)))
            };
            let along =
                |own: &Estimated| std::array::from_fn(|row| own.displacement(own.along[row]));
            MeasuredPoint {
                frequency_hz: rounded(measured.frequency_hz),
                measured: entries(measured),
                modelled: entries(modelled),
                direction: std::array::from_fn(|axis| parts(measured.direction[axis])),
                measured_along: along(measured),
                modelled_along: along(modelled),
                coherence: measured.coherence.map(rounded),
            }
        });
        let points: Vec<MeasuredPoint> = points.collect();
        (!points.is_empty()).then(|| Self {
            is_of_test: false,
            pose: first.pose.clone(),
            records: alike.iter().map(|own| own.number).collect(),
            segments: alike.len() * (2 * part - 1),
            segment_s: seconds / part as f64,
            points,
        })
    }
}

impl Estimated {
    /// Displacement per force from acceleration per force, real and imaginary part.
    fn displacement(&self, acceleration: Complex<f64>) -> [f64; 2] {
        let omega = TAU * self.frequency_hz;
        parts(acceleration / -(omega * omega))
    }
}

/// Real and imaginary part.
fn parts(value: Complex<f64>) -> [f64; 2] {
    [rounded(value.re), rounded(value.im)]
}

impl Signals {
    /// The signals of a record within its band, of so many samples over its length: of the acceleration less `left` times what the fit
    /// leaves.
    fn of(record: &FittedRecord, first_bin: usize, samples: usize, left: f64) -> Self {
        let inverse = RealFftPlanner::<f64>::new().plan_fft_inverse(samples);
        let signal = |part: &dyn Fn(usize) -> [f64; 2]| {
            let mut spectrum = inverse.make_input_vec();
            for index in 0..record.bins.len() {
                let [re, im] = part(index);
                spectrum[first_bin + index] = Complex::new(re, im);
            }
            let mut signal = inverse.make_output_vec();
            // The buffers have the plan's lengths. The spectrum of real numbers is real at both ends: an imaginary part there is left out.
            let _ = inverse.process(&mut spectrum, &mut signal);
            let seconds = record.samples as f64 / record.rate_hz;
            signal.iter_mut().for_each(|value| *value /= seconds);
            signal
        };
        let bins = &record.bins;
        let reading = |axis: usize| {
            signal(&|index| {
                let (measured, residual) = (bins[index].measured[axis], bins[index].left[axis]);
                [measured[0] - left * residual[0], measured[1] - left * residual[1]]
            })
        };
        Self {
            force: std::array::from_fn(|axis| signal(&|index| bins[index].force[axis])),
            reading: std::array::from_fn(reading),
        }
    }
}

/// H₁ of signals that are sampled at this rate, Hz, from segments of so many samples that overlap by a half, at each line above 0 and
/// below half of the rate.
///
/// # Panics
/// A segment has fewer than two samples.
pub fn estimate(records: &[Signals], rate_hz: f64, segment: usize) -> Vec<Estimated> {
    assert!(segment >= 2, "a segment of {segment} samples");
    let forward = RealFftPlanner::<f64>::new().plan_fft_forward(segment);
    let window: Vec<f64> =
        (0..segment).map(|n| (PI * n as f64 / segment as f64).sin().powi(2)).collect();
    let transform = |signal: &[f64]| {
        let mut windowed: Vec<f64> = signal.iter().zip(&window).map(|(a, b)| a * b).collect();
        let mut spectrum = forward.make_output_vec();
        // The buffers have the plan's lengths.
        let _ = forward.process(&mut windowed, &mut spectrum);
        spectrum
    };
    let lines = segment / 2;
    let mut sums = vec![Sums::default(); lines];
    let mut segments = 0.0;
    for record in records {
        let samples = record.force[0].len();
        for start in (0..=samples.saturating_sub(segment)).step_by((segment / 2).max(1)) {
            let cut = |signal: &Vec<f64>| transform(&signal[start..start + segment]);
            let (force, reading) =
                (record.force.each_ref().map(cut), record.reading.each_ref().map(cut));
            segments += 1.0;
            for (line, sums) in sums.iter_mut().enumerate() {
                let at = |spectra: &[Vec<Complex<f64>>; 3]| spectra.each_ref().map(|own| own[line]);
                sums.add(at(&force), at(&reading));
            }
        }
    }
    let independent = segments / (1.0 + 2.0 * OVERLAP * OVERLAP);
    let estimated = |(line, sums): (usize, &Sums)| {
        sums.estimated(line as f64 * rate_hz / segment as f64, independent)
    };
    sums.iter().enumerate().skip(1).map(estimated).collect()
}

/// Sums of the spectra of one line over the segments.
#[derive(Clone, Debug, Default)]
struct Sums {
    forces: Matrix3<Complex<f64>>,
    /// Reading times the conjugate of a force.
    across: Matrix3<Complex<f64>>,
    readings: [f64; 3],
}

impl Sums {
    fn add(&mut self, force: [Complex<f64>; 3], reading: [Complex<f64>; 3]) {
        for row in 0..3 {
            for column in 0..3 {
                self.forces[(row, column)] += force[row] * force[column].conj();
                self.across[(row, column)] += reading[row] * force[column].conj();
            }
            self.readings[row] += reading[row].norm_sqr();
        }
    }

    fn estimated(&self, frequency_hz: f64, segments: f64) -> Estimated {
        // Scaled to a unit diagonal. A force that is not there has zeros.
        let scale: [f64; 3] = std::array::from_fn(|axis| {
            let own = self.forces[(axis, axis)].re.sqrt();
            if own > 0.0 && own.is_finite() { own } else { 1.0 }
        });
        let scaled = Matrix3::from_fn(|row, column| {
            let rounding = if row == column { ROUNDING } else { 0.0 };
            self.forces[(row, column)] / (scale[row] * scale[column]) + rounding
        });
        let inverse = scaled.try_inverse().unwrap_or_else(Matrix3::zeros);
        let unscaled =
            Matrix3::from_fn(|row, column| inverse[(row, column)] / (scale[row] * scale[column]));
        let h = self.across * unscaled;
        let explained = h * self.across.adjoint();
        let coherence: [f64; 3] = std::array::from_fn(|axis| {
            let coherence = explained[(axis, axis)].re / self.readings[axis];
            if coherence.is_finite() { coherence.clamp(0.0, 1.0) } else { 0.0 }
        });
        let deviation = Matrix3::from_fn(|row, column| {
            let left = (1.0 - coherence[row]) * self.readings[row];
            let inverse = unscaled[(column, column)].re.max(0.0);
            (left * inverse / (segments - INPUTS).max(f64::MIN_POSITIVE)).sqrt()
        });
        let (largest, direction) = self.principal();
        let along = self.across * direction / Complex::from(largest.max(f64::MIN_POSITIVE));
        Estimated { frequency_hz, h, deviation, direction, along, coherence }
    }

    /// Largest eigenvalue of the forces' spectra, and its eigenvector with a real largest component.
    fn principal(&self) -> (f64, Vector3<Complex<f64>>) {
        let eigen = self.forces.symmetric_eigen();
        let (index, largest) = eigen.eigenvalues.argmax();
        let own: Vector3<Complex<f64>> = eigen.eigenvectors.column(index).into();
        let component = own[own.map(|entry| entry.norm()).imax()];
        if component.norm() > 0.0 {
            (largest, own * (component.conj() / component.norm()))
        } else {
            (largest, own)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695);
            (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
        };
        (0..4096).map(|_| next()).collect()
    }

    /// The readings tell nothing of two forces that are equal, or not there, and all of the third.
    #[test]
    fn forces_that_go_together_are_uncertain() {
        let (x, z) = (noise(1), noise(2));
        let own = noise(3);
        for times in [0.0, 2.0] {
            let y = x.iter().map(|own| times * own).collect();
            let reading =
                z.iter().zip(&own).map(|(z, own)| 3.0 * z + 0.01 * own).collect::<Vec<_>>();
            let reading = std::array::from_fn(|_| reading.clone());
            let force = [x.clone(), y, z.clone()];
            let estimated = estimate(&[Signals { force, reading }], 1000.0, 256);
            assert_eq!(estimated.len(), 127);
            for own in &estimated {
                assert!((own.h[(1, 2)] - Complex::from(3.0)).norm() < 0.05, "{own:?}");
                assert!(own.deviation[(1, 2)] < 0.02, "{own:?}");
                assert!(own.deviation[(1, 1)] > 1.0, "{own:?}");
                assert_eq!(own.deviation[(1, 0)] < 0.02, times == 0.0, "{own:?}");
                assert!(own.coherence.iter().all(|own| *own > 0.999), "{own:?}");
            }
        }
    }

    /// Three forces from one source: only the response along their direction is known.
    #[test]
    fn one_source_has_one_direction() {
        let source = noise(1);
        let scaled = |by: f64| -> Vec<f64> { source.iter().map(|own| by * own).collect() };
        let signals = Signals {
            force: [scaled(1.0), scaled(-2.0), scaled(2.5)],
            reading: [scaled(6.0), scaled(0.0), scaled(-3.0)],
        };
        let length = 11.25_f64.sqrt();
        for own in estimate(&[signals], 1.0, 256) {
            let expected = Vector3::new(1.0, -2.0, 2.5).map(|own| Complex::from(own / length));
            assert!((own.direction - expected).norm() < 1e-6, "{own:?}");
            let along = Vector3::new(6.0, 0.0, -3.0).map(|own| Complex::from(own / length));
            assert!((own.along - along).norm() < 1e-6, "{own:?}");
        }
    }

    /// The standard deviation is that of the scatter, and the coherence of noise is that of chance: 3 of 29 independent segments.
    #[test]
    fn deviation_and_coherence_of_noise_are_those_of_chance() {
        let force = [1, 2, 3].map(noise);
        let estimated = estimate(&[Signals { force, reading: [4, 5, 6].map(noise) }], 1.0, 256);
        let all: Vec<f64> = estimated.iter().flat_map(|own| own.coherence).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        assert!((0.06..0.15).contains(&mean), "{mean}");
        let squares = estimated.iter().map(|own| {
            let times = own.h.zip_map(&own.deviation, |h, std| h.norm_sqr() / (std * std));
            times.mean()
        });
        let mean = squares.sum::<f64>() / 127.0;
        assert!((0.8..1.2).contains(&mean), "{mean}");
    }
}
