//! The normal equations of a record that follow from the sums over its bins.

use super::OTHERS;
use super::sums::Sums;
use crate::linear::normal::Normal;

/// Column of an unknown, and the factor on the derivative by it. `None` of a parameter that is not sought.
pub(super) type Column = Option<(usize, f64)>;

/// Columns of a load in the normal equations.
#[derive(Clone, Copy, Debug)]
pub(in crate::refine) struct Columns {
    pub(in crate::refine) impulse: usize,
    pub(in crate::refine) step: usize,
    /// With −k.
    pub(in crate::refine) stiffness: Column,
    /// With −d.
    pub(in crate::refine) damping: Column,
}

impl Sums {
    /// Writes the normal equations. `columns` are those of a load.
    pub(in crate::refine) fn write<const L: usize>(
        &self,
        normal: &mut Normal<L>,
        columns: impl Fn(usize) -> Columns,
    ) {
        for i in 0..self.loads {
            let own = columns(i);
            for j in 0..i {
                self.write_pair(normal, [i, j], [own, columns(j)]);
            }
            self.write_one(normal, i, own);
            for other in 0..OTHERS {
                self.write_other(normal, i, own, other);
            }
        }
        let (first, size) = (2 * self.loads, self.jumps.unknowns() + 1);
        let last = normal.unknowns();
        for a in 0..size {
            for b in 0..=a {
                let row = if a + 1 == size { last } else { first + a };
                let column = if b + 1 == size { last } else { first + b };
                *normal.entry(row, column) += self.jumps.row(a)[b];
            }
        }
    }

    /// Products of the columns of load i with those of load j < i.
    fn write_pair<const L: usize>(
        &self,
        normal: &mut Normal<L>,
        [i, j]: [usize; 2],
        [a, b]: [Columns; 2],
    ) {
        let sum = |kind| self.pair(i, j, kind);
        add(normal, a.impulse, b.impulse, sum(0));
        add(normal, b.step, a.impulse, sum(1));
        add(normal, a.step, b.impulse, -sum(1));
        add(normal, a.step, b.step, sum(2));
        for (unknown, own, with_impulse, with_step) in [
            (b.stiffness, a, sum(3), -sum(5)),
            (b.damping, a, -sum(4), -sum(3)),
            (a.stiffness, b, sum(6), -sum(8)),
            (a.damping, b, -sum(7), -sum(6)),
        ] {
            let Some((column, factor)) = unknown else { continue };
            add(normal, column, own.impulse, factor * with_impulse);
            add(normal, column, own.step, factor * with_step);
        }
        for (one, other, value) in [
            (a.stiffness, b.stiffness, sum(9)),
            (a.stiffness, b.damping, -sum(10)),
            (a.damping, b.stiffness, sum(10)),
            (a.damping, b.damping, sum(11)),
        ] {
            let (Some((one, factor)), Some((other, by))) = (one, other) else { continue };
            add(normal, one, other, factor * by * value);
        }
    }

    /// Products of the columns of load i with each other.
    fn write_one<const L: usize>(&self, normal: &mut Normal<L>, i: usize, own: Columns) {
        let sum = |kind| self.pair(i, i, kind);
        *normal.entry(own.impulse, own.impulse) += sum(0);
        *normal.entry(own.step, own.step) += sum(2);
        if let Some((column, factor)) = own.stiffness {
            add(normal, column, own.impulse, factor * sum(3));
            add(normal, column, own.step, -factor * sum(5));
            *normal.entry(column, column) += factor * factor * sum(9);
        }
        if let Some((column, factor)) = own.damping {
            add(normal, column, own.impulse, -factor * sum(4));
            add(normal, column, own.step, -factor * sum(3));
            *normal.entry(column, column) += factor * factor * sum(11);
        }
    }

    /// Products of the columns of load i with those of a jump, or with the residual.
    fn write_other<const L: usize>(
        &self,
        normal: &mut Normal<L>,
        i: usize,
        own: Columns,
        other: usize,
    ) {
        let sum = |kind: usize| self.others[other][kind][i];
        let lowest = self.lowest;
        // By the order of the jump; the residual is like the first.
        let products = [
            [sum(0), -sum(1), sum(4), sum(5)],
            [-sum(3), -sum(0), -sum(5), sum(7)].map(|sum| sum / lowest),
            [sum(1), sum(2), sum(6), -sum(4)].map(|sum| sum * lowest),
        ];
        let is_residual = other + 1 == OTHERS;
        let orders = if is_residual { 1 } else { self.jumps.unknowns() / 3 };
        for (order, [impulse, step, stiffness, damping]) in
            products.into_iter().enumerate().take(orders)
        {
            let column =
                if is_residual { normal.unknowns() } else { 2 * self.loads + 3 * order + other };
            add(normal, column, own.impulse, impulse);
            add(normal, column, own.step, step);
            for (unknown, value) in [(own.stiffness, stiffness), (own.damping, damping)] {
                if let Some((unknown, factor)) = unknown {
                    add(normal, column, unknown, factor * value);
                }
            }
        }
    }
}

/// Adds the product of two different columns, which may be of the same unknown.
fn add<const L: usize>(normal: &mut Normal<L>, a: usize, b: usize, value: f64) {
    let value = if a == b { 2.0 * value } else { value };
    *normal.entry(a.max(b), a.min(b)) += value;
}
