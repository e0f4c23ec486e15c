//! The estimate of a plant that is not quite the one that the model describes.

use core::mem;

use heapless::Vec;

use super::decision::MAX_PROLONGATIONS;
use super::minimum::{Minimum, REACHED, structure_is_allowed_for};
use super::noise::MOVED;
use super::{Acceptance, Estimate, Identifier, Phase};
use crate::imperfection::{FoundImperfection, Imperfection, MAX_IMPERFECTIONS};
use crate::refine::{Explanation, MAX_EXPLANATIONS, Outcome, Plant, Problem};
use crate::spectrum::Experiment;
use crate::verdict::{Covariance, WEAK};

/// Share of the misfit that contradicted accuracies must explain. Shares overlap, so that their sum is the most that they explain.
/// Chosen: of single errors that are imperfections the right one explains nearly all; of others (pedestal, friction) what is
/// named instead explains up to a fourth.
const EXPLAINED: f64 = 0.3;
/// Errors of a kind, in their stated standard deviations, that a plausible plant has, however little they explain. Chosen: of the drawn
/// plants one in a hundred has crosstalks that are all alike and more than three times as large as stated, which contradict their accuracy
/// very strongly; friction is explained by errors of ten times their accuracy and more.
const STATED_TOO_WELL: f64 = 5.0;
/// Compliances of the ground, in the standard deviation of their prior, beyond which the mass of the base counts. Chosen: on three times
/// that, four times the typical accuracy, a base of 300 kg has its natural frequency at 208 Hz, at the end of the usual band.
const SOFT_GROUND: f64 = 3.0;
/// How far below zero the `1/ω²` of a sensor may lie, in stated standard deviations. There it stands for a low-pass: of first order, and of
/// corner frequency ω_c, it is −1/(2 ω_c²). Chosen: with typical accuracies the corner is then at 670 Hz, and a hundredth of the phase at
/// 200 Hz is left out.
const LOW_PASS: f64 = 10.0;
/// Distance of the first joint's elastic centre from its origin, in stated standard deviations, beyond which what the robot stands on gives
/// way, if those of the other joints are within half of it. Chosen: one bearing alone is hardly ever that far off.
const FAR_CENTRE: f64 = 5.0;

/// An estimate that holds whatever the imperfections of the plant are, within their accuracies.
#[derive(Clone, Debug)]
pub struct PlantEstimate {
    /// The parameters and how far they can be believed.
    pub estimate: Estimate,
    /// The most likely imperfections.
    pub imperfections: Vec<FoundImperfection, MAX_IMPERFECTIONS>,
    /// The accuracies that the data contradict, the one that explains most of the misfit first. If there is none, what explains most
    /// within its accuracy.
    pub explanations: Vec<Explanation, MAX_EXPLANATIONS>,
    /// Factor on the standard deviations that follow from [`Plant::information`]: √(χ²/dof), at least 1, times by how much robust ones are
    /// larger, as a root mean square over the unknowns that the data determine.
    pub widening: f64,
    /// Robust standard deviations over those that follow from accuracies and from noise times √(χ²/dof), at least 1: the same root mean square. `None` if standard deviations are not robust.
    pub robust_widening: Option<f64>,
}

