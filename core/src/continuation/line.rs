//! Contribution of one record to the cost of a level, along the search's line up to the level's highest frequency.
//!
//! The standard deviation of a residual has two parts: a part `η` of the size of both spectra, for the error of the model,
//! and the noise σ_A. Positive and negative errors of ln k then cost alike, and no resonance outweighs the rest:
//!
//! ```text
//! ρ = (A − Â) / √(η² (|A|² + |Â|²) + σ_A²)
//! ```

use fearless_simd::Level;

use crate::DOF;
use crate::linear::gram::padded;
use crate::parameters::MAX_PARAMETERS;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, Response, Terms};
use crate::refine::ParameterNormal;
use crate::sought::{MAX_UNKNOWNS, Sought};
use crate::spectrum::Experiment;
use crate::spectrum::thinned::THINNING;

/// Number of lanes of the widest vector.
const MAX_WIDTH: usize = 16;

/// Number of rows of a bin: real and imaginary parts along three axes.
const ROWS: usize = 6;

/// Length of a row: the derivatives, then the residual.
const COLUMNS: usize = padded(MAX_UNKNOWNS + 1);

/// Band of a level, and weight of its residuals.
pub(super) struct Weighing {
    /// Highest angular frequency of the level, rad/s.
    pub(super) highest: f32,
    /// Relative part η of the standard deviation.
    pub(super) relative: f64,
}

/// Adds the rows of one record to the normal equations, and returns the number of those that are measured. `terms` are those of the record's pose with
/// the bushings under test.
pub(super) fn add<const B: usize>(
    normal: &mut ParameterNormal,
    terms: &Terms<f32>,
    experiment: &Experiment<B>,
    weighing: Weighing,
    sought: &Sought,
    level: Level,
) -> usize {
    let spectra = &experiment.thinned;
    let bins = spectra.omega[..spectra.bins].partition_point(|&omega| omega <= weighing.highest);
    Line {
        terms,
        alpha: spectra.alpha,
        omega: &spectra.omega,
        bins,
        force: spectra.force.parts(),
        acceleration: spectra.acceleration.parts(),
        noise: Noise::of(experiment),
        relative: weighing.relative * weighing.relative,
        sought,
        normal,
        level,
    }
    .add();
    2 * experiment.measured_axes() * bins
}

/// Noise of the acceleration on the line.
#[derive(Clone, Copy)]
struct Noise<'a> {
    /// Mean square in each bin of the parts of the record, per axis.
    of_parts: [&'a [f32]; 3],
    /// Number of parts into which the record was divided.
    parts: usize,
    /// Numbers of the first bins of the whole record and of a part.
    first_bins: [usize; 2],
    /// Part of the mean square that remains on the line.
    left: f64,
}

impl<'a> Noise<'a> {
    fn of<const B: usize>(experiment: &'a Experiment<B>) -> Self {
        let (spectra, parts) = (&experiment.thinned, experiment.divided);
        Self {
            of_parts: experiment.acceleration_noise.each_ref().map(heapless::Vec::as_slice),
            parts,
            first_bins: [spectra.first_bin, experiment.first_bin],
            left: spectra.noise_left,
        }
    }

    /// Mean square in a bin of the line, from that of a part at the same frequency.
    fn at(&self, axis: usize, bin: usize) -> f64 {
        let [of_record, of_part] = self.first_bins;
        let bin = ((of_record + bin * THINNING) / self.parts).saturating_sub(of_part);
        let of_part = self.of_parts[axis].get(bin).copied().unwrap_or_default();
        self.left * (self.parts as f64 * f64::from(of_part))
    }
}

