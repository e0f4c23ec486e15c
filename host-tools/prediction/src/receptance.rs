//! The receptance along the band: what the tool is displaced per force there, with bands of 95 %.

use std::f64::consts::TAU;

use nalgebra::{Complex, DVector};
use serde::Serialize;

use crate::dynamics::{Dynamics, Place};
use crate::estimate::{Estimate, PositiveEstimate};

/// Receptance at one frequency. Rows are displacements, columns forces, along the axes of the tool centre point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReceptancePoint {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Magnitude, m/N.
    pub magnitude: [[PositiveEstimate; 3]; 3],
    /// Phase, rad, from −π to π.
    pub phase: [[Estimate; 3]; 3],
}

impl Dynamics<'_> {
    /// The receptance at a frequency above 0, Hz. `None` where the robot has no response.
    pub fn receptance(&self, frequency_hz: f64) -> Option<ReceptancePoint> {
        let place = Place::At(Complex::new(0.0, TAU * frequency_hz));
        let response = self.response(place, 3)?;
        let gradient = self.gradient(place, &response);
        let robot = self.robot();
        let of = |row: usize, column: usize| {
            let value = response.value[(row, column)];
            // ∂ ln H: its real part is that of the logarithm of the magnitude, its imaginary part that of the phase.
            let relative: Vec<Complex<f64>> =
                gradient.iter().map(|own| own[(row, column)] / value).collect();
            let std = |part: fn(&Complex<f64>) -> f64| {
                robot.std_of(&DVector::from_iterator(relative.len(), relative.iter().map(part)))
            };
            let magnitude = PositiveEstimate::new(value.norm(), std(|own| own.re));
            (magnitude, Estimate::new(value.arg(), std(|own| own.im)))
        };
        let all: [[_; 3]; 3] =
            std::array::from_fn(|row| std::array::from_fn(|column| of(row, column)));
        Some(ReceptancePoint {
            frequency_hz,
            magnitude: all.map(|row| row.map(|(magnitude, _)| magnitude)),
            phase: all.map(|row| row.map(|(_, phase)| phase)),
        })
    }

    /// The receptance at a frequency, Hz, without its band: complex, m/N. `None` where the robot has no response.
    pub fn receptance_value(&self, frequency_hz: f64) -> Option<[[Complex<f64>; 3]; 3]> {
        let place = Place::At(Complex::new(0.0, TAU * frequency_hz));
        let value = self.response(place, 3)?.value;
        Some(std::array::from_fn(|row| std::array::from_fn(|column| value[(row, column)])))
    }
}

/// `count` frequencies from the lower to the upper edge, Hz, equally far apart.
pub fn grid([lower, upper]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let step = (upper - lower) / (count.max(2) - 1) as f64;
    (0..count).map(move |index| lower + step * index as f64)
}