impl<R> Identifier<R> {
    /// Refines the settled estimate together with the imperfections of `plant`. The identifier keeps its own estimate. The movement in the parts of
    /// divided experiments becomes that of the plant.
    ///
    /// Returns `None` without a settled estimate of experiments, and for a plant without imperfections or of other joints.
    /// `go_on` is asked before each step and each experiment; once it says no, `None` is returned, and the movement may be that of a fit that has not ended.
    // A fit is large: inlined, it would take room on the stack of the caller.
    #[inline(never)]
    pub fn estimate_of_plant<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        plant: &mut Plant,
        mut go_on: impl FnMut() -> bool,
    ) -> Option<PlantEstimate> {
        let settled = self.estimate.clone().filter(|_| self.phase == Phase::Settled)?;
        let fits = plant.is_of(&self.chain);
        if experiments.is_empty() || plant.is_perfect() || !fits {
            return None;
        }
        let is_fitted = mem::take(&mut self.is_fitted_to_plant);
        let Self { chain, measurement, bounds, sought, statics, refinement, forgotten, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.follow_retired(plant);
        refinement.restart_at(&settled.coordinates);
        if !is_fitted {
            refinement.restart_plant_to(plant, experiments);
        }
        let mut prolongations = 0;
        let ended = loop {
            if !go_on() {
                break None;
            }
            if refinement.step_plant(&problem, experiments, plant) == Outcome::Improving {
                continue;
            }
            let may_go_on = prolongations < MAX_PROLONGATIONS;
            let has_moved = may_go_on
                && refinement.follow_movement(&problem, Some(&mut *plant), experiments) > MOVED;
            let ended = refinement.fit_plant(&problem, experiments, plant);
            let Some((fit, remaining)) = &ended else { break None };
            if has_moved || may_go_on && remaining.gain > REACHED && plant.prolong() {
                prolongations += 1;
                continue;
            }
            if plant.contradicts_retired(&problem, fit.inflation()) {
                *forgotten += refinement.forget_retired(sought, plant);
                prolongations = 0;
                continue;
            }
            if !plant.adopt_explanations(&problem, fit.inflation()) {
                break ended;
            }
            prolongations = 0;
        };
        let without_noise = ended.and_then(|(mut fit, remaining)| {
            refinement.leave_noise_out(&problem, experiments, plant, &mut fit, &mut go_on)?;
            Some((fit, remaining))
        });
        let Some((fit, remaining)) = without_noise else {
            refinement.restart_at(&settled.coordinates);
            return None;
        };
        let coordinates = *refinement.coordinates();
        let mut minimum = Minimum::new(coordinates, settled.found_by, fit, &remaining, sought);
        minimum.apart.clone_from(&settled.apart);
        minimum.deviations_elsewhere.clone_from(&settled.deviations_elsewhere);
        let explanations = plant.explain(&problem, minimum.inflation(), &mut |shift| {
            minimum.remember_explanation(shift)
        });
        let are_plausible = plant.is_plausible()
            && !stand_for_something_else(
                &explanations,
                &plant.found(),
                sought.imposes(),
                chain.joints()[0].drive().is_none(),
            );
        minimum.spread(sought);
        // The trust in an estimate multiplies its deviations by the inflation.
        let inflation = libm::sqrt(minimum.inflation());
        let robust = minimum
            .leaves_misfit()
            .then(|| refinement.jackknife_plant(&problem, experiments, plant, inflation));
        let robust = robust.flatten();
        let covariance = &minimum.fit.covariance;
        let robust_widening = robust.as_ref().map(|robust| times_wider(robust, covariance));
        let widening = inflation * robust_widening.unwrap_or(1.0);
        if let Some(deviations) = &robust {
            minimum.fit.raise(sought, deviations);
        }
        plant.widen_by_structure(
            &mut minimum.fit,
            sought,
            &sought.bushings(&coordinates),
            inflation,
        );
        let acceptance = match settled.acceptance {
            Acceptance::Unsettled => Acceptance::Unsettled,
            _ if !minimum.is_reached() => Acceptance::Unsettled,
            _ if are_plausible
                && minimum.agrees()
                && structure_is_allowed_for(&minimum.fit.structure, robust.is_some()) =>
            {
                Acceptance::Consistent
            }
            _ => Acceptance::ModelSuspect,
        };
        let forgotten = self.forgotten;
        let mut estimate = Estimate::of(
            &minimum,
            acceptance,
            forgotten,
            refinement,
            &problem,
            settled.experiments,
            Some(&mut *plant),
        );
        estimate.held_out = settled.held_out;
        // Where no plausible plant explains the records, the minimum may be a wrong one.
        estimate.is_robust = robust.is_some() && are_plausible;
        estimate.is_of_implausible_plant = !are_plausible;
        let imperfections = plant.found();
        refinement.restart_at(&settled.coordinates);
        Some(PlantEstimate { estimate, imperfections, explanations, widening, robust_widening })
    }
}

