//! A start: a descent or a random search, up to where the refinement begins.

use rand_core::Rng;

use super::branch::Tried;
use super::descent::Descent;
use super::start::{self, Method};
use super::{FoundBy, Identifier, Phase, Purpose};
use crate::DOF;
use crate::loss::spectral;
use crate::loss::target::Target;
use crate::refine::Problem;
use crate::search::{MAX_EXPERIMENTS, Search, Sensitivities, Strategy, Weighing};
use crate::sought::Coordinates;
use crate::spectrum::{Experiment, Site};

impl<R: Rng> Identifier<R> {
    pub(super) fn start_search<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        self.phase = Phase::Searching;
        self.prolongations = 0;
        self.descent_end = None;
        self.tried = Tried::default();
        self.exclusions = 0;
        self.times = 1;
        self.confirmations = 0;
        self.method = Method::after(self.starts);
        match self.method {
            Method::Descent if self.starts == 0 => {
                self.descent = Descent::first(start::middle(&self.bounds, &self.sought));
            }
            Method::Descent => {
                let from = start::elsewhere(&self.bounds, &self.sought, &mut self.generator);
                self.descent = Descent::elsewhere(from);
            }
            Method::RandomSearch => {
                self.search = Search::new(Strategy::default(), 2 * DOF * self.chain.joints().len());
                self.aim(experiments);
            }
        }
        self.starts += 1;
        self.effort.starts += 1;
        self.effort.random_searches += u32::from(self.method == Method::RandomSearch);
    }

    /// One step of a descent; its end is where the refinement begins.
    pub(super) fn descend<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let Self { chain, measurement, bounds, sought, statics, descent, generator, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        let next = || start::elsewhere(bounds, sought, generator);
        if let Some(found) = descent.step(&problem, experiments, self.refinement.memory(), next) {
            self.begin_refinement(&found);
            self.found_by = FoundBy::Descent;
            // That of a branch starts from a minimum which has been judged.
            self.descent_end = matches!(self.purpose, Purpose::Start).then_some(found);
        }
    }

    /// One sample of a random search; its end is where the refinement begins.
    pub(super) fn sample<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let mut guess = self.bounds.within(self.search.ask(&mut self.generator));
        self.sought.impose(&mut guess);
        self.search.tell(&spectral::losses(&self.targets, experiments, &guess, self.level));
        if self.search.finished() {
            let found = self.bounds.within(self.search.centre());
            self.begin_refinement(&self.sought.coordinates(&found));
            self.found_by = FoundBy::RandomSearch;
        }
    }

    /// Refines where a search has ended.
    fn begin_refinement(&mut self, found: &Coordinates) {
        if matches!(self.purpose, Purpose::Branch(_)) {
            self.restart_branch(found);
        } else {
            self.refinement.restart_at(found);
        }
        self.phase = Phase::Refining;
    }

    /// Continues the random search with these experiments.
    pub(super) fn aim<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let Self { chain, measurement, targets, search, .. } = self;
        let target = |experiment: &Experiment<B>| {
            let site = Site { pose: &experiment.thinned.pose, ..experiment.site() };
            Target::new(chain, measurement, site).ok()
        };
        targets.clear();
        targets.extend(experiments.iter().map_while(target).take(MAX_EXPERIMENTS));
        debug_assert_eq!(targets.len(), experiments.len().min(MAX_EXPERIMENTS), "of another chain");
        let jacobians = targets.iter().map(|target| &target.jacobian);
        let sensitivities = Sensitivities::jacobian(jacobians, chain.joints().len());
        search.renew(Weighing::Sensitivities(sensitivities));
    }
}
