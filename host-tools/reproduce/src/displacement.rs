//! The displacement of the TCP in one experiment, of the reference and of a model with other bushings, and the losses
//! between the two (paper, sections 3.2 and 3.3).
//!
//! The model's series comes from its receptance H. With both signals weighted by `e^(−αt)`, the response to a force
//! from rest is `X̂(s) = H(s) F(s)` on the line `s = α + iω`. The inverse transform times `e^(αt)` is the
//! displacement itself, up to what rings on after the record, damped by `e^(−αT)`. MAE and MSE compare the two series
//! as the paper states them. SSP compares their plain Fourier transforms.
//!
//! Everything is band-limited to the scenario's upper edge, and sampled no finer than that needs. The edge is soft,
//! since `e^(αt)` would enlarge the ripple that a hard one leaves at the end of the series.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::chain::linearise::LinearisationError;
use flexid_core::loss;
use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::receptance::lanes::{Kernel, Lanes, Precision};
use flexid_core::receptance::{Complex, Terms};
use flexid_core::sensors::Sensors;
use flexid_simulation::experiment::Response;
use flexid_simulation::scenario::Sampling;
use nalgebra::Vector3;
use realfft::num_complex::Complex as Bin;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::thinning::{Entries, Line, ROWS};

/// The product αT. What rings on after the record is damped by `e^(−αT)`, and the receptance's rounding grows by
/// `e^(αT)`. Together they are a thousandth of the displacement.
const DECAY: f64 = 6.5;
/// Part of the band, up to its edge, in which it rolls off.
pub const ROLL_OFF: f64 = 0.2;

/// Loss that the optimisers minimise, per direction and experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Mean absolute error, m.
    Mae,
    /// Mean squared error, m².
    Mse,
    /// Surface similarity parameter over the bins below the roll-off.
    Ssp,
}

/// One experiment of the reference model, prepared for comparisons.
pub struct Reference {
    terms: Terms<f32>,
    line: Line,
    /// Weighted force along each axis, real and imaginary parts, Ns, at the line's places.
    force: [[Vec<f32>; 2]; 3],
    bins: usize,
    /// Factor `e^(αt) / T` at the samples, from the transform to the series.
    growth: Vec<f32>,
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
    /// Series of the reference, m.
    series: [Vec<f32>; 3],
    /// Plain transform of the reference's series.
    spectrum: [Vec<Bin<f32>>; 3],
    /// Sampling rate of the series, Hz.
    pub rate_hz: f64,
}

/// Buffers for one model's displacement, usable with any number of references.
#[derive(Default)]
pub struct Scratch {
    receptance: Entries,
    weighted: [Vec<Bin<f32>>; 3],
    series: [Vec<f32>; 3],
    spectrum: Vec<Bin<f32>>,
    work: Vec<Bin<f32>>,
}

impl Reference {
    /// The reference from the response of the reference model at `pose`, from rest.
    ///
    /// # Errors
    /// The pose does not have one angle per driven joint.
    pub fn new(
        chain: &Chain,
        pose: &[f64],
        response: &Response,
        sampling: &Sampling,
    ) -> Result<Self, LinearisationError> {
        let samples = response.force.len();
        let duration = samples as f64 / sampling.rate_hz;
        let bins = ((sampling.band_hz[1] * duration) as usize).min(samples / 2 - 1) + 1;
        let kept = (2 * bins).next_power_of_two().min(samples);
        let alpha = DECAY / duration;
        let rate_hz = kept as f64 / duration;

        let mut planner = RealFftPlanner::<f64>::new();
        let fine = planner.plan_fft_forward(samples);
        let line = |signal: &[Vector3<f64>], axis: usize| {
            let decay = alpha / sampling.rate_hz;
            let weight =
                |(n, value): (usize, &Vector3<f64>)| value[axis] * (-decay * n as f64).exp();
            let mut weighted: Vec<f64> = signal.iter().enumerate().map(weight).collect();
            let mut spectrum = fine.make_output_vec();
            // Both buffers have the length that the plan needs.
            let _ = fine.process(&mut weighted, &mut spectrum);
            spectrum.truncate(bins);
            let scaled = |(bin, value)| value * (roll_off(bin, bins) / sampling.rate_hz);
            spectrum.into_iter().enumerate().map(scaled).collect::<Vec<_>>()
        };

        let places = Line::new(alpha, TAU / duration, bins);
        let force = [0, 1, 2].map(|axis| {
            let spectrum = line(&response.force, axis);
            let at = |bin: usize| spectrum.get(bin).copied().unwrap_or_default();
            let parts = |part: fn(Bin<f64>) -> f64| {
                places.bins.iter().map(|&bin| part(at(bin)) as f32).collect()
            };
            [parts(|bin| bin.re), parts(|bin| bin.im)]
        });

        let any = Bushing { stiffness: [1.0; 6], damping: [1.0; 6] };
        let bushings: Bushings = chain.joints().iter().map(|_| any).collect();
        let linear = chain.linearise(pose, Vector3::zeros(), &bushings)?;
        let mut planner = RealFftPlanner::<f32>::new();
        let growth = |n: usize| (alpha * n as f64 / rate_hz).exp() / duration;
        let mut reference = Self {
            terms: Terms::new(&linear, &bushings, &Sensors::default())?,
            line: places,
            force,
            bins,
            growth: (0..kept).map(|n| growth(n) as f32).collect(),
            forward: planner.plan_fft_forward(kept),
            inverse: planner.plan_fft_inverse(kept),
            series: Default::default(),
            spectrum: Default::default(),
            rate_hz,
        };
        // The reference's series comes from the line in the same way as the models'.
        let mut scratch = Scratch::default();
        for (axis, weighted) in scratch.weighted.iter_mut().enumerate() {
            let spectrum = line(&response.displacement, axis);
            *weighted = spectrum.iter().map(|z| Bin::new(z.re as f32, z.im as f32)).collect();
        }
        reference.to_series(&mut scratch);
        for axis in 0..3 {
            reference.to_spectrum(axis, &mut scratch);
            reference.spectrum[axis] = std::mem::take(&mut scratch.spectrum);
        }
        reference.series = scratch.series;
        Ok(reference)
    }

