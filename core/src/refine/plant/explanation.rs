//! The misfit as a function of the imperfections, with the unknowns at their best values.
//!
//! Where a fit has ended, the normal equations of imperfections and unknowns describe the sum of squares about that point. The priors
//! of the imperfections are taken out, the origin is moved to the perfect plant, and the unknowns are eliminated. What is left is a
//! quadratic function of the imperfections in their stated accuracies, from which any of them can be taken or given another prior: a
//! score test by linearisation (Rao, "Large sample tests of statistical hypotheses concerning several parameters", 1948).

use super::super::fit::lies_on_bound;
use super::super::proposal::FLOOR;
use super::super::sizes::{ALL, OF_ALL, WIDE_OF_RECORD};
use super::Plant;
use super::evidence::{Block, MAX_OF_KIND};
use super::factors::Restated;
use crate::imperfection::{Imperfection, KINDS, MAX_IMPERFECTIONS};
use crate::linear::normal::Normal;
use crate::refine::Problem;
use crate::sought::MAX_UNKNOWNS;

/// Variance of the prior of each kind, in that of its stated accuracy.
pub(super) type Squares = [f64; KINDS];

/// The sum of squares, over its excess above the noise.
pub(super) struct Quadratic<'a> {
    imperfections: &'a [(Imperfection, f64)],
    restated: &'a Restated,
    /// Normal equations of the imperfections, the unknowns eliminated.
    reduced: &'a Normal<WIDE_OF_RECORD>,
    /// Workspace: `reduced` in another order, of which some are eliminated.
    ordered: &'a mut Normal<WIDE_OF_RECORD>,
    /// Normal equations of unknowns and imperfections, the unknowns eliminated.
    factor: &'a Normal<OF_ALL>,
    /// Sum of squares at the end of the fit, without priors of the imperfections.
    left: f64,
}

impl Plant {
    /// The quadratic where the last fit has ended, whose residuals are `inflation` times as large as those of noise.
    pub(super) fn quadratic(&mut self, problem: &Problem<'_>, inflation: f64) -> Quadratic<'_> {
        let Self { imperfections, minimiser, point, restated, factor, whole, record, .. } = self;
        let (normal, all) = (&minimiser.normal, imperfections.all.as_slice());
        let (count, total) = (all.len(), normal.unknowns());
        let unknowns = total - count;
        let ranges = problem.sought.ranges(&point.coordinates, problem.bounds);
        let scale: [f64; ALL + 1] = core::array::from_fn(|i| match i.checked_sub(count) {
            // What is at the end of its range stays there.
            None if all[i].0.is_positive() && point.imperfections[i] <= 0.0 => 0.0,
            None => 1.0 / restated.factor(all[i].0),
            Some(unknown) if unknown < unknowns && lies_on_bound(&ranges[unknown]) => 0.0,
            Some(_) => 1.0,
        });
        let place = |i: usize| match i.checked_sub(count) {
            None => unknowns + i,
            Some(unknown) if unknown < unknowns => unknown,
            Some(_) => total,
        };
        factor.reset(total);
        for i in 0..=total {
            for (j, value) in normal.row(i).iter().enumerate() {
                let (one, other) = (place(i), place(j));
                *factor.entry(one.max(other), one.min(other)) = value * scale[i] * scale[j];
            }
        }
        let mut way = [0.0; ALL];
        for (i, p) in point.imperfections[..count].iter().enumerate() {
            let own = unknowns + i;
            *factor.entry(own, own) -= scale[i] * scale[i];
            *factor.entry(total, own) += p * scale[i];
            *factor.entry(total, total) -= p * p;
            way[own] = if scale[i] > 0.0 { -p / scale[i] } else { 0.0 };
        }
        let left = factor.sum_of_squares() / inflation;
        factor.shift(&way[..total]);
        for entry in factor.entries_mut() {
            *entry /= inflation;
        }
        for unknown in 0..unknowns {
            *factor.entry(unknown, unknown) += FLOOR;
        }
        factor.eliminate(unknowns);
        whole.reset(count);
        whole.add_complement(factor, unknowns);
        Quadratic { imperfections: all, restated, reduced: whole, ordered: record, factor, left }
    }
}

impl Quadratic<'_> {
    /// The kinds of imperfections that may explain records. The mass of the base does not: its effect is that of the square of a
    /// compliance, so that its derivative says little of a base that is many times heavier.
    pub(super) fn kinds(&self) -> impl Iterator<Item = usize> + use<> {
        let mut has = [false; KINDS];
        let all = self.imperfections.iter().map(|(imperfection, _)| imperfection);
        let explain = all.filter(|imperfection| **imperfection != Imperfection::BaseMass);
        explain.for_each(|imperfection| has[imperfection.kind()] = true);
        (0..KINDS).filter(move |kind| has[*kind])
    }

