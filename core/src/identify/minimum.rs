//! Minimum of a refinement, and whether noise explains it.

use heapless::Vec;

use super::FoundBy;
use super::judged::Judged;
use crate::chi_square::{noise_explains, rarely_exceeded, rarely_undercut};
use crate::refine::{Fit, Remaining, Structure};
use crate::sought::{Coordinates, MAX_UNKNOWNS, Sought};
use crate::verdict::FOREIGN;

/// χ² per degree of freedom below which the noise is taken for louder than it is, if the residuals are many. Chosen: the nearest wrong basin of
/// the reference scenario, at 2, would then be below 1.
const TOO_LOUD: f64 = 0.5;
/// Structure that matters in units of the noise. Chosen: in a part of the band where the mean square of the residuals is so much larger than in
/// all of it, intervals that hold for all of it are a twentieth too narrow, `1.05² − 1`, and miss 6 % instead of 5.
const STRUCTURED: f64 = 0.10;
/// Structure that matters in units of the residuals. Chosen: intervals are a tenth too narrow, `1.1² − 1`, and miss 7.5 %, half again as often as
/// they say.
const STRUCTURED_BEYOND_NOISE: f64 = 0.21;
/// Structure that matters where standard deviations are robust. Chosen: the most that right minima of drawn plants leave (`tests/README.md`).
/// Intervals hold with more: the blocks of the jackknife are as narrow as the smoothing, and with a structure of s the scatter of 48 is known as
/// that of `48 / (1 + s²)` (Satterthwaite, 1946), whose intervals miss 7.5 % at s = 1.7. They do not allow for a wrong minimum, which leaves 31 %
/// at least.
const STRUCTURED_AS_WRONG: f64 = 0.25;
/// Median SSP up to which the records stand clear of the noise. Chosen: with ten times the noise of the reference scenario (0.14) one wrong basin
/// in twenty has residuals that noise explains.
const CLEAR: f64 = 0.05;
/// Relative error of the noise's power over the three directions: `7 %/√3`, since that of each is known to 7 %.
const NOISE_ERROR: f64 = 0.04;
/// Size and structure of the residuals together, each in its standard deviations, above which a minimum that leaves a stiffness
/// undetermined is doubtful. The sum is about N(0, 2): noise exceeds it once in 430.
const DOUBTFUL: f64 = 4.0;
/// Sum of size and structure, as far as each is positive, above which the model does not explain the residuals. Noise exceeds it once in fifty
/// fits.
const MISFIT: f64 = 3.0;
/// χ² per degree of freedom up to which the branches of a minimum are refined although noise does not explain it. Chosen: residuals of more than
/// five times the noise are left to the next search.
pub(super) const NEAR: f64 = 30.0;
/// Relative difference of the sums of squares, beside 1, up to which two minima are equally good. Chosen: it counts for sums above ten thousand;
/// equal minima in different places are rivals.
const SAME_MINIMUM: f64 = 1e-4;
/// Difference of the deviances below which the worse of two minima in different places may be the right one; beyond it the evidence
/// is very strong (Kass and Raftery, "Bayes factors", 1995, section 3.2).
pub(super) const RIVAL: f64 = 10.0;
/// Least probability of a rival. Chosen: an interval of 95 % misses once in twenty. Of dozens of branches the best one looks better by chance, so
/// that the difference of the deviances is too large.
const RARE: f64 = 0.05;
/// Gain in the sum of squares up to which a minimum counts as reached although a step would still gain it. No parameter
/// then lies farther from the minimum than its own standard deviation, since `δᵢ² ≤ Cᵢᵢ δᵀNδ`; the deviations are widened
/// by the way that is left, and their intervals cover no less than at the minimum.
pub(super) const REACHED: f64 = 1.0;
/// Squared distance `Δθᵀ N Δθ` up to which two points are the same minimum: each may be `√REACHED` from it.
pub(super) const SAME_PLACE: f64 = 4.0 * REACHED;

/// Another minimum that the data do not exclude, as one unknown sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Rival {
    /// Value of its unknown less that of the minimum.
    pub(super) away: f64,
    /// Deviance less that of the minimum, at least 0.
    pub(super) gap: f64,
}

