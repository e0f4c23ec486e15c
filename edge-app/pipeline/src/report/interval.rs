//! Intervals of 95 %.

use flexid_wire::confidence::Interval;

/// Number of standard deviations within which 95 % of a normal distribution lie.
pub(super) const WITHIN: f64 = 1.959_964;

/// Returns the interval of a value whose logarithm is normally distributed.
pub(super) fn log_normal(value: f64, standard_deviation: f64) -> Interval {
    let factor = (WITHIN * standard_deviation / value).exp();
    [value / factor, value * factor]
}

/// Returns the interval of a value that is normally distributed.
pub(super) fn normal(value: f64, standard_deviation: f64) -> Interval {
    [value - WITHIN * standard_deviation, value + WITHIN * standard_deviation]
}
