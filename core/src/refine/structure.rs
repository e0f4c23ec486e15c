//! Structure of the residuals along the band: how large it is, where most of it is, and whether it is there at all.
//!
//! The whitened power of each record's axis has autocorrelations ρ along the band (`residuals`). Box and Pierce's statistic Q of white
//! residuals is χ² of as many degrees of freedom ν as there are lags. A spectrum `1 + 2 Σ ρ cos`, smoothed to a sixteenth of the band, has
//! a variance `s² = 2 Σ ρ²` along it. It adds `2 (bins + 1) Σ ρ²` to Q, and scatters the correlations by a variance `1 + s²` times that of
//! white residuals:
//!
//! ```text
//! E Q = ν + λ        λ = s² (bins + 1 + ν)        Q about noncentral χ²(ν, λ)        √(2Q − ν) about N(√(ν + 2λ), 2)
//! ```
//!
//! All of it adds up over axes and records, so that the estimate of the size s does not depend on their number; the interval of it does. A
//! limit is exceeded if that interval lies beyond it: residuals within a limit stay within it however many records there are, and those
//! beyond it are said to be so as soon as the records can tell.
//!
//! One record among many, or one axis, may have structure that the others dilute. Each is judged by itself at the same chance for all of
//! them together.

use crate::chi_square::deviate;

/// Significance from which on there is structure: noise alone exceeds it with the chance e⁻¹⁰ of `chi_square`. Noise makes it in one fit of
/// 10,000; in one of 3,500 with a single record of 50 bins, whose statistic has a longer tail than χ².
const SIGNIFICANT: f64 = 3.92;
/// Standard deviations of a normal distribution from an estimate to the end of its 95 % interval.
const END: f64 = 1.96;
/// Standard deviations that noise exceeds with the chance e⁻¹⁰ in any of 64 records and three axes, by Bonferroni's inequality.
const END_OF_ANY: f64 = 4.83;

/// Structure of residuals along the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Structure {
    /// How much the mean square of the residuals, smoothed to a sixteenth of the band, varies along it: root mean square in the mean over
    /// the band, without what noise adds. It does not depend on the number of bins and records.
    pub size: f64,
    /// Lower end of the 95 % interval of the size.
    pub least: f64,
    /// Deviate by which the statistic is larger than noise makes it: about N(0, 1) if the model is right. It grows with bins and records.
    pub significance: f64,
    /// Structure of the record or axis that has most of it, if that is surely more than the size in all of them.
    pub local: Option<Local>,
}

/// Structure of one record, or along one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Local {
    /// Its size, as [`Structure::size`].
    pub size: f64,
    /// The size that it surely has, though it is the largest of many.
    pub least: f64,
}

impl Structure {
    /// Structure as noise leaves it.
    pub const NONE: Self = Self { size: 0.0, least: 0.0, significance: 0.0, local: None };

    /// Returns whether there is any: noise hardly ever makes it. A value that is no number is structure.
    pub fn is_there(&self) -> bool {
        self.significance.is_nan() || self.significance > SIGNIFICANT || self.local.is_some()
    }

    /// Returns whether all records together surely have more than this size. A value that is no number is more.
    pub fn exceeds(&self, size: f64) -> bool {
        let is_more = self.least.is_nan() || self.least > size;
        is_more && (self.significance.is_nan() || self.significance > SIGNIFICANT)
    }

    /// Returns whether all records together, one of them or one axis surely have more than this size.
    pub fn exceeds_anywhere(&self, size: f64) -> bool {
        self.exceeds(size) || self.local.is_some_and(|local| local.least > size)
    }

    /// Returns the size where most of it is: in one record or along one axis, if that is surely more than in all of them.
    pub fn largest(&self) -> f64 {
        self.local.map_or(self.size, |local| local.size)
    }
}

/// Sums over the lags of one axis of a record, or over several.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Statistic {
    /// Box and Pierce's statistic.
    pub(super) statistic: f64,
    /// Its expectation where the residuals are white.
    pub(super) expected: f64,
    /// Its derivative by `Σ ρ²`.
    pub(super) gain: f64,
}

impl Statistic {
    fn add(&mut self, other: &Self) {
        let Self { statistic, expected, gain } = other;
        self.statistic += statistic;
        self.expected += expected;
        self.gain += gain;
    }

    fn sum<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self {
        parts.into_iter().fold(Self::default(), |mut sum, part| {
            sum.add(part);
            sum
        })
    }

    fn size(&self) -> f64 {
        self.size_of(2.0 * (self.statistic - self.expected))
    }

    /// Size that lies so many standard deviations of the statistic below the one that is found.
    fn least(&self, deviations: f64) -> f64 {
        let found = root(2.0 * self.statistic - self.expected);
        let least = found - core::f64::consts::SQRT_2 * deviations;
        self.size_of(least * least.abs() - self.expected)
    }

    /// Size that makes the statistic noncentral by half of `twice`.
    fn size_of(&self, twice: f64) -> f64 {
        root(twice / (self.gain + 2.0 * self.expected))
    }

    /// Structure as that of the largest of many.
    fn local(&self) -> Local {
        Local { size: self.size(), least: self.least(END_OF_ANY) }
    }
}

/// Square root, 0 where there is none.
fn root(square: f64) -> f64 {
    if square < 0.0 { 0.0 } else { libm::sqrt(square) }
}