/// End of a refinement.
#[derive(Clone, Debug)]
pub(super) struct Minimum {
    pub(super) coordinates: Coordinates,
    pub(super) found_by: FoundBy,
    pub(super) fit: Fit,
    /// Residuals that are left once the imperfections of the plant are fitted from here. `None` if they have not been.
    pub(super) of_plant: Option<Judged>,
    /// Gain of a further step.
    remaining: f64,
    /// Number of searches that have led to it, or to the minimum whose branch it is.
    pub(super) times: u32,
    /// Retired records and those that are kept are not of the same robot.
    pub(super) contradicted: bool,
    /// Another minimum elsewhere is hardly worse, so that the data do not say which of the two is right.
    pub(super) has_rival: bool,
    /// Its branches have been refined; none is clearly better.
    pub(super) is_branched: bool,
    /// For each unknown, the farthest rival below and above this minimum; empty without one.
    pub(super) apart: Vec<[Rival; 2], MAX_UNKNOWNS>,
    /// The largest standard deviation of every unknown at other points that the data do not exclude; empty without one.
    pub(super) deviations_elsewhere: Vec<f64, MAX_UNKNOWNS>,
}

impl Minimum {
    /// End of a refinement, with what is left to the minimum there.
    pub(super) fn new(
        coordinates: Coordinates,
        found_by: FoundBy,
        mut fit: Fit,
        remaining: &Remaining,
        sought: &Sought,
    ) -> Self {
        let contradicted = fit.contradiction > rarely_exceeded(fit.covariance.rank() as f64);
        fit.widen(sought, &remaining.step);
        let remaining = remaining.gain;
        Self {
            coordinates,
            found_by,
            fit,
            of_plant: None,
            remaining,
            times: 1,
            contradicted,
            has_rival: false,
            is_branched: false,
            apart: Vec::new(),
            deviations_elsewhere: Vec::new(),
        }
    }

    /// Returns whether the refinement has come to the minimum, or so near that it makes no difference.
    pub(super) fn is_reached(&self) -> bool {
        self.remaining <= REACHED && self.fit.objective.is_finite()
    }

    /// Residuals by which it is judged: those with the imperfections of the plant, if they have been fitted.
    pub(super) fn judged(&self) -> Judged {
        self.of_plant.unwrap_or_else(|| Judged::of(&self.fit))
    }

    /// Returns whether the residuals are larger than noise explains.
    pub(super) fn size_objects(&self) -> bool {
        let Judged { sum_of_squares, degrees_of_freedom, .. } = self.judged();
        !noise_explains(sum_of_squares, degrees_of_freedom)
    }

    /// Returns whether they have so much structure along the band, together or in one record or along one axis, that it matters. Residuals that
    /// are many times the noise may hold an error of the model that is small beside them, but not beside the noise.
    pub(super) fn structure_objects(&self) -> bool {
        let judged = self.judged();
        judged.structure.exceeds_anywhere(STRUCTURED / judged.inflation())
    }

    /// Returns whether they have structure along the band, however little, that noise hardly ever makes.
    pub(super) fn is_structured(&self) -> bool {
        self.judged().structure.is_there()
    }

    /// Returns whether noise hardly ever makes size and structure of the residuals together: the model is not quite that of the plant.
    pub(super) fn leaves_misfit(&self) -> bool {
        let misfit = self.excess().max(0.0) + self.judged().structure.significance.max(0.0);
        misfit.is_nan() || misfit > MISFIT
    }

    /// Returns whether the static tests' residuals by themselves are larger than their noise leaves them, or no number.
    pub(super) fn statics_object(&self) -> bool {
        let Judged { static_residuals, static_sum_of_squares, .. } = self.judged();
        !(0.0..=rarely_exceeded(static_residuals as f64)).contains(&static_sum_of_squares)
    }

    /// Returns whether the records' residuals are smaller than their noise leaves them: it was not read where nothing is cut. It would hide a
    /// wrong basin as well. Noise that is stated may be smaller, as long as the records stand clear of it.
    pub(super) fn noise_is_too_loud(&self) -> bool {
        if self.judged().has_stated_noise && self.stands_clear() {
            return false;
        }
        let Judged { sum_of_squares, degrees_of_freedom, .. } = self.judged();
        let Judged { static_sum_of_squares, static_residuals, .. } = self.judged();
        let of_records = sum_of_squares - static_sum_of_squares;
        let freedom = degrees_of_freedom - static_residuals as f64;
        of_records < (TOO_LOUD * freedom).min(rarely_undercut(freedom))
    }

