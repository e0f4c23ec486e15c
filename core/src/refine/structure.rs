//! Structure of the residuals of all records along the band: how large it is, and whether it is there at all.
//!
//! The whitened power of each record's axis has autocorrelations ρ along the band (`residuals`). Of white residuals Box and Pierce's
//! statistic is χ² of as many degrees of freedom as there are lags. Of others it is larger by `2 (bins + 1) Σ ρ²`, so that it grows
//! with bins and records though ρ stays. The excess of all over the sum of these factors is therefore an estimate of `Σ ρ²` without
//! bias, whatever their number. In a spectrum `1 + 2 Σ ρ cos`, smoothed to a sixteenth of the band, the mean square of what varies is
//! `2 Σ ρ²`.

/// Significance from which on there is structure at all. Noise of one record makes it once in 2,000 fits, that of eight
/// once in 9,000.
const SIGNIFICANT: f64 = 4.0;

/// Structure of residuals along the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Structure {
    /// How much the mean square of the residuals, smoothed to a sixteenth of the band, varies along it: root mean square in the mean over
    /// the band, without what noise adds. It does not depend on the number of bins and records.
    pub size: f64,
    /// By how many standard deviations of noise the statistic is larger than noise makes it: about N(0, 1) if the model is right. It
    /// grows with bins and records.
    pub significance: f64,
}

impl Structure {
    /// As noise leaves it.
    pub const NONE: Self = Self { size: 0.0, significance: 0.0 };

    /// Whether there is any: noise hardly ever makes it. What is no number is structure.
    pub fn is_there(&self) -> bool {
        self.significance.is_nan() || self.significance > SIGNIFICANT
    }

    /// Whether there is more of it than this size. What is no number is more.
    pub fn exceeds(&self, size: f64) -> bool {
        self.is_there() && (self.size.is_nan() || self.size > size)
    }
}

/// Sums over the axes of the records.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Statistic {
    /// Box and Pierce's statistic.
    pub(super) statistic: f64,
    /// Its expectation where the residuals are white.
    pub(super) expected: f64,
    /// By how much it is larger for each unit of `Σ ρ²`.
    pub(super) gain: f64,
}

impl Statistic {
    /// Adds that of another record.
    pub(super) fn add(&mut self, other: Self) {
        let Self { statistic, expected, gain } = other;
        self.statistic += statistic;
        self.expected += expected;
        self.gain += gain;
    }

    pub(super) fn structure(&self) -> Structure {
        let excess = self.statistic - self.expected;
        let square = 2.0 * excess / self.gain.max(1.0);
        Structure {
            size: if square < 0.0 { 0.0 } else { libm::sqrt(square) },
            significance: excess / libm::sqrt(2.0 * self.expected.max(1.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_structure() {
        let nan = Structure { size: f64::NAN, significance: f64::NAN };
        assert!(nan.is_there() && nan.exceeds(0.3) && !Structure::NONE.is_there());
        let few = Structure { size: 0.5, significance: 3.0 };
        assert!(!few.exceeds(0.3));
    }
}
