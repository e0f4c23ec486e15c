//! How well the parameters explain the records, and each record what the others say of it.

use super::equations::Unknowns;
use super::residuals::Agreement;
use super::{Problem, Refinement, seam};
use crate::parameters::MAX_PARAMETERS;
use crate::spectrum::Experiment;
use crate::unknowns::Sought;
use crate::verdict::Covariance;

/// How well the parameters explain the records.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Sum of squares of the whitened residuals, of static tests and of priors; what retired records add is left out.
    pub sum_of_squares: f64,
    /// What a refinement makes least: the same, with what retired records add.
    pub objective: f64,
    /// Expectation of [`Fit::sum_of_squares`] if the model is right: real residuals less unknowns that are told;
    /// a little more with retired records, which have told some of them before.
    pub degrees_of_freedom: f64,
    /// Share of the static tests in the sum of squares.
    pub static_sum_of_squares: f64,
    /// Displacements that the static tests have measured.
    pub static_residuals: usize,
    /// Standard deviation of the logarithm of each parameter; infinite where the data do not tell, zero where it is fixed.
    pub deviations: [f64; MAX_PARAMETERS],
    /// Covariance of the unknowns that are sought.
    pub covariance: Covariance,
    /// Surface similarity parameter per direction and experiment, median and largest.
    pub ssp: [f64; 2],
    /// Ljung and Box's statistic of the whitened residuals, less its expectation and in its standard deviations: about
    /// N(0, 1) if the model and the colour of the noise are right.
    pub whiteness: f64,
    /// By how much the sum of squares is larger than the least that kept and retired records would have each by
    /// themselves: χ² of as many degrees of freedom as unknowns are told, if nothing has changed; 0 without retired ones.
    pub contradiction: f64,
}

impl Refinement {
    /// Evaluates the fit at the parameters as they stand.
    pub fn fit<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> Fit {
        let static_sum_of_squares = self.statics(problem).sum_of_squares();
        let priors = problem.sought.priors(&self.coordinates);
        let (priors, off) =
            priors.fold((0, 0.0), |(n, sum), (_, value)| (n + 1, sum + value * value));
        let sum_of_squares = self.fit_seams(problem, experiments) + static_sum_of_squares + off;
        let summary = self.assemble(problem, experiments);
        let joints = problem.chain.joints().len();
        let covariance = Covariance::of(&self.normal);
        let static_residuals = problem.statics.iter().map(|test| test.readings().count()).sum();
        let residuals = experiments.iter().map(|e| 6 * e.bins()).sum::<usize>();
        let residuals = residuals + static_residuals + priors;
        // Retired records have told the unknowns before.
        let told = if self.knowledge.records() > 0 { 0 } else { covariance.rank() };
        let sought = told + experiments.len() * seam::unknowns(joints);
        let values = problem.sought.values(&self.coordinates);
        Fit {
            sum_of_squares,
            objective: self.normal.sum_of_squares(),
            static_sum_of_squares,
            static_residuals,
            degrees_of_freedom: residuals.saturating_sub(sought) as f64,
            deviations: deviations(problem.sought, &covariance),
            covariance,
            whiteness: summary.whiteness(),
            ssp: summary.similarities.median_and_largest(),
            contradiction: self.knowledge.contradiction(&self.normal, &values),
        }
    }

    /// How well all other records, and what is known, foretell this one, after [`Refinement::fit`]: one step of
    /// Gauss and Newton takes its share out of the estimate. Where the others hardly tell some parameter, that step goes too far,
    /// and what comes of it looks worse than a fit to the others would.
    pub fn hold_out<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
    ) -> Agreement {
        let standing = self.coordinates;
        self.assemble_record(problem, experiment, Unknowns::All);
        let mut others = self.normal.clone();
        others.subtract_complement(&self.record, seam::unknowns(problem.chain.joints().len()));
        let (step, _) = self.propose(problem, &others, 0.0);
        problem.sought.advance(&mut self.coordinates, &step);
        self.fit_seam(problem, experiment);
        let agreement = self.assemble_record(problem, experiment, Unknowns::All).agreement();
        self.coordinates = standing;
        self.fit_seam(problem, experiment);
        agreement
    }
}

/// Standard deviation of each parameter's logarithm.
fn deviations(sought: &Sought, covariance: &Covariance) -> [f64; MAX_PARAMETERS] {
    let mut deviations = [0.0; MAX_PARAMETERS];
    for (index, unknown) in sought.sought() {
        if let Some(deviation) = deviations.get_mut(index) {
            *deviation = covariance.deviation(unknown);
        }
    }
    deviations
}
