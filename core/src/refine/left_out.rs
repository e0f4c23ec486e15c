//! Prediction of each static test by all else.
//!
//! The rows A of a test, in its standard deviations, have the hat matrix `H = A N⁻¹ Aᵀ`. A fit without the test leaves it the
//! residuals e, whose weighted square q is by how much the sum of squares S falls without it (Cook and Weisberg, _Residuals and
//! Influence in Regression_, 1982, section 3.6):
//!
//! ```text
//! e = (I − H)⁻¹ r          q = rᵀ (I − H)⁻¹ r          F = (q / m) / s²          s² = (S − q) / (ν − m)
//! ```
//!
//! F has the distribution of Fisher with m, the number of the test's readings, and `ν − m` degrees of freedom if the test is as the
//! others are. It is the square of the externally studentised residual where m is 1. Of n tests the largest F is one of n trials, so
//! that its chance is at most n times as large (Bonferroni; the same, section 2.2.2).
//!
//! A displacement that only this test determines is predicted by nothing: `I − H` is singular along it, and it does not count.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use super::fit::leave_out_bounds;
use super::plant::Plant;
use super::problem::Problem;
use super::sizes::ALL;
use super::statics::Statics;
use super::{Fit, Refinement};
use crate::linear::normal::Normal;
use crate::statics::{LeftOut, MAX_STATIC_TESTS, RESOLVED, StaticTest};
use crate::verdict::fisher_exceeds;

/// Part of each unknown's information that is added to it: combinations of unknowns that the data determine less are undetermined.
/// Chosen: a hundredfold above what rounding leaves of an exact dependence.
const UNDETERMINED: f64 = 1e-12;
/// Least part of a displacement's variance that is left to test it by. Chosen: it is predicted a thousand times worse than measured.
const UNTESTED: f64 = 1e-6;

/// Residuals of a test, and what a fit without it would leave.
struct Block {
    /// r, zero of what was not measured.
    residual: Vector3<f64>,
    /// e; none of what nothing else predicts.
    left_out: Option<Vector3<f64>>,
    /// 1 − h of each reading.
    redundancy: [f64; 3],
    /// q.
    square: f64,
    /// m.
    readings: f64,
}

impl Refinement {
    /// Residuals of each static test, of the last [`Refinement::fit`], or of the last fit to a plant; none if that has found no equilibrium.
    /// `has_records` says whether the fit rests on more than static tests.
    // The normal equations are large: inlined, they would take room on the stack of the caller.
    #[inline(never)]
    pub(crate) fn static_tests_left_out(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        has_records: bool,
        plant: Option<&mut Plant>,
    ) -> Vec<LeftOut, MAX_STATIC_TESTS> {
        if problem.statics.is_empty() || !fit.objective.is_finite() {
            return Vec::new();
        }
        let blocks = match plant {
            Some(plant) => {
                let (statics, factor) = plant.statics_and_factor(problem);
                self.blocks(problem, &statics, factor)
            }
            None => {
                let correction = self.workspace.correction.values().iter().copied();
                let statics = Statics::at(problem, &self.coordinates, correction);
                let mut factor = self.minimiser.normal.clone();
                self.blocks(problem, &statics, &mut factor)
            }
        };
        let Some(blocks) = blocks else { return Vec::new() };
        // With a prior, which is no reading, fewer unknowns are taken off the readings.
        let freedom = match has_records {
            true => fit.degrees_of_freedom,
            false => blocks.iter().flat_map(|block| block.redundancy).sum(),
        };
        let tested = blocks.iter().filter(|block| block.readings > 0.0).count() as f64;
        let left_out = problem.statics.iter().zip(&blocks).map(|(test, block)| {
            let others = freedom - block.readings;
            let scale = (fit.sum_of_squares - block.square).max(0.0) / others;
            let scale = scale.max(least_scale(test));
            let can_be_tested = block.readings > 0.0 && others >= 1.0;
            let size = can_be_tested.then(|| block.square / block.readings / scale);
            let measured = |values: Vector3<f64>| {
                core::array::from_fn(|axis| test.displacement[axis].map(|_| values[axis]))
            };
            LeftOut {
                residual: measured(block.residual),
                left_out: block.left_out.map_or([None; 3], measured),
                redundancy: block.redundancy,
                deviations: size.map(libm::sqrt),
                chance: size
                    .map(|size| (tested * fisher_exceeds(size, block.readings, others)).min(1.0)),
            }
        });
        left_out.collect()
    }
}

