//! What a refinement has come to, and whether noise explains it.

use core::f64::consts::FRAC_1_SQRT_2;

use heapless::Vec;

use super::FoundBy;
use crate::refine::{Fit, Remaining};
use crate::unknowns::{Coordinates, MAX_UNKNOWNS, Sought};

/// χ² per degree of freedom up to which noise explains the residuals, if they are many. The noise itself is known from a
/// few hundred quiet samples to 7 % of its power; the nearest wrong basin of the reference scenario lies at 2.
const CONSISTENT: f64 = 1.3;
/// χ² per degree of freedom below which the noise is taken for louder than it is, if the residuals are many: the nearest wrong
/// basin of the reference scenario, at 2, would then be below 1.
const TOO_LOUD: f64 = 0.5;
/// Whiteness up to which noise explains the residuals' structure.
const STRUCTURED: f64 = 4.0;
/// Whiteness that no noise explains: hum between the lines that are taken for noise makes 10, the wrong minima of drawn six-joint
/// arms whose χ² noise would explain 24 to 72.
const STRUCTURED_BEYOND_NOISE: f64 = 16.0;
/// Median SSP up to which the records stand clear of the noise: with ten times the noise of the reference scenario (0.14)
/// one wrong basin in twenty has residuals that noise explains.
const CLEAR: f64 = 0.05;
/// Relative error of the noise's power over the three directions, of each of which it is known to 7 %.
const NOISE_ERROR: f64 = 0.04;
/// Size and structure of the residuals together, each in its standard deviations, above which a minimum that leaves a stiffness
/// undetermined is doubtful. The sum is about N(0, 2): noise exceeds it once in 430.
const DOUBTFUL: f64 = 4.0;
/// Two minima are equally good if their sums of squares differ by less than 1, and this part of them.
const SAME_MINIMUM: f64 = 1e-4;
/// Difference of the sums of squares below which the worse of two minima in different places may be the right one: the likelihood
/// of the worse is e⁻⁵ of the better's there, and an interval of 95 % allows itself no more than one in twenty.
pub(super) const RIVAL: f64 = 10.0;
/// Gain in the sum of squares up to which a minimum counts as reached although a step would still gain it. No parameter
/// then lies farther from the minimum than its own standard deviation, since `δᵢ² ≤ Cᵢᵢ δᵀNδ`; the deviations are widened
/// by the way that is left, and their intervals cover no less than at the minimum.
pub(super) const REACHED: f64 = 1.0;
/// Squared distance `Δθᵀ N Δθ` up to which two points are the same minimum: each may be `√REACHED` from it.
pub(super) const SAME_PLACE: f64 = 4.0 * REACHED;

/// Where a refinement has ended.
#[derive(Clone, Debug)]
pub(super) struct Minimum {
    pub(super) coordinates: Coordinates,
    pub(super) found_by: FoundBy,
    pub(super) fit: Fit,
    /// What a step would still gain.
    remaining: f64,
    /// How often it has been reached.
    pub(super) times: u32,
    /// Retired records and those that are kept are not of the same robot.
    pub(super) contradicted: bool,
    /// Another minimum elsewhere is hardly worse, so that the data do not say which of the two is right.
    pub(super) has_rival: bool,
    /// How far the unknowns of other minima lie that the data do not exclude; empty without one.
    pub(super) apart: Vec<f64, MAX_UNKNOWNS>,
    /// The largest standard deviation of every unknown at other points that the data do not exclude; empty without one.
    pub(super) deviations_elsewhere: Vec<f64, MAX_UNKNOWNS>,
}

