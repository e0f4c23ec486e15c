//! Criteria by which a minimum is judged.

use crate::refine::{Fit, Structure};

/// Residuals that are left at a minimum, and what it is compared by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    pub(super) sum_of_squares: f64,
    pub(super) degrees_of_freedom: f64,
    pub(super) static_sum_of_squares: f64,
    pub(super) static_residuals: usize,
    /// True if the errors of some records are those that their user states.
    pub(super) has_stated_noise: bool,
    pub(super) structure: Structure,
    /// Median surface similarity parameter.
    pub(super) ssp: f64,
    pub(super) objective: f64,
    pub(super) log_information: f64,
}

impl Judged {
    pub(super) fn of(fit: &Fit) -> Self {
        Self {
            sum_of_squares: fit.sum_of_squares,
            degrees_of_freedom: fit.degrees_of_freedom,
            static_sum_of_squares: fit.static_sum_of_squares,
            static_residuals: fit.static_residuals,
            has_stated_noise: fit.has_stated_noise,
            structure: fit.structure,
            ssp: fit.ssp[0],
            objective: fit.objective,
            log_information: fit.log_information,
        }
    }
}
