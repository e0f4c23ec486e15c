//! Quality of a fit to the records, and prediction of each record by the others.

use core::f64::consts::TAU;

use super::Refinement;
use super::basis::Asked;
use super::objective::Domain as _;
use super::plant::Plant;
use super::plant::imperfect::NO_RECORD;
use super::problem::Problem;
use super::proposal::propose;
use super::residuals::Agreement;
use super::sizes::ParameterNormal;
use super::statics::Statics;
use super::structure::Structure;
use super::sum_of_squares::SumOfSquares;
use super::summary::Summary;
use crate::chain::linearise::LinearisationError;
use crate::linear::normal::Normal;
use crate::parameters::{Bounds, End, MAX_PARAMETERS};
use crate::sought::{Coordinates, MAX_UNKNOWNS, Sought};
use crate::spectrum::Experiment;
use crate::verdict::Covariance;

/// Quality of a fit to the records.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Sum of squares of the whitened residuals, of static tests and of priors; what retired records add is left out.
    pub sum_of_squares: f64,
    /// Cost that a refinement minimises: the sum of squares, with what retired records add.
    pub objective: f64,
    /// Expectation of [`Fit::sum_of_squares`] if the model is right: real residuals less the unknowns that they determine, of
    /// which a parameter on a bound is none. A little more with retired records, which have determined some unknowns before.
    pub degrees_of_freedom: f64,
    /// Share of the static tests in the sum of squares.
    pub static_sum_of_squares: f64,
    /// Displacements that the static tests have measured.
    pub static_residuals: usize,
    /// True if the errors of some records are those that their user states, as of modal tests. They may be larger than they are.
    pub has_stated_noise: bool,
    /// Standard deviation of the logarithm of each parameter; infinite where the data do not determine it, zero where it is fixed.
    pub deviations: [f64; MAX_PARAMETERS],
    /// `ln det(N + P)`: minus twice the logarithm of the volume of the unknowns that explain the data, but for a constant. N is the
    /// information of the data about the unknowns, with the seams at their best values; P is `2π/w²`, w the width of an unknown's
    /// range, so that an undetermined unknown has the volume of its range. Unknowns on a bound count as if they were inside.
    pub log_information: f64,
    /// Covariance of the unknowns that are sought.
    pub covariance: Covariance,
    /// Surface similarity parameter per direction and experiment, median and largest.
    pub ssp: [f64; 2],
    /// Structure of the whitened residuals along the band: none if the model and the colour of the noise are right.
    pub structure: Structure,
    /// Excess of the sum of squares over the least that kept and retired records would have each by themselves: χ² of as many degrees of freedom
    /// as there are determined unknowns, if the robot has not changed; 0 without retired ones.
    pub contradiction: f64,
}

/// Sums at a point where the normal equations have been assembled.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembled {
    /// Sums over the residuals of the records.
    pub(super) summary: Summary,
    /// Sum of squares of the static tests.
    pub(super) of_statics: f64,
    /// Sum of squares of the retired records.
    pub(super) of_retired: f64,
    /// See [`Fit::contradiction`].
    pub(super) contradiction: f64,
}

impl Fit {
    /// χ² per degree of freedom, but at least 1.
    pub(crate) fn inflation(&self) -> f64 {
        (self.sum_of_squares / self.degrees_of_freedom.max(1.0)).max(1.0)
    }

    /// Takes the errors as those of this covariance.
    pub(super) fn take(&mut self, sought: &Sought, covariance: Covariance) {
        self.deviations = deviations(sought, &covariance);
        self.covariance = covariance;
    }

    /// Takes the errors as those of a point that lies `step` short of the minimum: their mean squares are the covariance of
    /// the minimum and the square of the way there.
    pub(crate) fn widen(&mut self, sought: &Sought, step: &[f64]) {
        self.covariance.widen(step);
        self.deviations = deviations(sought, &self.covariance);
    }

    /// Takes the errors as those of this point or of another one that is equally likely, with these standard deviations, if they
    /// are larger.
    pub(crate) fn mix(&mut self, sought: &Sought, others: &[f64]) {
        self.covariance.mix(others);
        self.deviations = deviations(sought, &self.covariance);
    }

    /// Raises the standard deviations to these, where they are larger.
    pub(crate) fn raise(&mut self, sought: &Sought, others: &[f64]) {
        self.covariance.raise(others);
        self.deviations = deviations(sought, &self.covariance);
    }
}

