//! Sums over the residuals of all records together.

use super::residuals::Residuals;
use super::structure::Structures;

/// Sums over records.
#[derive(Clone, Debug, Default)]
pub(super) struct Summary {
    pub(super) similarities: Similarities,
    pub(super) structures: Structures,
}

impl Summary {
    /// Takes a record. The structure of one that is divided is another matter: see `leverage`.
    pub(super) fn push(&mut self, residuals: &Residuals, is_whole: bool) {
        self.similarities.push(residuals.similarity());
        if is_whole {
            self.structures.push(&residuals.box_pierce());
        }
    }
}

/// SSP per direction and experiment, of as many experiments as fit; the rest count only to the largest.
#[derive(Clone, Debug, Default)]
pub(super) struct Similarities {
    values: heapless::Vec<f64, { 3 * 64 }>,
    largest: f64,
}

impl Similarities {
    fn push(&mut self, similarity: impl Iterator<Item = f64>) {
        for value in similarity {
            let _ = self.values.push(value);
            self.largest = self.largest.max(value);
        }
    }

    pub(super) fn median_and_largest(mut self) -> [f64; 2] {
        self.values.sort_unstable_by(f64::total_cmp);
        let middle = self.values.len() / 2;
        let median = match (self.values.len() % 2, self.values.get(middle)) {
            (0, Some(upper)) => 0.5 * (self.values[middle - 1] + upper),
            (_, Some(value)) => *value,
            _ => 0.0,
        };
        [median, self.largest]
    }
}
