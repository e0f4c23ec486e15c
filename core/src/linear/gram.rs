//! The Gram matrix of many rows, added to a packed triangle. It takes nearly all the work of a refinement.
//!
//! Tiles of `RᵀR` stay in registers while the rows pass, as in the matrix products of linear algebra libraries (Goto and van
//! de Geijn, "Anatomy of high-performance matrix multiplication", ACM Transactions on Mathematical Software 34, 2008).

use fearless_simd::Level;

use super::packed::packed;
use crate::receptance::lanes::{Kernel, Lanes, Precision};

/// Number of rows of a tile of one vector a row. A vector of 64 bytes fills two of AVX2's 16 registers, and the sums twelve.
const TILE: usize = 6;
/// Number of rows, and of vectors a row, of a tile where one of 32 registers holds a vector (AVX-512). A processor adds to eight sums
/// or more at a time; measured, these sixteen take four fifths of the time of six.
const LARGE_TILE: [usize; 2] = [8, 2];
/// Number of rows of R in one pass: those of eight bins. With the 154 columns of a robot of six joints they take 59 kB.
const PANEL: usize = 48;
/// Number of lanes of the widest vector.
pub(crate) const WIDEST: usize = 8;

/// Length to which rows of `columns` entries must be padded for [`add`].
pub(crate) const fn padded(columns: usize) -> usize {
    let large = columns.next_multiple_of(LARGE_TILE[1] * WIDEST);
    let small = columns.next_multiple_of(TILE);
    if large > small { large } else { small }
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
        if V::WIDTH == WIDEST && V::REGISTERS == 1 {
            self.add_tiles::<V, { LARGE_TILE[0] }, { LARGE_TILE[1] }>(like);
        } else {
            self.add_tiles::<V, TILE, 1>(like);
        }
    }
}

impl<const W: usize> Gram<'_, W> {
    /// Adds tiles of `T` rows and `C` vectors a row.
    #[inline(always)]
    fn add_tiles<V: Lanes<Scalar = f64>, const T: usize, const C: usize>(self, like: V) {
        let Self { triangle, columns, rows } = self;
        for panel in rows.chunks(PANEL) {
            for first in (0..columns).step_by(T) {
                let end = (first + T).min(columns);
                for j in (0..end).step_by(C * V::WIDTH) {
                    let sums: [[V; C]; T] = tile(like, panel, first, j);
                    if first + T <= columns && j + C * V::WIDTH <= first + 1 {
                        add_below_diagonal(triangle, first, j, sums);
                        continue;
                    }
                    for (i, sums) in (first..end).zip(sums) {
                        let row = &mut triangle[packed(i)..packed(i + 1)];
                        for (c, sum) in sums.into_iter().enumerate() {
                            add_from(row, j + c * V::WIDTH, sum);
                        }
                    }
                }
            }
        }
    }
}

/// `Σ R[i..i + T] R[j..]` over the rows of a panel.
#[inline(always)]
fn tile<V: Lanes<Scalar = f64>, const W: usize, const T: usize, const C: usize>(
    like: V,
    rows: &[[f64; W]],
    i: usize,
    j: usize,
) -> [[V; C]; T] {
    let mut sums = [[like.fill(0.0); C]; T];
    for row in rows {
        let (left, right) = (&row[i..i + T], &row[j..j + C * V::WIDTH]);
        for c in 0..C {
            let right = like.load(&right[c * V::WIDTH..]);
            for t in 0..T {
                sums[t][c] = like.fill(left[t]).mul_add(right, sums[t][c]);
            }
        }
    }
    sums
}

/// Adds the sums of a tile of which no entry lies above the diagonal. Most tiles are such, and their sums stay in registers.
#[inline(always)]
fn add_below_diagonal<V: Lanes<Scalar = f64>, const T: usize, const C: usize>(
    triangle: &mut [f64],
    i: usize,
    j: usize,
    sums: [[V; C]; T],
) {
    let mut start = packed(i) + j;
    for (t, sums) in sums.into_iter().enumerate() {
        let target = &mut triangle[start..start + C * V::WIDTH];
        for (target, sum) in target.chunks_exact_mut(V::WIDTH).zip(sums) {
            (sum.load(target) + sum).store(target);
        }
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
            for [rows, vectors] in [[TILE, 1], LARGE_TILE] {
                let last_tile = (columns - 1) / rows * rows;
                let length = vectors * WIDEST;
                let last_vector = (columns - 1) / length * length;
                assert!(padded(columns) >= (last_tile + rows).max(last_vector + length));
            }
        }
    }
}