    /// Returns whether the noise is too small to hide a wrong basin.
    pub(super) fn stands_clear(&self) -> bool {
        self.judged().ssp <= CLEAR
    }

    /// Returns whether noise explains the residuals, and by themselves those of the static tests, which are few beside those of the records; and
    /// is no louder than they are.
    pub(super) fn is_consistent(&self) -> bool {
        !self.size_objects() && !self.statics_object() && !self.noise_is_too_loud()
    }

    /// Returns whether the residuals are larger than the noise at rest, but random: the cut has more noise than the rest. A wrong model or
    /// minimum leaves structure.
    pub(super) fn is_noisier_than_at_rest(&self) -> bool {
        let Judged { sum_of_squares, degrees_of_freedom, .. } = self.judged();
        let is_sane = sum_of_squares <= FOREIGN * degrees_of_freedom;
        is_sane && self.size_objects() && !self.structure_objects() && !self.statics_object()
    }

    /// Returns whether noise explains the residuals, and hides nothing, and no older record objects.
    pub(super) fn is_explained(&self) -> bool {
        self.is_consistent() && self.stands_clear() && !self.contradicted
    }

    /// Returns whether it is explained, and a minimum.
    pub(super) fn is_beyond_doubt(&self) -> bool {
        self.is_reached() && self.is_explained() && !self.is_structured()
    }

    /// Returns whether noise explains the residuals, be it larger than at rest, and kept and retired records agree in it.
    pub(super) fn agrees(&self) -> bool {
        let is_noise = self.is_consistent() || self.is_noisier_than_at_rest();
        self.is_reached() && is_noise && !self.contradicted
    }

    /// Returns whether its residuals are so small that one of its branches may be the right minimum.
    pub(super) fn is_near(&self) -> bool {
        self.fit.sum_of_squares <= NEAR * self.fit.degrees_of_freedom
    }

    /// Returns whether size and structure of the residuals together are more than noise nearly ever makes them, though each by itself may be
    /// explained. Of seven wrong minima of drawn six-joint arms with one record, five are doubtful.
    pub(super) fn is_doubtful(&self) -> bool {
        self.excess() + self.judged().structure.significance > DOUBTFUL
    }

    /// Returns the excess of the residuals over the noise, in standard deviations.
    fn excess(&self) -> f64 {
        let Judged { sum_of_squares, degrees_of_freedom, .. } = self.judged();
        let freedom = degrees_of_freedom.max(1.0);
        let spread = libm::sqrt(2.0 / freedom + NOISE_ERROR * NOISE_ERROR);
        (sum_of_squares / freedom - 1.0) / spread
    }

    /// Keeps the better of the two minima. If both have reached the same minimum, adds their visits. `distance` is the squared distance between
    /// them in standard deviations.
    pub(super) fn compete(&mut self, mut other: Self, distance: f64) {
        let both_reached = self.is_reached() && other.is_reached();
        let same_place = other.is_same_place(distance);
        let same = self.is_as_good_as(&other) && same_place;
        if same && both_reached {
            self.times += other.times;
            other.times = self.times;
            self.has_rival |= other.has_rival;
            other.has_rival = self.has_rival;
        } else if both_reached && self.is_rivalled_by(&other, distance) {
            (self.has_rival, other.has_rival) = (true, true);
        }
        if same {
            other.is_branched |= self.is_branched;
            other.remember(self.apart.iter().copied());
            other.remember_deviations(self.deviations_elsewhere.iter().copied());
            other.of_plant = other.of_plant.or(self.of_plant);
        }
        // Of one that did not get there and the same that did, the latter.
        let better = if same && self.is_reached() != other.is_reached() {
            other.is_reached()
        } else {
            let [own, other] = self.ranks(&other);
            // What is no number is the worst.
            other.total_cmp(&own).is_lt()
        };
        if better {
            *self = other;
        }
    }

