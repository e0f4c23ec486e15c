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
    /// Finds the seams that fit best at the parameters. Returns the sum of squares that remains, infinite where gravity leaves
    /// the robot no equilibrium.
    pub(super) fn fit_seams<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
    ) -> f64 {
        self.seams.clear();
        let mut sum_of_squares = 0.0;
        for experiment in experiments {
            let Ok((seam, remaining)) = self.fit_seam(problem, experiment) else {
                return f64::INFINITY;
            };
            // A record for which there is no place is fitted again.
            let _ = self.seams.push(seam);
            sum_of_squares += remaining;
        }
        sum_of_squares
    }

    /// The seam that fits a record best at the parameters, and the sum of squares that remains.
    pub(super) fn fit_seam<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
    ) -> Result<(Seam, f64), LinearisationError> {
        let joints = problem.chain.joints().len();
        self.run(problem, experiment, &Seam::default(), Unknowns::Seam)?;
        let seam = problem.seam_unknowns();
        let normal = &mut self.record;
        normal.prefer_small(&[0.0; MAX_SEAM][..seam], SMALL_SEAM);
        normal.eliminate(seam);
        let mut solution = [0.0; MAX_SEAM];
        normal.substitute(seam, &mut solution);
        Ok((Seam::from_solution(&solution[..seam], joints), normal.sum_of_squares()))
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

    /// The normal equations of all unknowns, with the seams that [`Refinement::fit_seams`] has found at the same parameters.
    pub(super) fn assemble<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
    ) -> Result<Summary, LinearisationError> {
        let mut total = self.normal.clone();
        total.reset(problem.sought.unknowns());
        let mut summary = Summary::default();
        for (index, experiment) in experiments.iter().enumerate() {
            let seam = match self.seams.get(index) {
                Some(seam) => *seam,
                None => self.fit_seam(problem, experiment)?.0,
            };
            summary.push(&self.assemble_record(problem, experiment, &seam, Unknowns::All)?);
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

    /// The normal equations of one record at this seam, which is eliminated.
    pub(super) fn assemble_record<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
        seam: &Seam,
        wanted: Unknowns,
    ) -> Result<Residuals, LinearisationError> {
        let joints = problem.chain.joints().len();
        let residuals = self.run(problem, experiment, seam, wanted)?;
        let unknowns = problem.seam_unknowns();
        self.record.prefer_small(&seam.to_solution(joints)[..unknowns], SMALL_SEAM);
        self.record.eliminate(unknowns);
        Ok(residuals)
    }

    /// The normal equations of one record at its best seam, which is eliminated.
    pub(super) fn assemble_fitted<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
    ) -> Result<Residuals, LinearisationError> {
        let (seam, _) = self.fit_seam(problem, experiment)?;
        self.assemble_record(problem, experiment, &seam, Unknowns::All)
    }

    /// Fills the record's normal equations.
    fn run<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
        seam: &Seam,
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
            seam,
            sought,
            calibration: &calibration,
            unknowns,
            normal: &mut self.record,
            level: problem.level,
        };
        Ok(assembly.run())
    }
}