impl Minimum {
    /// Where a refinement has ended, with what is left to the minimum there.
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
            remaining,
            times: 1,
            contradicted,
            has_rival: false,
            apart: Vec::new(),
            deviations_elsewhere: Vec::new(),
        }
    }

    /// The refinement has come to the minimum, or so near that it makes no difference.
    pub(super) fn is_reached(&self) -> bool {
        self.remaining <= REACHED && self.fit.objective.is_finite()
    }

    /// The residuals are larger than noise explains.
    pub(super) fn size_objects(&self) -> bool {
        !noise_explains(self.fit.sum_of_squares, self.fit.degrees_of_freedom)
    }

    /// They have more structure along the band than noise explains; what is no number has.
    pub(super) fn whiteness_objects(&self) -> bool {
        self.fit.whiteness.is_nan() || self.fit.whiteness > STRUCTURED
    }

    /// The static tests' residuals by themselves are larger than their noise leaves them; what is no number is.
    pub(super) fn statics_object(&self) -> bool {
        let most = rarely_exceeded(self.fit.static_residuals as f64);
        !(0.0..=most).contains(&self.fit.static_sum_of_squares)
    }

    /// The records' residuals are smaller than their noise leaves them: it was not read where nothing is cut. It would hide a
    /// wrong basin as well.
    pub(super) fn noise_is_too_loud(&self) -> bool {
        let Fit { sum_of_squares, degrees_of_freedom, .. } = self.fit;
        let of_records = sum_of_squares - self.fit.static_sum_of_squares;
        let freedom = degrees_of_freedom - self.fit.static_residuals as f64;
        of_records < (TOO_LOUD * freedom).min(rarely_undercut(freedom))
    }

    /// The noise is too small to hide a wrong basin.
    pub(super) fn stands_clear(&self) -> bool {
        self.fit.ssp[0] <= CLEAR
    }

    /// Noise explains the residuals, and by themselves those of the static tests, which the many of the records would
    /// outvote; and it is no louder than they are.
    pub(super) fn is_consistent(&self) -> bool {
        !self.size_objects() && !self.statics_object() && !self.noise_is_too_loud()
    }

    /// Noise explains the residuals, and hides nothing; and no older record objects.
    pub(super) fn is_explained(&self) -> bool {
        self.is_consistent() && self.stands_clear() && !self.contradicted
    }

    /// It is explained, and a minimum.
    pub(super) fn is_beyond_doubt(&self) -> bool {
        self.is_reached() && self.is_explained() && !self.whiteness_objects()
    }

    /// Size and structure of the residuals together are more than noise nearly ever makes them, though each by itself may be
    /// explained. Of seven wrong minima of drawn six-joint arms with one record, five are doubtful.
    pub(super) fn is_doubtful(&self) -> bool {
        let freedom = self.fit.degrees_of_freedom.max(1.0);
        let spread = libm::sqrt(2.0 / freedom + NOISE_ERROR * NOISE_ERROR);
        let size = (self.fit.sum_of_squares / freedom - 1.0) / spread;
        size + self.fit.whiteness > DOUBTFUL
    }

    /// Becomes the better of the two; what has been reached twice has been reached as often as both. `distance` is the
    /// squared distance between them in standard deviations.
    pub(super) fn compete(&mut self, mut other: Self, distance: f64) {
        let both_reached = self.is_reached() && other.is_reached();
        let same_place = other.has_place(distance);
        let same = self.is_as_good_as(&other) && same_place;
        if same && both_reached {
            self.times += other.times;
            other.times = self.times;
            self.has_rival |= other.has_rival;
            other.has_rival = self.has_rival;
        } else if both_reached && self.is_rivalled_by(&other, distance) {
            (self.has_rival, other.has_rival) = (true, true);
        }
        // Of one that did not get there and the same that did, the latter.
        let better = if same && self.is_reached() != other.is_reached() {
            other.is_reached()
        } else {
            other.fit.objective < self.fit.objective
        };
        if better {
            *self = other;
        }
    }

    /// Remembers another minimum that the data do not exclude, which lies `apart` and has these standard deviations.
    pub(super) fn remember(
        &mut self,
        apart: impl Iterator<Item = f64>,
        deviations: impl Iterator<Item = f64>,
    ) {
        enlarge(&mut self.apart, apart);
        self.remember_deviations(deviations);
    }

    /// Standard deviation of an unknown, here or at another point that the data do not exclude: the largest.
    pub(super) fn deviation(&self, unknown: usize) -> f64 {
        let elsewhere = self.deviations_elsewhere.get(unknown).copied().unwrap_or(0.0);
        self.fit.covariance.deviation(unknown).max(elsewhere)
    }

    /// Remembers the standard deviations at another point that the data do not exclude.
    pub(super) fn remember_deviations(&mut self, deviations: impl Iterator<Item = f64>) {
        enlarge(&mut self.deviations_elsewhere, deviations);
    }

    /// Takes the errors as those of two points that are equally likely: this minimum, and one that lies `apart`. Their mean square
    /// about the minimum is the mean of both variances and `½ apart²`.
    pub(super) fn spread(&mut self, sought: &Sought) {
        self.fit.mix(sought, &self.deviations_elsewhere);
        if !self.apart.is_empty() {
            let shift: Vec<f64, MAX_UNKNOWNS> =
                self.apart.iter().map(|apart| FRAC_1_SQRT_2 * apart).collect();
            self.fit.widen(sought, &shift);
        }
    }

    /// What a refinement makes least is the same for both.
    fn is_as_good_as(&self, other: &Self) -> bool {
        let (own, other) = (self.fit.objective, other.fit.objective);
        (own - other).abs() <= 1.0 + SAME_MINIMUM * other
    }

    /// The two lie in different places, and the data do not say which is right.
    pub(super) fn is_rivalled_by(&self, other: &Self, distance: f64) -> bool {
        let gap = (self.fit.objective - other.fit.objective).abs();
        !other.has_place(distance) && (gap < RIVAL || self.is_as_good_as(other))
    }

    /// Whether a point at this squared distance is the same minimum. Residuals larger than the noise make the standard
    /// deviations larger, too.
    pub(super) fn has_place(&self, distance: f64) -> bool {
        let inflation = self.fit.sum_of_squares / self.fit.degrees_of_freedom.max(1.0);
        distance <= SAME_PLACE * inflation.max(1.0)
    }

    /// Whether the contradiction of retired records is more than the model's own error makes, which differs from cut to cut:
    /// that error is what noise does not explain of `alone`, the records that are kept without them.
    pub(super) fn is_contradicted_beyond(&self, alone: &Self) -> bool {
        let error = (alone.fit.sum_of_squares - alone.fit.degrees_of_freedom).max(0.0);
        self.fit.contradiction > rarely_exceeded(self.fit.covariance.rank() as f64) + error
    }

    /// There are more residuals than unknowns, so that a wrong model would show.
    pub(super) fn is_tested(&self) -> bool {
        self.fit.degrees_of_freedom >= 1.0
    }
}