impl Refinement {
    /// Evaluates the fit at the parameters as they stand, by all bins. Where gravity leaves the robot no equilibrium, its sum of squares
    /// is infinite and nothing is determined.
    pub fn fit<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
    ) -> Fit {
        self.minimiser.linearised = false;
        self.fit_here(problem, experiments)
    }

    /// Returns the [`Refinement::fit`]. Its assembly is that of the last step if this ended with all bins of the same records.
    pub(crate) fn fit_here<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
    ) -> Fit {
        let Self { coordinates, minimiser, every, workspace, retired, .. } = self;
        if core::mem::replace(every, 1) > 1 {
            minimiser.linearised = false;
        }
        let mut records = SumOfSquares::new(problem, experiments, retired, workspace, 1);
        let assembled = minimiser.linearise(&mut records, coordinates);
        let assembled = assembled.map(|()| {
            let Self { coordinates, minimiser, workspace, retired, .. } = &*self;
            let sought = problem.sought;
            let correction = workspace.correction.values().iter().copied();
            Assembled {
                summary: workspace.summary.clone(),
                of_statics: Statics::at(problem, coordinates, correction).sum_of_squares(),
                of_retired: retired.sum_at(sought, coordinates),
                contradiction: retired.contradiction(&minimiser.normal, sought, coordinates),
            }
        });
        self.fit_of(problem, experiments, None, assembled)
    }

    /// The fit of the normal equations as they have been assembled at the present coordinates, or where a plant stands, if there is one.
    pub(super) fn fit_of<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: Option<&Plant>,
        assembled: Result<Assembled, LinearisationError>,
    ) -> Fit {
        let Self { minimiser, .. } = self;
        let normal = &mut minimiser.normal;
        minimiser.linearised = assembled.is_ok();
        let (assembled, objective) = match assembled {
            Ok(assembled) => (assembled, normal.sum_of_squares()),
            Err(_) => {
                normal.reset(problem.sought.unknowns());
                (Assembled::default(), f64::INFINITY)
            }
        };
        let Assembled { summary, of_statics, of_retired, contradiction } = assembled;
        let covariance = Covariance::of(normal);
        let Summary { similarities, mut structures } = summary;
        let seams = self.taken_by_seams(problem, experiments, plant, &mut structures);
        let static_residuals = problem.statics.iter().map(|test| test.readings().count()).sum();
        let residuals = experiments.iter().map(|e| e.residuals(1)).sum::<usize>();
        let priors = problem.sought.priors(&self.coordinates).count()
            + problem.sought.expected(&self.coordinates, problem.bounds).count();
        let residuals = residuals + static_residuals + priors;
        // The retired records have determined the unknowns before.
        let determined = if self.retired.records() > 0 { 0 } else { self.determined(problem) };
        Fit {
            sum_of_squares: objective - of_retired,
            objective,
            static_sum_of_squares: of_statics,
            static_residuals,
            has_stated_noise: experiments.iter().any(|own| !own.is_record()),
            degrees_of_freedom: (residuals.saturating_sub(determined) as f64 - seams).max(0.0),
            deviations: deviations(problem.sought, &covariance),
            log_information: log_information(
                &self.minimiser.normal,
                problem.sought,
                problem.bounds,
            ),
            covariance,
            structure: structures.structure(),
            ssp: similarities.median_and_largest(),
            contradiction,
        }
    }

    /// Number of combinations of unknowns that the data determine; those that lie on a bound do not count. That is what the optimum within the
    /// bounds takes off the expectation of χ² where the truth lies on these bounds, too (Meyer and Woodroofe, "On the degrees of freedom in
    /// shape-restricted regression", 2000); where it lies inside, it takes off up to as many more as there are parameters on bounds.
    fn determined(&self, problem: &Problem<'_>) -> usize {
        Covariance::of(&self.free(problem)).rank()
    }

    /// The normal equations of the last assembly, without the unknowns that lie on a bound.
    fn free(&self, problem: &Problem<'_>) -> ParameterNormal {
        let mut free = self.minimiser.normal.clone();
        leave_out_bounds(problem, &self.coordinates, &mut free);
        free
    }

    /// How well all other records and the priors predict this one, of this number, after [`Refinement::fit`]: one step of
    /// Gauss and Newton takes its share out of the estimate. Where the others hardly determine some parameter, that step goes too
    /// far, and the agreement looks worse than that of a fit to the others. No agreement where the step ends at a robot that
    /// gravity leaves no equilibrium.
    #[inline(never)]
    pub fn hold_out<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        record: usize,
        experiment: &Experiment<B>,
    ) -> Agreement {
        let Self { coordinates, minimiser, workspace, retired, .. } = self;
        let mut objective = SumOfSquares::new(problem, &[], retired, workspace, 1);
        let mut own = ParameterNormal::new();
        own.reset(problem.sought.unknowns());
        let of_record = (record, experiment);
        if objective.add_record(coordinates, of_record, Asked::Fit, &mut own).is_err() {
            return Agreement::default();
        }
        let mut others = minimiser.normal.clone();
        others.subtract_complement(&own, 0);
        let (step, _) = propose(problem.level, &others, &problem.room(coordinates), 0.0);
        let without = problem.advance(coordinates, &step);
        // What a correction has of this record alone, the others do not know.
        let of_record = (NO_RECORD, experiment);
        let predicted = objective.add_record(&without, of_record, Asked::Fit, &mut own);
        predicted.map_or_else(|_| Agreement::default(), |it| it.agreement())
    }
}

