//! Findings from the equations of least squares: readings `z = B x + n` of errors and parameters x, noise n of variance 1.
#![allow(dead_code)]

use flexid_prediction::history::{Epoch, Posterior};
use nalgebra::{DMatrix, DVector};

use crate::common::Random;

/// As of three joints.
pub(crate) const PARAMETERS: usize = 36;
pub(crate) const ERRORS: usize = 6;
const READINGS: usize = 90;

/// What cuts at a place say.
pub(crate) struct Place {
    /// BᵀB, errors first, and its factor.
    pub(crate) information: DMatrix<f64>,
    root: DMatrix<f64>,
    /// Inverse of the information and of the priors of the errors, and its factor.
    pub(crate) covariance: DMatrix<f64>,
    factor: DMatrix<f64>,
}

/// Standard deviations of parameters in a finding without errors: 0.3 to 3 %.
pub(crate) fn deviations(random: &mut Random) -> Vec<f64> {
    (0..PARAMETERS).map(|_| 0.003 * 10_f64.powf(random.uniform(0.0, 1.0))).collect()
}

/// What errors of the size of their priors do to parameters, with this standard deviation.
pub(crate) fn effects(size: f64, random: &mut Random) -> DMatrix<f64> {
    DMatrix::from_fn(PARAMETERS, ERRORS, |_, _| size * random.normal())
}

impl Place {
    /// A place whose readings show parameters with these standard deviations. Errors act like a change of the parameters, `by_error`, and a
    /// little in a way of their own.
    pub(crate) fn new(stds: &[f64], by_error: &DMatrix<f64>, random: &mut Random) -> Self {
        // With so many readings of parameters that are as many less, the variance of each is the inverse of the difference.
        let size = ((READINGS - PARAMETERS) as f64).sqrt();
        let of_parameters = DMatrix::from_fn(READINGS, PARAMETERS, |_, parameter| {
            random.normal() / (stds[parameter] * size)
        });
        let own = DMatrix::from_fn(READINGS, ERRORS, |_, _| 0.3 * random.normal());
        let of_errors = &of_parameters * by_error + own;
        let mut all = DMatrix::zeros(READINGS, ERRORS + PARAMETERS);
        all.columns_mut(0, ERRORS).copy_from(&of_errors);
        all.columns_mut(ERRORS, PARAMETERS).copy_from(&of_parameters);
        let information = all.transpose() * &all;
        let mut whole = information.clone();
        (0..ERRORS).for_each(|own| whole[(own, own)] += 1.0);
        let covariance = whole.try_inverse().unwrap();
        let covariance = (&covariance + covariance.transpose()) * 0.5;
        let root = information.clone().cholesky().unwrap().unpack();
        let factor = covariance.clone().cholesky().unwrap().unpack();
        Self { information, root, covariance, factor }
    }

    /// What is found of this truth: errors, then logarithms.
    pub(crate) fn estimate(&self, truth: &DVector<f64>, random: &mut Random) -> DVector<f64> {
        let noise = DVector::from_fn(truth.len(), |_, _| random.normal());
        &self.covariance * (&self.information * truth + &self.root * noise)
    }

    /// A finding with this estimate.
    pub(crate) fn posterior(&self, estimate: &DVector<f64>) -> Posterior {
        let logarithms = (0..PARAMETERS).map(|own| {
            let row = ERRORS + own;
            Some((estimate[row], self.covariance[(row, row)].sqrt()))
        });
        Posterior {
            columns: (0..ERRORS).collect(),
            priors: vec![1.0; ERRORS],
            errors: estimate.rows(0, ERRORS).into_owned(),
            logarithms: logarithms.collect(),
            factor: self.factor.clone(),
            widening: 1.0,
        }
    }

    /// The same, the errors apart.
    pub(crate) fn epoch(&self, estimate: &DVector<f64>) -> Epoch {
        Epoch::new(&self.posterior(estimate), ERRORS).unwrap()
    }
}
