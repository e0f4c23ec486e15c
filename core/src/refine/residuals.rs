//! Statistics of a record's residuals: similarity and agreement with the model, and whiteness.

use super::structure::Statistic;
use crate::loss::ssp_term;

/// Lags at which the residuals of one axis are correlated with themselves. Chosen: they resolve a sixteenth of the band (see `structure`).
const LAGS: usize = 16;

/// How far model and measurement of one record agree, per TCP axis: 1 where they are the same. An axis that is not measured has the least of the
/// others.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Frequency response assurance criterion: `|Σ X* X̂|² / (Σ |X|² Σ |X̂|²)` (Heylen and Lammens, 1996).
    pub frac: [f64; 3],
    /// Variance accounted for: `1 − Σ |X − X̂|² / Σ |X|²`; below 0 where the model is worse than none.
    pub vaf: [f64; 3],
}

/// Sums over the bins of one record, or of one of its parts.
#[derive(Clone, Debug, Default)]
pub(crate) struct Residuals {
    /// Number of bins of a part.
    bins: usize,
    /// Number of the bins of all parts that have been taken.
    taken: usize,
    axes: [Axis; 3],
}

#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    similarity: f64,
    measured: f64,
    model: f64,
    gap: f64,
    cross: [f64; 2],
    /// Power of the whitened residual; `lags` is its cosine transform over the band.
    power: f64,
    lags: [f64; LAGS],
}

impl Axis {
    /// Returns whether the axis is measured: without any weight, the residual is exactly zero.
    fn is_measured(&self) -> bool {
        self.power != 0.0
    }

    fn add(&mut self, other: &Self) {
        let Self { similarity, measured, model, gap, cross: [re, im], power, lags } = other;
        self.similarity += similarity;
        self.measured += measured;
        self.model += model;
        self.gap += gap;
        self.cross[0] += re;
        self.cross[1] += im;
        self.power += power;
        for (sum, lag) in self.lags.iter_mut().zip(lags) {
            *sum += lag;
        }
    }
}

impl Residuals {
    /// Statistics of a part with so many bins, none of them taken yet.
    pub(crate) fn new(bins: usize) -> Self {
        Self { bins, ..Self::default() }
    }

    /// Takes the next bin, `[re, im]` per axis.
    pub(crate) fn take(
        &mut self,
        measured: &[[f64; 2]; 3],
        model: &[[f64; 2]; 3],
        white: &[[f64; 2]; 3],
    ) {
        let square = |[re, im]: [f64; 2]| re * re + im * im;
        let angle = core::f64::consts::PI * (self.taken as f64 + 0.5) / self.bins as f64;
        let cosine = libm::cos(angle);
        for (axis, sums) in self.axes.iter_mut().enumerate() {
            let (x, y) = (measured[axis], model[axis]);
            sums.similarity += ssp_term(x, y);
            sums.measured += square(x);
            sums.model += square(y);
            sums.gap += square([x[0] - y[0], x[1] - y[1]]);
            sums.cross[0] += x[0] * y[0] + x[1] * y[1];
            sums.cross[1] += x[0] * y[1] - x[1] * y[0];
            let power = square(white[axis]);
            sums.power += power;
            // cos(nφ) by Chebyshev's recurrence.
            let (mut before, mut now) = (1.0, cosine);
            for lag in &mut sums.lags {
                *lag += power * now;
                (before, now) = (now, 2.0 * cosine * now - before);
            }
        }
        self.taken += 1;
    }

    /// Adds another part, of as many bins.
    pub(crate) fn add(&mut self, other: &Self) {
        self.bins = other.bins;
        self.taken += other.taken;
        for (sum, axis) in self.axes.iter_mut().zip(&other.axes) {
            sum.add(axis);
        }
    }

    /// Surface similarity parameter of each axis that is measured.
    pub(crate) fn similarity(&self) -> impl Iterator<Item = f64> {
        let measured = self.axes.iter().filter(|axis| axis.is_measured());
        measured.map(|axis| axis.similarity / self.taken.max(1) as f64)
    }

    /// How far model and measurement agree.
    pub(crate) fn agreement(&self) -> Agreement {
        let ratio = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        let frac = |axis: &Axis| {
            let [re, im] = axis.cross;
            ratio(re * re + im * im, axis.measured * axis.model)
        };
        let vaf = |axis: &Axis| 1.0 - ratio(axis.gap, axis.measured);
        let of_all = |own: &dyn Fn(&Axis) -> f64| {
            let measured = self.axes.iter().filter(|axis| axis.is_measured());
            let least = measured.map(own).fold(1.0, f64::min);
            self.axes.each_ref().map(|axis| if axis.is_measured() { own(axis) } else { least })
        };
        Agreement { frac: of_all(&frac), vaf: of_all(&vaf) }
    }

