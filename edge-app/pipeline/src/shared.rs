//! What two findings of a robot share: the errors of robot, sensors and mounting that stay from one to the next.
//!
//! ```text
//! C = L Lᵀ        C = [ C_νν  C_νθ ]        L = [ L_νν   0   ]        θ | ν ~ N(θ̂ + A (ν − ν̂), w² L_θθ L_θθᵀ)        A = L_θν L_νν⁻¹
//!                     [ C_θν  C_θθ ]            [ L_θν  L_θθ ]
//! ```
//!
//! ν are the errors in units of their priors' standard deviations, θ the logarithms of the parameters. What a finding says of both with the
//! priors is N((ν̂, θ̂), C); a reader of several findings takes the priors once. A factor keeps small variances that a covariance loses by
//! rounding.

use flexid_core::chain::Chain;
use flexid_core::identify::{Estimate, PlantEstimate};
use flexid_core::imperfection::Imperfection;
use flexid_core::refine::Plant;
use flexid_core::sought::Sought;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::dynamics::OF_JOINT;
use crate::posterior::{Posterior, Uncertain};

/// Part of a variance below which what is left of it is rounding. Chosen: a hundred times that of an inverse of two hundred rows.
const ROUNDING: f64 = 1e-12;

/// Errors that findings share, and the factor of their covariance with the parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shared {
    /// The errors.
    pub imperfections: Vec<SharedImperfection>,
    /// w: by how many times the noise is larger than stated, as a standard deviation.
    pub widening: f64,
    /// Lower triangle of L, row by row: the errors, then the logarithms of all parameters, joint by joint stiffnesses and dampings.
    pub factor: Vec<f32>,
}

/// An error that findings share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SharedImperfection {
    /// The error.
    pub imperfection: Imperfection,
    /// Most likely value, in its unit.
    pub value: f64,
    /// Standard deviation of its prior, in its unit.
    pub prior: f64,
}

impl Shared {
    /// What an estimate shares with others, by the information of the fit to a `plant` that gave it, unless that is perfect. The plant must
    /// stand where this fit has ended.
    pub(crate) fn new(
        config: &Config,
        sought: &Sought,
        estimate: &Estimate,
        plant: Option<(&Plant, &PlantEstimate)>,
    ) -> Self {
        let posterior = Posterior::new(config, sought, estimate, plant);
        let own = posterior.imperfections.iter();
        let own: Vec<&Uncertain> = own.filter(|own| !is_of_a_record(own.imperfection)).collect();
        let rows: Vec<Option<usize>> =
            own.iter().map(|own| Some(own.row)).chain(posterior.parameters).collect();
        let covariance = DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
            rows[i].zip(rows[j]).map_or(0.0, |place| posterior.covariance[place])
        });
        let factor = factor(&covariance);
        let lower = (0..rows.len()).flat_map(|row| (0..=row).map(move |column| (row, column)));
        Self {
            imperfections: own
                .into_iter()
                .map(|&Uncertain { imperfection, value, prior, .. }| SharedImperfection {
                    imperfection,
                    value,
                    prior,
                })
                .collect(),
            widening: posterior.widening,
            factor: lower.map(|place| factor[place] as f32).collect(),
        }
    }
}

impl Shared {
    /// What is wrong with it as one of a robot with this chain. `None` if nothing is.
    pub fn fault(&self, chain: &Chain) -> Option<String> {
        let Self { imperfections, widening, factor } = self;
        let is_right = |own: &SharedImperfection| {
            let is_known = own.imperfection.is_of(chain) && !is_of_a_record(own.imperfection);
            is_known && own.value.is_finite() && own.prior > 0.0 && own.prior.is_finite()
        };
        if let Some(wrong) = imperfections.iter().position(|own| !is_right(own)) {
            return Some(format!("imperfections[{wrong}] is of another robot, or no number"));
        }
        if !(*widening > 0.0 && widening.is_finite()) {
            return Some("widening is no positive number".into());
        }
        let size = imperfections.len() + OF_JOINT * chain.joints().len();
        let wanted = size * (size + 1) / 2;
        if factor.len() != wanted || !factor.iter().all(|own| own.is_finite()) {
            let given = factor.len();
            return Some(format!(
                "factor has {given} entries, and this robot has {wanted}, or one is no number"
            ));
        }
        let diagonal = |row: usize| factor[row * (row + 3) / 2];
        if !(0..imperfections.len()).all(|row| diagonal(row) > 0.0) {
            return Some("factor has an imperfection without a variance".into());
        }
        None
    }
}

fn is_of_a_record(imperfection: Imperfection) -> bool {
    matches!(imperfection, Imperfection::RecordDelay(_) | Imperfection::RecordStiffness(_))
}

/// Lower triangular L with `L Lᵀ = C`. What does not vary beside the rows before has a column of zeros.
fn factor(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let size = covariance.nrows();
    let mut factor = DMatrix::zeros(size, size);
    for column in 0..size {
        for row in column..size {
            let before = (0..column).map(|k| factor[(row, k)] * factor[(column, k)]);
            let rest = covariance[(row, column)] - before.sum::<f64>();
            factor[(row, column)] = match row == column {
                true if rest > ROUNDING * covariance[(row, row)] => rest.sqrt(),
                true => 0.0,
                false if factor[(column, column)] > 0.0 => rest / factor[(column, column)],
                false => 0.0,
            };
        }
    }
    factor
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squared again it is the covariance; the second row is twice the first, the last does not vary.
    #[test]
    fn a_singular_covariance_has_a_factor() {
        let covariance = DMatrix::from_row_slice(
            4,
            4,
            &[4.0, 8.0, 2.0, 0.0, 8.0, 16.0, 4.0, 0.0, 2.0, 4.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        );
        let factor = factor(&covariance);
        assert!((&factor * factor.transpose() - &covariance).amax() < 1e-12, "{factor}");
        assert_eq!((factor[(1, 1)], factor[(2, 2)], factor[(0, 1)]), (0.0, 2.0, 0.0));
    }
}
