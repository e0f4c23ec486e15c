//! The minimum over unknowns and imperfections, by Levenberg and Marquardt's method.

use super::super::damping::Damping;
use super::super::levenberg_marquardt::{LAST_DAMPING, LEAST_DAMPING, Remaining};
use super::super::objective::Domain as _;
use super::super::proposal::{Room, Step, propose};
use super::super::statics::Statics;
use super::super::summary::Summary;
use super::super::{Fit, ParameterNormal, Problem, Refinement};
use super::Plant;
use crate::chain::linearise::LinearisationError;
use crate::imperfection::MAX_IMPERFECTIONS;
use crate::sought::MAX_UNKNOWNS;
use crate::spectrum::Experiment;

/// Gain of a step below which a fit is at its minimum. Chosen: all unknowns together are then within a tenth of a standard deviation.
const NEGLIGIBLE: f64 = 1e-2;
/// Steps after which a fit ends wherever it is. Chosen: three times as many as it typically takes.
const MAX_STEPS: usize = 30;

/// A point of a fit to a plant, and the normal equations there.
struct Linearised {
    summary: Summary,
    /// Sum of squares of records, static tests, priors, imperfections and retired records.
    cost: f64,
}

impl Refinement {
    /// Goes to the minimum over unknowns and imperfections, by damped steps of Gauss and Newton, and evaluates the fit there. Fisher
    /// information and covariance are those that hold whatever the imperfections are. Returns also the way that is left to the minimum.
    /// Returns `None` once `go_on` says no.
    pub(crate) fn fit_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
        mut go_on: impl FnMut() -> bool,
    ) -> Option<(Fit, Remaining)> {
        if !go_on() {
            return None;
        }
        let mut here = self.linearise_plant(problem, experiments, plant);
        // The first assembly has no seams: the second has them at their best.
        here = here.and_then(|_| self.linearise_plant(problem, experiments, plant));
        let mut damping = Damping::first(LEAST_DAMPING);
        let mut refused = false;
        for _ in 0..MAX_STEPS {
            let Ok(Linearised { cost, .. }) = here else { break };
            if !go_on() {
                return None;
            }
            let room = problem.room(&self.coordinates);
            let normal = &self.minimiser.normal;
            let (step, change, predicted) = plant.propose(normal, &room, damping.value());
            if predicted < NEGLIGIBLE {
                // A damped step says little: what counts is the step without damping.
                let (_, _, left) = plant.propose(normal, &room, 0.0);
                if left < NEGLIGIBLE || refused {
                    break;
                }
                damping.fall();
                continue;
            }
            if damping.value() > LAST_DAMPING {
                break;
            }
            let standing = (self.coordinates, plant.imperfections.values, plant.seams.clone());
            self.coordinates = problem.advance(&standing.0, &step);
            plant.imperfections.values = core::array::from_fn(|i| standing.1[i] + change[i]);
            match self.linearise_plant(problem, experiments, plant) {
                Ok(there) if there.cost < cost => {
                    damping.follow((cost - there.cost) / predicted);
                    refused = false;
                    here = Ok(there);
                }
                _ => {
                    (self.coordinates, plant.imperfections.values, plant.seams) = standing;
                    damping.rise();
                    refused = true;
                    here = self.linearise_plant(problem, experiments, plant);
                }
            }
        }
        // The seams of the last assembly were those of the point before.
        here = here.and_then(|_| self.linearise_plant(problem, experiments, plant));
        let room = problem.room(&self.coordinates);
        let (step, _, gain) = plant.propose(&self.minimiser.normal, &room, 0.0);
        plant.determine(&self.minimiser.normal);
        plant.eliminate();
        self.minimiser.normal.add_complement(&plant.eliminated, plant.imperfections.all.len());
        let fit = self.fit_of(problem, experiments, here.map(|here| here.summary));
        Some((fit, Remaining { step, gain }))
    }

    /// Assembles the normal equations where coordinates and imperfections stand.
    fn linearise_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
    ) -> Result<Linearised, LinearisationError> {
        let Self { coordinates, minimiser, retired, .. } = self;
        let normal = &mut minimiser.normal;
        minimiser.linearised = false;
        let summary = plant.assemble(problem, coordinates, experiments)?;
        normal.reset(problem.sought.unknowns());
        for (unknown, value) in problem.sought.priors(coordinates) {
            normal.add_prior(unknown, value);
        }
        Statics::at(problem, coordinates).add_to(normal)?;
        retired.add_to(normal, &problem.sought.values(coordinates));
        let cost = plant.all.sum_of_squares() + normal.sum_of_squares();
        minimiser.linearised = true;
        Ok(Linearised { summary, cost })
    }
}

impl Plant {
    /// Eliminates the imperfections from a copy of the normal equations.
    fn eliminate(&mut self) {
        let Self { all, eliminated, imperfections, .. } = self;
        eliminated.clone_from(all);
        eliminated.eliminate(imperfections.all.len());
    }

    /// The damped step of the unknowns in the box, that of the imperfections, and the gain that both promise. `others` are the normal
    /// equations of the unknowns apart from the records.
    fn propose(
        &mut self,
        others: &ParameterNormal,
        room: &Room,
        damping: f64,
    ) -> (Step, [f64; MAX_IMPERFECTIONS], f64) {
        let imperfections = self.imperfections.all.len();
        let unknowns = self.all.unknowns() - imperfections;
        let Self { all, eliminated, .. } = self;
        eliminated.clone_from(all);
        for i in 0..imperfections + unknowns {
            let more = if i < imperfections {
                0.0
            } else {
                others.row(i - imperfections)[i - imperfections]
            };
            let diagonal = eliminated.entry(i, i);
            *diagonal += damping * (*diagonal + more);
        }
        eliminated.eliminate(imperfections);
        let mut normal = others.clone();
        normal.add_complement(eliminated, imperfections);
        let (step, _) = propose(&normal, room, 0.0);
        let mut change = [0.0; MAX_IMPERFECTIONS];
        eliminated.substitute_at(imperfections, &step[..unknowns], &mut change);
        let mut both = [0.0; MAX_IMPERFECTIONS + MAX_UNKNOWNS];
        both[..imperfections].copy_from_slice(&change[..imperfections]);
        both[imperfections..imperfections + unknowns].copy_from_slice(&step[..unknowns]);
        let gain = all.gain(&both) + others.gain(&step);
        (step, change, gain)
    }
}
