//! Accuracies that the data contradict, and what replaces them.
//!
//! Accuracies are stated for a kind of imperfection: all masses, say. The sum `S = Σ p²` over the imperfections of a kind, in their
//! standard deviations, is hardly ever larger than q, its mean and at least three standard deviations. Where it is, the accuracy was stated
//! too well: it grows by the factor τ, and the fit is made again.
//!
//! ```text
//! γ = max(1, Σ (1 − σ²))        q = γ + 3 √(2γ)        τ² = max(1, S/q)
//! ```
//!
//! σ is the standard deviation of an imperfection after the fit, in that of its prior, and γ the number of imperfections that the data
//! determine (MacKay, "Bayesian interpolation", Neural Computation 4, 1992): one that they do not determine stays near 0, and says nothing of
//! its accuracy. A kind of which they determine less than one is judged as if they did.
//!
//! This is one step of empirical Bayes (Carlin and Louis, _Bayes and Empirical Bayes Methods for Data Analysis_, 2000, chapter 3).
//! Further steps would leave all of what several kinds explain alike to one of them: all masses and all gains, say.
//!
//! A plant that adopts explanations then takes τ of each kind from its evidence ([`diagnosis`](super::diagnosis)): that of a kind that
//! is contradicted, and 1 of all others. The fit is made again, until τ stays.

use super::Plant;
use super::factors::Restated;
use crate::chi_square::rarely_exceeded;
use crate::imperfection::{self, Imperfection, KINDS};
use crate::refine::problem::Problem;

/// Most adoptions of explanations. Chosen: of errors ten times their accuracy, the first adoption changes τ by a tenth, the next ones by less.
const MAX_ADOPTIONS: u32 = 3;
/// Change of τ below which it stays. Chosen: what a prior adds to the information then changes by less than half.
const SAME: f64 = 1.2;

/// τ beyond which a plant is not plausible, however well it explains the records. Chosen: errors of thirty times their accuracy are
/// explained rightly (tests/README, one error at a time); a parameter fixed at a wrong value is explained by accuracies far beyond.
const FARTHEST: f64 = 50.0;

impl Plant {
    /// Restates the accuracies that the imperfections contradict where the fit has ended, which goes on from there. Returns whether there
    /// were any; false if it has been done before.
    pub(super) fn restate_accuracies(&mut self) -> bool {
        if self.restated.is_done {
            return false;
        }
        // Without derivatives where the fit has ended, all are taken as determined.
        let is_known = self.minimiser.linearised;
        if is_known {
            self.determine();
        }
        let (mut sums, mut determined) = ([0.0; KINDS], [0.0; KINDS]);
        let values = self.point.imperfections.iter().zip(&self.deviations);
        for ((imperfection, _), (p, deviation)) in self.imperfections.all.iter().zip(values) {
            let kind = imperfection.kind();
            sums[kind] += p * p;
            determined[kind] += if is_known { (1.0 - deviation * deviation).max(0.0) } else { 1.0 };
        }
        self.restated.is_done = true;
        self.restated.determined = determined.map(|own: f64| own.max(1.0));
        let factors =
            core::array::from_fn(|kind| factor(sums[kind], self.restated.determined[kind]));
        let are_contradicted = factors.iter().any(|factor| *factor > 1.0);
        if are_contradicted {
            self.restate(factors);
        }
        are_contradicted
    }

    /// Adopts what explains the records where the fit has ended, if the plant does so. `inflation` is χ² per degree of freedom there, at
    /// least 1. Returns whether that changes an accuracy; the fit then goes on from there.
    pub(crate) fn adopt_explanations(&mut self, problem: &Problem<'_>, inflation: f64) -> bool {
        if !self.adopts || self.restated.adoptions == MAX_ADOPTIONS {
            return false;
        }
        let mut factors = [1.0; KINDS];
        for explanation in self.explain(problem, inflation, &mut |_| {}) {
            factors[explanation.largest.imperfection.kind()] = explanation.times;
        }
        let stays = |(new, old): (&f64, &f64)| (1.0 / SAME..SAME).contains(&(new / old));
        if factors.iter().zip(&self.restated.factors).all(stays) {
            return false;
        }
        self.restated.adoptions += 1;
        self.restate(factors);
        true
    }

    /// Takes these as τ. Each imperfection keeps its value.
    fn restate(&mut self, factors: [f64; KINDS]) {
        let Self { imperfections, point, restated, minimiser, .. } = self;
        for ((imperfection, deviation), p) in
            imperfections.all.iter_mut().zip(&mut point.imperfections)
        {
            let by = factors[imperfection.kind()] / restated.factor(*imperfection);
            *deviation *= by;
            *p /= by;
        }
        restated.factors = factors;
        minimiser.restart();
        self.follow_delay();
    }

