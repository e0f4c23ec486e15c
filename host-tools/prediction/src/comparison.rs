//! Compares two fits of a robot.
//!
//! ```text
//! dᵢ = ln θᵢ(after) − ln θᵢ(before)        C = C(before) + C(after)        D² = dᵀ (C + diag (rᵢ²/2)²)⁻¹ d ~ χ²(rank C)
//!                                          rᵢ = min(|dᵢ|, 3 √Cᵢᵢ)
//! ```
//!
//! D is the Mahalanobis distance over the parameters that both fits determine (Casella and Berger, _Statistical Inference_, 2002, section
//! 10.3). The records of the fits are independent. The imperfections of a robot, such as its masses, are common to both fits, and their
//! part of d would cancel; here both covariances hold it. So the intervals are too wide rather than too narrow, and a change that is
//! smaller than the accuracies of the robot is not seen.
//!
//! The term with r is the remainder of the logarithms' linearisation: where two parameters trade off, a combination of them is known far
//! better than either, and what a shift along the valley leaves of it grows with its square (Chosen: half of it, as of a Taylor series, up
//! to where chance alone carries a parameter). It is of the distance alone, not of the intervals.
//!
//! Each parameter is judged by itself, too, by Holm's method ("A simple sequentially rejective multiple test procedure", Scandinavian
//! Journal of Statistics 6, 1979). Either test has half of the level, so that two fits of the same robot are called different in at
//! most [`LEVEL`] of all cases (Bonferroni).

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use crate::document::Found;
use crate::holm::holm;
use crate::parameter::{IncomparableError, Place, Quantity, places, same_joints};
use crate::reference;
use flexid_pipeline::dynamics::PositiveEstimate;

/// Chance that two fits of the same robot are called different.
pub const LEVEL: f64 = 0.05;
/// Level of each of the two tests.
const OF_TEST: f64 = LEVEL / 2.0;
/// Smallest eigenvalue of a scaled covariance, in parts of the largest one, that is more than rounding. Chosen: between what the inverse of
/// an information matrix keeps, 1e-14, and its square root.
const CONDITION: f64 = 1e-9;
/// Distance up to which chance carries a parameter, in standard deviations. Chosen.
const BY_CHANCE: f64 = 3.0;

/// A parameter in both fits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Name of its joint.
    pub joint: String,
    /// Degree of freedom, 0 to 5: `tx ty tz rx ry rz`.
    pub dof: usize,
    /// Stiffness or damping.
    pub quantity: Quantity,
    /// Values before and after, in the unit of the quantity.
    pub values: [f64; 2],
    /// After over before.
    pub ratio: PositiveEstimate,
    /// Difference of the logarithms in standard deviations.
    pub deviations: f64,
    /// Chance of so large a difference of any of the parameters in two fits of the same robot (Holm).
    pub chance: f64,
    /// True if the parameter has changed.
    pub has_changed: bool,
}

/// Two fits of a robot, one beside the other.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// True if the fits agree within their intervals.
    pub agree: bool,
    /// Square of the Mahalanobis distance.
    pub distance_squared: f64,
    /// Its degrees of freedom: combinations of parameters that the fits determine.
    pub freedoms: usize,
    /// χ² that two fits of the same robot exceed with half of [`LEVEL`].
    pub quantile: f64,
    /// Chance of so large a distance in two fits of the same robot.
    pub chance: f64,
    /// Parameters that both fits determine, base first.
    pub parameters: Vec<Change>,
    /// Number of all parameters.
    pub all: usize,
    /// Frequency at which the values are those of both fits, where stiffness and damping depend on it, Hz.
    pub reference_hz: f64,
}

