//! The noise of the cut, which differs from that at rest.

use heapless::Vec;

use super::cut_noise;
use super::shown::Shown;
use super::{Estimate, Identifier, Phase, Purpose, lines, tones};
use crate::refine::{Plant, Problem, Unexplained};
use crate::search::MAX_EXPERIMENTS;
use crate::spectrum::Experiment;
use crate::verdict::FOREIGN;

/// Most fits that follow each other because the noise was read again. Chosen: a fit that strong tones have biased shows others; the second
/// is without that bias, and the level of the noise follows.
pub const MAX_NOISE_ROUNDS: u32 = 4;
/// Gain in the sum of squares for which a fit goes on with another movement. Chosen: it moves no estimate by more than a tenth of its standard
/// deviation (Cauchy and Schwarz), and an interval of 95 % then holds with 94.9 %.
pub(super) const MOVED: f64 = 0.01;

impl<R> Identifier<R> {
    /// Reads the noise in `experiments` again, from the residuals of a settled `estimate`, which is that of `plant`, if there is one, or else
    /// the identifier's own. Tones are subtracted. Without new ones, the level is raised where the cut has more noise than the rest.
    ///
    /// Without a plant, the movement in the parts of the records becomes that of the model; with one, [`Identifier::estimate_of_plant`] has
    /// read it.
    ///
    /// Returns whether that changes the experiments; then they are to be [renewed](Identifier::renew_noise) and fitted again, up to
    /// [`MAX_NOISE_ROUNDS`] times. Nothing is changed where the noise that is assumed explains the residuals. The level stays where no
    /// level that a cut may have explains them.
    // What the records show is large: inlined, it would take room on the stack of the caller.
    #[inline(never)]
    pub fn read_noise_again<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        plant: Option<&Plant>,
        estimate: &Estimate,
    ) -> bool {
        let objects = estimate.size_objects || estimate.structure.is_there();
        let is_louder = experiments.iter().any(|experiment| experiment.cut_noise.is_louder());
        let feeds = experiments.iter().any(|experiment| !experiment.is_whole());
        let is_due = feeds || objects || estimate.noise_too_loud || is_louder;
        if self.phase != Phase::Settled || !is_due {
            return false;
        }
        let mut moves = false;
        if plant.is_none() {
            self.refinement.restart_at(&estimate.coordinates);
            moves = self.follows_movement(experiments, None);
        }
        let bins = experiments.iter().map(Experiment::bins).sum();
        let records = experiments.iter().take(MAX_EXPERIMENTS).enumerate();
        let shown: Vec<Shown, MAX_EXPERIMENTS> = records
            .map(|(record, experiment)| self.shown(experiment, plant, estimate, record, bins))
            .collect();
        // Tones and lines are narrow. In a level they would cost a whole band.
        let has_lines = self.raise_lines(experiments, plant, estimate);
        has_lines
            || moves
            || tones::subtract(experiments, &shown)
            || estimate.consistency <= FOREIGN && cut_noise::replace(experiments, shown)
    }

    /// Gives the divided records the movement of the model where the refinement of a start has ended, or that of the plant where a fit to it has, up
    /// to [`MAX_NOISE_ROUNDS`] times. Returns whether the refinement, or the fit, goes on with it.
    pub(super) fn goes_on_moving<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        plant: Option<&mut Plant>,
    ) -> bool {
        let may_go_on = matches!(self.purpose, Purpose::Start | Purpose::Plant { .. })
            && self.movements < MAX_NOISE_ROUNDS;
        let goes_on = may_go_on && self.follows_movement(experiments, plant);
        self.movements = if goes_on { self.movements + 1 } else { 0 };
        goes_on
    }

    /// Gives the divided records the movement of the model where the refinement stands, or that of the plant. Returns whether another step gains by it.
    #[inline(never)]
    pub(super) fn follows_movement<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        plant: Option<&mut Plant>,
    ) -> bool {
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.follow_movement(&problem, plant, experiments) > MOVED
    }

    /// Raises the noise at the lines of the divided records. Returns whether that changes it.
    #[inline(never)]
    fn raise_lines<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        plant: Option<&Plant>,
        estimate: &Estimate,
    ) -> bool {
        let mut is_raised = false;
        for (record, experiment) in experiments.iter_mut().enumerate() {
            if !experiment.is_whole()
                && let Some(left) = self.unexplained(experiment, plant, estimate, record)
            {
                is_raised |= lines::raise(experiment, &left);
            }
        }
        is_raised
    }

    /// Noise that the residuals of one record show, of all records' `bins`.
    // Residuals are large: inlined, they would take room on the stack of the caller.
    #[inline(never)]
    fn shown<const B: usize>(
        &mut self,
        experiment: &Experiment<B>,
        plant: Option<&Plant>,
        estimate: &Estimate,
        record: usize,
        bins: usize,
    ) -> Shown {
        let Some(mut left) = self.unexplained(experiment, plant, estimate, record) else {
            return Shown { tones: Vec::new(), cut_noise: experiment.cut_noise.clone() };
        };
        let cut_noise = cut_noise::of(experiment, &left);
        Shown { tones: tones::candidates(experiment, &mut left, bins), cut_noise }
    }

    /// Returns the residuals of `estimate` in one record. `None` where its model cannot be computed.
    #[inline(never)]
    pub(super) fn unexplained<const B: usize>(
        &mut self,
        experiment: &Experiment<B>,
        plant: Option<&Plant>,
        estimate: &Estimate,
        record: usize,
    ) -> Option<Unexplained<B>> {
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.unexplained(&problem, &estimate.coordinates, plant, experiment, record)
    }
}

#[cfg(test)]
mod tests {
    use super::super::deferred::tests::identifier;
    use super::super::estimate::tests::estimate;
    use super::super::{Acceptance, Estimate, Phase};
    use crate::spectrum::Experiment;

    #[test]
    fn the_budget_of_searches_is_that_of_the_records() {
        let mut identifier = identifier();
        let none: [Experiment<8>; 0] = [];
        identifier.starts = 5;
        identifier.renew_noise(&none);
        assert_eq!(identifier.starts, 5);
        identifier.renew(&none);
        assert_eq!(identifier.starts, 0);
    }
    #[test]
    fn only_a_settled_consistent_minimum_keeps_its_visits_for_new_records() {
        for (phase, acceptance, expected) in [
            (Phase::Settled, Acceptance::Consistent, 3),
            (Phase::Settled, Acceptance::ModelSuspect, 0),
            (Phase::Refining, Acceptance::Consistent, 0),
        ] {
            let mut identifier = identifier();
            identifier.settled_times = 3;
            identifier.phase = phase;
            identifier.estimate = Some(Estimate { acceptance, ..*estimate(0.0) });
            let none: [Experiment<8>; 0] = [];
            identifier.renew(&none);
            assert_eq!(identifier.confirmations, expected, "{phase:?} {acceptance:?}");
        }
    }
}