/// Returns whether accuracies that are contradicted very strongly stand for an error that no imperfection has.
///
/// - A parameter fixed at a wrong value (`imposes`) is explained by wrong masses, gains or records.
/// - What is no imperfection, friction say, is explained by many imperfections together, and the contradicted ones explain little of the misfit,
///   though they are far off. A high-pass is no such sign: noise that grows towards the lower end of the band looks like one, and moves a
///   few bins there.
/// - A pedestal that gives way, and that the model lacks, is explained by an elastic centre of the first joint, alone, that lies far below it.
/// - On ground that is much softer than stated the mass of the base counts, which nobody gives.
/// - A low-pass near the band is explained by a natural frequency whose square would be negative, and not as well by that of the other sensor.
/// - A high-pass whose corner frequency would be negative does not exist.
fn stand_for_something_else(
    explanations: &[Explanation],
    found: &[FoundImperfection],
    imposes: bool,
    has_pedestal: bool,
) -> bool {
    let contradicted = explanations.iter().filter(|own| own.is_contradicted());
    let share: f64 = contradicted.map(|own| own.share).sum();
    let is_far = |own: &FoundImperfection, times: f64| own.value.abs() > times * own.prior;
    let is_of_another =
        |own: &FoundImperfection| matches!(own.imperfection, Imperfection::ElasticCentre(1.., _));
    let is_pedestal = |own: &Explanation| {
        let is_of_first = matches!(own.largest.imperfection, Imperfection::ElasticCentre(0, _));
        let mut others = found.iter().filter(|own| is_of_another(own));
        is_of_first
            && !has_pedestal
            && is_far(&own.largest, FAR_CENTRE)
            && !others.any(|other| is_far(other, FAR_CENTRE / 2.0))
    };
    let is_soft_ground = |own: &Explanation| {
        let is_of_ground = matches!(own.largest.imperfection, Imperfection::Ground(_));
        is_of_ground && own.times > SOFT_GROUND
    };
    let is_filter_of_another_kind = |own: &Explanation| {
        let FoundImperfection { imperfection, value, prior, .. } = own.largest;
        let is_resonance =
            |rival: &FoundImperfection| matches!(rival.imperfection, Imperfection::Resonance(_));
        matches!(imperfection, Imperfection::Resonance(_))
            && value < -LOW_PASS * prior
            && !own.rivals.iter().any(is_resonance)
    };
    let is_low = |own: &Explanation| matches!(own.largest.imperfection, Imperfection::HighPass(_));
    let explains_little =
        |own: &Explanation| share < EXPLAINED && errors(own) > STATED_TOO_WELL && !is_low(own);
    let is_elsewhere = |own: &Explanation| {
        imposes
            || explains_little(own)
            || is_pedestal(own)
            || is_soft_ground(own)
            || is_filter_of_another_kind(own)
    };
    let mut strongly = explanations.iter().filter(|own| own.is_contradicted_very_strongly());
    strongly.any(is_elsewhere)
}

/// Returns the error of an imperfection in standard deviations. The damping of the ground is the product of two errors, its compliance and its
/// lag: if both are off alike, each is off by its square root.
fn errors(explanation: &Explanation) -> f64 {
    match explanation.largest.imperfection {
        Imperfection::GroundDamping(_) => libm::sqrt(explanation.times),
        _ => explanation.times,
    }
}