    /// A delay beyond its accuracy may be that of a low-pass: the plant then has what a low-pass does beside, as its accuracy follows from that
    /// of the delay. Each imperfection keeps its value.
    fn follow_delay(&mut self) {
        let factor = self.restated.factor(Imperfection::Delay);
        let Self { accuracies, imperfections, point, .. } = self;
        for (own, prior) in imperfection::of_low_pass(factor * accuracies.delay) {
            let place = imperfections.all.iter().position(|(imperfection, _)| *imperfection == own);
            if let Some(index) = place {
                let before = core::mem::replace(&mut imperfections.all[index].1, prior);
                point.imperfections[index] *= before / prior;
            } else if factor > 1.0 && imperfections.all.insert(0, (own, prior)).is_ok() {
                point.imperfections.rotate_right(1);
                point.imperfections[0] = 0.0;
            }
        }
    }

    /// Returns the distance of the imperfections from those of a plausible plant where the last fit has ended, and their number. The distance is
    /// minus twice the logarithm of their density by the stated kind of prior, `Σ (S/τ² + γ ln τ²)`, but for a constant.
    pub(crate) fn size(&self) -> (f64, usize) {
        let count = self.imperfections.all.len();
        let squares = self.point.imperfections[..count].iter().map(|p| p * p);
        (squares.sum::<f64>() + self.cost_of_restating(), count)
    }

    /// Returns whether a plausible plant has these imperfections: their [`Plant::size`] is hardly ever exceeded, and no accuracy would have to be
    /// far worse. The records have far more residuals than there are priors, so that a wrong minimum would be explained by imperfections that no
    /// plant has.
    pub(crate) fn is_plausible(&self) -> bool {
        let (size, count) = self.size();
        let is_restated_too_far = self.restated.factors.iter().any(|factor| *factor > FARTHEST);
        (0.0..=rarely_exceeded(count as f64)).contains(&size) && !is_restated_too_far
    }

    /// The largest `√(S/q)` of a kind where the last fit has ended, S by the stated accuracies, at least 1: the factor by which they would
    /// have to be worse for the imperfections to be plausible.
    pub(crate) fn largest_factor(&self) -> f64 {
        let mut sums = [0.0; KINDS];
        for ((imperfection, _), p) in self.imperfections.all.iter().zip(&self.point.imperfections) {
            let by_stated = p * self.restated.factor(*imperfection);
            sums[imperfection.kind()] += by_stated * by_stated;
        }
        let factors =
            sums.iter().zip(&self.restated.determined).map(|(sum, own)| factor(*sum, *own));
        factors.fold(1.0, f64::max)
    }

    /// Cost of restated accuracies, `Σ γ ln τ²`: they would explain less than those that were stated. An imperfection that the data do not
    /// determine has the wider prior as a wider posterior, too, and costs nothing.
    pub(crate) fn cost_of_restating(&self) -> f64 {
        let Restated { factors, determined, .. } = &self.restated;
        let kinds = factors.iter().zip(determined);
        kinds.map(|(factor, determined)| 2.0 * determined * libm::log(*factor)).sum()
    }
}