/// Of each unknown the value that is larger by its size.
fn enlarge(own: &mut Vec<f64, MAX_UNKNOWNS>, new: impl Iterator<Item = f64>) {
    for (unknown, new) in new.enumerate() {
        match own.get_mut(unknown) {
            Some(own) if new.abs() > own.abs() => *own = new,
            Some(_) => {}
            // As many as a fit has unknowns, for which there is room.
            None => drop(own.push(new)),
        }
    }
}

/// Whether residuals of this whiteness have more structure than any noise, also one that has lines; what is no number has.
pub(super) fn structure_is_beyond_noise(whiteness: f64) -> bool {
    whiteness.is_nan() || whiteness > STRUCTURED_BEYOND_NOISE
}

/// Whether noise leaves a sum of squares of this size; none that is no number.
fn noise_explains(sum_of_squares: f64, degrees_of_freedom: f64) -> bool {
    let most = (CONSISTENT * degrees_of_freedom).max(rarely_exceeded(degrees_of_freedom));
    (0.0..=most).contains(&sum_of_squares)
}

/// What χ² of so many degrees of freedom exceeds with a chance below e⁻¹⁰ (Laurent and Massart, 2000, lemma 1).
fn rarely_exceeded(degrees_of_freedom: f64) -> f64 {
    degrees_of_freedom + 2.0 * libm::sqrt(10.0 * degrees_of_freedom) + 2.0 * 10.0
}