    /// The reference's displacement along each TCP axis, m.
    pub fn series(&self) -> &[Vec<f32>; 3] {
        &self.series
    }

    /// The displacement of a robot with `bushings` under the same force, m.
    pub fn displacement<'a>(
        &self,
        bushings: &[Bushing],
        level: Level,
        scratch: &'a mut Scratch,
    ) -> &'a [Vec<f32>; 3] {
        let mut terms = self.terms.clone();
        terms.set_bushings(bushings);
        self.line.receptance(&terms, level, &mut scratch.receptance);
        for weighted in &mut scratch.weighted {
            weighted.resize(self.bins, Bin::default());
        }
        let Scratch { receptance, weighted, .. } = scratch;
        f32::dispatch(level, Move { reference: self, receptance, moved: weighted });
        self.to_series(scratch);
        &scratch.series
    }

    /// Computes the series from the weighted transform: `e^(αt) irfft / T`.
    fn to_series(&self, scratch: &mut Scratch) {
        let length = self.growth.len();
        for (weighted, series) in scratch.weighted.iter_mut().zip(&mut scratch.series) {
            weighted.resize(self.bins, Bin::default());
            weighted[0].im = 0.0;
            weighted.resize(length / 2 + 1, Bin::default());
            series.resize(length, 0.0);
            scratch.work.resize(self.inverse.get_scratch_len(), Bin::default());
            // All lengths are the plan's, and the ends are real.
            let _ = self.inverse.process_with_scratch(weighted, series, &mut scratch.work);
            for (value, growth) in series.iter_mut().zip(&self.growth) {
                *value *= growth;
            }
        }
    }

    /// The plain transform of one direction's series.
    fn to_spectrum(&self, axis: usize, scratch: &mut Scratch) {
        let series = &mut scratch.series[axis];
        scratch.spectrum.resize(series.len() / 2 + 1, Bin::default());
        scratch.work.resize(self.forward.get_scratch_len(), Bin::default());
        // The transform overwrites its input.
        let kept = series.clone();
        let _ = self.forward.process_with_scratch(series, &mut scratch.spectrum, &mut scratch.work);
        *series = kept;
    }
}

impl Reference {
    /// The loss of each direction.
    pub fn losses(
        &self,
        loss: Loss,
        bushings: &[Bushing],
        level: Level,
        scratch: &mut Scratch,
    ) -> [f32; 3] {
        self.displacement(bushings, level, scratch);
        [0, 1, 2].map(|axis| {
            let pair = (&self.series[axis], &scratch.series[axis]);
            match loss {
                Loss::Mae => loss::mean_absolute_error(pair.0, pair.1),
                Loss::Mse => loss::mean_squared_error(pair.0, pair.1),
                Loss::Ssp => {
                    self.to_spectrum(axis, scratch);
                    let parts = |bin: &Bin<f32>| [bin.re.into(), bin.im.into()];
                    let bins = self.spectrum[axis].iter().zip(&scratch.spectrum);
                    let bins = bins.take(flat(self.bins)).map(|(x, y)| (parts(x), parts(y)));
                    loss::surface_similarity(bins) as f32
                }
            }
        })
    }
}

/// Number of bins below the roll-off.
fn flat(bins: usize) -> usize {
    (bins as f64 * (1.0 - ROLL_OFF)) as usize
}

/// Factor of a bin: half a cosine from the flat part to the upper edge.
fn roll_off(bin: usize, bins: usize) -> f64 {
    let into = bin.saturating_sub(flat(bins)) as f64 / (bins - flat(bins)) as f64;
    0.5 + 0.5 * (PI * into).cos()
}

/// The kernel of `X̂ = H F` on the line.
struct Move<'a> {
    reference: &'a Reference,
    receptance: &'a Entries,
    moved: &'a mut [Vec<Bin<f32>>; 3],
}

