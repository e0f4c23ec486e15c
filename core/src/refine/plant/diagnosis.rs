//! Wrong statements: the kinds of imperfections whose accuracies the data contradict.
//!
//! One kind after the other is given an accuracy of its own, the one that gains most evidence first, as long as it gains enough (forward
//! selection). The fit is linearised where it has ended, and is not made again.
//!
//! A kind that would gain nearly as much in the place of a selected one is its rival: the data do not say which of the two statements
//! is wrong. Gains of a force sensor that are all alike and masses that are all alike, for instance, differ by their accuracies alone,
//! and these are what the data contradict. The parameters may then be those of either.
//!
//! Where no accuracy is contradicted, the kind that by itself is the most likely cause of the misfit is named.

use heapless::Vec;

use super::Plant;
use super::evidence::{Restatement, Values};
use super::explanation::{Quadratic, Squares};
use crate::imperfection::{FoundImperfection, Imperfection, KINDS};
use crate::refine::Problem;

/// Largest number of kinds that are selected. Chosen: each has the largest gain beside those before it, so that the ones left out explain least.
pub const MAX_EXPLANATIONS: usize = 6;
/// Largest number of rivals of a kind that are named. Chosen: those that gain least are left out.
pub const MAX_RIVALS: usize = 4;

/// Gain of −2 ln of the evidence from which on a statement counts as wrong: positive evidence (Kass and Raftery, "Bayes factors", 1995,
/// section 3.2).
const POSITIVE: f64 = 2.0;
/// Difference below which one kind is the rival of another: beyond, the evidence is very strong (Kass and Raftery, 1995, section 3.2).
const VERY_STRONG: f64 = 10.0;

/// A kind of imperfections that explains the records.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The largest of the kind. Its value is that where this accuracy is wrong and the others are right.
    pub largest: FoundImperfection,
    /// Size of the error of this kind in its accuracy, at least 1.
    pub times: f64,
    /// Share of the misfit of a perfect plant that the kind explains by itself, 0 to 1. Shares of several kinds may overlap.
    pub share: f64,
    /// Decrease of −2 ln of the evidence if this accuracy is wrong. Zero if the data do not contradict the accuracy.
    pub evidence: f64,
    /// True if the estimate rests on it: its accuracy was taken as worse by `times`.
    pub is_adopted: bool,
    /// The largest of each other kind that explains the records as well in the place of this one, the most likely first.
    pub rivals: Vec<FoundImperfection, MAX_RIVALS>,
}

impl Explanation {
    /// Returns whether the data contradict the stated accuracy.
    pub fn is_contradicted(&self) -> bool {
        self.evidence > 0.0
    }

    /// Returns whether they contradict it very strongly.
    pub fn is_contradicted_very_strongly(&self) -> bool {
        self.evidence > VERY_STRONG
    }
}

impl Plant {
    /// The kinds whose accuracies are contradicted where the last fit has ended, those with the largest share first; if there is none, the
    /// one that explains the misfit best. `inflation` is χ² per degree of freedom of the fit, at least 1. `elsewhere` is given the unknowns
    /// with each contradicted accuracy restated, and with that of each rival in its place, from where the fit has ended.
    #[inline(never)]
    pub(crate) fn explain(
        &mut self,
        problem: &Problem<'_>,
        inflation: f64,
        elsewhere: &mut dyn FnMut(&[f64]),
    ) -> Vec<Explanation, MAX_EXPLANATIONS> {
        let mut quadratic = self.quadratic(problem, inflation);
        let (selected, squares) = select(&mut quadratic);
        let mut explanations = Vec::new();
        for &kind in &selected {
            // No more are selected than there is room for.
            explanations.extend(contradicted(&mut quadratic, kind, &selected, &squares, elsewhere));
        }
        if explanations.is_empty() {
            explanations.extend(leading(&mut quadratic));
        }
        explanations.sort_unstable_by(|one, other| other.share.total_cmp(&one.share));
        let fitted = |imperfection: Imperfection| {
            let mut all = self.imperfections.all.iter().zip(&self.deviations);
            all.find(|((own, _), _)| *own == imperfection).map(|((_, prior), std)| prior * std)
        };
        for explanation in &mut explanations {
            let is_restated = self.restated.factor(explanation.largest.imperfection) > 1.0;
            explanation.is_adopted = self.adopts && explanation.is_contradicted() && is_restated;
            let rivals = explanation.rivals.iter_mut();
            for found in rivals.chain([&mut explanation.largest]) {
                // A report multiplies deviations by the root of the inflation.
                found.deviation /= libm::sqrt(inflation);
                // Compliances of the ground that are zero stay so in the quadratic. They may be larger, and the fit allows for that.
                let fitted = fitted(found.imperfection).unwrap_or(0.0);
                found.deviation = found.deviation.max(fitted);
            }
        }
        explanations
    }
}