/// What χ² of so many degrees of freedom falls below with a chance below e⁻¹⁰ (the same lemma).
fn rarely_undercut(degrees_of_freedom: f64) -> f64 {
    degrees_of_freedom - 2.0 * libm::sqrt(10.0 * degrees_of_freedom.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Nuisances;
    use crate::refine::Information;

    /// Where nothing is left to gain: so many residuals of this χ², of which static tests have a part.
    fn fit(sum_of_squares: f64, degrees_of_freedom: f64, statics: [f64; 2]) -> Fit {
        let sought = Sought::new(1, &Nuisances::default()).unwrap();
        let mut information = Information::none(sought.unknowns());
        information.add_known(0, 0.01);
        Fit {
            sum_of_squares,
            objective: sum_of_squares,
            degrees_of_freedom,
            static_sum_of_squares: statics[0],
            static_residuals: statics[1] as usize,
            deviations: [f64::INFINITY; _],
            covariance: information.covariance(),
            ssp: [0.1; 2],
            whiteness: 0.0,
            contradiction: 0.0,
        }
    }

    /// A minimum of two thousand residuals that noise explains, with `gain` left to it, along the first unknown, whose
    /// standard deviation is 0.01.
    fn minimum(sum_of_squares: f64, gain: f64) -> Minimum {
        let sought = Sought::new(1, &Nuisances::default()).unwrap();
        let mut step = [0.0; MAX_UNKNOWNS];
        step[0] = 0.01 * libm::sqrt(gain);
        let fit = fit(sum_of_squares, 2000.0, [0.0; 2]);
        Minimum::new([0.0; _], FoundBy::Descent, fit, &Remaining { step, gain }, &sought)
    }

    #[test]
    fn residuals_far_below_the_noise_are_not_consistent() {
        for (sum_of_squares, freedom, statics, too_loud) in [
            (200.0, 10_000.0, [0.0; 2], true),
            (4_900.0, 10_000.0, [0.0; 2], true),
            (5_100.0, 10_000.0, [0.0; 2], false),
            // A few may be as small by chance.
            (0.1, 30.0, [0.0; 2], false),
            (55.0, 160.0, [0.0; 2], true),
            (75.0, 120.0, [0.0; 2], false),
            // Readings by hand may be better than their user says.
            (10_000.1, 10_100.0, [0.1, 100.0], false),
            (0.1, 100.0, [0.1, 100.0], false),
        ] {
            let fit = fit(sum_of_squares, freedom, statics);
            let minimum = Minimum { fit, ..minimum(2000.0, 0.0) };
            assert_eq!(minimum.noise_is_too_loud(), too_loud, "{sum_of_squares} of {freedom}");
            assert_eq!(minimum.is_consistent(), !too_loud, "{sum_of_squares} of {freedom}");
        }
    }
    #[test]
    fn a_minimum_is_reached_twice_only_at_the_same_place() {
        let cases = [
            // Gains left, sums of squares, squared distance: times reached, rival.
            ([0.0, 0.0], [2000.0, 2000.5], 1e-3, (2, false)),
            ([0.9, 0.9], [2000.0, 2000.5], 3.9, (2, false)),
            ([0.0, 0.0], [2000.0, 2000.5], 1e4, (1, true)),
            // The likelihood of the worse is 0.22, 0.05 and 0.008 of the better's.
            ([0.0, 0.0], [2000.0, 2003.0], 1e4, (1, true)),
            ([0.0, 0.0], [2006.0, 2000.0], 1e4, (1, true)),
            ([0.0, 0.0], [2000.0, 2009.6], 1e4, (1, true)),
            ([0.0, 0.0], [2000.0, 2010.0], 1e4, (1, false)),
            // One basin, and one that was not reached.
            ([0.0, 0.0], [2000.0, 2003.0], 3.9, (1, false)),
            ([0.0, 2.0], [2000.0, 2003.0], 1e4, (1, false)),
            ([0.0, 2.0], [2000.0, 2000.5], 1e-3, (1, false)),
            ([0.0, 2.0], [2000.0, 2000.5], 1e4, (1, false)),
            // Residuals of a hundred times the noise: so is the distance.
            ([0.0, 0.0], [2e5, 2e5 + 1.0], 300.0, (2, false)),
        ];
        for (gains, sums, distance, expected) in cases {
            let mut best = minimum(sums[0], gains[0]);
            best.compete(minimum(sums[1], gains[1]), distance);
            assert_eq!((best.times, best.has_rival), expected, "{gains:?} {sums:?} {distance}");
        }
    }

    /// However often the better of two is reached, the worse one remains possible.
    #[test]
    fn a_rival_is_not_outvoted() {
        let mut best = minimum(2000.0, 0.0);
        best.compete(minimum(2004.0, 0.0), 1e4);
        best.compete(minimum(2000.0, 0.0), 1e-3);
        assert!(best.has_rival && best.times == 2);
    }

    /// A better minimum has no rival in a worse one's.
    #[test]
    fn a_better_minimum_has_no_rival_among_the_worse() {
        let mut best = minimum(2010.0, 0.0);
        best.compete(minimum(2010.0, 0.0), 1e4);
        assert!(best.has_rival);
        best.compete(minimum(2000.0, 0.0), 1e4);
        assert!(!best.has_rival && best.times == 1);
    }

    /// Of each unknown the farthest of several rivals counts, with the largest standard deviation at any of them.
    #[test]
    fn the_errors_hold_the_farthest_rivals() {
        let sought = Sought::new(1, &Nuisances::default()).unwrap();
        let mut minimum = minimum(2000.0, 0.0);
        let unknowns = |first: f64, second: f64| {
            (0..sought.unknowns()).map(move |i| [first, second].get(i).copied().unwrap_or(0.0))
        };
        minimum.spread(&sought);
        assert!((minimum.fit.deviations[0] - 0.01).abs() < 1e-12);
        minimum.remember(unknowns(0.3, -0.1), unknowns(0.07, 0.0));
        minimum.remember(unknowns(-0.4, 0.05), unknowns(0.02, 0.0));
        assert_eq!(minimum.apart[..2], [-0.4, -0.1]);
        minimum.spread(&sought);
        let widened = libm::sqrt(0.05 * 0.05 + 0.5 * 0.4 * 0.4);
        assert!((minimum.fit.deviations[0] - widened).abs() < 1e-12);
    }

    #[test]
    fn size_and_structure_are_looked_at_together() {
        let freedom = 5000.0;
        let spread = libm::sqrt(2.0 / freedom + 0.04 * 0.04);
        for (size, whiteness, doubtful) in [
            (0.0, 3.9, false),
            (0.0, 4.1, true),
            (3.9, 0.0, false),
            (4.1, 0.0, true),
            (1.9, 2.0, false),
            (2.1, 2.0, true),
            (-1.0, 4.9, false),
            (4.9, -1.0, false),
        ] {
            let fit = fit(freedom * (1.0 + size * spread), freedom, [0.0; 2]);
            let minimum = Minimum { fit: Fit { whiteness, ..fit }, ..minimum(2000.0, 0.0) };
            assert_eq!(minimum.is_doubtful(), doubtful, "{size} {whiteness}");
        }
    }

    #[test]
    fn what_is_left_to_a_minimum_widens_its_deviations() {
        for (gain, reached, deviation) in [
            (0.0, true, 0.01),
            (0.25, true, 0.0125_f64.sqrt() * 0.1),
            (1.1, false, 0.021_f64.sqrt() * 0.1),
        ] {
            let minimum = minimum(2000.0, gain);
            assert_eq!(minimum.is_reached(), reached, "{gain}");
            let widened = minimum.fit.deviations[0];
            assert!(
                (widened / deviation - 1.0).abs() < 1e-12,
                "{gain}: {widened}, not {deviation}"
            );
            assert_eq!(minimum.fit.deviations[1], f64::INFINITY);
        }
        assert!(!minimum(2000.0, f64::NAN).is_reached());
    }

    #[test]
    fn few_residuals_may_be_larger_than_many() {
        for (sum_of_squares, degrees_of_freedom, explained) in [
            (12_900.0, 10_000.0, true),
            (13_100.0, 10_000.0, false),
            (30.0, 10.0, true),
            (60.0, 10.0, false),
            (f64::NAN, 10.0, false),
            (f64::INFINITY, 10.0, false),
            (-1.0, 10.0, false),
        ] {
            let told = noise_explains(sum_of_squares, degrees_of_freedom);
            assert_eq!(told, explained, "{sum_of_squares} of {degrees_of_freedom}");
        }
    }
}