    /// Remembers a worse minimum that the data do not exclude, whose unknowns lie `away`. Its variances count as its probability
    /// allows.
    pub(super) fn remember_rival(&mut self, rival: &Self, away: impl Iterator<Item = f64>) {
        let gap = (rival.deviance() - self.deviance()).max(0.0);
        let weight = 2.0 * probability(gap, self.inflation());
        let deviations: Vec<f64, MAX_UNKNOWNS> = (0..rival.fit.covariance.unknowns())
            .map(|unknown| {
                let [own, other] = [&*self, rival].map(|one| one.fit.covariance.deviation(unknown));
                let variance = (1.0 - weight) * own * own + weight * other * other;
                // Zero times infinity, of an unknown that is undetermined.
                if variance.is_nan() { f64::INFINITY } else { libm::sqrt(variance) }
            })
            .collect();
        self.remember(away.map(|away| [Rival { away, gap }; 2]));
        self.remember_deviations(deviations.into_iter());
    }

    /// Remembers another explanation of the records, whose unknowns lie `away`, as one that is as likely.
    pub(super) fn remember_explanation(&mut self, away: &[f64]) {
        let unknowns = self.fit.covariance.unknowns();
        self.remember(away[..unknowns].iter().map(|&away| [Rival { away, gap: 0.0 }; 2]));
    }

    /// Remembers the rivals of a worse minimum that lies `away`.
    pub(super) fn remember_rivals_of(&mut self, worse: &Self, away: impl Iterator<Item = f64>) {
        let gap = (worse.deviance() - self.deviance()).max(0.0);
        let shifted = worse.apart.iter().zip(away).map(|(apart, away)| {
            apart.map(|rival| Rival { away: rival.away + away, gap: rival.gap + gap })
        });
        self.remember(shifted);
        self.remember_deviations(worse.deviations_elsewhere.iter().copied());
    }

    /// Keeps, for each unknown, the rivals that count more than those it remembers.
    fn remember(&mut self, rivals: impl Iterator<Item = [Rival; 2]>) {
        let inflation = self.inflation();
        for (unknown, new) in rivals.enumerate() {
            if unknown == self.apart.len() {
                // As many as a fit has unknowns, for which there is room.
                let _ = self.apart.push([Rival::default(); 2]);
            }
            let Some([below, above]) = self.apart.get_mut(unknown) else { return };
            for rival in new {
                let side = if rival.away < 0.0 { &mut *below } else { &mut *above };
                if rival.shift(inflation).abs() > side.shift(inflation).abs() {
                    *side = rival;
                }
            }
        }
    }

    /// Standard deviation of an unknown, here or at another point that the data do not exclude: the largest.
    pub(super) fn deviation(&self, unknown: usize) -> f64 {
        let elsewhere = self.deviations_elsewhere.get(unknown).copied().unwrap_or(0.0);
        self.fit.covariance.deviation(unknown).max(elsewhere)
    }

    /// Remembers the standard deviations at another point that the data do not exclude.
    pub(super) fn remember_deviations(&mut self, deviations: impl Iterator<Item = f64>) {
        for (unknown, deviation) in deviations.enumerate() {
            match self.deviations_elsewhere.get_mut(unknown) {
                Some(own) => *own = own.max(deviation),
                None => drop(self.deviations_elsewhere.push(deviation)),
            }
        }
    }

    /// Takes the errors as those of this minimum or of a rival. Their mean square about the minimum is the mean of both variances and
    /// `p away²`, where p is the rival's probability; of each unknown that rival counts for which it is the largest.
    pub(super) fn spread(&mut self, sought: &Sought) {
        self.fit.mix(sought, &self.deviations_elsewhere);
        if !self.apart.is_empty() {
            let inflation = self.inflation();
            let shifts = self.apart.iter().map(|rivals| {
                let [below, above] = rivals.map(|rival| rival.shift(inflation));
                if -below > above { below } else { above }
            });
            let shifts: Vec<f64, MAX_UNKNOWNS> = shifts.collect();
            self.fit.widen(sought, &shifts);
        }
    }

    /// Returns whether both have the same objective, but for [`SAME_MINIMUM`].
    pub(super) fn is_as_good_as(&self, other: &Self) -> bool {
        let (own, other) = (self.fit.objective, other.fit.objective);
        (own - other).abs() <= 1.0 + SAME_MINIMUM * other
    }

