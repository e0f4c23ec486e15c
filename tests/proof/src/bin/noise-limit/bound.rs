//! The Cramér-Rao bound of a record whose state at its ends is unknown, by the dense model and the true motion.
//!
//! To first order, a change of stiffness k_i acts on its degree of freedom like the load −δk_i q_i(t), with the true
//! elongation q_i. A change of damping acts like −δd_i q̇_i(t). The ends of a record add to its spectrum the response
//! to unknown impulses and steps on every degree of freedom, and a jump of the reading. These are projected out.

use std::f64::consts::TAU;
use std::ops::Range;

use anyhow::{Context, Result};
use flexid_core::chain::Chain;
use flexid_core::parameters::Bushing;
use flexid_simulation::experiment::Cut;
use nalgebra::{Complex, DMatrix, DVector, Matrix3x6, Vector3};

use crate::linear::{Equation, Motion};
use crate::spectra::{Bin, Spectra};
use crate::study::Study;

/// Ridge on the normalised columns of the ends, since some of them hardly differ in the band.
const RIDGE: f64 = 1e-12;

/// Derivative of the reading that the force predicts, by a further unknown.
pub(crate) type Column = Box<dyn Fn(&Bin) -> Vector3<Complex<f64>>>;

/// Fisher information of the logarithms of the parameters: joint by joint, six stiffnesses, then six dampings.
pub(crate) fn information(
    study: &Study,
    chain: &Chain,
    bushings: &[Bushing],
    cut: &Cut,
    motion: &Motion,
    window: Range<usize>,
) -> Result<DMatrix<f64>> {
    let record = Milled { study, chain, bushings, cut, motion };
    record.information(window, &[])
}

/// A cut by the true robot.
#[derive(Clone, Copy)]
pub(crate) struct Milled<'a> {
    pub(crate) study: &'a Study,
    pub(crate) chain: &'a Chain,
    pub(crate) bushings: &'a [Bushing],
    pub(crate) cut: &'a Cut,
    pub(crate) motion: &'a Motion,
}

impl Milled<'_> {
    /// Fisher information that the samples of a window have of the logarithms of the parameters and of `further` unknowns.
    pub(crate) fn information(
        &self,
        window: Range<usize>,
        further: &[Column],
    ) -> Result<DMatrix<f64>> {
        let Self { study, chain, bushings, cut, motion } = *self;
        let sampling = &study.scenario.measurement;
        let equation = Equation::new(chain, bushings, cut);
        let (n, samples) = (equation.size(), window.len());
        let spectra = Spectra::new(motion, window)?;
        let hz_per_bin = cut.rate_hz / samples as f64;
        let [first, last] = study.measurement.band_hz.map(|edge| edge / hz_per_bin);
        let bins: Vec<usize> = (first.ceil() as usize..=last.floor() as usize).collect();
        let ends = 2 * n + 6;
        let sought = 2 * n + further.len();
        let mut rows = DMatrix::zeros(6 * bins.len(), ends + sought);
        // Variance of the real and of the imaginary part, each.
        let variance = |deviation: f64| 0.5 * samples as f64 * deviation * deviation;
        let force_variance = variance(sampling.force_noise());
        let acceleration_variance = variance(sampling.acceleration_noise());
        let loads = {
            let mut loads = DMatrix::zeros(n, 6);
            loads.columns_mut(0, 3).copy_from(&equation.tip.transpose());
            loads.columns_mut(3, 3).copy_from(&equation.tilt.transpose());
            loads.map(Complex::from)
        };
        for (index, &bin) in bins.iter().enumerate() {
            let omega = TAU * hz_per_bin * bin as f64;
            let s = Complex::new(0.0, omega);
            let dynamic = equation.mass.map(Complex::from) * (s * s)
                + equation.damping.map(|d| s * d)
                + equation.stiffness.map(Complex::from);
            let moved = dynamic.lu().solve(&loads).context("a pole on the axis")?;
            let per_load = (moved.columns(0, 3) * (s * s) + moved.columns(3, 3)).transpose();
            let accelerance = &per_load * equation.tip.transpose().map(Complex::from);
            let covariance = &accelerance * accelerance.adjoint() * Complex::from(force_variance)
                + DMatrix::identity(3, 3) * Complex::from(acceleration_variance);
            let factor = covariance.cholesky().context("noise without a covariance")?.unpack();
            let at = spectra.at(bin, s, per_load, accelerance);
            let mut columns = DMatrix::<Complex<f64>>::zeros(3, ends + sought);
            for dof in 0..n {
                let load = at.per_load.column(dof);
                let place = 12 * (dof / 6) + dof % 6;
                let (k, d) =
                    (bushings[dof / 6].stiffness[dof % 6], bushings[dof / 6].damping[dof % 6]);
                let q = at.elongation[dof];
                columns.set_column(dof, &load);
                columns.set_column(n + dof, &(load / (s / TAU)));
                columns.set_column(ends + place, &(load * (q * -k)));
                columns.set_column(ends + place + 6, &(load * (q * s * -d)));
            }
            let jump = Matrix3x6::from_fn(|axis, column| match column {
                c if c == axis => Complex::from(1.0),
                c if c == axis + 3 => s,
                _ => Complex::from(0.0),
            });
            columns.columns_mut(2 * n, 6).copy_from(&jump);
            for (index, column) in further.iter().enumerate() {
                columns.set_column(ends + 2 * n + index, &column(&at));
            }
            factor.solve_lower_triangular_mut(&mut columns);
            for axis in 0..3 {
                for (column, value) in columns.row(axis).iter().enumerate() {
                    rows[(6 * index + 2 * axis, column)] = value.re;
                    rows[(6 * index + 2 * axis + 1, column)] = value.im;
                }
            }
        }
        project_out(&rows, ends)
    }
}

