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
    /// True if the number says something beside its [size](Estimate::beside).
    pub determined: bool,
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
    /// True if the number says something.
    pub determined: bool,
}

/// Square root of a variance. Rounding may have made it negative; what is no number stays so.
pub fn root(variance: f64) -> f64 {
    if variance < 0.0 { 0.0 } else { variance.sqrt() }
}

impl Estimate {
    /// A value with this standard deviation. Where that is no number, the interval has no end.
    pub fn new(value: f64, std: f64) -> Self {
        let std = if std.is_nan() { f64::INFINITY } else { std };
        let reach = TWO_SIDED * std;
        let interval = [value - reach, value + reach];
        Self { value, std, interval, determined: false }.beside(value.abs())
    }

    /// The number beside others of this `size`, where that is not its own: the length of the vector that it is a component of, say.
    pub fn beside(self, size: f64) -> Self {
        Self { determined: self.std <= USELESS * size, ..self }
    }

    /// Components of a vector, which say something beside its length.
    pub fn beside_length<const N: usize>(all: [Self; N]) -> [Self; N] {
        let length = all.iter().map(|own| own.value.powi(2)).sum::<f64>().sqrt();
        all.map(|own| own.beside(length))
    }
}

impl PositiveEstimate {
    /// A value whose logarithm has this standard deviation. Where that is no number, as of a value of zero, the interval has no end.
    pub fn new(value: f64, relative_std: f64) -> Self {
        let factor = (TWO_SIDED * relative_std).exp();
        if !factor.is_finite() {
            let interval = [0.0, f64::INFINITY];
            return Self { value, relative_std: f64::INFINITY, interval, determined: false };
        }
        let interval = [value / factor, value * factor];
        Self { value, relative_std, interval, determined: value > 0.0 && relative_std <= USELESS }
    }

    /// One over the number. Its logarithm has the same deviation.
    pub fn inverse(&self) -> Self {
        Self::new(self.value.recip(), self.relative_std)
    }

    /// Returns whether the records show it to a factor of 1.8 with 95 %: by the limit of a parameter that is not observable.
    pub fn is_observable(&self) -> bool {
        self.value > 0.0 && self.relative_std <= WEAK
    }
}

#[cfg(test)]
mod tests {
    use flexid_core::verdict::{Trust, Verdict};

    use super::*;

    #[test]
    fn a_number_is_observable_where_a_parameter_would_be() {
        let trust = Trust::new(1.0, true);
        for relative_std in [0.01, 0.999 * WEAK, 1.001 * WEAK, 1.0, f64::NAN] {
            let (verdict, _) = trust.verdict(1.0, relative_std);
            let is_observable = PositiveEstimate::new(1.0, relative_std).is_observable();
            assert_eq!(is_observable, verdict != Verdict::NotObservable, "{relative_std}");
        }
    }

    #[test]
    fn a_number_is_determined_where_its_error_is_below_its_size() {
        let of = |value, std| Estimate::new(value, std).determined;
        assert_eq!([of(1.0, 0.9), of(1.0, 1.1), of(-1.0, 0.9)], [true, false, true]);
        let own = Estimate::new(0.0, 1.0);
        assert_eq!([own.beside(2.0).determined, own.beside(0.5).determined], [true, false]);
        let vector = [Estimate::new(3.0, 4.9), Estimate::new(-4.0, 5.1)];
        assert_eq!(Estimate::beside_length(vector).map(|own| own.determined), [true, false]);
        let of = |value, std| PositiveEstimate::new(value, std).determined;
        assert_eq!(
            [of(1.0, 0.9), of(1.0, 1.1), of(1.0, f64::NAN), of(-1.0, 0.1)],
            [true, false, false, false]
        );
    }
}
