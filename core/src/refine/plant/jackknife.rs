//! Standard deviations that hold where the residuals are not those of noise.
//!
//! What the model leaves of the records beside noise is not independent from bin to bin: it is alike over a band of a resonance's width,
//! along all directions, and alike in records of one pose. The scatter of the estimate is then read from the data: blocks c of a pose and a
//! band are left out, one at a time, of all records of the pose, and the estimate moves by d_c, one step of Gauss and Newton.
//!
//! ```text
//! V = (C − 1)/C Σ (d_c − d̄) (d_c − d̄)ᵀ + N⁻¹ P N⁻¹          d_c = (N − N_c)⁻¹ (−g_c)          d̄ the mean of d_c
//! ```
//!
//! The first term is the cluster-robust covariance in its jackknife form, CR3, which accounts for the leverage of a block (Cameron and Miller,
//! "A practitioner's guide to cluster-robust inference", Journal of Human Resources 50, 2015, section VI; Efron, _The Jackknife, the
//! Bootstrap and Other Resampling Plans_, 1982). It is right if the misfits of blocks are independent; a misfit that all of them share is
//! not seen. The second term is what the imperfections add: the data do not scatter with them. P is the information of their priors.

use super::super::batch::Bins;
use super::super::equations::Equations;
use super::super::objective::Domain as _;
use super::super::proposal::propose;
use super::super::record::share_pose;
use super::super::sizes::ALL;
use super::super::sum_of_squares::{Fitted as _, PartOf, SumOfSquares};
use super::super::{Problem, Refinement};
use super::Plant;
use super::domain::PlantDomain;
use super::objective::OfPlant;
use crate::sought::MAX_UNKNOWNS;
use crate::spectrum::Experiment;

/// Blocks that three or more records have together, about. Chosen: the deviation is then known to a tenth; of one record to a fifth.
const BLOCKS: usize = 48;
/// Bands of a record, least and most. Chosen: a band is wider than the resonance of a robot's joint, some tens of hertz at most.
const BANDS: [usize; 2] = [4, 16];

impl Refinement {
    /// Standard deviation of each unknown where the plant stands, after [`Refinement::fit_plant`], by the scatter between blocks of the
    /// records, over `inflation`. Those of the imperfections are raised to theirs. `None` where gravity leaves the robot no equilibrium.
    pub(crate) fn jackknife_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
        inflation: f64,
    ) -> Option<[f64; MAX_UNKNOWNS]> {
        plant.determine();
        let of_priors = plant.variances_of_priors();
        let scatter = self.jackknife(problem, experiments, plant)?;
        self.discount_fit(problem, experiments, plant, || true)?;
        let moved: [f64; ALL] =
            core::array::from_fn(|column| libm::sqrt(scatter[column] + of_priors[column]));
        let count = plant.imperfections.all.len();
        for (own, robust) in plant.deviations.iter_mut().zip(&moved[..count]) {
            *own = own.max(*robust / inflation);
        }
        Some(core::array::from_fn(|unknown| moved[count + unknown] / inflation))
    }

    /// Variance of each imperfection and unknown, by the scatter between blocks.
    fn jackknife<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
    ) -> Option<[f64; ALL]> {
        let Plant {
            imperfections, minimiser, point, record, summary, factor, whole, retired, ..
        } = plant;
        let domain = PlantDomain::new(problem, &imperfections.all);
        let room = domain.room(point);
        self.minimiser.linearised = false;
        let seam_unknowns = problem.seam_unknowns();
        let [least, most] = BANDS;
        let poses = (0..experiments.len()).filter(|&it| first_of_pose(experiments, it) == it);
        let bands = (BLOCKS / poses.clone().count().max(1)).clamp(least, most);
        let (retired, workspace) = (retired.as_ref(), &mut self.workspace);
        let fitted = OfPlant { retired, workspace, imperfections, record, summary };
        let mut objective =
            SumOfSquares { problem, experiments, fitted, relative_error: 0.0, every: 1 };
        // Those of the fit are discounted.
        minimiser.linearised = false;
        minimiser.linearise(&mut objective, point).ok()?;
        // Each part has a seam of its own.
        objective.fitted.workspace.seams.clear();
        let (mut blocks, mut sums, mut squares) = (0.0, [0.0; ALL], [0.0; ALL]);
        for pose in poses {
            let is_of_pose = |&(index, _): &(usize, _)| first_of_pose(experiments, index) == pose;
            let records = || experiments.iter().enumerate().filter(is_of_pose);
            let parts = || {
                records().flat_map(|(record, experiment)| {
                    let place = move |part| PartOf { experiment, part, record, seam: 0 };
                    experiment.parts().map(place)
                })
            };
            let is_alone = parts().count() == 1;
            let mut prepared = None;
            for band in 0..bands {
                factor.clone_from(&minimiser.normal);
                for place in parts() {
                    let bins = Bins::of(place.experiment, &place.part);
                    // There is memory for the equations of one whole part: those of several are assembled again for each band.
                    if prepared.is_none() || !is_alone {
                        let (model, seam) = objective.prepare(point, &place).ok()?;
                        let all = bins.some(0..bins.bins());
                        objective.fitted.assemble(problem, &model, all, Equations::All(&seam));
                        whole.clone_from(objective.fitted.record);
                        prepared = Some((model, seam));
                    }
                    let Some((model, seam)) = &prepared else { continue };
                    objective.fitted.record.clone_from(whole);
                    problem.eliminate_seam(seam, objective.fitted.record);
                    factor.subtract_complement(objective.fitted.record, seam_unknowns);
                    let edge = |band: usize| bins.bins() * band / bands;
                    let left_out = edge(band)..edge(band + 1);
                    // A short part may have no bin in a band.
                    match left_out.is_empty() {
                        true => objective.fitted.record.clone_from(whole),
                        false => {
                            let some = bins.some(left_out);
                            objective.fitted.assemble(problem, model, some, Equations::All(seam));
                            objective.fitted.record.take_from(whole);
                        }
                    }
                    objective.fitted.add_complement(problem, seam, factor);
                }
                let (step, _) = propose::<_, ALL>(problem.level, factor, &room, 0.0);
                blocks += 1.0;
                for (column, moved) in step.iter().enumerate() {
                    sums[column] += moved;
                    squares[column] += moved * moved;
                }
            }
        }
        let variance = |column: usize| {
            let mean = sums[column] / blocks;
            let scatter = squares[column] - blocks * mean * mean;
            // What is no number says nothing of the estimate.
            if scatter.is_nan() {
                f64::INFINITY
            } else {
                scatter.max(0.0) * (blocks - 1.0) / blocks
            }
        };
        Some(core::array::from_fn(variance))
    }
}

impl Plant {
    /// Variance of each imperfection and unknown by the priors of the imperfections, the diagonal of `N⁻¹ P N⁻¹`, after [`Plant::determine`].
    pub(super) fn variances_of_priors(&mut self) -> [f64; ALL] {
        let mut variances = [0.0; ALL];
        for index in 0..self.imperfections.all.len() {
            // N x = e.
            let mut x = [0.0; ALL];
            self.factor.solve(|i| if i == index { 1.0 } else { 0.0 }, &mut x);
            for (variance, x) in variances.iter_mut().zip(&x) {
                *variance += x * x;
            }
        }
        variances
    }
}

/// Number of the first experiment that has the pose of this one.
fn first_of_pose<const B: usize>(experiments: &[Experiment<B>], index: usize) -> usize {
    let shares = |other: &Experiment<B>| share_pose(&other.pose, &experiments[index].pose);
    experiments.iter().position(shares).unwrap_or(index)
}
