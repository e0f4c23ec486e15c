//! The result of a settled fit.

use heapless::Vec;

use super::FoundBy;
use super::minimum::{Minimum, Rival, structure_is_beyond_noise};
use crate::imperfection::FoundImperfection;
use crate::parameters::Bushings;
use crate::refine::{Agreement, Plant, Problem, Refinement, Structure, lies_on_bound};
use crate::search::MAX_EXPERIMENTS;
use crate::sought::{Coordinate, Coordinates, MAX_SOUGHT, MAX_UNKNOWNS};
use crate::statics::{LeftOut, MAX_STATIC_TESTS};
use crate::verdict::{Covariance, Direction, MAX_DIRECTIONS, Trust};

/// How far a settled estimate can be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Acceptance {
    /// The residuals are as large as the noise explains, on a plant that is not perfect with the imperfections fitted; where they have more
    /// structure than noise, up to 25 %, the standard deviations are robust. Or they are random, and up to ten times as large: the cut has more
    /// noise than the rest.
    Consistent,
    /// Several searches have reached this minimum, and its residuals are larger than the noise explains, or have more structure: the model is
    /// wrong.
    ModelSuspect,
    /// The budget of starts ran out before either; or the residuals are too few to test the model, or far smaller than the stated
    /// noise.
    Unsettled,
}

/// The parameters, and how far they can be trusted.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Stiffness and damping of every joint.
    pub bushings: Bushings,
    /// Standard deviation of each, same units; infinite where the data do not determine it.
    pub standard_deviations: Bushings,
    /// Surface similarity parameter per direction and experiment: the median of them.
    pub ssp_median: f64,
    /// The largest of them.
    pub ssp_max: f64,
    /// χ² per degree of freedom; 1 when noise alone explains the residuals.
    pub consistency: f64,
    /// Residuals less the unknowns that they determine: below 1 nothing is left to test the model by.
    pub degrees_of_freedom: f64,
    /// Sum of squares of the static tests' residuals per displacement measured, about 1 or less when their noise alone
    /// explains them; none without static tests.
    pub static_consistency: Option<f64>,
    /// Each static test, in their order: its residuals, and those of a fit without it.
    pub static_tests: Vec<LeftOut, MAX_STATIC_TESTS>,
    /// How far it can be believed.
    pub acceptance: Acceptance,
    /// The method that found it.
    pub found_by: FoundBy,
    /// Structure of the residuals along the band. Where there is some, the model or the colour of the noise is wrong.
    pub structure: Structure,
    /// The residuals are larger than noise explains.
    pub size_objects: bool,
    /// The residuals are far smaller than the stated noise, which is then too large.
    pub noise_too_loud: bool,
    /// The residuals have so much structure along the band, in units of the noise, that it matters to the intervals.
    pub structure_objects: bool,
    /// The residuals of the static tests by themselves are larger than their noise explains.
    pub statics_object: bool,
    /// The records stand clear of the noise, so that it cannot hide a wrong minimum.
    pub stands_clear: bool,
    /// Covariance of the unknowns; [`Identifier::sought`](super::Identifier::sought) says which they are.
    pub covariance: Covariance,
    /// Combinations of unknowns that the data determine badly, the worst first. Without records no single damping is one.
    pub weak_directions: Vec<Direction, MAX_DIRECTIONS>,
    /// The standard deviations hold also where the residuals are not those of noise: they are no smaller than those by the scatter
    /// between blocks of the records.
    pub is_robust: bool,
    /// The records need imperfections that no plausible plant has: the minimum may be a wrong one, or a parameter fixed at a wrong
    /// value.
    pub is_of_implausible_plant: bool,
    /// Agreement of each experiment with a fit to the others, in their order; empty if there are no others.
    pub held_out: Vec<Agreement, MAX_EXPERIMENTS>,
    /// The imperfections that were sought with the parameters.
    pub imperfections: Vec<FoundImperfection, MAX_SOUGHT>,
    /// Number of kept experiments in the fit; 0 where it rests on static tests alone.
    pub experiments: usize,
    /// Number of retired records, whose information is in the numbers.
    pub retired: u64,
    /// Number of retired records that were dropped because newer ones contradict them: the robot has changed.
    pub forgotten: u64,
    pub(super) coordinates: Coordinates,
    /// For each unknown, the farthest rival below and above the minimum; empty without one.
    pub(super) apart: Vec<[Rival; 2], MAX_UNKNOWNS>,
    /// The largest standard deviation of every unknown at other points that the data do not exclude; empty without one.
    pub(super) deviations_elsewhere: Vec<f64, MAX_UNKNOWNS>,
}

impl Estimate {
    /// Returns whether the residuals have more structure along the band than any noise, also one that has lines.
    pub fn is_structured_beyond_noise(&self) -> bool {
        structure_is_beyond_noise(&self.structure)
    }

