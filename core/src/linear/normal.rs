//! Normal equations of a linear least-squares problem, with the right-hand side as their last row.
//!
//! Each row `[a | b]` is added to `N = Σ [a | b]ᵀ [a | b]`. Elimination of the first unknowns (a partial Cholesky
//! factorisation) leaves the Schur complement in place: the same equations with those unknowns projected out. The last corner
//! then holds the sum of squares that remains.

use fearless_simd::Level;
use heapless::Vec;

use super::gram;
use super::packed::packed;
use crate::receptance::lanes::{Kernel, Lanes, Precision};

/// Part of its diagonal below which the pivot of an unknown counts as zero: the unknown then depends on the unknowns before it.
const DEPENDENT: f64 = 1e-13;

/// `Σ aᵢ bᵢ`, in partial sums, so that the additions need not wait for each other.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const SUMS: usize = 8;
    let mut sums = [0.0; SUMS];
    let (a, a_rest) = a.as_chunks::<SUMS>();
    let (b, b_rest) = b.as_chunks::<SUMS>();
    assert!(a.len() <= b.len() && a_rest.len() <= b_rest.len());
    // Iterators over both are not inlined in functions as long as an elimination.
    for k in 0..a.len() {
        for (lane, sum) in sums.iter_mut().enumerate() {
            *sum += a[k][lane] * b[k][lane];
        }
    }
    let mut rest = 0.0;
    for k in 0..a_rest.len() {
        rest += a_rest[k] * b_rest[k];
    }
    sums.iter().sum::<f64>() + rest
}

/// Derivatives of an unknown by others: the number of each, and the derivative.
pub(crate) type Derivatives = Vec<(usize, f64), 2>;

/// Normal equations: a symmetric matrix, lower triangle packed by rows. `L` is `packed(most unknowns + 1)`.
#[derive(Clone, Debug)]
pub(crate) struct Normal<const L: usize> {
    /// Number of unknowns, plus one for the right-hand side.
    size: usize,
    entries: [f64; L],
}

impl<const L: usize> Normal<L> {
    pub(crate) const fn new() -> Self {
        Self { size: 1, entries: [0.0; L] }
    }

