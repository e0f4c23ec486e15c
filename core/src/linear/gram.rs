//! The Gram matrix of many rows, added to a packed triangle. It takes nearly all the work of a refinement.
//!
//! Tiles of `RᵀR` stay in registers while the rows pass, as in the matrix products of linear algebra libraries (Goto and van
//! de Geijn, "Anatomy of high-performance matrix multiplication", ACM Transactions on Mathematical Software 34, 2008).

use fearless_simd::Level;

use super::packed::packed;
use crate::receptance::lanes::{Kernel, Lanes, Precision};

/// Number of rows of a tile. With one vector of 64 bytes each, they fill 12 of AVX2's 16 registers.
const TILE: usize = 6;
/// Number of rows of R in one pass: those of eight bins. With the 154 columns of a robot of six joints they take 59 kB.
const PANEL: usize = 48;
/// Number of lanes of the widest vector.
pub(crate) const WIDEST: usize = 8;

/// Length to which rows of `columns` entries must be padded for [`add`].
pub(crate) const fn padded(columns: usize) -> usize {
    columns.next_multiple_of(TILE).next_multiple_of(WIDEST)
}

/// Adds `RᵀR` of the rows R to the lower triangle, packed by rows, of a symmetric matrix of `columns` columns. The rows are
/// [`padded`]; their entries beyond `columns` are ignored.
pub(super) fn add<const W: usize>(
    level: Level,
    triangle: &mut [f64],
    columns: usize,
    rows: &[[f64; W]],
) {
    assert!(padded(columns) <= W);
    f64::dispatch(level, Gram { triangle, columns, rows });
}

struct Gram<'a, const W: usize> {
    triangle: &'a mut [f64],
    columns: usize,
    rows: &'a [[f64; W]],
}

impl<const W: usize> Kernel<f64> for Gram<'_, W> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) {
        let Self { triangle, columns, rows } = self;
        for panel in rows.chunks(PANEL) {
            for first in (0..columns).step_by(TILE) {
                let end = (first + TILE).min(columns);
                for j in (0..end).step_by(V::WIDTH) {
                    let sums = tile(like, panel, first, j);
                    if first + TILE <= columns && j + V::WIDTH <= first + 1 {
                        add_below_diagonal(triangle, first, j, sums);
                        continue;
                    }
                    for (t, &sum) in sums.iter().enumerate() {
                        let i = first + t;
                        if i < end {
                            add_from(&mut triangle[packed(i)..packed(i + 1)], j, sum);
                        }
                    }
                }
            }
        }
    }
}

/// `Σ R[i..i + TILE] R[j..]` over the rows of a panel.
#[inline(always)]
fn tile<V: Lanes<Scalar = f64>, const W: usize>(
    like: V,
    rows: &[[f64; W]],
    i: usize,
    j: usize,
) -> [V; TILE] {
    let mut sums = [like.fill(0.0); TILE];
    for row in rows {
        let right = like.load(&row[j..j + V::WIDTH]);
        for (sum, left) in sums.iter_mut().zip(&row[i..i + TILE]) {
            *sum = like.fill(*left).mul_add(right, *sum);
        }
    }
    sums
}

/// Adds the sums of a tile of which no entry lies above the diagonal. Most tiles are such, and their sums stay in registers.
#[inline(always)]
fn add_below_diagonal<V: Lanes<Scalar = f64>>(
    triangle: &mut [f64],
    i: usize,
    j: usize,
    sums: [V; TILE],
) {
    let mut start = packed(i) + j;
    for (t, sum) in sums.into_iter().enumerate() {
        let target = &mut triangle[start..start + V::WIDTH];
        (sum.load(target) + sum).store(target);
        start += i + t + 1;
    }
}

/// Adds `sum` to a row of the triangle from column `j` on, up to the end of the row.
#[inline(always)]
fn add_from<V: Lanes<Scalar = f64>>(row: &mut [f64], j: usize, sum: V) {
    if let Some(target) = row.get_mut(j..j + V::WIDTH) {
        (sum.load(target) + sum).store(target);
    } else if let Some(target) = row.get_mut(j..) {
        let mut lanes = V::each(0.0);
        let lanes = lanes.as_mut();
        sum.store(lanes);
        target.iter_mut().zip(lanes).for_each(|(target, sum)| *target += *sum);
    }
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    const LONGEST: usize = 48;

    proptest! {
        /// The result equals the definition for any number of rows and columns, with and without vectors. Entries beyond the
        /// columns are ignored.
        #[test]
        fn every_entry_is_the_product_of_two_columns(
            values in vec(-1.0..1.0_f64, 60 * LONGEST),
            count in 0..60_usize,
            columns in 1..=LONGEST,
        ) {
            let (mut rows, _) = values.as_chunks::<LONGEST>();
            rows = &rows[..count];
            let spoilt = rows.iter().map(|row| {
                core::array::from_fn(|column| if column < columns { row[column] } else { f64::NAN })
            });
            let spoilt: std::vec::Vec<[f64; LONGEST]> = spoilt.collect();
            let mut expected = std::vec![0.5; packed(columns)];
            for i in 0..columns {
                for j in 0..=i {
                    expected[packed(i) + j] += rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
                }
            }
            for level in [Level::baseline(), Level::new()] {
                let mut triangle = std::vec![0.5; packed(columns)];
                add(level, &mut triangle, columns, &spoilt);
                for (own, expected) in triangle.iter().zip(&expected) {
                    prop_assert!((own - expected).abs() < 1e-12, "{own} for {expected}");
                }
            }
        }
    }

    #[test]
    fn padded_rows_hold_every_tile_and_vector() {
        for columns in 1..300 {
            let last_tile = (columns - 1) / TILE * TILE;
            let last_vector = (columns - 1) / WIDEST * WIDEST;
            assert!(padded(columns) >= (last_tile + TILE).max(last_vector + WIDEST));
        }
    }
}
