//! The normal equations of all that a fit rests on: records, static tests, priors, and what is retired.

use super::batch::Bins;
use super::equations::{Assembly, Unknowns};
use super::residuals::Residuals;
use super::seam::{MAX_SEAM, Seam};
use super::statics::Statics;
use super::summary::Summary;
use super::{Problem, Refinement};
use crate::chain::linearise::LinearisationError;
use crate::receptance::Terms;
use crate::spectrum::Experiment;

/// What a seam's unknowns cost, as a part of what they explain: with many joints some hardly differ in the band,
/// and would grow without bound against each other.
const SMALL_SEAM: f64 = 1e-11;

impl Refinement {
    /// The seams that fit best at the parameters; returns the sum of squares that remains, infinite where gravity leaves the
    /// robot no equilibrium.
    pub(super) fn fit_seams<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> f64 {
        experiments.iter_mut().map(|experiment| self.fit_seam(problem, experiment)).sum()
    }

    pub(super) fn fit_seam<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
    ) -> f64 {
        let joints = problem.chain.joints().len();
        if self.run(problem, experiment, Unknowns::Seam).is_err() {
            return f64::INFINITY;
        }
        let seam = problem.seam_unknowns();
        let normal = &mut self.record;
        normal.prefer_small(&[0.0; MAX_SEAM][..seam], SMALL_SEAM);
        normal.eliminate(seam);
        let mut solution = [0.0; MAX_SEAM];
        normal.substitute(seam, &mut solution);
        experiment.seam = Seam::from_solution(&solution[..seam], joints);
        normal.sum_of_squares()
    }

    /// Sum of squares of what is known beside the records that are kept: priors, static tests and retired records.
    pub(super) fn beside(&self, problem: &Problem<'_>) -> f64 {
        let priors = problem.sought.priors(&self.coordinates).map(|(_, value)| value * value);
        priors.sum::<f64>()
            + self.statics(problem).sum_of_squares()
            + self.retired.sum_of_squares(&problem.sought.values(&self.coordinates))
    }

    pub(super) fn statics<'a>(&self, problem: &'a Problem<'a>) -> Statics<'a> {
        let sought = problem.sought;
        Statics { problem, bushings: self.bushings(sought), calibration: self.calibration(sought) }
    }

    /// The normal equations of all unknowns.
    pub(super) fn assemble<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> Result<Summary, LinearisationError> {
        let mut total = self.normal.clone();
        total.reset(problem.sought.unknowns());
        let mut summary = Summary::default();
        for experiment in experiments {
            summary.push(&self.assemble_record(problem, experiment, Unknowns::All)?);
            total.add_complement(&self.record, problem.seam_unknowns());
        }
        for (unknown, value) in problem.sought.priors(&self.coordinates) {
            total.add_prior(unknown, value);
        }
        self.statics(problem).add_to(&mut total)?;
        self.retired.add_to(&mut total, &problem.sought.values(&self.coordinates));
        self.normal = total;
        self.assembled = true;
        Ok(summary)
    }

    /// The normal equations of one record, the seam eliminated.
    pub(super) fn assemble_record<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
        wanted: Unknowns,
    ) -> Result<Residuals, LinearisationError> {
        let joints = problem.chain.joints().len();
        let standing = experiment.seam;
        let residuals = self.run(problem, experiment, wanted)?;
        let seam = problem.seam_unknowns();
        self.record.prefer_small(&standing.to_solution(joints)[..seam], SMALL_SEAM);
        self.record.eliminate(seam);
        Ok(residuals)
    }

    /// Fills the record's normal equations.
    fn run<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
        unknowns: Unknowns,
    ) -> Result<Residuals, LinearisationError> {
        let Problem { measurement, sought, .. } = *problem;
        let bushings = self.bushings(sought);
        let calibration = self.calibration(sought);
        let linear = problem.linearise(&experiment.pose, &bushings, &calibration)?;
        let mut terms = Terms::new(&linear, &bushings, &measurement.sensors(&calibration))?;
        if sought.seeks_masses() {
            terms = terms.with_masses();
        }
        let assembly = Assembly {
            terms: &terms,
            record: Bins::of(experiment),
            sought,
            calibration: &calibration,
            unknowns,
            normal: &mut self.record,
            level: problem.level,
        };
        Ok(assembly.run())
    }
}