    /// Sets all entries to zero, for `unknowns` unknowns.
    pub(crate) fn reset(&mut self, unknowns: usize) {
        self.size = unknowns + 1;
        self.entries[..packed(self.size)].fill(0.0);
    }

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.size - 1
    }

    /// All rows, one after the other, each up to its diagonal.
    pub(crate) fn entries(&self) -> &[f64] {
        &self.entries[..packed(self.size)]
    }

    /// The [entries](Normal::entries), mutable.
    pub(crate) fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries[..packed(self.size)]
    }

    /// Row `i` up to its diagonal.
    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.entries[packed(i)..packed(i + 1)]
    }

    /// The right-hand side, and behind it the sum of squares of the residual.
    pub(crate) fn right(&self) -> &[f64] {
        self.row(self.size - 1)
    }

    /// Sum of squares of the residual.
    pub(crate) fn sum_of_squares(&self) -> f64 {
        self.entries[packed(self.size) - 1]
    }

    /// Difference between the sum of squares and its minimum. Valid before an elimination.
    pub(crate) fn excess(&self) -> f64 {
        let mut least = self.clone();
        least.eliminate(self.unknowns());
        self.sum_of_squares() - least.sum_of_squares()
    }

    /// Adds six rows, each as long as the unknowns and the right-hand side.
    #[inline(always)]
    pub(crate) fn add<const W: usize>(&mut self, rows: &[[f64; W]; 6]) {
        for i in 0..self.size {
            let [a, b, c, d, e, f] = rows.each_ref().map(|row| &row[..=i]);
            let (ai, bi, ci, di, ei, fi) = (a[i], b[i], c[i], d[i], e[i], f[i]);
            let target = &mut self.entries[packed(i)..packed(i + 1)];
            for (j, target) in target.iter_mut().enumerate() {
                *target += ai * a[j] + bi * b[j] + ci * c[j] + di * d[j] + ei * e[j] + fi * f[j];
            }
        }
    }

    /// Adds many rows, each as long as the unknowns and the right-hand side, and [padded](gram::padded).
    pub(crate) fn add_all<const W: usize>(&mut self, level: Level, rows: &[[f64; W]]) {
        gram::add(level, &mut self.entries[..packed(self.size)], self.size, rows);
    }

    /// Adds a cost that prefers small values of the first unknowns; the equations seek the changes of these values from
    /// `standing`. The square of each value costs `part` of the unknown's diagonal.
    pub(crate) fn prefer_small(&mut self, standing: &[f64], part: f64) {
        let right = packed(self.size - 1);
        for (k, value) in standing.iter().enumerate() {
            let cost = part * self.entries[packed(k + 1) - 1];
            self.entries[packed(k + 1) - 1] += cost;
            self.entries[right + k] -= cost * value;
            self.entries[packed(self.size) - 1] += cost * value * value;
        }
    }

    /// Eliminates the first `count` unknowns. Their rows and columns then hold the factor, and the rest holds the Schur
    /// complement. An unknown that the equations do not determine stays at zero.
    pub(crate) fn eliminate(&mut self, count: usize) {
        self.eliminate_with(Level::baseline(), count);
    }

    /// [`Normal::eliminate`] with these instructions.
    pub(crate) fn eliminate_with(&mut self, level: Level, count: usize) {
        let Self { size, entries } = self;
        f64::dispatch(level, Elimination { size: *size, entries, count });
    }

    /// Eliminates unknown `k` alone: its row and column are zero then. Valid before an elimination.
    pub(crate) fn eliminate_one(&mut self, k: usize) {
        let at = |i: usize| if i > k { packed(i) + k } else { packed(k) + i };
        let pivot = self.entries[at(k)];
        for i in (0..self.size).filter(|i| *i != k && pivot > 0.0) {
            let factor = self.entries[at(i)] / pivot;
            for j in (0..=i).filter(|j| *j != k) {
                self.entries[packed(i) + j] -= factor * self.entries[at(j)];
            }
        }
        for i in 0..self.size {
            self.entries[at(i)] = 0.0;
        }
    }

    /// Lets unknown `k` differ by an error of this variance from what the others know it as. Valid before an elimination.
    pub(crate) fn loosen(&mut self, k: usize, variance: f64) {
        let at = |i: usize| if i > k { packed(i) + k } else { packed(k) + i };
        let own = self.entries[at(k)];
        let pivot = own + 1.0 / variance;
        for i in (0..self.size).filter(|i| *i != k) {
            let factor = self.entries[at(i)] / pivot;
            for j in (0..=i).filter(|j| *j != k) {
                self.entries[packed(i) + j] -= factor * self.entries[at(j)];
            }
        }
        // Those of k, which the others have needed.
        for i in 0..self.size {
            self.entries[at(i)] *= 1.0 - own / pivot;
        }
    }

    /// Values of the first `count` unknowns after [`Normal::eliminate`] of these, with the later unknowns at zero.
    pub(crate) fn substitute(&self, count: usize, solution: &mut [f64]) {
        self.substitute_at(count, &[], solution);
    }

    /// [`Normal::substitute`] with the later unknowns at `later`.
    pub(crate) fn substitute_at(&self, count: usize, later: &[f64], solution: &mut [f64]) {
        let right = packed(self.size - 1);
        for k in (0..count).rev() {
            let mut sum = self.entries[right + k];
            for (i, value) in later.iter().enumerate() {
                sum -= self.entries[packed(count + i) + k] * value;
            }
            for i in k + 1..count {
                sum -= self.entries[packed(i) + k] * solution[i];
            }
            let pivot = self.entries[packed(k + 1) - 1];
            solution[k] = if pivot > 0.0 { sum / pivot } else { 0.0 };
        }
    }

    /// Values for another right-hand side, which takes the place of the present one, after [`Normal::eliminate`] of all unknowns.
    pub(crate) fn solve(&mut self, right: impl Fn(usize) -> f64, solution: &mut [f64]) {
        let (rows, own) = self.entries.split_at_mut(packed(self.size - 1));
        for i in 0..self.size - 1 {
            let (known, pivot) = (&rows[packed(i)..packed(i) + i], rows[packed(i) + i]);
            let known = dot(known, &own[..i]);
            own[i] = if pivot > 0.0 { (right(i) - known) / pivot } else { 0.0 };
        }
        self.substitute(self.unknowns(), solution);
    }

    /// Adds the Schur complement of another problem, whose first `eliminated` unknowns have been eliminated.
    pub(crate) fn add_complement<const M: usize>(&mut self, other: &Normal<M>, eliminated: usize) {
        self.take_complement(other, eliminated, 1.0);
    }

    /// Subtracts a complement that [`Normal::add_complement`] has added.
    pub(crate) fn subtract_complement<const M: usize>(
        &mut self,
        other: &Normal<M>,
        eliminated: usize,
    ) {
        self.take_complement(other, eliminated, -1.0);
    }

    fn take_complement<const M: usize>(&mut self, other: &Normal<M>, eliminated: usize, sign: f64) {
        for i in 0..self.size {
            let row = &other.row(eliminated + i)[eliminated..];
            for (target, value) in self.entries[packed(i)..packed(i + 1)].iter_mut().zip(row) {
                *target += sign * value;
            }
        }
    }

    /// Adds other equations, whose origin is moved to `step`, in other unknowns: `Jᵀ N J`, with the rows of J that `derivatives` gives. Valid before
    /// an elimination.
    pub(crate) fn add_mapped<const M: usize>(
        &mut self,
        other: &Normal<M>,
        step: &[f64],
        derivatives: &[Derivatives],
    ) {
        let right = self.unknowns();
        for (i, of_row) in derivatives.iter().enumerate() {
            for &(row, by_row) in of_row {
                for (j, (of_column, value)) in derivatives.iter().zip(other.row(i)).enumerate() {
                    for &(column, by_column) in of_column {
                        // Of two entries that are each other's image one is kept.
                        let times = match (i == j, row == column) {
                            (true, _) if row < column => continue,
                            (false, true) => 2.0,
                            _ => 1.0,
                        };
                        let entry = self.entry(row.max(column), row.min(column));
                        *entry += times * by_row * by_column * value;
                    }
                }
                *self.entry(right, row) += by_row * other.slope(i, step);
            }
        }
        *self.entry(right, right) += other.sum_of_squares() - other.gain(step);
    }

    /// Becomes what these equations leave of others of the same unknowns. Valid before an elimination.
    pub(crate) fn take_from(&mut self, whole: &Self) {
        for (entry, whole) in self.entries_mut().iter_mut().zip(whole.entries()) {
            *entry = whole - *entry;
        }
    }

    /// Fixes unknowns at the given values: their columns move to the right-hand side. Valid before an elimination.
    pub(crate) fn fix(&mut self, values: &[Option<f64>]) {
        for (k, value) in values.iter().enumerate() {
            if let Some(value) = value {
                self.fix_one(k, *value);
            }
        }
    }

    /// [Fixes](Normal::fix) unknown `k` alone.
    fn fix_one(&mut self, k: usize, value: f64) {
        let right = packed(self.size - 1);
        for i in (0..self.unknowns()).filter(|i| *i != k) {
            let entry = if i > k { packed(i) + k } else { packed(k) + i };
            self.entries[right + i] -= self.entries[entry] * value;
            self.entries[entry] = 0.0;
        }
        self.entries[packed(k) + k] = 1.0;
        self.entries[right + k] = value;
    }

    /// `2 gᵀx − xᵀNx`: decrease of the sum of squares by `step`. Valid before an elimination.
    pub(crate) fn gain(&self, step: &[f64]) -> f64 {
        let linear: f64 =
            self.right()[..self.unknowns()].iter().zip(step).map(|(g, x)| g * x).sum();
        2.0 * linear - self.quadratic(step)
    }

    /// `xᵀNx`: increase of the sum of squares by `step` from the minimum. Valid before an elimination.
    pub(crate) fn quadratic(&self, step: &[f64]) -> f64 {
        let mut sum = 0.0;
        for i in 0..self.unknowns() {
            let row = self.row(i);
            let off: f64 = row[..i].iter().zip(step).map(|(n, x)| n * x).sum();
            sum += step[i] * (row[i] * step[i] + 2.0 * off);
        }
        sum
    }

    /// The least `xᵀNx` of an x that equals `step` but for the unknowns that are free. Valid before an elimination.
    pub(crate) fn least_quadratic(&self, step: &[f64], is_free: impl Fn(usize) -> bool) -> f64 {
        let mut rest = self.clone();
        rest.entries[packed(self.size - 1)..packed(self.size)].fill(0.0);
        rest.shift(step);
        for unknown in (0..self.unknowns()).filter(|&unknown| !is_free(unknown)) {
            rest.fix_one(unknown, 0.0);
        }
        rest.eliminate(self.unknowns());
        rest.sum_of_squares()
    }

    /// `(Nx)ᵢ`. Valid before an elimination.
    pub(crate) fn times(&self, i: usize, x: &[f64]) -> f64 {
        let before = self.row(i)[..i].iter().zip(x).map(|(n, x)| n * x);
        let behind = (i..self.unknowns()).map(|j| self.row(j)[i] * x[j]);
        before.sum::<f64>() + behind.sum::<f64>()
    }

    /// `g − Nx` of unknown `i`: half the decrease of the sum of squares per unit of this unknown, after `step`. Valid before
    /// an elimination.
    pub(crate) fn slope(&self, i: usize, step: &[f64]) -> f64 {
        self.right()[i] - self.times(i, step)
    }

    /// Weights equations whose derivatives contain noise as their errors require: `N → D N⁻¹ D` and `g → D N⁻¹ g`, with `D = N − K`, where K is what the
    /// noise adds to N. `factor` and `x` are memory; x is as long as the unknowns. Valid before an elimination.
    pub(crate) fn discount<const M: usize>(
        &mut self,
        level: Level,
        noise: &Normal<M>,
        factor: &mut Normal<M>,
        x: &mut [f64],
    ) {
        let unknowns = self.unknowns();
        factor.reset(unknowns);
        factor.add_complement(self, 0);
        factor.eliminate_with(level, unknowns);
        factor.substitute(unknowns, x);
        for i in 0..unknowns {
            *self.entry(unknowns, i) -= noise.times(i, x);
        }
        for j in 0..unknowns {
            let k = |i: usize| if i > j { noise.row(i)[j] } else { noise.row(j)[i] };
            factor.solve(k, x);
            for i in j..unknowns {
                *self.entry(i, j) += noise.times(i, x) - 2.0 * k(i);
            }
        }
    }

    /// Moves the origin of the unknowns to `step`: the equations then seek the rest of the way. Valid before an elimination.
    pub(crate) fn shift(&mut self, step: &[f64]) {
        let gain = self.gain(step);
        let right = packed(self.size - 1);
        for i in 0..self.unknowns() {
            for j in 0..=i {
                let entry = self.entries[packed(i) + j];
                self.entries[right + i] -= entry * step[j];
                if j < i {
                    self.entries[right + j] -= entry * step[i];
                }
            }
        }
        self.entries[packed(self.size) - 1] -= gain;
    }

    /// Adds the square of `value + step` of one unknown to the sum of squares.
    pub(crate) fn add_prior(&mut self, unknown: usize, value: f64) {
        self.add_sparse(&[(unknown, 1.0)], value);
    }

    /// Adds the square of `value + Σ factor · step` over some unknowns to the sum of squares.
    pub(crate) fn add_sparse(&mut self, terms: &[(usize, f64)], value: f64) {
        let right = packed(self.size - 1);
        for &(i, own) in terms {
            for &(j, other) in terms.iter().filter(|(j, _)| *j <= i) {
                self.entries[packed(i) + j] += own * other;
            }
            self.entries[right + i] -= own * value;
        }
        self.entries[packed(self.size) - 1] += value * value;
    }

    /// Entry (i, j), j ≤ i.
    pub(crate) fn entry(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.entries[packed(i) + j]
    }
}