/// τ of a kind with this sum of squares and so many imperfections that the data determine.
fn factor(sum_of_squares: f64, determined: f64) -> f64 {
    let plausible = determined + 3.0 * libm::sqrt(2.0 * determined);
    if sum_of_squares > plausible { libm::sqrt(sum_of_squares / plausible) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imperfection::{self, Accuracies};
    use crate::refine::plant::tests::plant;
    use crate::refine::tests::chain;

    /// Two masses, ten times as far off as stated: q is 2 + 3 √4, and τ is √(200/8).
    #[test]
    fn contradicted_accuracies_are_restated_once() {
        let mut plant = plant();
        let p = |imperfection| match imperfection {
            Imperfection::Mass(0) => 10.0,
            Imperfection::Mass(_) => -10.0,
            // One delay is plausible up to √(1 + 3 √2) = 2.29.
            Imperfection::Delay => 2.2,
            _ => 0.0,
        };
        let all = plant.imperfections.all.clone();
        for (value, (imperfection, _)) in plant.point.imperfections.iter_mut().zip(&all) {
            *value = p(*imperfection);
        }
        let before = plant.found();
        assert!(plant.restate_accuracies());
        for (index, (imperfection, deviation)) in all.iter().enumerate() {
            let factor = plant.imperfections.all[index].1 / deviation;
            let expected = if matches!(imperfection, Imperfection::Mass(_)) { 5.0 } else { 1.0 };
            assert!((factor - expected).abs() < 1e-12, "{imperfection:?}: {factor}");
            let found = plant.found()[index];
            assert!((found.value - before[index].value).abs() < 1e-12);
            assert!((found.prior - before[index].prior).abs() < 1e-12);
        }
        // 8 + 2 ln 25 of the masses, 2.2² of the delay.
        let (size, count) = plant.size();
        let expected = 8.0 + 2.0 * libm::log(25.0) + 2.2 * 2.2;
        assert!((size - expected).abs() < 1e-9 && count == all.len(), "{size}");
        assert!(!plant.restate_accuracies());
    }

    /// Of two masses the data determine one: γ is 1, q is 1 + 3 √2, and τ is √(25/q).
    #[test]
    fn what_the_data_do_not_determine_does_not_count() {
        let mut plant = plant();
        let all = plant.imperfections.all.clone();
        let normal = &mut plant.minimiser.normal;
        normal.reset(all.len() + 24);
        for (index, (imperfection, _)) in all.iter().enumerate() {
            let is_determined = matches!(imperfection, Imperfection::Mass(0));
            *normal.entry(index, index) = if is_determined { 1e12 } else { 1.0 };
            // The fit of a centre, which the data do not determine, has not come to the end.
            plant.point.imperfections[index] = match imperfection {
                Imperfection::Mass(0) => 5.0,
                Imperfection::ElasticCentre(0, 0) => 2.0,
                _ => 0.0,
            };
        }
        plant.minimiser.linearised = true;
        assert!(plant.restate_accuracies());
        for (imperfection, _) in &all {
            let is_mass = matches!(imperfection, Imperfection::Mass(_));
            let expected =
                if is_mass { libm::sqrt(25.0 / (1.0 + 3.0 * libm::sqrt(2.0))) } else { 1.0 };
            let factor = plant.restated.factor(*imperfection);
            assert!((factor - expected).abs() < 1e-6, "{imperfection:?}: {factor}");
        }
        let expected = libm::log(25.0 / (1.0 + 3.0 * libm::sqrt(2.0)));
        assert!((plant.cost_of_restating() - expected).abs() < 1e-6);
    }

    /// A delay of ten accuracies may be that of a low-pass: τ is √(100/q), with q = 1 + 3 √2. The others keep their values.
    #[test]
    fn a_delay_beyond_its_accuracy_may_be_that_of_a_low_pass() {
        let mut plant = plant();
        let all = plant.imperfections.all.clone();
        for (value, (imperfection, _)) in plant.point.imperfections.iter_mut().zip(&all) {
            *value = if *imperfection == Imperfection::Delay { 10.0 } else { 0.5 };
        }
        let before = plant.found();
        assert!(plant.restate_accuracies());
        let found = plant.found();
        let [roll_off, dispersion, others @ ..] = &found[..] else { panic!("{found:?}") };
        let delay = 20e-6 * libm::sqrt(100.0 / (1.0 + 3.0 * libm::sqrt(2.0)));
        for (own, imperfection, prior) in [
            (dispersion, Imperfection::Dispersion, 3.0 * delay.powi(3)),
            (roll_off, Imperfection::RollOff, 5.0 * delay.powi(4)),
        ] {
            assert_eq!((own.imperfection, own.value), (imperfection, 0.0));
            assert!((own.prior / prior - 1.0).abs() < 1e-12, "{own:?}");
        }
        for (own, before) in others.iter().zip(&before) {
            assert_eq!(own.imperfection, before.imperfection);
            assert!((own.value - before.value).abs() <= 1e-12 * before.value.abs());
        }
        assert_eq!(others.len(), before.len());
        // With an accuracy of the delay that is worse twice, both keep their values.
        plant.point.imperfections[..2].fill(1.0);
        let before = plant.found();
        let mut factors = plant.restated.factors;
        factors[Imperfection::Delay.kind()] *= 2.0;
        plant.restate(factors);
        for (index, times) in [16.0, 8.0].into_iter().enumerate() {
            let own = plant.found()[index];
            assert!((own.prior / before[index].prior / times - 1.0).abs() < 1e-12);
            assert!((own.value / before[index].value - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn plausible_accuracies_stand() {
        let mut plant = plant();
        plant.point.imperfections.fill(1.4);
        assert!(!plant.restate_accuracies());
        let stated = imperfection::all(&Accuracies::typical(), &chain().kinds(), 0);
        assert!(plant.imperfections.all == stated);
    }
}