    /// Places of the imperfections of a kind.
    pub(super) fn members(&self, kind: usize) -> impl Iterator<Item = usize> + '_ {
        let all = self.imperfections.iter().enumerate();
        all.filter(move |(_, (imperfection, _))| imperfection.kind() == kind).map(|(i, _)| i)
    }

    /// An imperfection, with its stated accuracy.
    pub(super) fn stated(&self, index: usize) -> (Imperfection, f64) {
        let (imperfection, deviation) = self.imperfections[index];
        (imperfection, deviation / self.restated.factor(imperfection))
    }

    /// Returns the information of the data about a kind where nothing else is off.
    pub(super) fn alone(&mut self, kind: usize) -> Block {
        let others = self.imperfections.len() - self.members(kind).count();
        self.order(kind, None);
        // The others stay at zero.
        Block::of_complement(self.ordered, others)
    }

    /// Returns the decrease of the sum of squares of the perfect plant by all imperfections together.
    pub(super) fn misfit(&self) -> f64 {
        self.reduced.sum_of_squares() - self.left
    }

    /// Returns the information of the data and of the priors of all others about a kind.
    pub(super) fn block(&mut self, kind: usize, squares: &Squares) -> Block {
        let others = self.imperfections.len() - self.members(kind).count();
        self.order(kind, Some(squares));
        self.ordered.eliminate(others);
        Block::of_complement(self.ordered, others)
    }

    /// The unknowns, from where the fit has ended, with the imperfections of the kind of the last [`Quadratic::block`] at these values
    /// and all else at its best.
    pub(super) fn unknowns(&self, kind: usize, values: &[f64; MAX_OF_KIND]) -> [f64; MAX_UNKNOWNS] {
        let (order, others) = self.places(kind);
        let count = self.imperfections.len();
        let (mut of_others, mut all) = ([0.0; MAX_IMPERFECTIONS], [0.0; MAX_IMPERFECTIONS]);
        self.ordered.substitute_at(others, &values[..count - others], &mut of_others);
        for (place, &index) in order[..count].iter().enumerate() {
            all[index] = match place.checked_sub(others) {
                None => of_others[place],
                Some(own) => values[own],
            };
        }
        let mut unknowns = [0.0; MAX_UNKNOWNS];
        self.factor.substitute_at(self.factor.unknowns() - count, &all[..count], &mut unknowns);
        unknowns
    }

    /// The imperfections in the order in which those of a kind are the last, and the number of the others.
    fn places(&self, kind: usize) -> ([usize; MAX_IMPERFECTIONS], usize) {
        let is_own = |index: &usize| self.imperfections[*index].0.kind() == kind;
        let all = || 0..self.imperfections.len();
        let others = all().filter(|index| !is_own(index));
        let mut order = [0; MAX_IMPERFECTIONS];
        let ordered = others.clone().chain(all().filter(is_own));
        order.iter_mut().zip(ordered).for_each(|(place, index)| *place = index);
        (order, others.count())
    }

    /// Puts the imperfections of a kind last, and gives the others their priors, if there are any.
    #[inline(never)]
    fn order(&mut self, kind: usize, squares: Option<&Squares>) {
        let (order, others) = self.places(kind);
        let count = self.imperfections.len();
        let at = |place: usize| if place < count { order[place] } else { count };
        self.ordered.reset(count);
        for i in 0..=count {
            for j in 0..=i {
                let (one, other) = (at(i), at(j));
                *self.ordered.entry(i, j) = self.reduced.row(one.max(other))[one.min(other)];
            }
        }
        let Some(squares) = squares else { return };
        for (place, &index) in order[..others].iter().enumerate() {
            *self.ordered.entry(place, place) += 1.0 / squares[self.imperfections[index].0.kind()];
        }
    }
}

#[cfg(test)]
mod tests;