struct Line<'a> {
    terms: &'a Terms<f32>,
    alpha: f32,
    omega: &'a [f32],
    /// Number of bins of the level.
    bins: usize,
    /// Force along each axis, real and imaginary part.
    force: [[&'a [f32]; 2]; 3],
    /// Acceleration along each axis, real and imaginary part.
    acceleration: [[&'a [f32]; 2]; 3],
    noise: Noise<'a>,
    /// η².
    relative: f64,
    sought: &'a Sought,
    normal: &'a mut ParameterNormal,
    level: Level,
}

impl Line<'_> {
    /// Compiled once: not again for each number of bins, in each crate.
    fn add(self) {
        f32::dispatch(self.level, self);
    }
}

impl Kernel<f32> for Line<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f32>>(self, like: V) {
        let Self { terms, alpha, omega, bins, force, acceleration, sought, normal, level, .. } =
            self;
        let mut response = Response::new(like);
        let mut derivatives = [[[[0.0_f32; MAX_WIDTH]; 2]; MAX_PARAMETERS]; 3];
        let mut modelled = [[[0.0_f32; MAX_WIDTH]; 2]; 3];
        let mut rows = V::each([[0.0; COLUMNS]; ROWS]);
        let rows = rows.as_mut();
        for first in (0..bins).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(alpha), like.load(&omega[first..]));
            let pushed = force
                .map(|[re, im]| Complex::new(like.load(&re[first..]), like.load(&im[first..])));
            response.evaluate(terms, s, &pushed, None);
            for axis in 0..3 {
                store(response.observed[axis], &mut modelled[axis]);
            }
            for joint in 0..terms.joints.len() {
                for dof in 0..DOF {
                    let index = 2 * DOF * joint + dof;
                    let by = response.derivatives(terms, joint, dof);
                    for (axis, [stiffness, damping]) in by.into_iter().enumerate() {
                        store(stiffness, &mut derivatives[axis][index]);
                        store(damping, &mut derivatives[axis][index + DOF]);
                    }
                }
            }
            let lanes = V::WIDTH.min(bins - first);
            for (lane, rows) in rows[..lanes].iter_mut().enumerate() {
                let bin = first + lane;
                for axis in 0..3 {
                    let residual = Residual {
                        measured: complex(acceleration[axis].map(|part| part[bin])),
                        modelled: complex(modelled[axis].map(|part| part[lane])),
                        relative: self.relative,
                        noise: self.noise.at(axis, bin),
                    };
                    let rows = &mut rows[2 * axis..2 * axis + 2];
                    residual.write(rows, sought, |index| {
                        complex(derivatives[axis][index].map(|part| part[lane]))
                    });
                }
            }
            normal.add_all(level, rows[..lanes].as_flattened());
        }
    }
}

/// Residual A − Â along one axis, and the parts of its variance.
struct Residual {
    /// Measured acceleration A.
    measured: Complex<f64>,
    /// Modelled acceleration Â.
    modelled: Complex<f64>,
    /// η².
    relative: f64,
    /// σ_A².
    noise: f64,
}

impl Residual {
    /// Writes one row for the real part and one for the imaginary part. `derivative` is the derivative of Â by the logarithm
    /// of a parameter. Both rows are zero if the variance is not positive and finite, as for spectra of zero.
    #[inline(always)]
    fn write(
        &self,
        rows: &mut [[f64; COLUMNS]],
        sought: &Sought,
        derivative: impl Fn(usize) -> Complex<f64>,
    ) {
        for row in rows.iter_mut() {
            row[..=sought.unknowns()].fill(0.0);
        }
        let Self { measured, modelled, relative, noise } = *self;
        let variance = relative * (measured.square() + modelled.square()) + noise;
        if !(variance > 0.0 && variance.is_finite()) {
            return;
        }
        let factor = 1.0 / libm::sqrt(variance);
        let residual = (measured - modelled).scale(factor);
        for (index, unknown) in sought.parameters() {
            let derivative = derivative(index);
            // The variance grows with the model.
            let along = modelled.re * derivative.re + modelled.im * derivative.im;
            let growth = relative * along / variance;
            rows[0][unknown] += factor * derivative.re + residual.re * growth;
            rows[1][unknown] += factor * derivative.im + residual.im * growth;
        }
        rows[0][sought.unknowns()] = residual.re;
        rows[1][sought.unknowns()] = residual.im;
    }
}

fn complex([re, im]: [f32; 2]) -> Complex<f64> {
    Complex { re: re.into(), im: im.into() }
}

#[inline(always)]
fn store<V: Lanes<Scalar = f32>>(value: Complex<V>, to: &mut [[f32; MAX_WIDTH]; 2]) {
    value.re.store(&mut to[0]);
    value.im.store(&mut to[1]);
}
