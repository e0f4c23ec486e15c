//! Frequency dependence of the bushings, beside that of a spring and a damper.
//!
//! The impedance of a bushing along one degree of freedom is
//!
//! ```text
//! z(s) = k (1 + g ψ(s)) + d σ(s)        ψ(s) = s/(s + ω_s)        σ(s) = s + h χ(s)        χ(s) = ω_r 2/π ln(s/ω_r) − s
//! ```
//!
//! h is the part of all dampings that is hysteretic. Hysteresis dissipates the same at each frequency; since it is causal, the stiffness
//! then grows with the logarithm of the frequency (Nashif, Jones and Henderson, _Vibration Damping_, 1985, chapter 2). k and d are those at
//! ω_r; at s = iω is `2/π ln(s/ω_r) = i + 2/π ln(ω/ω_r)`. g is the growth of the stiffness of a drive, whose position loop gives way below the frequency ω_s; its k is that far below ω_s.

use core::f64::consts::{FRAC_2_PI, TAU};

use super::complex::Complex;
use super::lanes::{Lanes, Scalar};

/// ω_s, rad/s: 10 Hz, the bandwidth of the position loop of an industrial drive (assumed).
const SERVO: f64 = TAU * 10.0;
/// Frequency of a load that rests on the robot for some seconds, rad/s: 0.1 Hz (assumed).
const REST: f64 = TAU * 0.1;
/// Number of lanes of the widest vector.
const WIDEST: usize = 16;

/// h and ω_r of a robot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Hysteresis<T> {
    /// h.
    pub(crate) part: T,
    /// ω_r, rad/s.
    pub(crate) reference: T,
}

impl Hysteresis<f64> {
    /// Stiffness at rest less that at ω_r, per damping, 1/s: `h Re χ`.
    pub(crate) fn at_rest(&self) -> f64 {
        let rest = Complex { re: 0.0, im: REST };
        if self.part == 0.0 {
            0.0
        } else {
            self.part * per_hysteretic_part(rest, self.reference).re
        }
    }
}

/// σ and ψ at one complex frequency per lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rates<V> {
    /// σ.
    pub(crate) damper: Complex<V>,
    /// ψ; `None` if no stiffness grows.
    pub(crate) drive: Option<Complex<V>>,
}

impl<V: Lanes> Rates<V> {
    #[inline(always)]
    pub(crate) fn new(hysteresis: &Hysteresis<V::Scalar>, has_growth: bool, s: Complex<V>) -> Self {
        let mut rates = Self::plain(s);
        if hysteresis.part.to_f64() != 0.0 {
            let excess = per_hysteretic_part(s, hysteresis.reference.to_f64());
            rates.damper = rates.damper.add_mul_real(excess, s.re.fill(hysteresis.part));
        }
        if has_growth {
            rates.drive = Some(per_growth(s));
        }
        rates
    }

    /// The law of springs and dampers.
    #[inline(always)]
    pub(crate) fn plain(s: Complex<V>) -> Self {
        Self { damper: s, drive: None }
    }
}

/// χ.
#[inline(always)]
pub(crate) fn per_hysteretic_part<V: Lanes>(s: Complex<V>, reference: f64) -> Complex<V> {
    let [mut re, mut im] = [[V::Scalar::default(); WIDEST]; 2];
    s.re.store(&mut re);
    s.im.store(&mut im);
    // The logarithm of a complex number.
    for (re, im) in re[..V::WIDTH].iter_mut().zip(&mut im) {
        let (x, y) = (re.to_f64(), im.to_f64());
        let logarithm = libm::log(libm::hypot(x, y) / reference);
        *re = V::Scalar::from_f64(reference * FRAC_2_PI * logarithm);
        *im = V::Scalar::from_f64(reference * FRAC_2_PI * libm::atan2(y, x));
    }
    Complex::new(s.re.load(&re), s.re.load(&im)) - s
}

/// ψ.
#[inline(always)]
pub(crate) fn per_growth<V: Lanes>(s: Complex<V>) -> Complex<V> {
    let mut sum = s;
    sum.re = sum.re + s.re.fill(V::Scalar::from_f64(SERVO));
    s * sum.reciprocal()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Many springs with dampers in series, whose rates are a factor of 1.5 apart, have a loss that does not depend on the frequency.
    #[test]
    fn hysteresis_is_that_of_many_relaxations() {
        let (reference, ratio) = (100.0_f64, 1.5_f64);
        let chain = |omega: f64| {
            let mut sum = [0.0; 2];
            for m in -60..=60 {
                let rate = reference * ratio.powi(m);
                let square = omega * omega + rate * rate;
                sum[0] += omega * omega / square;
                sum[1] += omega * rate / square;
            }
            sum.map(|part| part * 2.0 * ratio.ln() / core::f64::consts::PI * reference)
        };
        let [at_rest, _] = chain(reference);
        for omega in [2.0, 30.0, 100.0, 400.0, 5000.0] {
            let s = Complex { re: 0.0, im: omega };
            let sigma = s + per_hysteretic_part(s, reference);
            let [elastic, loss] = chain(omega);
            assert!((sigma.im - loss).abs() < 1e-3 * reference, "{omega}: {sigma:?}");
            assert!(
                (sigma.re - (elastic - at_rest)).abs() < 1e-3 * reference,
                "{omega}: {sigma:?}"
            );
        }
    }

    /// The law is analytic: its derivatives along the real and the imaginary axis agree, also off the imaginary one.
    #[test]
    fn hysteresis_is_analytic() {
        let at = |re: f64, im: f64| per_hysteretic_part(Complex { re, im }, 100.0);
        let step = 1e-4;
        for (re, im) in [(0.0, 30.0), (3.0, 25.0), (20.0, 10.0)] {
            let along = (at(re + step, im) - at(re - step, im)).scale(0.5 / step);
            let across = (at(re, im + step) - at(re, im - step)).scale(0.5 / step);
            let gap = Complex { re: along.re - across.im, im: along.im + across.re };
            assert!(gap.square() < 1e-12, "{re} {im}: {along:?} {across:?}");
        }
    }

    #[test]
    fn a_drive_is_stiff_above_its_bandwidth() {
        let at = |hz: f64| per_growth(Complex { re: 0.0, im: TAU * hz });
        assert!(at(0.1).re < 1e-3 && at(1000.0).re > 0.999);
        let middle = at(10.0);
        assert!((middle.re - 0.5).abs() < 1e-12 && (middle.im - 0.5).abs() < 1e-12);
    }
}
