//! A function of frequency between two degrees of freedom.

use crate::poses::Direction;

use super::unit::Unit;

/// Largest deviation of a frequency from an even grid, as a part of the spacing. Chosen: a universal file rounds spacing and first frequency to six digits,
/// which add up to 1e-2 of the spacing over 20,000 lines, and half a spacing takes a line for the next one.
const EVEN: f64 = 0.05;

/// A place and a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dof {
    /// Number of the node.
    pub(super) node: i64,
    /// Direction along an axis of the test. `None` if the file does not say.
    pub(super) direction: Option<Direction>,
}

/// What a function is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Kind {
    /// A motion per force, in the unit that the file states, or the reason why it states none.
    Response(Result<Unit, String>),
    /// An ordinary coherence, γ².
    Coherence,
}

/// A function of frequency.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Function {
    /// Place in the file, for messages.
    pub(super) place: String,
    pub(super) kind: Kind,
    pub(super) response: Dof,
    pub(super) reference: Dof,
    pub(super) grid: Grid,
    /// Real and imaginary parts. Not finite where there is no number.
    pub(super) values: Vec<[f64; 2]>,
}

/// Even frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    /// Distance of two frequencies, Hz.
    pub(super) spacing_hz: f64,
    /// The first frequency, Hz.
    pub(super) first_hz: f64,
}

impl Grid {
    /// The grid of a first frequency and a distance, Hz.
    pub(super) fn new(first_hz: f64, spacing_hz: f64) -> Result<Self, String> {
        if !(spacing_hz > 0.0 && spacing_hz.is_finite() && first_hz >= 0.0 && first_hz.is_finite())
        {
            return Err(format!(
                "its frequencies begin at {first_hz} Hz, {spacing_hz} Hz apart: must be ascending, from 0 Hz or above"
            ));
        }
        Ok(Self { spacing_hz, first_hz })
    }

    /// The grid of these frequencies, Hz.
    pub(super) fn of(frequencies: &[f64]) -> Result<Self, String> {
        let [first, .., last] = frequencies else {
            return Err("it has fewer than two frequencies: export the whole band".to_owned());
        };
        let spacing = (last - first) / (frequencies.len() - 1) as f64;
        let grid = Self::new(*first, spacing)?;
        let off = |(index, own): (usize, &f64)| {
            let is_even = (own - first - spacing * index as f64).abs() < EVEN * spacing;
            (!is_even).then_some((index, *own))
        };
        match frequencies.iter().enumerate().find_map(off) {
            None => Ok(grid),
            Some((index, own)) => Err(format!(
                "its frequencies are uneven (number {} is {own} Hz): export them at even distances",
                index + 1
            )),
        }
    }

    /// Returns whether two grids have the same frequencies, over so many bins.
    pub(super) fn is_same(&self, other: &Self, bins: usize) -> bool {
        let apart = |bin: usize| (self.hz(bin) - other.hz(bin)).abs();
        apart(0).max(apart(bins)) < EVEN * self.spacing_hz
    }

    /// Frequency of a value, Hz.
    pub(super) fn hz(&self, index: usize) -> f64 {
        self.first_hz + index as f64 * self.spacing_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_are_even() {
        assert_eq!(Grid::of(&[2.0, 2.5, 3.0]), Ok(Grid { spacing_hz: 0.5, first_hz: 2.0 }));
        for (frequencies, expected) in [
            (&[2.0][..], "it has fewer than two frequencies"),
            (&[2.0, 2.5, 3.2], "its frequencies are uneven (number 2 is 2.5 Hz): "),
            (&[3.0, 2.0], "its frequencies begin at 3 Hz, -1 Hz apart: must be ascending"),
            (&[2.0, f64::NAN, 3.0], "its frequencies are uneven (number 2 is NaN Hz)"),
        ] {
            let error = Grid::of(frequencies).unwrap_err();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
