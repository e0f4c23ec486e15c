//! Information of a plant without what the noise in the seams adds to it.

use super::super::Refinement;
use super::super::basis::Asked;
use super::super::fit::Fit;
use super::super::levenberg_marquardt::Remaining;
use super::super::objective::Domain as _;
use super::super::problem::Problem;
use super::super::sizes::ALL;
use super::super::sum_of_squares::SumOfSquares;
use super::Plant;
use super::domain::PlantDomain;
use super::objective::OfPlant;
use crate::spectrum::Experiment;
use crate::verdict::Covariance;

impl Refinement {
    /// Goes from the minimum of a plant, whose [fit](Refinement::fit_plant) this is, to the estimate in which the noise in the seams of divided records
    /// counts as noise. Its covariance becomes that of the fit, whose residuals are those of the minimum. Without divided records nothing changes.
    /// `go_on` is asked before each of them. Returns `None` once it says no, and if the robot has no equilibrium at the minimum.
    pub(crate) fn leave_noise_out<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
        fit: &mut Fit,
        go_on: impl FnMut() -> bool,
    ) -> Option<()> {
        if !self.discount_fit(problem, experiments, plant, go_on)? {
            return Some(());
        }
        let Plant { imperfections, minimiser, point, .. } = plant;
        let domain = PlantDomain::new(problem, &imperfections.all);
        let Remaining { step, .. } = minimiser.remaining(&domain, point);
        *point = domain.advance(point, &step);
        minimiser.normal.shift(&step);
        self.go_where_plant_stands(problem, plant);
        fit.take(problem.sought, Covariance::of(&self.minimiser.normal));
        Some(())
    }

    /// [Discounts](crate::linear::normal::Normal::discount) the divided records in the equations of the last fit. Returns whether there are any. The K of
    /// retired records, which nobody knows any more, is taken as that of as many kept ones. Returns `None` once `go_on` says no, and if the robot has no
    /// equilibrium where the plant stands; then the equations stay.
    pub(super) fn discount_fit<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
        mut go_on: impl FnMut() -> bool,
    ) -> Option<bool> {
        let divided = || experiments.iter().enumerate().filter(|(_, own)| !own.is_whole());
        let kept = divided().count();
        if kept == 0 {
            return Some(false);
        }
        let Plant {
            imperfections, point, summary, minimiser, factor, whole, record, retired, ..
        } = plant;
        let normal = &mut minimiser.normal;
        let (own, noise) = (factor, whole);
        own.reset(normal.unknowns());
        noise.reset(normal.unknowns());
        let workspace = &mut self.workspace;
        let fitted = OfPlant { retired: None, workspace, imperfections, record, summary };
        let mut objective =
            SumOfSquares { problem, experiments: &[], fitted, relative_error: 0.0, every: 1 };
        for numbered in divided() {
            if !go_on() {
                return None;
            }
            objective.add_record(point, numbered, Asked::Fit, own).ok()?;
            objective.add_noise(point, numbered, noise).ok()?;
        }
        if let Some(retired) = retired {
            retired.add_to(own, problem.sought, point, &imperfections.all);
            let all = 1.0 + retired.information.records() as f64 / kept as f64;
            noise.entries_mut().iter_mut().for_each(|entry| *entry *= all);
        }
        normal.subtract_complement(own, 0);
        own.discount(problem.level, noise, record, &mut [0.0; ALL]);
        normal.add_complement(own, 0);
        Some(true)
    }
}
