//! Leverage of a seam: the part of the noise of each bin that the seam takes.
//!
//! Let S be the whitened rows of a seam and P the information of its prior. White noise e leaves
//!
//! ```text
//! r = (1 − H) e        H = S (Sᵀ S + P)⁻¹ Sᵀ        E rᵀ r + prior = n − tr H
//! ```
//!
//! of n residuals. In a long record H is small: a seam has few unknowns. In the short parts of a divided record it takes much of the lowest bins, so
//! that white residuals would look structured. Divided by `√(1 − h)`, h the diagonal of H, they are as white as those of a long record (Cook and
//! Weisberg, _Residuals and Influence in Regression_, 1982, section 2.1).

use super::Refinement;
use super::batch::{Batch, Bins};
use super::equations::{Assembly, Equations, by_lane, whiten};
use super::model::Model;
use super::plant::Plant;
use super::plant::columns::Columns;
use super::problem::Problem;
use super::record::Workspace;
use super::residuals::Residuals;
use super::rows::{Rows, write_seam};
use super::seam::MAX_SEAM;
use super::sizes::{COLUMNS, OF_RECORD, RecordNormal};
use super::structure::Structures;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, Response};
use crate::spectrum::{Experiment, Part};

/// Least part of the noise of a bin that a seam leaves. Chosen: rounding of H is far below; such a bin hardly counts.
const LEAST_LEFT: f64 = 0.01;

impl Refinement {
    /// Adds the structure of the divided records to that of the others, at the present coordinates, or where a plant stands, if there is one. Returns
    /// the number of residuals that the seams of all records take.
    pub(super) fn taken_by_seams<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: Option<&Plant>,
        structures: &mut Structures,
    ) -> f64 {
        let mut taken = 0.0;
        for (record, experiment) in experiments.iter().enumerate() {
            if experiment.is_whole() {
                taken += problem.seam_unknowns_of(experiment) as f64;
                continue;
            }
            let mut residuals = Residuals::default();
            for part in experiment.parts() {
                let coordinates = &self.coordinates;
                let Ok(model) = self.model_of(problem, coordinates, plant, &part, record) else {
                    return taken;
                };
                taken += self.workspace.levered(problem, &model, experiment, &part, &mut residuals);
            }
            structures.push(&residuals.box_pierce());
        }
        taken
    }
}

impl Workspace {
    /// Adds the residuals of a part, divided by what its seam leaves of their noise. Returns the number of residuals that the seam takes.
    fn levered<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        experiment: &Experiment<B>,
        part: &Part<'_>,
        residuals: &mut Residuals,
    ) -> f64 {
        let bins = || Bins::of(experiment, part);
        let (seam, _) = self.fit_seam(problem, model, bins());
        let assembly = Assembly {
            model,
            record: bins(),
            equations: Equations::All(&seam),
            sought: problem.sought,
            columns: Columns::NONE,
            normal: &mut self.record,
            level: problem.level,
        };
        let (of_part, taken) = run(assembly);
        residuals.add(&of_part);
        taken
    }
}

/// [`Levered::run`], compiled once: not again for each number of bins, in each crate.
#[inline(never)]
fn run(assembly: Assembly<'_, COLUMNS, OF_RECORD>) -> (Residuals, f64) {
    f64::dispatch(assembly.level, Levered(assembly))
}

/// An assembly whose normal equations hold the factor of the seam.
struct Levered<'a>(Assembly<'a, COLUMNS, OF_RECORD>);

impl Kernel<f64> for Levered<'_> {
    type Output = (Residuals, f64);

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) -> (Residuals, f64) {
        let Self(assembly) = self;
        let bins = assembly.record.bins();
        let columns = assembly.seam_columns();
        let mut residuals = Residuals::new(bins);
        let mut taken = 0.0;
        let mut response = Response::new(like);
        let mut rows = V::each([[0.0; COLUMNS]; 6]);
        let rows: &mut [Rows] = rows.as_mut();
        for first in (0..bins).step_by(V::WIDTH) {
            let lanes = first..bins.min(first + V::WIDTH);
            let mut batch = Batch::new(like, &assembly.record, assembly.model, first);
            let unexplained = assembly.read(&mut response, &batch, lanes.clone());
            let accelerance = by_lane(&response.per_force);
            let noise = assembly.noise(lanes.clone());
            let weights = whiten(&noise, &accelerance, lanes.len());
            assembly.elongate(&mut response, &mut batch, &[Complex::zero(like); 3]);
            write_seam(rows, &response, &batch, assembly.model.terms.joints.len());
            for (lane, bin) in lanes.enumerate() {
                let rows = &mut rows[lane];
                for (row, value) in rows.iter_mut().zip(unexplained[lane].as_flattened()) {
                    row[columns] = *value;
                }
                weights[lane].apply(rows, columns + 1);
                let mut white = [[0.0; 2]; 3];
                for (axis, white) in white.iter_mut().enumerate() {
                    let [re, im] = [&rows[2 * axis], &rows[2 * axis + 1]];
                    let taken_of_both: f64 =
                        [re, im].map(|row| leverage(assembly.normal, &row[..columns])).iter().sum();
                    taken += taken_of_both;
                    let left = (1.0 - 0.5 * taken_of_both).max(LEAST_LEFT);
                    *white = [re, im].map(|row| row[columns] / libm::sqrt(left));
                }
                assembly.take_residual(&mut residuals, bin, &unexplained[lane], &white);
            }
        }
        (residuals, taken)
    }
}

/// `sᵀ (L Lᵀ)⁻¹ s` of a row s, with the factor L of a seam: `|u|²` of `L u = s`.
fn leverage(factor: &RecordNormal, row: &[f64]) -> f64 {
    let mut u = [0.0; MAX_SEAM];
    let mut sum = 0.0;
    for (i, value) in row.iter().enumerate() {
        let of_factor = factor.row(i);
        let known: f64 = of_factor[..i].iter().zip(&u[..i]).map(|(l, u)| l * u).sum();
        u[i] = if of_factor[i] > 0.0 { (value - known) / of_factor[i] } else { 0.0 };
        sum += u[i] * u[i];
    }
    sum
}

#[cfg(test)]
pub(super) mod tests;