/// `NᵀN` of the columns from `ends` on, less what the columns before them explain.
fn project_out(rows: &DMatrix<f64>, ends: usize) -> Result<DMatrix<f64>> {
    let mut own = rows.columns(0, ends).into_owned();
    for mut column in own.column_iter_mut() {
        let length = column.norm();
        column /= length;
    }
    let sought = rows.columns(ends, rows.ncols() - ends);
    let cross = own.tr_mul(&sought);
    let explained = own.tr_mul(&own) + DMatrix::identity(ends, ends) * RIDGE;
    let factor = explained.cholesky().context("the ends of a record cannot be distinguished")?;
    Ok(sought.tr_mul(&sought) - cross.tr_mul(&factor.solve(&cross)))
}

/// Covariance of the logarithms.
pub(crate) fn covariance(information: &DMatrix<f64>) -> Result<DMatrix<f64>> {
    let scale = information.diagonal().map(|entry| 1.0 / entry.sqrt());
    let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
        information[(i, j)] * scale[i] * scale[j]
    });
    let inverse = scaled.cholesky().context("a parameter that nothing determines")?.inverse();
    Ok(DMatrix::from_fn(scale.len(), scale.len(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

/// Standard deviations of the logarithms.
pub(crate) fn deviations(information: &DMatrix<f64>) -> Result<Vec<f64>> {
    Ok(covariance(information)?.diagonal().iter().map(|variance| variance.sqrt()).collect())
}

/// Length of `errors` of the logarithms by `information`. The noise at the bound gives a mean square of 1.
pub(crate) fn distance(information: &DMatrix<f64>, errors: &[f64]) -> f64 {
    let errors = DVector::from_column_slice(errors);
    (errors.dot(&(information * &errors)) / errors.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use flexid_simulation::force::OVERSAMPLING;

    use super::*;
    use crate::common::Dense;
    use crate::linear::motion;

    type Spectrum = Vec<Vector3<Complex<f64>>>;

    /// A window in mid-milling, as short as two hundred bins and the ends allow.
    const WINDOW: Range<usize> = 1000..3048;
    /// Step of a logarithm, for differences.
    const STEP: f64 = 1e-4;

    /// The test compares with the motion itself: differences of the simulated reading by each parameter. Further
    /// unknowns of the same least-squares problem are the free motion from every state at the start of the window,
    /// and each axis's jump.
    #[test]
    fn equals_that_of_differences_of_the_motion() {
        let study = Study::load().unwrap();
        let mut cut = study.unseen(1).swap_remove(0);
        cut.force.truncate(WINDOW.end * OVERSAMPLING);
        let truth = study.robot(0);
        let bins: Vec<usize> = (0..WINDOW.len() / 2)
            .filter(|bin| {
                let hz = *bin as f64 * cut.rate_hz / WINDOW.len() as f64;
                (study.measurement.band_hz[0]..=study.measurement.band_hz[1]).contains(&hz)
            })
            .collect();
        let omega = |bin: usize| TAU * cut.rate_hz / WINDOW.len() as f64 * bin as f64;
        let moved = |index: usize, by: f64| {
            let mut bushings = truth.clone();
            let joint = &mut bushings[index / 12];
            let value = match index % 12 {
                dof @ 0..6 => &mut joint.stiffness[dof],
                dof => &mut joint.damping[dof - 6],
            };
            *value *= by.exp();
            motion(&study.chain, &bushings, &cut).acceleration
        };
        let parameters = 12 * truth.len();
        let mut columns: Vec<Spectrum> = (0..parameters)
            .map(|index| {
                let (up, down) = (moved(index, STEP), moved(index, -STEP));
                let slope = |n: usize| (up[n] - down[n]) / (2.0 * STEP);
                transform(&WINDOW.map(slope).collect::<Vec<_>>(), &bins)
            })
            .collect();
        let equation = Equation::new(&study.chain, &truth, &cut);
        columns.extend(free(&equation, &cut).iter().map(|series| transform(series, &bins)));
        for axis in 0..3 {
            let along = |value| Vector3::ith(axis, value);
            columns.push(bins.iter().map(|_| along(Complex::from(1.0))).collect());
            columns.push(bins.iter().map(|bin| along(Complex::new(0.0, omega(*bin)))).collect());
        }

        let sampling = &study.scenario.measurement;
        let dense = Dense::new(&study.chain, &cut.pose, cut.gravity, &[[0.0; 6]; 3]);
        // The inverse of the noise's covariance, for each bin. White noise has in every bin the variance of all
        // samples together.
        let weights: Vec<_> = bins
            .iter()
            .map(|bin| {
                let s = Complex::new(0.0, omega(*bin));
                let accelerance = dense.receptance(&truth, s) * (s * s);
                let force = sampling.force_noise().powi(2);
                let noise = &accelerance * accelerance.adjoint() * Complex::from(force)
                    + DMatrix::identity(3, 3)
                        * Complex::from(sampling.acceleration_noise().powi(2));
                (noise * Complex::from(WINDOW.len() as f64)).try_inverse().unwrap()
            })
            .collect();
        // Both parts of a complex number carry information, and each has half of its variance.
        let product = |a: &Spectrum, b: &Spectrum| {
            let bins = a.iter().zip(&weights).zip(b);
            2.0 * bins.map(|((a, weight), b)| (a.adjoint() * weight * b)[0].re).sum::<f64>()
        };
        let gram = DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            product(&columns[i], &columns[j])
        });
        let scale = gram.diagonal().map(|entry| 1.0 / entry.sqrt());
        let scaled = DMatrix::from_diagonal(&scale) * gram * DMatrix::from_diagonal(&scale);
        let inverse = scaled.cholesky().unwrap().inverse();
        let motion = motion(&study.chain, &truth, &cut);
        let gathered = information(&study, &study.chain, &truth, &cut, &motion, WINDOW).unwrap();
        for (index, deviation) in deviations(&gathered).unwrap().into_iter().enumerate() {
            let ours = scale[index] * inverse[(index, index)].sqrt();
            assert!((deviation / ours - 1.0).abs() < 1e-3, "{index}: {deviation:e}, not {ours:e}");
        }
    }

    /// Readings of the free robot from the start of the window, for each elongation and velocity.
    fn free(equation: &Equation, cut: &Cut) -> Vec<Vec<Vector3<f64>>> {
        let n = equation.size();
        let per_mass = equation.mass.clone().lu();
        let mut state_matrix = DMatrix::zeros(2 * n, 2 * n);
        state_matrix.view_mut((0, n), (n, n)).fill_with_identity();
        let pull = -per_mass.solve(&equation.stiffness).unwrap();
        let drag = -per_mass.solve(&equation.damping).unwrap();
        state_matrix.view_mut((n, 0), (n, n)).copy_from(&pull);
        state_matrix.view_mut((n, n), (n, n)).copy_from(&drag);
        let read = &equation.tip * state_matrix.rows(n, n);
        let step = (state_matrix / cut.rate_hz).exp();
        let mut states = DMatrix::identity(2 * n, 2 * n);
        let mut series = vec![Vec::new(); 2 * n];
        for _ in WINDOW {
            for (readings, reading) in series.iter_mut().zip((&read * &states).column_iter()) {
                readings.push(reading.into_owned());
            }
            states = &step * states;
        }
        series
    }

    /// The discrete Fourier transform by its definition.
    fn transform(series: &[Vector3<f64>], bins: &[usize]) -> Spectrum {
        let turn = |k| Complex::from_polar(1.0, -TAU * k as f64 / series.len() as f64);
        let turns: Vec<_> = (0..series.len()).map(turn).collect();
        let at = |&bin: &usize| {
            let each = series.iter().enumerate();
            each.map(|(n, value)| value.map(Complex::from) * turns[n * bin % turns.len()]).sum()
        };
        bins.iter().map(at).collect()
    }
}