/// The kinds whose accuracies are contradicted, and the variances of all.
fn select(quadratic: &mut Quadratic<'_>) -> (Vec<usize, MAX_EXPLANATIONS>, Squares) {
    let (mut selected, mut squares) = (Vec::<usize, MAX_EXPLANATIONS>::new(), [1.0; KINDS]);
    while !selected.is_full() {
        let (mut gain, mut best) = (POSITIVE, None);
        for kind in quadratic.kinds().filter(|kind| !selected.contains(kind)) {
            let restatement = quadratic.block(kind, &squares).restatement();
            if restatement.gain > gain {
                (gain, best) = (restatement.gain, Some((kind, restatement.square)));
            }
        }
        let Some((kind, square)) = best else { break };
        squares[kind] = square;
        let _ = selected.push(kind);
    }
    // Later ones may explain what the first ones seemed to.
    selected.retain(|&kind| {
        let Restatement { square, gain, .. } = quadratic.block(kind, &squares).restatement();
        squares[kind] = if gain > POSITIVE { square } else { 1.0 };
        gain > POSITIVE
    });
    (selected, squares)
}

/// Returns the explanation by a selected kind, with its rivals. `None` if no gain is a number, beside other kinds than those that it was selected
/// beside.
fn contradicted(
    quadratic: &mut Quadratic<'_>,
    kind: usize,
    selected: &[usize],
    squares: &Squares,
    elsewhere: &mut dyn FnMut(&[f64]),
) -> Option<Explanation> {
    let mut rest = *squares;
    rest[kind] = 1.0;
    let mut restated = |quadratic: &mut Quadratic<'_>, kind, least: f64| {
        let block = quadratic.block(kind, &rest);
        let Restatement { square, gain, .. } = block.restatement();
        (gain > least).then(|| {
            let values = block.values(square);
            elsewhere(&quadratic.unknowns(kind, &values.values));
            (gain, libm::sqrt(square), quadratic.largest(kind, &values))
        })
    };
    let (evidence, times, largest) = restated(quadratic, kind, f64::NEG_INFINITY)?;
    let mut rivals: Vec<(f64, FoundImperfection), KINDS> = Vec::new();
    for other in quadratic.kinds().filter(|other| !selected.contains(other)) {
        let rival = restated(quadratic, other, POSITIVE.max(evidence - VERY_STRONG));
        // There is room for every kind.
        rivals.extend(rival.map(|(gain, _, largest)| (gain, largest)));
    }
    let share = quadratic.share(kind);
    let rivals = best_of(rivals);
    Some(Explanation { largest, times, share, evidence, is_adopted: false, rivals })
}

/// The kind that is the most likely cause of the misfit if nothing else is off, and what explains as much.
fn leading(quadratic: &mut Quadratic<'_>) -> Option<Explanation> {
    let mut all: Vec<(f64, usize), KINDS> = Vec::new();
    for kind in quadratic.kinds() {
        let gain = -quadratic.alone(kind).restatement().evidence;
        if gain > POSITIVE {
            let _ = all.push((gain, kind));
        }
    }
    let &(gain, kind) = all.iter().max_by(|(one, _), (other, _)| one.total_cmp(other))?;
    let mut stated = |kind| {
        let values = quadratic.block(kind, &[1.0; KINDS]).values(1.0);
        quadratic.largest(kind, &values)
    };
    let largest = stated(kind);
    let rivals = all.iter().filter(|(own, other)| *other != kind && gain - own < VERY_STRONG);
    let rivals = best_of(rivals.map(|(gain, other)| (*gain, stated(*other))).collect());
    let share = quadratic.share(kind);
    Some(Explanation { largest, times: 1.0, share, evidence: 0.0, is_adopted: false, rivals })
}

/// Returns the rivals with the largest gains.
fn best_of(mut rivals: Vec<(f64, FoundImperfection), KINDS>) -> Vec<FoundImperfection, MAX_RIVALS> {
    rivals.sort_unstable_by(|(one, _), (other, _)| other.total_cmp(one));
    rivals.into_iter().map(|(_, rival)| rival).take(MAX_RIVALS).collect()
}

impl Quadratic<'_> {
    /// Share of the misfit of the perfect plant that a kind explains by itself.
    fn share(&mut self, kind: usize) -> f64 {
        let (gain, misfit) = (self.alone(kind).gain_without_prior(), self.misfit());
        if misfit > 0.0 { (gain / misfit).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The largest imperfection of a kind with these values.
    fn largest(&self, kind: usize, values: &Values) -> FoundImperfection {
        let found = self.members(kind).enumerate().map(|(own, index)| {
            let (imperfection, prior) = self.stated(index);
            let Values { values, deviations } = values;
            let (value, deviation) = (prior * values[own], prior * deviations[own]);
            FoundImperfection { imperfection, prior, value, deviation }
        });
        let largest = found.max_by(|one, other| one.value.abs().total_cmp(&other.value.abs()));
        largest.expect("a kind that has imperfections")
    }
}
