//! Factors on the accuracies that the data contradict.

use crate::imperfection::{Imperfection, KINDS};

/// Factor τ of each kind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Restated {
    pub(super) factors: [f64; KINDS],
    /// γ of each kind.
    pub(super) determined: [f64; KINDS],
    pub(super) is_done: bool,
    pub(super) adoptions: u32,
}

impl Default for Restated {
    fn default() -> Self {
        Self { factors: [1.0; KINDS], determined: [1.0; KINDS], is_done: false, adoptions: 0 }
    }
}

impl Restated {
    /// τ of the kind of an imperfection.
    pub(super) fn factor(&self, imperfection: Imperfection) -> f64 {
        self.factors[imperfection.kind()]
    }
}