    /// Returns the estimate of a minimum, where `refinement` stands and has been [fitted](Refinement::fit) to so many `experiments`, with the
    /// imperfections of `plant`. The
    /// prediction of the experiments held out is the caller's.
    pub(super) fn of(
        minimum: &Minimum,
        acceptance: Acceptance,
        forgotten: u64,
        refinement: &Refinement,
        problem: &Problem<'_>,
        experiments: usize,
        plant: Option<&mut Plant>,
    ) -> Self {
        // Static tests determine dampings in no pose.
        let moves = experiments > 0 || refinement.retired() > 0;
        let is_damping = |unknown| {
            matches!(problem.sought.coordinate(unknown), Some(Coordinate::Damping { .. }))
        };
        let weak_directions = refinement.weak_directions(|unknown| moves || !is_damping(unknown));
        let bushings = refinement.bushings(problem.sought);
        let fit = &minimum.fit;
        Self {
            standard_deviations: within(problem, minimum, &bushings),
            bushings,
            ssp_median: fit.ssp[0],
            ssp_max: fit.ssp[1],
            consistency: fit.sum_of_squares / fit.degrees_of_freedom.max(1.0),
            degrees_of_freedom: fit.degrees_of_freedom,
            static_consistency: (fit.static_residuals > 0)
                .then(|| fit.static_sum_of_squares / fit.static_residuals as f64),
            static_tests: refinement.static_tests_left_out(problem, fit, moves, plant),
            acceptance,
            found_by: minimum.found_by,
            structure: fit.structure,
            size_objects: minimum.size_objects(),
            noise_too_loud: minimum.noise_is_too_loud(),
            structure_objects: minimum.structure_objects(),
            statics_object: minimum.statics_object(),
            stands_clear: minimum.stands_clear(),
            weak_directions,
            is_robust: false,
            is_of_implausible_plant: false,
            held_out: Vec::new(),
            experiments,
            imperfections: problem.sought.found(&minimum.coordinates, &fit.covariance),
            retired: refinement.retired(),
            forgotten,
            coordinates: minimum.coordinates,
            apart: minimum.apart.clone(),
            deviations_elsewhere: minimum.deviations_elsewhere.clone(),
            covariance: minimum.fit.covariance.clone(),
        }
    }

    /// How far its parameters can be trusted: none is identified in a fit that did not settle, that static tests contradict, that needs
    /// imperfections of no plausible plant, or, unless its standard deviations are robust, whose residuals show a wrong model: they have more
    /// structure than any noise, or are both larger and more alike than noise makes them.
    pub fn trust(&self) -> Trust {
        let settled = self.acceptance != Acceptance::Unsettled
            && !self.statics_object
            && !self.is_of_implausible_plant;
        if self.is_robust {
            return Trust::robust(self.consistency, settled);
        }
        let wrong =
            self.is_structured_beyond_noise() || self.size_objects && self.structure_objects;
        Trust::new(self.consistency, settled && !wrong)
    }
}

/// Standard deviations in the parameters' units; infinite for a parameter on a bound, where the data would move it further.
fn within(problem: &Problem<'_>, minimum: &Minimum, bushings: &Bushings) -> Bushings {
    let Problem { sought, bounds, .. } = *problem;
    let ranges = sought.ranges(&minimum.coordinates, bounds);
    let mut deviations = bushings.clone();
    let values = deviations.iter_mut().flat_map(|b| b.stiffness.iter_mut().chain(&mut b.damping));
    for (index, value) in values.enumerate() {
        let relative = minimum.fit.deviations[index];
        // A parameter that is fixed may lie anywhere; those that are tied may lie where all of them may.
        let unknown = sought.unknown(Coordinate::of(index));
        let at_end = unknown.is_some_and(|unknown| lies_on_bound(&ranges[unknown]));
        *value = if at_end { f64::INFINITY } else { *value * relative };
    }
    deviations
}

#[cfg(test)]
pub(super) mod tests {
    use std::boxed::Box;

    use super::super::Identifier;
    use super::super::deferred::tests::identifier;
    use super::super::minimum::tests::{minimum, of_size};
    use super::*;
    use crate::verdict::Verdict;

    /// Of residuals as large as noise makes them, with so much structure.
    pub(in crate::identify) fn estimate(structure: f64) -> Box<Estimate> {
        let identifier = identifier();
        let mut minimum = minimum(2000.0, 0.0);
        minimum.fit.structure = of_size(structure);
        let Identifier { chain, measurement, bounds, sought, statics, level, .. } = &*identifier;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: *level };
        let (accepted, refinement) = (Acceptance::ModelSuspect, &identifier.refinement);
        Box::new(Estimate::of(&minimum, accepted, 0, refinement, &problem, 3, None))
    }

    #[test]
    fn structure_beyond_noise_lets_nothing_be_identified_unless_deviations_are_robust() {
        for (structure, is_robust, expected) in [
            (0.2, false, Verdict::Identified),
            (0.22, false, Verdict::Weak),
            (0.22, true, Verdict::Identified),
        ] {
            let mut estimate = estimate(structure);
            estimate.is_robust = is_robust;
            let (verdict, _) = estimate.trust().verdict(1.0, 0.01);
            assert_eq!(verdict, expected, "{structure} {is_robust}");
        }
    }
}
