//! Noise of the seams in the derivatives of short parts.
//!
//! The derivatives A of a part's reading are taken at the seam that fits it best. It contains noise, `u = (SᵀS + P)⁻¹ Sᵀ e`, with the whitened rows S of the
//! seam, the information P of its prior and white noise e. The residual does not depend on u, so that the estimate has no bias. But `N = Σ AᵀA` counts the
//! noise in A as information. With K, the mean of what u adds to N, the gradient g has the slope `D = N − K`, and still the covariance N:
//!
//! ```text
//! cov θ̂ = D⁻¹ N D⁻¹        equations of this covariance: D N⁻¹ D, with the right-hand side D N⁻¹ g
//! ```
//!
//! (Neyman and Scott, "Consistent estimates based on partially consistent observations", Econometrica 16, 1948; White, "Maximum likelihood estimation of
//! misspecified models", Econometrica 50, 1982, theorem 3.2). A seam of a record of some seconds is so well known that K does not count; in parts of a
//! tenth of a second it is half of N for what the cut hardly shows.
//!
//! K is a mean over vectors e of ±1: rows of a Hadamard matrix (Sylvester's), of which consecutive ones have the covariance of white noise, exactly
//! where they are as many as its columns. The neighbours of a part, which are much like it, take the rows that follow.

use super::batch::Bins;
use super::equations::Equations;
use super::model::Model;
use super::plant::columns::Columns;
use super::problem::Problem;
use super::record::Workspace;
use super::seam::{MAX_SEAM, Seam, cost_of};
use super::sum_of_squares::{Fitted, SumOfSquares};
use crate::chain::linearise::LinearisationError;
use crate::linear::normal::Normal;
use crate::spectrum::Experiment;

/// Vectors of noise a part. Chosen: four neighbouring parts have as many as a seam of three joints has unknowns, and eight as one of six.
const DRAWS: usize = 16;

/// Entry of Sylvester's Hadamard matrix.
fn hadamard(row: usize, column: usize) -> f64 {
    if (row & column).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
}

impl Workspace {
    /// Seams that fit noise alone, over √[`DRAWS`], where the rows of the Hadamard matrix begin at `first`.
    fn seams_of_noise(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: &Bins<'_>,
        first: usize,
    ) -> [Seam; DRAWS] {
        let (unknowns, joints) = (problem.seam_unknowns(), problem.chain.joints().len());
        self.run(problem, model, record.clone(), Equations::Seam, Columns::NONE);
        self.record.eliminate_with(problem.level, unknowns);
        // With SᵀS = L Lᵀ, L e has the covariance of Sᵀe.
        let scale = 1.0 / libm::sqrt(DRAWS as f64);
        let rights: [[f64; MAX_SEAM]; DRAWS] = core::array::from_fn(|draw| {
            core::array::from_fn(|i| {
                let row = if i < unknowns { self.record.row(i) } else { &[] };
                let of_noise = |(k, l): (usize, &f64)| l * hadamard(first + draw, k);
                scale * row.iter().enumerate().map(of_noise).sum::<f64>()
            })
        });
        self.run(problem, model, record.clone(), Equations::Seam, Columns::NONE);
        let cost = cost_of(record.square(), record.parts());
        problem.eliminate_seam(&Seam { cost, ..Seam::ZERO }, &mut self.record);
        rights.map(|right| {
            let mut solution = [0.0; MAX_SEAM];
            self.record.solve(|i| right[i], &mut solution);
            Seam { cost, ..Seam::from_solution(&solution[..unknowns], joints) }
        })
    }
}

impl<F, const B: usize> SumOfSquares<'_, F, B> {
    /// Adds K of a record of this number to `noise`, without a right-hand side.
    ///
    /// # Errors
    /// The robot has no equilibrium at the point.
    pub(super) fn add_noise<const L: usize, const M: usize>(
        &mut self,
        point: &F::Point,
        (record, experiment): (usize, &Experiment<B>),
        noise: &mut Normal<M>,
    ) -> Result<(), LinearisationError>
    where
        F: Fitted<L>,
    {
        for (number, part) in experiment.parts().enumerate() {
            let model = self.model(point, (part.site, record), true)?;
            let Self { problem, fitted, every, .. } = self;
            let bins = Bins::thinned(experiment, &part, *every);
            let seams = fitted.workspace().seams_of_noise(problem, &model, &bins, DRAWS * number);
            for seam in &seams {
                fitted.assemble(problem, &model, bins.clone(), Equations::Noise(seam));
                fitted.add_complement(problem, seam, noise);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
