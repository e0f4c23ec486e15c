//! Steps of a spectrum: pieces of constant density, as many as the data demand.
//!
//! The partition by repeated halving that costs least is taken:
//!
//! ```text
//! Σ over pieces of  n (ln m + 1) + STEP        n values, of mean m
//! ```
//!
//! The first part is Whittle's negative log-likelihood. White noise of a given level, known from more samples, has no second part.
//! Other levels replace it only for a gain of [`COLOUR`].

use heapless::Vec;

use super::periodogram::{MAX_ORDINATES, Periodogram};
use crate::noise::{Level, MAX_LEVELS};

/// Least gain of coloured noise on white noise. Twice the gain of a step that does not exist is χ² of one degree of freedom. It is
/// beyond 20 once in 100,000, and there are some hundred places for a step.
const COLOUR: f32 = 10.0;
/// Least gain of another piece once the noise is not white. A step that does not exist costs some precision. A step that is
/// overlooked at the corner of a filter biases the whole band.
const STEP: f32 = 4.0;
/// Ordinates of the shortest piece, about the width of the window's main lobe.
const SHORTEST: usize = 4;

/// Sum of the ordinates that count, and their number.
#[derive(Clone, Copy, Default)]
struct Sum {
    power: f32,
    count: f32,
}

impl Sum {
    fn of(cells: &[Self]) -> Self {
        cells.iter().fold(Self::default(), |sum, cell| Self {
            power: sum.power + cell.power,
            count: sum.count + cell.count,
        })
    }

    fn mean(self) -> f32 {
        (self.power / self.count.max(1.0)).max(f32::MIN_POSITIVE)
    }

    /// Cost of a level that is fitted to the sum.
    fn cost(self, freedom: f32) -> f32 {
        freedom * self.count * (libm::logf(self.mean()) + 1.0)
    }

    /// Cost of a level that is known.
    fn cost_at(self, level: f32, freedom: f32) -> f32 {
        let level = level.max(f32::MIN_POSITIVE);
        freedom * (self.count * libm::logf(level) + self.power / level)
    }
}

/// Levels of the density of a periodogram, in its unit, without the ordinates that are left out; empty if it is white of variance
/// `white`.
pub(super) fn levels(
    periodogram: &Periodogram,
    left_out: &[bool; MAX_ORDINATES],
    white: f32,
) -> Vec<Level, MAX_LEVELS> {
    const CELLS: usize = MAX_ORDINATES / SHORTEST;
    let cells: Vec<Sum, CELLS> = periodogram
        .power
        .chunks(SHORTEST)
        .zip(left_out.chunks(SHORTEST))
        .map(|(power, left_out)| {
            let counted = power.iter().zip(left_out).filter(|(_, left_out)| !**left_out);
            counted.fold(Sum::default(), |sum, (power, _)| Sum {
                power: sum.power + power,
                count: sum.count + 1.0,
            })
        })
        .collect();
    let freedom = periodogram.freedom;
    let mut penalty = STEP;
    loop {
        let mut pieces = Vec::<usize, CELLS>::new();
        let cost = halve(&cells, 0, freedom, penalty, &mut pieces);
        if Sum::of(&cells).cost_at(white, freedom) <= cost + COLOUR {
            return Vec::new();
        }
        if pieces.len() <= MAX_LEVELS {
            return densities(&cells, &pieces);
        }
        penalty *= 2.0;
    }
}

/// Least cost of some cells; the ends of their pieces are appended to `ends`.
fn halve<const C: usize>(
    cells: &[Sum],
    first: usize,
    freedom: f32,
    penalty: f32,
    ends: &mut Vec<usize, C>,
) -> f32 {
    let sum = Sum::of(cells);
    let whole = sum.cost(freedom) + if sum.count > 0.0 { penalty } else { 0.0 };
    let before = ends.len();
    if cells.len() > 1 {
        let (low, high) = cells.split_at(cells.len() / 2);
        let halves = halve(low, first, freedom, penalty, ends)
            + halve(high, first + low.len(), freedom, penalty, ends);
        if halves < whole {
            return halves;
        }
        ends.truncate(before);
    }
    let _ = ends.push(first + cells.len());
    whole
}

/// Mean of every piece. A piece that has no ordinate left goes to the piece above it.
fn densities(cells: &[Sum], ends: &[usize]) -> Vec<Level, MAX_LEVELS> {
    let mut levels: Vec<Level, MAX_LEVELS> = Vec::new();
    let mut start = 0;
    for &end in ends {
        let sum = Sum::of(&cells[start..end]);
        start = end;
        if sum.count > 0.0 {
            let end = 0.5 * end as f32 / cells.len() as f32;
            let _ = levels.push(Level { end, density: sum.mean() });
        }
    }
    if let Some(last) = levels.last_mut() {
        last.end = 0.5;
    }
    levels
}