    /// Box and Pierce's statistic of the residuals' autocorrelation (1970), `(n + 2) Σ r²`, along each axis: the band is taken as the
    /// spectrum of a series sampled at twice its width, of n = 2 × bins samples. Several parts are as many such series: r is that of all.
    ///
    /// That series is periodic, and every lag uses all of it, so that Ljung and Box's weights (1978) have no place: the
    /// variance of r is `1 / (n + 2)` at every lag, exactly, since the powers of white bins, over their sum, are spread evenly
    /// over a simplex.
    pub(super) fn box_pierce(&self) -> [Statistic; 3] {
        // Few bins have few lags that are not each other's mirror images, and the fit has had its part of them.
        let lags = LAGS.min(self.bins / 8);
        let gain = 2.0 * (self.taken + 1) as f64;
        self.axes.map(|axis| {
            if !axis.is_measured() {
                return Statistic::default();
            }
            let correlations =
                axis.lags.iter().take(lags).map(|lag| lag / axis.power.max(f64::MIN_POSITIVE));
            Statistic {
                statistic: gain * correlations.map(|r| r * r).sum::<f64>(),
                expected: lags as f64,
                gain,
            }
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    const BINS: usize = 800;

    fn residuals(shape: impl Fn(usize) -> f64) -> Residuals {
        noise(BINS, 7, |bin| [shape(bin); 3])
    }

    /// Complex white noise of unit variance in each part, times what `shape` says of a bin along each axis.
    fn noise(bins: usize, seed: u64, shape: impl Fn(usize) -> [f64; 3]) -> Residuals {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        let mut residuals = Residuals::new(bins);
        for bin in 0..bins {
            let white = shape(bin).map(|amplitude| {
                let radius = libm::sqrt(-2.0 * libm::log(uniform())) * amplitude;
                let angle = core::f64::consts::TAU * uniform();
                [radius * libm::cos(angle), radius * libm::sin(angle)]
            });
            residuals.take(&[[1.0, 0.0]; 3], &[[1.0, 1.0]; 3], &white);
        }
        residuals
    }

    /// Noise of record `number`, whose power varies along the band by a cosine of these root mean squares along each axis.
    pub(in super::super) fn drawn(number: u64, bins: usize, sizes: [f64; 3]) -> Residuals {
        let seed = number.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(11);
        noise(bins, seed, |bin| {
            let cosine = libm::cos(core::f64::consts::TAU * 2.0 * bin as f64 / bins as f64);
            sizes.map(|size| libm::sqrt(1.0 + core::f64::consts::SQRT_2 * size * cosine))
        })
    }

    /// Statistic of all axes, and its expectation for noise.
    fn statistic(residuals: &Residuals) -> [f64; 2] {
        let axes = residuals.box_pierce();
        [axes.map(|axis| axis.statistic), axes.map(|axis| axis.expected)]
            .map(|of_axes| of_axes.iter().sum())
    }

    #[test]
    fn white_residuals_have_the_expected_statistic() {
        let [statistic, expected] = statistic(&residuals(|_| 1.0));
        assert!((statistic - expected).abs() < 3.0 * libm::sqrt(2.0 * expected), "{statistic}");
    }

    /// Twenty thousand records of eight bins, the fewest that a fit takes, know the mean of the statistic to 1 %; without
    /// the two of `n + 2` it is 11 % too small.
    #[test]
    fn few_bins_have_the_expected_statistic() {
        let mut sums = [0.0; 2];
        for number in 0..20_000 {
            let own = statistic(&drawn(number, 8, [0.0; 3]));
            sums = [sums[0] + own[0], sums[1] + own[1]];
        }
        let ratio = sums[0] / sums[1];
        assert!((ratio - 1.0).abs() < 0.03, "{ratio} of the expectation");
    }

    #[test]
    fn a_resonance_that_is_left_is_seen() {
        let bump = |bin: usize| if (300..360).contains(&bin) { 1.7 } else { 1.0 };
        let [statistic, expected] = statistic(&residuals(bump));
        assert!(statistic - expected > 5.0 * libm::sqrt(2.0 * expected), "{statistic}");
    }

    #[test]
    fn agreement_of_a_known_pair() {
        let Agreement { frac, vaf } = residuals(|_| 1.0).agreement();
        assert!(frac.iter().all(|frac| (frac - 1.0).abs() < 1e-12), "{frac:?}");
        assert!(vaf.iter().all(|vaf| vaf.abs() < 1e-12), "{vaf:?}");
    }

    /// Two bins: the one is right, in the other the model turns by a quarter to either side, or is silent.
    #[test]
    fn agreement_of_pairs_that_are_half_right() {
        for (wrong, expected) in [([0.0, 1.0], 0.0), ([0.0, -1.0], 0.0), ([0.0, 0.0], 0.5)] {
            let mut residuals = Residuals::new(2);
            for model in [[1.0, 0.0], wrong] {
                residuals.take(&[[1.0, 0.0]; 3], &[model; 3], &[[1.0, 0.0]; 3]);
            }
            let Agreement { frac, vaf } = residuals.agreement();
            assert!(frac.iter().all(|frac| (frac - 0.5).abs() < 1e-12), "{wrong:?}: {frac:?}");
            assert!(vaf.iter().all(|vaf| (vaf - expected).abs() < 1e-12), "{wrong:?}: {vaf:?}");
        }
    }
}