/// Returns the ratio of these standard deviations to those of the covariance, each at least 1: root mean square over the unknowns that the data
/// determine.
fn times_wider(deviations: &[f64], covariance: &Covariance) -> f64 {
    let own = |unknown: usize| covariance.deviation(unknown);
    let ratios = (0..covariance.unknowns())
        .filter(|&unknown| own(unknown) <= WEAK)
        .map(|unknown| (deviations[unknown] / own(unknown)).max(1.0));
    let (count, sum) =
        ratios.fold((0.0, 0.0), |(count, sum), ratio| (count + 1.0, sum + ratio * ratio));
    if count > 0.0 { libm::sqrt(sum / count) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use core::slice;

    use super::*;
    use crate::imperfection::Sensor;

    /// A contradicted accuracy that explains a share of the misfit.
    fn explanation(imperfection: Imperfection, value: f64, share: f64) -> Explanation {
        let largest = FoundImperfection { imperfection, prior: 0.01, value, deviation: 1e-3 };
        let rivals = Vec::new();
        Explanation { largest, times: 5.2, share, evidence: 11.0, is_adopted: false, rivals }
    }

    #[test]
    fn a_contradicted_accuracy_may_stand_for_another_error() {
        let mass = |share| explanation(Imperfection::Mass(1), 0.1, share);
        let centre = |joint, value| explanation(Imperfection::ElasticCentre(joint, 2), value, 1.0);
        let ground = explanation(Imperfection::Ground(4), 5e-9, 1.0);
        let resonance =
            |value| explanation(Imperfection::Resonance(Sensor::Accelerometer), value, 1.0);
        let of_other_sensor =
            explanation(Imperfection::Resonance(Sensor::Force), 0.11, 1.0).largest;
        let rivals = Vec::from_slice(slice::from_ref(&of_other_sensor)).unwrap();
        let of_either_sensor = Explanation { rivals, ..resonance(-0.11) };
        let ground = Explanation { times: 3.5, ..ground };
        let of_ground_damping =
            |times| Explanation { times, ..explanation(Imperfection::GroundDamping(2), 1.0, 0.05) };
        let hard_ground = Explanation { times: 2.5, ..ground.clone() };
        let weakly = Explanation { evidence: 9.0, ..mass(0.05) };
        let hardly = Explanation { times: 4.8, ..mass(0.05) };
        let high_pass = explanation(Imperfection::HighPass(Sensor::Force), 0.1, 0.05);
        let hardly_far = Explanation { times: 2.7, ..centre(0, -0.09) };
        // Of the second joint, beside the largest.
        let (near, far) = (0.02, 0.03);
        for (explanations, other, imposes, expected) in [
            (&[][..], near, true, false),
            (&[mass(0.9)], near, false, false),
            (&[mass(0.9)], near, true, true),
            (&[mass(0.2)], near, false, true),
            (&[mass(0.2), mass(0.15)], near, false, false),
            (&[weakly], near, false, false),
            (slice::from_ref(&hardly), near, false, false),
            (slice::from_ref(&hardly), near, true, true),
            (&[hardly_far], near, false, true),
            (&[ground], near, false, true),
            (&[of_ground_damping(24.0)], near, false, false),
            (&[of_ground_damping(26.0)], near, false, true),
            (&[hard_ground], near, false, false),
            (&[high_pass], near, false, false),
            (&[resonance(0.2)], near, false, false),
            (&[resonance(-0.09)], near, false, false),
            (&[resonance(-0.11)], near, false, true),
            (&[of_either_sensor], near, false, false),
            (&[centre(0, -0.09)], near, false, true),
            (&[centre(0, -0.09)], far, false, false),
            (&[centre(0, 0.04)], near, false, false),
            (&[centre(1, 0.09)], near, false, false),
        ] {
            let found = [centre(0, -0.09), centre(1, other)].map(|own| own.largest);
            let elsewhere = stand_for_something_else(explanations, &found, imposes, false);
            assert_eq!(elsewhere, expected, "{explanations:?} {other} {imposes}");
        }
        // The pedestal of the model may have its elastic centre far from its origin.
        let found = [centre(0, -0.09), centre(1, near)].map(|own| own.largest);
        assert!(!stand_for_something_else(&[centre(0, -0.09)], &found, false, true));
    }
}