/// Leaves out the unknowns that lie on a bound, the last of these normal equations.
pub(super) fn leave_out_bounds<const L: usize>(
    problem: &Problem<'_>,
    coordinates: &Coordinates,
    normal: &mut Normal<L>,
) {
    let (all, unknowns) = (normal.unknowns(), problem.sought.unknowns());
    let ranges = problem.sought.ranges(coordinates, problem.bounds);
    for unknown in (0..unknowns).filter(|&unknown| lies_on_bound(&ranges[unknown])) {
        let own = all - unknowns + unknown;
        for other in 0..all {
            *normal.entry(own.max(other), own.min(other)) = 0.0;
        }
    }
}

/// See [`Fit::log_information`].
// The copy of the normal equations is large: inlined, it would take room on the stack of the caller.
#[inline(never)]
fn log_information(normal: &ParameterNormal, sought: &Sought, bounds: &Bounds) -> f64 {
    let unknowns = sought.unknowns();
    let ranges = sought.ranges(&[0.0; MAX_UNKNOWNS], bounds);
    // None of an unknown without bounds: of imperfections the normal equations hold the priors.
    let of_bounds = |unknown: usize| {
        let [_, lower, upper] = ranges[unknown];
        let width = upper - lower;
        if width > 0.0 && width.is_finite() { TAU / (width * width) } else { 0.0 }
    };
    let mut factor = normal.clone();
    for unknown in 0..unknowns {
        *factor.entry(unknown, unknown) += of_bounds(unknown);
    }
    factor.eliminate(unknowns);
    let pivots = (0..unknowns).map(|unknown| {
        let pivot = *factor.entry(unknown, unknown);
        // No smaller than of the bounds alone, but for rounding.
        (pivot * pivot).max(of_bounds(unknown))
    });
    pivots.filter(|pivot| *pivot > 0.0).map(libm::log).sum()
}

/// Returns whether the value of an unknown lies on an end of its range, `[value, lower, upper]` by logarithms.
pub(crate) fn lies_on_bound(range: &[f64; 3]) -> bool {
    let [value, lower, upper] = range.map(libm::exp);
    End::reached([lower, upper], value).is_some()
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

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// That of a dense matrix, also where the data determine fewer combinations than there are unknowns.
        #[test]
        fn the_logarithm_is_that_of_a_dense_determinant(
            rows in prop::collection::vec(prop::array::uniform24(-10.0..10.0_f64), 0..30),
            decades in 1.0..8.0_f64,
        ) {
            let sought = Sought::new(2).unwrap();
            let wide = [1.0, 10.0_f64.powf(decades)];
            let bounds = Bounds::new(wide, wide, wide, wide).unwrap();
            let mut normal = Normal::new();
            normal.reset(24);
            let width = decades * core::f64::consts::LN_10;
            let mut dense = DMatrix::identity(24, 24) * (TAU / (width * width));
            for row in &rows {
                let terms: std::vec::Vec<_> = row.iter().copied().enumerate().collect();
                normal.add_sparse(&terms, 1.0);
                let row = DMatrix::from_row_slice(1, 24, row);
                dense += row.transpose() * row;
            }
            let expected = dense.symmetric_eigenvalues().map(f64::ln).sum();
            let error = log_information(&normal, &sought, &bounds) - expected;
            prop_assert!(error.abs() < 1e-6, "{error}");
        }
    }

    /// The data determine one combination 10⁹ times as well as the bounds do. Rounding makes no pivot smaller than that of the bounds.
    #[test]
    fn rounding_leaves_the_information_of_the_bounds() {
        let sought = Sought::new(1).unwrap();
        let wide = [1.0, 1e6];
        let bounds = Bounds::new(wide, wide, wide, wide).unwrap();
        let mut normal = Normal::new();
        normal.reset(12);
        normal.add_sparse(&[(0, 1e9), (1, 1e9)], 0.0);
        let of_bounds = TAU / (1e6_f64.ln() * 1e6_f64.ln());
        let expected = (2e18_f64).ln() + 11.0 * of_bounds.ln();
        let found = log_information(&normal, &sought, &bounds);
        assert!((found - expected).abs() < 1.0, "{found}, not {expected}");
    }
}
