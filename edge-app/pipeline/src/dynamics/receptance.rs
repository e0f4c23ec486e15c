//! The receptance along the band: what the tool is displaced per force there, with bands of 95 %.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};
use serde::Serialize;

use super::at_pose::Dynamics;
use super::estimate::{Estimate, PositiveEstimate};
use super::modes::Mode;
use super::place::Place;

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
        // ∂ ln H, an entry after the other: its real part is that of the logarithm of the magnitude, its imaginary part that of the phase.
        let relative = DMatrix::from_fn(gradient.len(), 2 * 9, |own, column| {
            let entry = column / 2;
            let relative = gradient[own][entry] / response.value[entry];
            if column % 2 == 0 { relative.re } else { relative.im }
        });
        let stds = self.robot().stds_of(&relative);
        let of = |row: usize, column: usize| {
            let (value, entry) = (response.value[(row, column)], row + 3 * column);
            let magnitude = PositiveEstimate::new(value.norm(), stds[2 * entry]);
            // An error of one radian is as large as the number.
            (magnitude, Estimate::new(value.arg(), stds[2 * entry + 1]).beside(1.0))
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

/// Frequencies of a receptance along a band.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// So many, equally far apart. First and step have six digits, as in a universal file.
    Even(usize),
    /// Equally far apart, [`COARSE`] or as many more as show the peak of each mode to 3 %, up to [`MOST`].
    EvenlyResolved,
    /// [`COARSE`], and closer together about each mode, so that its peak shows to 1 %.
    Resolved,
}

/// Frequencies where no mode asks for more.
pub const COARSE: usize = 400;
/// Most frequencies that are equally far apart.
pub const MOST: usize = 20_000;
/// Frequencies within the half-power bandwidth of a mode. A peak between two of them is higher than either by at most
/// 1/(2 n²): 3 % and 1 %.
const EVENLY: f64 = 4.0;
const CLOSELY: i32 = 8;
/// Half-power bandwidths on each side of a mode within which its frequencies are close together. Chosen: there it has fallen to a sixth.
const REACH: i32 = 3;

impl Grid {
    /// The frequencies from the lower to the upper edge of a band, Hz, for these modes.
    pub fn frequencies(self, band_hz: [f64; 2], modes: &[Mode]) -> Vec<f64> {
        let [lower, upper] = band_hz;
        // The bandwidth where the power is half of that of the peak is 2 ζ f.
        let peaks = modes.iter().map(|mode| {
            let hz = mode.frequency_hz.value;
            (hz, 2.0 * mode.damping_ratio.value * hz)
        });
        let peaks = peaks.filter(|(hz, width)| (lower..=upper).contains(hz) && *width > 0.0);
        match self {
            Self::Even(count) => even(band_hz, count).collect(),
            Self::EvenlyResolved => {
                let narrowest = peaks.map(|(_, width)| width).fold(f64::INFINITY, f64::min);
                let count = 1.0 + (EVENLY * (upper - lower) / narrowest).ceil();
                // The conversion saturates.
                even(band_hz, (count as usize).clamp(COARSE, MOST)).collect()
            }
            Self::Resolved => {
                let about = peaks.flat_map(|(hz, width)| {
                    let steps = -REACH * CLOSELY..=REACH * CLOSELY;
                    steps.map(move |step| hz + width * f64::from(step) / f64::from(CLOSELY))
                });
                let within = about.filter(|hz| (lower..=upper).contains(hz));
                let mut all: Vec<f64> = grid(band_hz, COARSE).chain(within).collect();
                all.sort_by(f64::total_cmp);
                all.dedup();
                all
            }
        }
    }
}

/// The [`grid`] with lower edge and step rounded to six digits.
fn even([lower, upper]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let rounded = |value: f64| format!("{value:.5e}").parse().unwrap_or(value);
    let first = rounded(lower);
    let step = rounded((upper - first) / (count.max(2) - 1) as f64);
    (0..count).map(move |index| first + step * index as f64)
}

/// `count` frequencies from the lower to the upper edge, Hz, equally far apart.
pub fn grid([lower, upper]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let step = (upper - lower) / (count.max(2) - 1) as f64;
    (0..count).map(move |index| lower + step * index as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_stand_close_together_about_a_mode() {
        let mode = |hz: f64, damping: f64| Mode {
            frequency_hz: PositiveEstimate::new(hz, 0.01),
            damping_ratio: PositiveEstimate::new(damping, 0.01),
            energy: Vec::new(),
            tool: [[0.0; 2]; 6],
        };
        let band = [2.0, 200.0];
        // Bandwidths of 0.2 and 4 Hz; the third lies above the band.
        let modes = [mode(20.0, 0.005), mode(100.0, 0.02), mode(300.0, 1e-4)];
        assert_eq!(Grid::Even(5).frequencies(band, &modes), [2.0, 51.5, 101.0, 150.5, 200.0]);
        let whole: Vec<f64> = (2..=200).map(f64::from).collect();
        assert_eq!(Grid::Even(199).frequencies(band, &modes), whole);
        let resolved = Grid::Resolved.frequencies(band, &modes);
        assert_eq!(resolved.len(), COARSE + 2 * 49);
        assert!(resolved.is_sorted_by(|a, b| a < b) && resolved.contains(&20.0));
        let near = resolved.iter().filter(|hz| (19.9..20.1).contains(*hz)).count();
        assert!((8..=10).contains(&near), "{near}");
        let even = Grid::EvenlyResolved.frequencies(band, &modes);
        assert!(even[1] - even[0] <= 0.05 && even.len() == 3961, "{}", even.len());
        assert_eq!(Grid::EvenlyResolved.frequencies(band, &[]).len(), COARSE);
        assert_eq!(Grid::EvenlyResolved.frequencies(band, &[mode(20.0, 1e-7)]).len(), MOST);
    }
}