/// Compares the fits of a robot `before` and `after`.
///
/// # Errors
/// The robots have other joints, or no parameter is determined by both fits.
pub fn compare(before: &Found, after: &Found) -> Result<Comparison, IncomparableError> {
    same_joints(before, after)?;
    let all = places(before.joints.len());
    // Files of older programs state their parameters elsewhere.
    let hz = after.robot.reference_hz();
    let restated = [before, after].map(|found| reference::at(found, hz));
    let (places, stds): (Vec<&Place>, Vec<[f64; 2]>) = all
        .iter()
        .filter_map(|own| {
            let [before, after] = restated.each_ref().map(|found| own.determined(&found.joints));
            Some((own, [before?, after?]))
        })
        .unzip();
    if places.is_empty() {
        return Err(IncomparableError::Nothing);
    }
    let values: Vec<[f64; 2]> =
        places.iter().map(|own| restated.each_ref().map(|found| own.of(&found.joints).0)).collect();
    let difference =
        DVector::from_iterator(values.len(), values.iter().map(|[from, to]| to.ln() - from.ln()));
    let [of_before, of_after] = [0, 1].map(|fit| {
        let stds: Vec<f64> = stds.iter().map(|own| own[fit]).collect();
        covariance(&restated[fit].covariance, &places, &stds)
    });
    let covariance = of_before + of_after;
    let mut curved = covariance.clone();
    for (i, own) in difference.iter().enumerate() {
        let reach = own.abs().min(BY_CHANCE * covariance[(i, i)].sqrt());
        curved[(i, i)] += (reach * reach / 2.0).powi(2);
    }
    let (distance_squared, freedoms) = mahalanobis(&difference, &curved);
    let (quantile, chance) =
        chi_squared(distance_squared, freedoms).ok_or(IncomparableError::Nothing)?;
    let deviations: Vec<f64> =
        (0..values.len()).map(|i| difference[i] / covariance[(i, i)].sqrt()).collect();
    let chances = holm(&deviations);
    let parameters: Vec<Change> = (0..values.len())
        .map(|i| Change {
            joint: before.joints[places[i].joint].name.to_string(),
            dof: places[i].dof,
            quantity: places[i].quantity,
            values: values[i],
            ratio: PositiveEstimate::new(difference[i].exp(), covariance[(i, i)].sqrt()),
            deviations: deviations[i],
            chance: chances[i],
            has_changed: chances[i] < OF_TEST,
        })
        .collect();
    let agree = chance >= OF_TEST && !parameters.iter().any(|own| own.has_changed);
    Ok(Comparison {
        agree,
        distance_squared,
        freedoms,
        quantile,
        chance,
        parameters,
        all: all.len(),
        reference_hz: hz,
    })
}

/// Covariance of the logarithms at these places. A variance that the report states larger, as by the scatter of its records, replaces
/// that of the fit; correlations stay.
fn covariance(all: &DMatrix<f64>, places: &[&Place], stds: &[f64]) -> DMatrix<f64> {
    let at = |i: usize, j: usize| all[(places[i].coordinate(), places[j].coordinate())];
    let widening: Vec<f64> = stds
        .iter()
        .enumerate()
        .map(|(i, std)| if at(i, i) > 0.0 { (std / at(i, i).sqrt()).max(1.0) } else { 0.0 })
        .collect();
    DMatrix::from_fn(places.len(), places.len(), |i, j| match i == j {
        true => (widening[i] * widening[i] * at(i, i)).max(stds[i] * stds[i]),
        false => widening[i] * widening[j] * at(i, j),
    })
}

/// `dᵀ C⁻¹ d` over the combinations that C determines, and their number.
fn mahalanobis(difference: &DVector<f64>, covariance: &DMatrix<f64>) -> (f64, usize) {
    let scale: Vec<f64> = covariance.diagonal().iter().map(|own| own.sqrt().recip()).collect();
    let scaled =
        DMatrix::from_fn(scale.len(), scale.len(), |i, j| covariance[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.symmetric_eigen();
    let difference = difference.component_mul(&DVector::from_vec(scale));
    let least = CONDITION * eigen.eigenvalues.max();
    let mut squares = Vec::new();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > least {
            squares.push(vector.dot(&difference).powi(2) / value);
        }
    }
    (squares.iter().sum(), squares.len())
}

/// Quantile and chance of a χ² of so many degrees of freedom. `None` without any.
fn chi_squared(value: f64, freedoms: usize) -> Option<(f64, f64)> {
    let distribution = ChiSquared::new(freedoms as f64).ok()?;
    Some((distribution.inverse_cdf(1.0 - OF_TEST), distribution.sf(value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: with correlation ρ, `D² = (a² − 2 ρ a b + b²) / (1 − ρ²)` in standard deviations a and b.
    #[test]
    fn the_distance_counts_correlations_and_leaves_out_what_is_singular() {
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 1.2, 1.2, 1.0]);
        let (distance, freedoms) = mahalanobis(&DVector::from_vec(vec![2.0, -1.0]), &covariance);
        assert!((distance - 3.2 / 0.64).abs() < 1e-12 && freedoms == 2, "{distance}");
        let singular = DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0]);
        let (distance, freedoms) = mahalanobis(&DVector::from_vec(vec![1.0, 1.0]), &singular);
        assert!((distance - 1.0).abs() < 1e-12 && freedoms == 1, "{distance}");
        // A table of χ² has 9.35 and 0.0498 (Abramowitz and Stegun, table 26.7 and 26.8).
        assert_eq!(chi_squared(1.0, 0), None);
        let (quantile, chance) = chi_squared(7.82, 3).unwrap();
        assert!((quantile - 9.348).abs() < 1e-3 && (chance - 0.0499).abs() < 1e-4, "{chance}");
    }
}