/// Sums over records, and the record that has most structure.
#[derive(Clone, Debug, Default)]
pub(super) struct Structures {
    axes: [Statistic; 3],
    worst: Local,
}

impl Structures {
    /// Takes the axes of a record.
    pub(super) fn push(&mut self, axes: &[Statistic; 3]) {
        let record = Statistic::sum(axes);
        if record.expected == 0.0 {
            return;
        }
        self.worst = worse(self.worst, record.local());
        for (sum, axis) in self.axes.iter_mut().zip(axes) {
            sum.add(axis);
        }
    }

    pub(super) fn structure(&self) -> Structure {
        let all = Statistic::sum(&self.axes);
        if all.expected == 0.0 {
            return Structure::NONE;
        }
        let size = all.size();
        let worst = self.axes.iter().map(Statistic::local).fold(self.worst, worse);
        Structure {
            size,
            least: all.least(END),
            significance: deviate(all.statistic, all.expected),
            local: Some(worst).filter(|worst| worst.least > size),
        }
    }
}

fn worse(one: Local, other: Local) -> Local {
    if other.least > one.least { other } else { one }
}

#[cfg(test)]
mod tests {
    use super::super::residuals::tests::drawn;
    use super::*;

    /// Structures of records that vary along the band by these sizes along each axis.
    fn structures(records: impl IntoIterator<Item = [f64; 3]>, bins: usize) -> Structure {
        let mut structures = Structures::default();
        for (number, sizes) in (0..).zip(records) {
            structures.push(&drawn(number, bins, sizes).box_pierce());
        }
        structures.structure()
    }

    fn alike(records: usize, bins: usize, size: f64) -> Structure {
        structures(core::iter::repeat_n([size; 3], records), bins)
    }

    const RECORDS: [usize; 4] = [3, 8, 16, 60];

    #[test]
    fn a_value_that_is_no_number_is_structure() {
        let nan = drawn(0, 100, [f64::NAN; 3]);
        let mut structures = Structures::default();
        structures.push(&nan.box_pierce());
        let nan = structures.structure();
        assert!(nan.is_there() && nan.exceeds(0.3) && nan.exceeds_anywhere(0.3), "{nan:?}");
        assert_eq!(Structures::default().structure(), Structure::NONE);
        assert!(!Structure::NONE.is_there());
    }

    #[test]
    fn the_size_does_not_depend_on_records_and_bins() {
        for (size, least, most) in [(0.127, 0.10, 0.16), (0.354, 0.33, 0.38)] {
            for records in RECORDS {
                for bins in [800, 1600] {
                    let found = alike(records, bins, size);
                    let what = (size, records, bins, found);
                    assert!(found.is_there() && (least..most).contains(&found.size), "{what:?}");
                    assert!(found.least < size && found.local.is_none(), "{what:?}");
                }
            }
        }
    }

    /// Variance of the power along the band scatters the correlations more: without that, the size would be 0.526.
    #[test]
    fn few_bins_have_the_same_size() {
        let found = alike(400, 99, 0.5);
        assert!((found.size - 0.5).abs() < 0.012, "{found:?}");
    }

    /// The same error is within its limit or beyond it with few records and with many. The data cannot tell a size that is near the limit
    /// from the limit, and then they do not say that it is exceeded.
    #[test]
    fn more_records_do_not_turn_the_word() {
        for bins in [99, 800] {
            for records in RECORDS {
                for (size, limit, is_beyond) in [
                    (0.05, 0.10, false),
                    (0.09, 0.10, false),
                    (0.19, 0.21, false),
                    (0.4, 0.10, true),
                    (0.4, 0.21, true),
                ] {
                    let found = alike(records, bins, size);
                    let what = (bins, records, size, limit, found);
                    assert_eq!(found.exceeds(limit), is_beyond, "{what:?}");
                    assert_eq!(found.exceeds_anywhere(limit), is_beyond, "{what:?}");
                }
            }
        }
    }

    /// A record that is off, or an axis, objects among many that are right.
    #[test]
    fn a_local_error_is_not_diluted() {
        for count in RECORDS {
            let one = (0..count).map(|record| [if record == 1 { 0.7 } else { 0.0 }; 3]);
            let found = structures(one, 800);
            let size = found.local.map_or(0.0, |local| local.size);
            assert!((0.6..0.8).contains(&size), "{count}: {found:?}");
            assert!(found.is_there() && found.exceeds_anywhere(0.3), "{count}: {found:?}");
            assert_eq!(found.largest(), size);
            // The others dilute it to 0.098.
            let axis = structures((0..count).map(|_| [0.0, 0.17, 0.0]), 3200);
            assert!(axis.exceeds_anywhere(0.10) && !axis.exceeds(0.10), "{count}: {axis:?}");
        }
    }

    /// Noise of single records is structure at most as often as the limit says: of 10,000 e⁻¹⁰ is 0.5, and one in 3,500 is 3.
    #[test]
    fn noise_hardly_ever_has_any() {
        for bins in [8, 50, 99] {
            let there = (0..10_000)
                .filter(|&number| {
                    let mut structures = Structures::default();
                    structures.push(&drawn(number, bins, [0.0; 3]).box_pierce());
                    structures.structure().is_there()
                })
                .count();
            assert!(there <= 6, "{there} of 10,000 records of {bins} bins");
        }
        for records in [1, 3, 8, 16, 60] {
            for bins in [8, 100, 800] {
                assert!(!alike(records, bins, 0.0).is_there(), "{records} {bins}");
            }
        }
    }
}
