//! One parameter through the findings.

use std::ops::Range;

use nalgebra::DVector;

use crate::findings::{Epoch, Pool};

/// A parameter in the findings that determine it, in their order.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// Number of the finding of each entry.
    pub(super) findings: Vec<usize>,
    /// Value without the errors, weight (1/variance), and slopes along the errors, of each entry.
    entries: Vec<(f64, f64, DVector<f64>)>,
    /// Sums over the entries before: of weights, and of values and slopes times weights.
    sums: Vec<(f64, f64, DVector<f64>)>,
}

/// A linear combination of the logarithms of a series: its value, the variance by each finding's own noise, and the slopes along the errors.
#[derive(Clone, Debug)]
pub(super) struct Contrast {
    value: f64,
    variance: f64,
    slopes: DVector<f64>,
}

impl Contrast {
    /// Its value, with the errors as the findings have them.
    pub(super) fn value(&self, pool: &Pool) -> f64 {
        self.value + self.slopes.dot(&pool.errors)
    }

    /// Its standard deviation, by noise so many times as large and by what is not known of the errors.
    pub(super) fn deviation(&self, scatter: f64, pool: &Pool) -> f64 {
        (self.variance * scatter + pool.variance(&self.slopes)).sqrt()
    }

    /// Standard deviations that it could be from zero, if the errors were known: not fewer than there are.
    pub(super) fn most_deviations(&self, pool: &Pool) -> f64 {
        self.value(pool).abs() / self.variance.sqrt()
    }
}

impl Series {
    pub(super) fn new(errors: usize) -> Self {
        let sums = vec![(0.0, 0.0, DVector::zeros(errors))];
        Self { findings: Vec::new(), entries: Vec::new(), sums }
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Adds what finding number `finding` says of parameter number `parameter`, if it determines it.
    pub(super) fn add(&mut self, epoch: &Epoch, parameter: usize, finding: usize) {
        let Some((value, variance)) = epoch.values[parameter] else { return };
        let (weight, slopes) = (variance.recip(), epoch.slopes.row(parameter).transpose());
        let (of_weights, of_values, of_slopes) = &self.sums[self.len()];
        let sums = (of_weights + weight, of_values + weight * value, of_slopes + weight * &slopes);
        self.sums.push(sums);
        self.entries.push((value, weight, slopes));
        self.findings.push(finding);
    }

    /// The mean of these entries, weighted by their information.
    pub(super) fn mean(&self, range: Range<usize>) -> Contrast {
        let (first, last) = (&self.sums[range.start], &self.sums[range.end]);
        let weight = last.0 - first.0;
        Contrast {
            value: (last.1 - first.1) / weight,
            variance: weight.recip(),
            slopes: (&last.2 - &first.2) / weight,
        }
    }

    /// The mean from `split` on less that before it, within these entries.
    pub(super) fn step(&self, range: Range<usize>, split: usize) -> Contrast {
        let [before, after] = [range.start..split, split..range.end].map(|own| self.mean(own));
        Contrast {
            value: after.value - before.value,
            variance: after.variance + before.variance,
            slopes: after.slopes - before.slopes,
        }
    }

    /// The slope of a line through all entries at these times, weighted by their information. `None` if the times are all the same.
    pub(super) fn line(&self, times: &[f64]) -> Option<Contrast> {
        let middle = self.middle(times);
        let about = |entry: usize| times[self.findings[entry]] - middle;
        let weights = self.entries.iter().enumerate().map(|(i, own)| own.1 * about(i).powi(2));
        let whole = weights.sum::<f64>();
        let mut line = Contrast {
            value: 0.0,
            variance: whole.recip(),
            slopes: DVector::zeros(self.sums[0].2.len()),
        };
        for (i, (value, weight, slopes)) in self.entries.iter().enumerate() {
            let share = weight * about(i) / whole;
            line.value += share * value;
            line.slopes.axpy(share, slopes, 1.0);
        }
        (whole > 0.0 && line.value.is_finite()).then_some(line)
    }

    /// Mean of the times of the entries, weighted by their information.
    pub(super) fn middle(&self, times: &[f64]) -> f64 {
        let weighted = self.entries.iter().zip(&self.findings).map(|(own, at)| own.1 * times[*at]);
        weighted.sum::<f64>() / self.sums[self.len()].0
    }

    /// An entry: its logarithm, with the errors as the findings have them, and the standard deviation by its own noise.
    pub(super) fn point(&self, entry: usize, pool: &Pool) -> (f64, f64) {
        let (value, weight, slopes) = &self.entries[entry];
        (value + slopes.dot(&pool.errors), weight.recip().sqrt())
    }

    /// χ² of these entries about a curve.
    pub(super) fn chi_squared(
        &self,
        range: Range<usize>,
        pool: &Pool,
        curve: impl Fn(usize) -> f64,
    ) -> f64 {
        let squares = range.map(|entry| {
            let (value, std) = self.point(entry, pool);
            ((value - curve(entry)) / std).powi(2)
        });
        squares.sum()
    }

    /// χ² of these entries about their mean.
    pub(super) fn about_mean(&self, range: Range<usize>, pool: &Pool) -> f64 {
        let mean = self.mean(range.clone()).value(pool);
        self.chi_squared(range, pool, |_| mean)
    }
}

/// By how many times findings scatter more than they state, as a variance, never below 1 (R. T. Birge, "The calculation of errors by the
/// method of least squares", Physical Review 40, 1932).
pub(super) fn scatter(chi_squared: f64, freedoms: usize) -> f64 {
    if freedoms == 0 { 1.0 } else { (chi_squared / freedoms as f64).max(1.0) }
}
