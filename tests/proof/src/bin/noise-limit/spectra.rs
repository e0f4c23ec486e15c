//! The true motion, frequency by frequency.

use std::ops::Range;

use anyhow::Result;
use nalgebra::{Complex, DMatrix, DVector, MatrixXx3, Vector3};
use realfft::RealFftPlanner;

use crate::linear::Motion;

/// The true robot at a frequency.
pub(crate) struct Bin {
    /// iω, 1/s.
    pub(crate) s: Complex<f64>,
    /// Force at the TCP, along its axes.
    pub(crate) force: Vector3<Complex<f64>>,
    /// Reading of the accelerometer.
    pub(crate) reading: Vector3<Complex<f64>>,
    /// Rate of that reading, times the time from the start of the window.
    pub(crate) rate_by_time: Vector3<Complex<f64>>,
    /// Elongation of each degree of freedom.
    pub(crate) elongation: DVector<Complex<f64>>,
    /// Reading per unit load on each degree of freedom, 3×N.
    pub(crate) per_load: DMatrix<Complex<f64>>,
    /// Reading per unit force.
    pub(crate) accelerance: MatrixXx3<Complex<f64>>,
}

/// Discrete Fourier transforms of a motion in the window.
pub(crate) struct Spectra {
    force: Vec<Vec<Complex<f64>>>,
    reading: Vec<Vec<Complex<f64>>>,
    rate_by_time: Vec<Vec<Complex<f64>>>,
    elongation: Vec<Vec<Complex<f64>>>,
}

impl Spectra {
    pub(crate) fn new(motion: &Motion, window: Range<usize>) -> Result<Self> {
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(window.len());
        let spectrum = |mut series: Vec<f64>| {
            let mut spectrum = transform.make_output_vec();
            transform.process(&mut series, &mut spectrum)?;
            Ok(spectrum)
        };
        let axes = |signal: &[Vector3<f64>]| -> Result<Vec<_>> {
            let along = |axis: usize| signal[window.clone()].iter().map(|v| v[axis]).collect();
            (0..3).map(|axis| spectrum(along(axis))).collect()
        };
        // The period of a sample cancels.
        let rate_by_time = |axis: usize| {
            let at = |n: isize| {
                let last = window.len() as isize - 1;
                motion.acceleration[window.start + n.clamp(0, last) as usize][axis]
            };
            // Central differences of sixth order: exact to 1e-3 up to 200 Hz.
            let weights = [(1, 0.75), (2, -0.15), (3, 1.0 / 60.0)];
            let rate = |n: usize| -> f64 {
                let n = n as isize;
                weights.iter().map(|(apart, weight)| weight * (at(n + apart) - at(n - apart))).sum()
            };
            spectrum((0..window.len()).map(|n| n as f64 * rate(n)).collect())
        };
        let elongation = motion.elongation.iter().map(|one| spectrum(one[window.clone()].to_vec()));
        Ok(Self {
            force: axes(&motion.force)?,
            reading: axes(&motion.acceleration)?,
            rate_by_time: (0..3).map(rate_by_time).collect::<Result<_>>()?,
            elongation: elongation.collect::<Result<_>>()?,
        })
    }

    /// The robot at bin number `bin`, of frequency s.
    pub(crate) fn at(
        &self,
        bin: usize,
        s: Complex<f64>,
        per_load: DMatrix<Complex<f64>>,
        accelerance: MatrixXx3<Complex<f64>>,
    ) -> Bin {
        let each = |series: &[Vec<Complex<f64>>], index: usize| series[index][bin];
        Bin {
            s,
            force: Vector3::from_fn(|axis, _| each(&self.force, axis)),
            reading: Vector3::from_fn(|axis, _| each(&self.reading, axis)),
            rate_by_time: Vector3::from_fn(|axis, _| each(&self.rate_by_time, axis)),
            elongation: DVector::from_fn(self.elongation.len(), |dof, _| {
                each(&self.elongation, dof)
            }),
            per_load,
            accelerance,
        }
    }
}
