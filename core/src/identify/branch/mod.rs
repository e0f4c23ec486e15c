//! Branches of a minimum: other places where the sum of squares may have a minimum as good.
//!
//! | file                 | what is different on the branch                                                    |
//! | -------------------- | ---------------------------------------------------------------------------------- |
//! | `series`             | springs of two joints with parallel axes: they share or exchange their compliance  |
//! | `stiff`              | one bushing of unsure stiffness: it is stiff                                       |
//! | `typical`            | every undetermined damping: its ratio is that of the middle of the bounds          |
//! | `light`              | every heavily damped bushing: it is damped lightly                                 |
//! | [`super::descent`]   | anything: the end of descents from elsewhere, while some stiffness is undetermined |
//!
//! `screen` refines a branch on some of the bins first. `ended` compares the end of a branch with its minimum.
//!
//! A search may end in any of them, and noise can explain the residuals of the worse ones. So before a minimum is settled on, its
//! branches are refined. The best minimum counts; its errors include the others that the data do not exclude. The branches of the
//! best minimum are also refined before another search if noise nearly explains it: often only a few bushings are wrong then.

mod ended;
mod light;
mod screen;
mod screened;
mod series;
mod stiff;
mod tried;
mod typical;

use rand_core::Rng;

use super::descent::Descent;
use super::minimum::Minimum;
use super::start::{self, Method};
use super::{Acceptance, FoundBy, Identifier, Phase, Purpose};
use crate::sought::Coordinates;
use crate::spectrum::Experiment;
use crate::verdict::WEAK;
pub(super) use tried::{Branch, Tried};
pub(super) use typical::typically_damped;

/// Records in a row without a rival among the branches after which these are not refined again before the next search. Chosen: each record makes
/// a wrong minimum worse, on average.
const MAX_EXCLUSIONS: u32 = 3;
/// Most branches in a row that replace their minimum since the last search. Chosen: sums of squares and deviances rank minima in different
/// orders, so that two could replace each other without an end.
const MAX_REPLACED: u32 = 30;
/// Searches for rivals of a minimum that leaves some stiffness undetermined. Chosen: without them four of 48 drawn six-joint arms with three cuts
/// had a wrong parameter called identified; with two searches these four are right.
const SEARCHES_ELSEWHERE: u32 = 2;
/// Change of the logarithm of an undetermined stiffness beyond which a branch is far from its minimum. Chosen: a decade. From branches of a drawn
/// six-joint arm that were up to three times stiffer the fit of the imperfections led back to the minimum, from those that were 34 and more
/// times stiffer to the right one.
const FAR_STIFFNESS: f64 = core::f64::consts::LN_10;
/// Factor on the minimum's sum of squares up to which a branch of springs in series or of a stiff bushing is worth a step. Chosen on arms 4 to 33
/// of the proof: 100 takes no more time than 10; without a limit they take three times as long. Of arms 40 to 99 it leaves none wrong, and 10
/// leaves three.
const WORTH_A_STEP: f64 = 100.0;

impl<R: Rng> Identifier<R> {
    /// Settles on a minimum, if need be after its branches have been refined.
    pub(super) fn conclude<const B: usize>(
        &mut self,
        minimum: &mut Minimum,
        acceptance: Acceptance,
        experiments: &[Experiment<B>],
    ) {
        if !self.branch_off(minimum, Some(acceptance), experiments) {
            self.settle_after_branches(minimum, acceptance, experiments);
        }
    }

    /// Settles on a minimum, all of whose branches have been refined.
    fn settle_after_branches<const B: usize>(
        &mut self,
        minimum: &mut Minimum,
        acceptance: Acceptance,
        experiments: &[Experiment<B>],
    ) {
        if self.tried.any {
            let is_rivalled = !minimum.apart.is_empty();
            self.exclusions = if is_rivalled { 0 } else { self.exclusions + 1 };
        }
        self.settle(minimum, acceptance, experiments);
    }

