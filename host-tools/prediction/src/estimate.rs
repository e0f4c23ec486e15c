//! Predicted numbers with their standard deviations.

use flexid_core::verdict::WEAK;
use serde::Serialize;

/// Half of a 95 % interval, in standard deviations of a normal distribution.
pub const TWO_SIDED: f64 = 1.959_963_984_540_054;

/// Standard deviation, in parts of a number, above which the number says nothing. At 1 the 95 % interval of a normal error reaches from
/// −1 to 3 times the number, so that not even its sign is known; that of a logarithm reaches from a seventh to seven times.
const USELESS: f64 = 1.0;

/// A predicted number whose errors are normal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Most likely value.
    pub value: f64,
    /// Standard deviation, in the unit of the value.
    pub std: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
}

/// A predicted positive number. The errors of its logarithm are normal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PositiveEstimate {
    /// Most likely value.
    pub value: f64,
    /// Standard deviation of its logarithm.
    pub relative_std: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
}

/// Square root of a variance. Rounding may have made it negative; what is no number stays so.
pub(crate) fn root(variance: f64) -> f64 {
    if variance < 0.0 { 0.0 } else { variance.sqrt() }
}

impl Estimate {
    /// A value with this standard deviation. Where that is no number, the interval has no end.
    pub fn new(value: f64, std: f64) -> Self {
        let std = if std.is_nan() { f64::INFINITY } else { std };
        let reach = TWO_SIDED * std;
        Self { value, std, interval: [value - reach, value + reach] }
    }

    /// Whether the number says something beside others of this `size`: its own, or the length of the vector that it is a component of.
    pub fn is_useful(&self, size: f64) -> bool {
        self.std <= USELESS * size
    }
}

impl PositiveEstimate {
    /// A value whose logarithm has this standard deviation. Where that is no number, as of a value of zero, the interval has no end.
    pub fn new(value: f64, relative_std: f64) -> Self {
        let factor = (TWO_SIDED * relative_std).exp();
        if !factor.is_finite() {
            return Self { value, relative_std: f64::INFINITY, interval: [0.0, f64::INFINITY] };
        }
        Self { value, relative_std, interval: [value / factor, value * factor] }
    }

    /// Whether the records determine it, to a factor of 1.8 with 95 %: by the limit of a parameter that is not observable.
    pub fn is_determined(&self) -> bool {
        self.value > 0.0 && self.relative_std <= WEAK
    }

    /// Whether the number says something at all.
    pub fn is_useful(&self) -> bool {
        self.value > 0.0 && self.relative_std <= USELESS
    }
}

#[cfg(test)]
mod tests {
    use flexid_core::verdict::{Trust, Verdict};

    use super::*;

    #[test]
    fn a_number_is_determined_where_a_parameter_would_be_observable() {
        let trust = Trust::new(1.0, true);
        for relative_std in [0.01, 0.999 * WEAK, 1.001 * WEAK, 1.0, f64::NAN] {
            let (verdict, _) = trust.verdict(1.0, relative_std);
            let is_determined = PositiveEstimate::new(1.0, relative_std).is_determined();
            assert_eq!(is_determined, verdict != Verdict::NotObservable, "{relative_std}");
        }
    }
}
