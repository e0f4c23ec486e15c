//! The Cramér-Rao bound of a record whose state at its ends is unknown, by the dense model and the true motion.
//!
//! To first order, a change of stiffness k_i acts on its degree of freedom like the load −δk_i q_i(t), with the true
//! elongation q_i; a change of damping like −δd_i q̇_i(t). Over one record, what the ends do to a spectrum is the
//! response to unknown impulses and steps on every degree of freedom, and a jump of the reading: these are
//! projected out.

use std::f64::consts::TAU;
use std::ops::Range;

use anyhow::{Context, Result};
use flexid::simulation::experiment::Cut;
use flexid_core::chain::Chain;
use flexid_core::parameters::Bushing;
use nalgebra::{Complex, DMatrix, DVector, Matrix3x6};
use realfft::RealFftPlanner;

use crate::linear::{Equation, Motion};
use crate::study::Study;

/// What the ends may do costs this part of what it explains: some of it hardly differs in the band.
const RIDGE: f64 = 1e-12;

/// Fisher information of the logarithms of the parameters: joint by joint, six stiffnesses, then six dampings.
pub(crate) fn information(
    study: &Study,
    chain: &Chain,
    bushings: &[Bushing],
    cut: &Cut,
    motion: &Motion,
    window: Range<usize>,
) -> Result<DMatrix<f64>> {
    let sampling = &study.scenario.measurement;
    let equation = Equation::new(chain, bushings, cut);
    let (n, samples) = (equation.size(), window.len());
    let elongation = spectra(motion, window)?;
    let hz_per_bin = cut.rate_hz / samples as f64;
    let [first, last] = study.measurement.band_hz.map(|edge| edge / hz_per_bin);
    let bins: Vec<usize> = (first.ceil() as usize..=last.floor() as usize).collect();
    let ends = 2 * n + 6;
    let mut rows = DMatrix::zeros(6 * bins.len(), ends + 2 * n);
    // Of real and imaginary part each.
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
        // Reading per unit load on each degree of freedom, 3×N.
        let per_load = (moved.columns(0, 3) * (s * s) + moved.columns(3, 3)).transpose();
        let accelerance = &per_load * equation.tip.transpose().map(Complex::from);
        let covariance = &accelerance * accelerance.adjoint() * Complex::from(force_variance)
            + DMatrix::identity(3, 3) * Complex::from(acceleration_variance);
        let factor = covariance.cholesky().context("noise without a covariance")?.unpack();
        let mut columns = DMatrix::<Complex<f64>>::zeros(3, ends + 2 * n);
        for dof in 0..n {
            let load = per_load.column(dof);
            let place = 12 * (dof / 6) + dof % 6;
            let (k, d) = (bushings[dof / 6].stiffness[dof % 6], bushings[dof / 6].damping[dof % 6]);
            let q = elongation[dof][bin];
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

/// `NᵀN` of the columns from `ends` on, what the columns before them explain taken out.
fn project_out(rows: &DMatrix<f64>, ends: usize) -> Result<DMatrix<f64>> {
    let mut own = rows.columns(0, ends).into_owned();
    for mut column in own.column_iter_mut() {
        let length = column.norm();
        column /= length;
    }
    let sought = rows.columns(ends, rows.ncols() - ends);
    let cross = own.tr_mul(&sought);
    let explained = own.tr_mul(&own) + DMatrix::identity(ends, ends) * RIDGE;
    let factor = explained.cholesky().context("the ends of a record cannot be told apart")?;
    Ok(sought.tr_mul(&sought) - cross.tr_mul(&factor.solve(&cross)))
}

/// Covariance of the logarithms.
pub(crate) fn covariance(information: &DMatrix<f64>) -> Result<DMatrix<f64>> {
    let scale = information.diagonal().map(|entry| 1.0 / entry.sqrt());
    let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
        information[(i, j)] * scale[i] * scale[j]
    });
    let inverse = scaled.cholesky().context("a parameter that nothing tells of")?.inverse();
    Ok(DMatrix::from_fn(scale.len(), scale.len(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

/// Standard deviations of the logarithms.
pub(crate) fn deviations(information: &DMatrix<f64>) -> Result<Vec<f64>> {
    Ok(covariance(information)?.diagonal().iter().map(|variance| variance.sqrt()).collect())
}

/// Length of `errors` of the logarithms by `information`: the noise at the bound makes its mean square 1.
pub(crate) fn distance(information: &DMatrix<f64>, errors: &[f64]) -> f64 {
    let errors = DVector::from_column_slice(errors);
    (errors.dot(&(information * &errors)) / errors.len() as f64).sqrt()
}

/// Discrete Fourier transforms of the elongations in the window: `[dof][bin]`.
fn spectra(motion: &Motion, window: Range<usize>) -> Result<Vec<Vec<Complex<f64>>>> {
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(window.len());
    let spectrum = |series: &Vec<f64>| {
        let mut spectrum = transform.make_output_vec();
        transform.process(&mut series[window.clone()].to_vec(), &mut spectrum)?;
        Ok(spectrum)
    };
    motion.elongation.iter().map(spectrum).collect()
}