    /// Goes on from a branch of the minimum, if there is one that has not been refined.
    // A minimum is large: inlined, those here would take room on the stack of the caller.
    #[inline(never)]
    pub(super) fn branch_off<const B: usize>(
        &mut self,
        minimum: &Minimum,
        acceptance: Option<Acceptance>,
        experiments: &[Experiment<B>],
    ) -> bool {
        // Static tests do not determine dampings, and in the compliances they are linear.
        if self.excludes_branches() || experiments.is_empty() {
            return false;
        }
        let worth = if let Some((branch, worth)) = self.next_branch(minimum, experiments) {
            self.effort.branches += 1;
            self.prepare_screen(minimum, experiments);
            self.restart_branch(&branch);
            self.found_by = FoundBy::Branch;
            self.phase = Phase::Refining;
            worth
        } else if self.is_worth_a_search(minimum, acceptance) {
            self.tried.elsewhere += 1;
            self.effort.starts += 1;
            self.prepare_screen(minimum, experiments);
            let from = start::elsewhere(&self.bounds, &self.sought, &mut self.generator);
            self.descent = Descent::few(from);
            self.method = Method::Descent;
            self.phase = Phase::Searching;
            f64::INFINITY
        } else {
            return false;
        };
        self.tried.any = true;
        let objective = self.tried.screen.map_or(minimum.fit.objective, |screen| screen.objective);
        self.purpose = Purpose::Branch(Branch::of(objective, acceptance, worth));
        self.best = Some(minimum.clone());
        true
    }

    /// Returns whether branches have been worse so often that they are not refined before the next search.
    pub(super) fn excludes_branches(&self) -> bool {
        self.exclusions >= MAX_EXCLUSIONS
    }

    /// Returns whether another minimum may explain the records as well.
    fn is_worth_a_search(&self, minimum: &Minimum, acceptance: Option<Acceptance>) -> bool {
        acceptance == Some(Acceptance::Consistent)
            && self.tried.elsewhere < SEARCHES_ELSEWHERE
            && self.leaves_stiffness_undetermined(minimum)
    }

    /// Returns whether some stiffness is undetermined in the minimum.
    pub(super) fn leaves_stiffness_undetermined(&self, minimum: &Minimum) -> bool {
        self.undetermined_stiffnesses(minimum).next().is_some()
    }

    /// The unknowns that are undetermined stiffnesses in the minimum.
    fn undetermined_stiffnesses(&self, minimum: &Minimum) -> impl Iterator<Item = usize> {
        stiff::stiffnesses(&self.sought).filter(|unknown| minimum.deviation(*unknown) > WEAK)
    }

    /// The start of the next branch, and the multiple of the minimum's sum of squares up to which it is worth a step.
    fn next_branch<const B: usize>(
        &mut self,
        minimum: &Minimum,
        experiments: &[Experiment<B>],
    ) -> Option<(Coordinates, f64)> {
        if minimum.is_branched || self.tried.replaced >= MAX_REPLACED {
            return None;
        }
        let Self { chain, bounds, sought, tried, .. } = self;
        let untried = |unknown: &usize| tried.stiff & (1 << unknown) == 0;
        let coordinates = &minimum.coordinates;
        let deviation = |unknown| minimum.deviation(unknown);
        let mut in_series =
            series::branches(chain, sought, bounds, coordinates, experiments, tried.series);
        if let Some((place, branch)) = in_series.next() {
            tried.series = place + 1;
            return Some((branch, WORTH_A_STEP));
        }
        if let Some(unknown) = stiff::unsure(sought, deviation).find(untried) {
            tried.stiff |= 1 << unknown;
            let stiff = stiff::stiffened(sought, bounds, coordinates, unknown);
            return Some((stiff, WORTH_A_STEP));
        }
        if !core::mem::replace(&mut tried.typical, true) {
            let branch = typically_damped(sought, bounds, coordinates, deviation);
            if let Some(branch) = branch {
                return Some((branch, f64::INFINITY));
            }
        }
        if core::mem::replace(&mut tried.light, true) {
            return None;
        }
        Some((light::lightly_damped(chain, sought, bounds, coordinates)?, f64::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Matrix3, Unit, Vector3};

    use crate::chain::{Chain, Joint, JointKind, Link};

    /// Two joints that carry 5 and 2 kg, with moments of inertia of 0.05 and 0.02 kg m².
    pub(super) fn chain() -> Chain {
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
}