    /// −2 ln of the evidence of the minimum, but for a constant (Laplace's approximation: Kass and Raftery, "Bayes factors", 1995,
    /// section 4.1). By the sum of squares alone, one of many narrow minima would explain the noise better than the right one.
    pub(super) fn deviance(&self) -> f64 {
        self.fit.objective + self.fit.log_information
    }

    /// Returns whether the two lie in different places, and the data do not say which is right.
    pub(super) fn is_rivalled_by(&self, other: &Self, distance: f64) -> bool {
        let gap = (self.deviance() - other.deviance()).abs();
        !other.is_same_place(distance) && (gap < self.beyond_doubt() || self.is_as_good_as(other))
    }

    /// Returns whether it is better than another one beyond doubt.
    pub(super) fn is_clearly_better_than(&self, other: &Self) -> bool {
        let beyond_doubt = self.beyond_doubt();
        let [own, other] = self.ranks(other);
        own < other - beyond_doubt
    }

    /// Difference of the deviances beyond which one minimum is better beyond doubt. Where the perfect model does not explain the records,
    /// errors of the model change deviances as noise of that size would.
    fn beyond_doubt(&self) -> f64 {
        if self.of_plant.is_some() { RIVAL * self.inflation() } else { RIVAL }
    }

    /// Ranks of the two, the smaller the better: the deviance, or the sum of squares if either is no minimum yet, for which Laplace's
    /// approximation does not hold. If both have been judged on the plant, it is that of their fits there.
    fn ranks(&self, other: &Self) -> [f64; 2] {
        if let (Some(own), Some(other)) = (self.of_plant, other.of_plant) {
            return [own, other].map(|fit| fit.objective + fit.log_information);
        }
        let both_reached = self.is_reached() && other.is_reached();
        [self, other].map(|one| if both_reached { one.deviance() } else { one.fit.objective })
    }

    /// χ² per degree of freedom, but at least 1.
    pub(super) fn inflation(&self) -> f64 {
        self.fit.inflation()
    }

    /// Returns whether a point at this squared distance is the same minimum. Residuals larger than the noise make the standard deviations larger,
    /// too.
    pub(super) fn is_same_place(&self, distance: f64) -> bool {
        distance <= SAME_PLACE * self.inflation()
    }

    /// Returns whether the contradiction of retired records is more than the model's own error makes, which differs from cut to cut: that error
    /// is what noise does not explain of `alone`, the records that are kept without them.
    pub(super) fn is_contradicted_beyond(&self, alone: &Self) -> bool {
        let error = (alone.fit.sum_of_squares - alone.fit.degrees_of_freedom).max(0.0);
        self.fit.contradiction > rarely_exceeded(self.fit.covariance.rank() as f64) + error
    }

    /// Returns whether there are more residuals than unknowns, so that a wrong model would show.
    pub(super) fn is_tested(&self) -> bool {
        self.fit.degrees_of_freedom >= 1.0
    }
}

impl Rival {
    /// `√p away`, with p its [`probability`].
    fn shift(&self, inflation: f64) -> f64 {
        libm::sqrt(probability(self.gap, inflation)) * self.away
    }
}

/// Probability of the worse one of two minima, but at least [`RARE`]: `1/(1 + e^(Δ/2))`, where Δ is the difference of their deviances
/// over χ² per degree of freedom.
fn probability(gap: f64, inflation: f64) -> f64 {
    (1.0 / (1.0 + libm::exp(0.5 * gap / inflation))).max(RARE)
}

/// Returns whether residuals have more structure than any noise, also one that has lines: in all records together, as a wrong minimum has.
pub(super) fn structure_is_beyond_noise(structure: &Structure) -> bool {
    structure.exceeds(STRUCTURED_BEYOND_NOISE)
}

/// Returns whether a fit whose residuals have this structure may be consistent. Robust standard deviations allow for more.
pub(super) fn structure_is_allowed_for(structure: &Structure, is_robust: bool) -> bool {
    !structure.exceeds(if is_robust { STRUCTURED_AS_WRONG } else { STRUCTURED_BEYOND_NOISE })
}

#[cfg(test)]
pub(super) mod tests;
