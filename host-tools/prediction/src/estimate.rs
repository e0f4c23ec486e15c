//! Predicted numbers with their standard deviations.

use serde::Serialize;

/// Half of a 95 % interval, in standard deviations of a normal distribution.
pub const TWO_SIDED: f64 = 1.959_963_984_540_054;

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

impl Estimate {
    /// A value with this standard deviation.
    pub fn new(value: f64, std: f64) -> Self {
        let reach = TWO_SIDED * std;
        Self { value, std, interval: [value - reach, value + reach] }
    }
}

impl PositiveEstimate {
    /// A value whose logarithm has this standard deviation.
    pub fn new(value: f64, relative_std: f64) -> Self {
        let factor = (TWO_SIDED * relative_std).exp();
        Self { value, relative_std, interval: [value / factor, value * factor] }
    }
}
