//! Estimate from the end of a refinement.

use super::branch::typically_damped;
use super::minimum::Minimum;
use super::{Acceptance, Estimate, Identifier, Phase};
use crate::refine::Problem;
use crate::search::MAX_EXPERIMENTS;
use crate::sought::{Coordinate, Coordinates};
use crate::spectrum::Experiment;
use crate::verdict::WEAK;

// A fit is large: inlined, each of these would take room on the stack of a caller that makes another one.
impl<R> Identifier<R> {
    /// The minimum where the refinement stands.
    #[inline(never)]
    pub(super) fn minimum_here<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
    ) -> Minimum {
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        let fit = refinement.fit_here(&problem, experiments);
        let remaining = refinement.remaining(&problem);
        let mut minimum =
            Minimum::new(*refinement.coordinates(), self.found_by, fit, &remaining, sought);
        minimum.times = self.times;
        minimum
    }

    /// Squared distance from where the refinement stands to `coordinates`, in standard deviations. Dampings that neither fit determines are
    /// free: one without effect may be anywhere.
    #[inline(never)]
    pub(super) fn distance(&self, coordinates: &Coordinates, fits: [&Minimum; 2]) -> f64 {
        let is_damping =
            |unknown| matches!(self.sought.coordinate(unknown), Some(Coordinate::Damping { .. }));
        let is_open = |one: &&Minimum, unknown| one.fit.covariance.deviation(unknown) > WEAK;
        let is_free = |unknown| is_damping(unknown) && fits.iter().all(|one| is_open(one, unknown));
        self.refinement.least_distance(&self.sought, coordinates, is_free)
    }

    /// Returns to a minimum, and fits the seams there.
    #[inline(never)]
    pub(super) fn stand_at<const B: usize>(
        &mut self,
        minimum: &Minimum,
        experiments: &[Experiment<B>],
    ) {
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.restart_at(&minimum.coordinates);
        refinement.fit(&problem, experiments);
        self.found_by = minimum.found_by;
    }

    /// Settles on the estimate of the minimum.
    pub(super) fn settle<const B: usize>(
        &mut self,
        minimum: &mut Minimum,
        acceptance: Acceptance,
        experiments: &[Experiment<B>],
    ) {
        self.look_at_typical_dampings(minimum, experiments);
        self.stand_at(minimum, experiments);
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        let forgotten = self.forgotten;
        minimum.spread(sought);
        // The estimate is judged by its own residuals.
        minimum.of_plant = None;
        let count = experiments.len();
        let mut estimate =
            Estimate::of(minimum, acceptance, forgotten, refinement, &problem, count, None);
        if count > 1 {
            let held_out = experiments.iter().take(MAX_EXPERIMENTS);
            estimate.held_out = held_out
                .enumerate()
                .map(|(record, one)| refinement.hold_out(&problem, record, one))
                .collect();
        }
        self.estimate = Some(estimate);
        self.settled_times = minimum.times;
        self.best = None;
        self.phase = Phase::Settled;
    }

    /// Remembers the standard deviations where every undetermined damping has a typical ratio.
    ///
    /// A fit lets such a damping go to where it has no effect. There it does not trade off against the determined parameters, whose
    /// standard deviations are then too small: with drawn six-joint arms two to five times smaller than at the truth.
    #[inline(never)]
    fn look_at_typical_dampings<const B: usize>(
        &mut self,
        minimum: &mut Minimum,
        experiments: &[Experiment<B>],
    ) {
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        // Of the fit alone: what is remembered would change it when an identifier resumes.
        let deviation = |unknown| minimum.fit.covariance.deviation(unknown);
        let typical = typically_damped(sought, bounds, &minimum.coordinates, deviation);
        // Static tests determine dampings in no pose.
        let Some(typical) = typical.filter(|_| !experiments.is_empty()) else { return };
        refinement.restart_at(&typical);
        let there = refinement.fit(&problem, experiments);
        if there.objective.is_finite() {
            let unknowns = 0..sought.unknowns();
            minimum.remember_deviations(unknowns.map(|i| there.covariance.deviation(i)));
        }
    }
}