/// Elimination of the first `count` unknowns of packed equations.
struct Elimination<'a> {
    size: usize,
    entries: &'a mut [f64],
    count: usize,
}

/// Number of rows that are reduced together. Each entry of a row waits for the one before it; those of other rows need not wait. Chosen: with
/// four, an elimination of the 174 unknowns of a plant of six joints takes two thirds (AVX-512) to four
/// fifths (SSE2) of the time of one.
const TOGETHER: usize = 4;

impl Kernel<f64> for Elimination<'_> {
    type Output = ();

    /// The compiler makes vectors of the partial sums, whose values are the same with any instructions.
    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, _like: V) {
        let Self { size, entries, count } = self;
        for first in (0..size).step_by(TOGETHER) {
            let (above, rows) = entries.split_at_mut(packed(first));
            let start = |i: usize| packed(i) - packed(first);
            let block = first..size.min(first + TOGETHER);
            for j in 0..first {
                let factor = &above[packed(j)..packed(j + 1)];
                for i in block.clone() {
                    reduce(&mut rows[start(i)..start(i + 1)], factor, j, count);
                }
            }
            for i in block {
                let (above, row) = rows.split_at_mut(start(i));
                for j in first..i {
                    reduce(row, &above[start(j)..start(j + 1)], j, count);
                }
                let known = i.min(count);
                let pivot = row[i] - dot(&row[..known], &row[..known]);
                row[i] = match i < count {
                    true if pivot > DEPENDENT * row[i] => libm::sqrt(pivot),
                    true => 0.0,
                    false => pivot,
                };
            }
        }
    }
}

/// Entry j of a row, by row j above it, of which the first `count` are eliminated.
#[inline(always)]
fn reduce(row: &mut [f64], factor: &[f64], j: usize, count: usize) {
    let known = j.min(count);
    row[j] -= dot(&row[..known], &factor[..known]);
    if j < count {
        row[j] = if factor[j] > 0.0 { row[j] / factor[j] } else { 0.0 };
    }
}

#[cfg(test)]
mod tests;