impl Refinement {
    /// Each test, by the normal equations of the fit, which become their factor. `None` where the robot has no equilibrium.
    fn blocks<const L: usize>(
        &self,
        problem: &Problem<'_>,
        statics: &Statics<'_>,
        normal: &mut Normal<L>,
    ) -> Option<Vec<Block, MAX_STATIC_TESTS>> {
        leave_out_bounds(problem, &self.coordinates, normal);
        let unknowns = normal.unknowns();
        for unknown in 0..unknowns {
            *normal.entry(unknown, unknown) *= 1.0 + UNDETERMINED;
        }
        normal.eliminate(unknowns);
        problem.statics.iter().map(|test| block(statics, test, normal)).collect()
    }
}

/// Least scale of the other residuals that counts, as a mean square in the test's standard deviations: that of stated noise, or of what a
/// gauge resolves. Exact displacements would make an outlier of rounding.
fn least_scale(test: &StaticTest) -> f64 {
    let least = |(_, reading): (usize, crate::statics::Reading)| match reading.is_stated {
        true => 1.0,
        false => RESOLVED / reading.deviation,
    };
    let least = test.readings().map(least).fold(0.0, f64::max);
    least * least
}

/// A test's residuals by the Cholesky factor L of the information: `H = Z Zᵀ`, where `L Z_iᵀ = A_iᵀ`. None where the robot has no
/// equilibrium.
fn block<const L: usize>(
    statics: &Statics<'_>,
    test: &StaticTest,
    factor: &Normal<L>,
) -> Option<Block> {
    let unknowns = factor.unknowns();
    let rows = statics.rows(test).ok()?;
    let mut solved = [[0.0; ALL]; 3];
    for (row, solved) in rows.iter().zip(&mut solved) {
        for k in 0..unknowns {
            let own = &factor.row(k)[..=k];
            let known: f64 = own[..k].iter().zip(&*solved).map(|(l, z)| l * z).sum();
            solved[k] = if own[k] > 0.0 { (row[k] - known) / own[k] } else { 0.0 };
        }
    }
    let hat =
        Matrix3::from_fn(|i, j| solved[i].iter().zip(&solved[j]).map(|(a, b)| a * b).sum::<f64>());
    let residual = Vector3::from_fn(|axis, _| rows[axis][unknowns]);
    Some(Block::new(residual, &hat, test))
}

impl Block {
    /// Returns the comparison of one test. A displacement that was not measured has no residual and the hat value 0.
    fn new(residual: Vector3<f64>, hat: &Matrix3<f64>, test: &StaticTest) -> Self {
        let readings = test.readings().count();
        let left = (Matrix3::identity() - hat).symmetric_eigen();
        let redundancy = core::array::from_fn(|axis| {
            test.displacement[axis].map_or(0.0, |_| 1.0 - hat[(axis, axis)])
        });
        let (mut left_out, mut square, mut untested) = (Vector3::zeros(), 0.0, 0);
        for (value, direction) in left.eigenvalues.iter().zip(left.eigenvectors.column_iter()) {
            if *value <= UNTESTED {
                untested += 1;
                continue;
            }
            let along = direction.dot(&residual);
            left_out += direction * (along / value);
            square += along * along / value;
        }
        Self {
            residual,
            left_out: (untested == 0).then_some(left_out),
            redundancy,
            square,
            readings: readings.saturating_sub(untested) as f64,
        }
    }
}
