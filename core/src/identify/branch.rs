//! The lightly damped branch of a minimum.
//!
//! In series with others a bushing adds `1/(k + iωd)` to the receptance. What it dissipates grows with d up to `ωd = k` and
//! falls beyond, so that a light damping and a heavy one give a mode the same decay. The sum of squares can have a minimum at
//! each, with the same stiffnesses, and noise can explain the residuals of the worse one. A search ends at either. So before a
//! minimum with heavily damped bushings is settled on, they are damped lightly and the refinement goes on from there; the
//! better minimum counts.

use heapless::Vec;
use rand_core::Rng;

use super::minimum::{Minimum, RIVAL};
use super::{Acceptance, Identifier, Phase};
use crate::DOF;
use crate::chain::Chain;
use crate::spectrum::Experiment;
use crate::unknowns::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};

/// Damping ratio, with the inertia that the joint carries, above which a bushing is heavily damped: the wrong dampings of the
/// heavy branches that drawn six-joint arms ended in had ratios of 0.2 to 0.6,
const HEAVY: f64 = 0.05;
/// and the ratio that takes its place, a decade below: from there the refinement finds either branch.
const LIGHT: f64 = 0.005;
/// A branch that has been clearly worse so many times in a row, as records came, is not refined again before the next search:
/// what each record adds to the difference is positive on average.
const MAX_EXCLUSIONS: u32 = 3;
/// A branch is given up after so many steps in a row, refused ones included: up to ten are refused before one is good,
const PATIENCE: u32 = 12;
/// of which each gains less than this part of what the branch lacks to be clearly better.
const CRAWL: f64 = 0.05;

/// A branch that is refined before its minimum, the best so far, is settled on.
#[derive(Clone, Debug)]
pub(super) struct Branch {
    /// Of the minimum.
    acceptance: Acceptance,
    /// Sum of squares below which the branch is clearly better.
    better: f64,
    /// Sum of squares after the last step.
    objective: f64,
    /// Steps in a row that have gained too little.
    crawling: u32,
}

impl Branch {
    fn of(minimum: &Minimum, acceptance: Acceptance) -> Self {
        let better = minimum.fit.objective - RIVAL;
        Self { acceptance, better, objective: f64::INFINITY, crawling: 0 }
    }

    /// Whether the branch, which has come to `objective`, is not worth another step.
    pub(super) fn is_hopeless(&mut self, objective: f64) -> bool {
        let gain = self.objective - objective;
        let crawls = gain < CRAWL * (objective - self.better);
        self.crawling = if crawls { self.crawling + 1 } else { 0 };
        self.objective = objective;
        self.crawling >= PATIENCE
    }
}

impl<R: Rng> Identifier<R> {
    /// Settles on a minimum, if need be after its lightly damped branch has been refined.
    // A minimum is large: inlined, those here would take room on the stack of the caller.
    #[inline(never)]
    pub(super) fn conclude<const B: usize>(
        &mut self,
        minimum: &Minimum,
        acceptance: Acceptance,
        experiments: &mut [Experiment<B>],
    ) {
        let excluded = minimum.is_branch || self.exclusions >= MAX_EXCLUSIONS;
        // Static tests tell nothing of dampings.
        let light = if excluded || experiments.is_empty() {
            None
        } else {
            lightly_damped(&self.chain, &self.sought, &minimum.coordinates)
        };
        match light {
            Some(light) => {
                self.refinement.restart_at(&light);
                self.branch = Some(Branch::of(minimum, acceptance));
                self.best = Some(minimum.clone());
                self.phase = Phase::Refining;
            }
            None => self.settle(minimum, acceptance, experiments),
        }
    }

    /// What the refinement has come to, if it is to be judged. A branch is if it is clearly better than its minimum; else the
    /// minimum is settled on.
    // As above.
    #[inline(never)]
    pub(super) fn come_to<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
    ) -> Option<Minimum> {
        let mut branch = self.reached(experiments);
        let pending = self.branch.take().and_then(|pending| Some((pending, self.best.take()?)));
        let Some((Branch { acceptance, better, .. }, mut minimum)) = pending else {
            return Some(branch);
        };
        branch.is_branch = true;
        branch.times = minimum.times;
        if branch.fit.objective < better {
            self.exclusions = 0;
            return Some(branch);
        }
        let distance = self.refinement.distance(&self.sought, &minimum.coordinates);
        let is_rival = branch.is_reached() && minimum.is_rivalled_by(&branch, distance);
        if is_rival && branch.fit.objective < minimum.fit.objective {
            core::mem::swap(&mut minimum, &mut branch);
        }
        self.exclusions = if is_rival { 0 } else { self.exclusions + 1 };
        if is_rival {
            let [own, other] = [&minimum, &branch].map(|one| self.sought.values(&one.coordinates));
            let apart = (0..self.sought.unknowns()).map(|unknown| other[unknown] - own[unknown]);
            minimum.spread(&self.sought, &apart.collect::<Vec<_, MAX_UNKNOWNS>>());
        }
        self.settle(&minimum, acceptance, experiments);
        None
    }
}