impl Kernel<f32> for Move<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f32>>(self, like: V) {
        let Self { reference, receptance, moved } = self;
        for (first, bins) in reference.line.bins.chunks_exact(V::WIDTH).enumerate() {
            let first = first * V::WIDTH;
            let at = |[re, im]: &[Vec<f32>; 2]| {
                Complex::new(like.load(&re[first..]), like.load(&im[first..]))
            };
            let force = reference.force.each_ref().map(at);
            let entries = receptance.each_ref().map(at);
            for (row, moved) in ROWS.into_iter().zip(moved.iter_mut()) {
                let [x, y, z] = row.map(|entry| entries[entry]);
                let displacement = (x * force[0]).add_mul(y, force[1]).add_mul(z, force[2]);
                let (mut re, mut im) = ([0.0_f32; 16], [0.0_f32; 16]);
                displacement.re.store(&mut re);
                displacement.im.store(&mut im);
                for (&bin, (&re, &im)) in bins.iter().zip(re.iter().zip(&im)) {
                    if let Some(moved) = moved.get_mut(bin) {
                        *moved = Bin::new(re, im);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::reference::mill3;
    use flexid_simulation::experiment::Cut;
    use flexid_simulation::scenario::Scenario;
    use rand_core::SeedableRng as _;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn reference() -> (Scenario, Response, Reference) {
        let (scenario, chain) = mill3();
        let sampling = scenario.measurement;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let cut = Cut::new(&scenario.experiments[1], &scenario.cutting, &sampling, &mut rng);
        let response = cut.response(&chain, &scenario.truth);
        let reference = Reference::new(&chain, &cut.pose, &response, &sampling).unwrap();
        (scenario, response, reference)
    }

    fn stiffer(truth: &[Bushing], factor: f64) -> Vec<Bushing> {
        let stiffer = |bushing: &Bushing| Bushing {
            stiffness: bushing.stiffness.map(|stiffness| factor * stiffness),
            ..*bushing
        };
        truth.iter().map(stiffer).collect()
    }

    /// RMS of the difference over RMS of the first, over all directions.
    fn difference(of: &[Vec<f32>; 3], to: impl Fn(usize, usize) -> f64) -> f64 {
        let (mut error, mut size) = (0.0_f64, 0.0_f64);
        for (axis, series) in of.iter().enumerate() {
            for (n, &value) in series.iter().enumerate() {
                error += (f64::from(value) - to(axis, n)).powi(2);
                size += f64::from(value).powi(2);
            }
        }
        (error / size).sqrt()
    }

    /// The test compares the motion integrated in time, the reference's series, and the receptance's response to the
    /// same force. The equation of motion is not linear: a thousandth of the displacement is not the receptance's.
    #[test]
    fn the_true_robot_moves_like_the_reference() {
        let (scenario, response, reference) = reference();
        let mut scratch = Scratch::default();
        let model = reference.displacement(&scenario.truth, Level::new(), &mut scratch);
        let step = response.displacement.len() / model[0].len();
        let from_model = difference(&reference.series, |axis, n| model[axis][n].into());
        let from_all =
            difference(&reference.series, |axis, n| response.displacement[step * n][axis]);
        println!(
            "of the displacement, the model misses {from_model:.1e}, the roll-off {from_all:.1e}"
        );
        assert!((1e-9..2e-3).contains(&from_model), "{from_model}");
        assert!(from_all < 0.01, "{from_all}");
    }

    #[test]
    fn losses_are_small_at_the_truth() {
        let (scenario, _, reference) = reference();
        let mut scratch = Scratch::default();
        for loss in [Loss::Mae, Loss::Mse, Loss::Ssp] {
            let at = |bushings: &[Bushing], scratch: &mut Scratch| {
                reference.losses(loss, bushings, Level::new(), scratch).iter().sum::<f32>()
            };
            let right = at(&scenario.truth, &mut scratch);
            let wrong = at(&stiffer(&scenario.truth, 1.1), &mut scratch);
            assert!(right < 0.05 * wrong, "{loss:?}: {right} at the truth, {wrong} beside it");
        }
    }

    /// Parseval: the mean squared error is the same from the plain spectra.
    #[test]
    fn the_squared_error_is_that_of_the_spectra() {
        let (scenario, _, reference) = reference();
        let mut scratch = Scratch::default();
        let bushings = stiffer(&scenario.truth, 1.3);
        let losses = reference.losses(Loss::Mse, &bushings, Level::new(), &mut scratch);
        for (axis, loss) in losses.into_iter().enumerate() {
            reference.to_spectrum(axis, &mut scratch);
            let length = reference.series[axis].len();
            let bins = reference.spectrum[axis].iter().zip(&scratch.spectrum).enumerate();
            let sum: f64 = bins
                .map(|(bin, (x, y))| {
                    let twice = if bin == 0 || bin == length / 2 { 1.0 } else { 2.0 };
                    twice * f64::from((x - y).norm_sqr())
                })
                .sum();
            let spectral = sum / (length * length) as f64;
            assert!((f64::from(loss) / spectral - 1.0).abs() < 1e-4, "{loss} is not {spectral}");
        }
    }
}