/// The same stiffnesses, every heavily damped bushing damped lightly; `None` if there is none.
fn lightly_damped(chain: &Chain, sought: &Sought, heavy: &Coordinates) -> Option<Coordinates> {
    let mut step = [0.0; MAX_UNKNOWNS];
    let mut found = false;
    for (joint, (bushing, inertia)) in
        sought.bushings(heavy).iter().zip(chain.carried()).enumerate()
    {
        for dof in 0..DOF {
            let critical = 2.0 * libm::sqrt(bushing.stiffness[dof] * inertia[dof]);
            let ratio = bushing.damping[dof] / critical;
            let unknown = sought.unknown(Coordinate::Damping { joint, dof });
            if let Some(unknown) = unknown.filter(|_| ratio > HEAVY) {
                step[unknown] = libm::log(LIGHT / ratio);
                found = true;
            }
        }
    }
    let mut light = *heavy;
    sought.advance(&mut light, &step);
    found.then_some(light)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Nuisances;
    use crate::chain::{Joint, JointKind, Link};
    use crate::parameters::Bounds;
    use nalgebra::{Isometry3, Matrix3, Unit, Vector3};
    use proptest::prelude::*;

    /// Two joints that carry 5 and 2 kg, with moments of inertia of 0.05 and 0.02 kg m².
    fn chain() -> Chain {
        let joint = |mass| Joint {
            origin: Isometry3::identity(),
            axis: Unit::new_normalize(Vector3::z()),
            kind: JointKind::Revolute,
            link: Link {
                mass,
                centre_of_mass: Vector3::zeros(),
                inertia: Matrix3::identity() * (0.01 * mass),
            },
        };
        Chain::new(&[joint(3.0), joint(2.0)], Isometry3::identity()).unwrap()
    }

    /// Against 100 to reach: crawling ends it, a leap starts the count anew, and what is better is never given up.
    #[test]
    fn a_branch_that_crawls_is_given_up() {
        let steps_until_hopeless = |course: &dyn Fn(u32) -> f64| {
            let acceptance = Acceptance::Consistent;
            let mut branch =
                Branch { acceptance, better: 100.0, objective: f64::INFINITY, crawling: 0 };
            (0..50).position(|step| branch.is_hopeless(course(step)))
        };
        assert_eq!(steps_until_hopeless(&|_| 200.0), Some(12));
        assert_eq!(
            steps_until_hopeless(&|step| 100.0 + 1e5 * 0.97_f64.powi(step as i32)),
            Some(12)
        );
        assert_eq!(steps_until_hopeless(&|step| 100.0 + 1e5 * 0.9_f64.powi(step as i32)), None);
        assert_eq!(steps_until_hopeless(&|step| if step < 10 { 300.0 } else { 200.0 }), Some(22));
        assert_eq!(steps_until_hopeless(&|_| 99.0), None);
    }

    proptest! {
        /// Of every heavily damped bushing the ratio is the light one, and nothing else has changed.
        #[test]
        fn heavy_dampings_become_light_and_nothing_else_changes(
            ratios in prop::array::uniform24(1e-3..0.3_f64), hz in prop::array::uniform12(5.0..500.0_f64),
        ) {
            let chain = chain();
            let sought = Sought::new(2, &Nuisances::default()).unwrap();
            let critical = |index: usize| {
                let (joint, dof) = (index / DOF, index % DOF);
                let inertia = [[5.0, 0.05], [2.0, 0.02]][joint][dof / 3];
                let omega = core::f64::consts::TAU * hz[index];
                (inertia * omega * omega, 2.0 * inertia * omega)
            };
            let mut bushings = Bounds::of(&chain).middle(&sought);
            for index in 0..2 * DOF {
                let (k, d) = critical(index);
                bushings[index / DOF].stiffness[index % DOF] = k;
                bushings[index / DOF].damping[index % DOF] = ratios[index] * d;
            }
            let light = lightly_damped(&chain, &sought, &sought.coordinates(&bushings));
            let heavy = (0..2 * DOF).any(|index| ratios[index] > HEAVY);
            prop_assert_eq!(light.is_some(), heavy);
            let Some(light) = light.map(|light| sought.bushings(&light)) else { return Ok(()) };
            for index in 0..2 * DOF {
                let (k, d) = critical(index);
                let ratio = if ratios[index] > HEAVY { LIGHT } else { ratios[index] };
                let (found, dof) = (&light[index / DOF], index % DOF);
                prop_assert!((found.stiffness[dof] / k - 1.0).abs() < 1e-9);
                prop_assert!((found.damping[dof] / (ratio * d) - 1.0).abs() < 1e-9);
            }
        }
    }
}
