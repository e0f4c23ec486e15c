//! Complex numbers in lanes.

use core::ops::{Add, Mul, Neg, Sub};

use super::lanes::Lanes;
use crate::DOF;

/// A complex number in every lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complex<V> {
    /// Real part.
    pub re: V,
    /// Imaginary part.
    pub im: V,
}

/// A load or a displacement of one link.
pub(super) type Column<V> = [Complex<V>; DOF];

impl<V: Lanes> Complex<V> {
    /// A complex number from its real and imaginary part.
    #[inline(always)]
    pub fn new(re: V, im: V) -> Self {
        Self { re, im }
    }

    /// Zero in as many lanes as `like` has.
    #[inline(always)]
    pub fn zero(like: V) -> Self {
        let zero = like.fill(Default::default());
        Self::new(zero, zero)
    }

    /// `self + a·b`.
    #[inline(always)]
    pub fn add_mul(self, a: Self, b: Self) -> Self {
        Self::new(
            (-a.im).mul_add(b.im, a.re.mul_add(b.re, self.re)),
            a.im.mul_add(b.re, a.re.mul_add(b.im, self.im)),
        )
    }

    /// `self − a·b`.
    #[inline(always)]
    pub fn sub_mul(self, a: Self, b: Self) -> Self {
        Self::new(
            a.im.mul_add(b.im, (-a.re).mul_add(b.re, self.re)),
            (-a.im).mul_add(b.re, (-a.re).mul_add(b.im, self.im)),
        )
    }

    /// `self + a·b` with a real `b`.
    #[inline(always)]
    pub fn add_mul_real(self, a: Self, b: V) -> Self {
        Self::new(a.re.mul_add(b, self.re), a.im.mul_add(b, self.im))
    }

    /// `self · b` with a real `b`.
    #[inline(always)]
    pub fn scale(self, b: V) -> Self {
        Self::new(self.re * b, self.im * b)
    }

    /// Complex conjugate.
    #[inline(always)]
    pub fn conjugate(self) -> Self {
        Self::new(self.re, -self.im)
    }

    /// Square of the magnitude.
    #[inline(always)]
    pub fn square(self) -> V {
        self.re.mul_add(self.re, self.im * self.im)
    }

    /// `e^self` to 1e-12 for magnitudes of `self` up to 16: the power series of `e^(self/32)`, squared five times.
    #[inline(always)]
    pub fn exponential(self) -> Self {
        let real = |value: f64| self.re.fill(<V::Scalar as super::lanes::Scalar>::from_f64(value));
        let small = self.scale(real(1.0 / 32.0));
        let one = Self::new(real(1.0), real(0.0));
        let mut sum = one;
        for power in 1..=12 {
            sum = one.add_mul(small.scale(real(1.0 / f64::from(13 - power))), sum);
        }
        for _ in 0..5 {
            sum = sum * sum;
        }
        sum
    }

    /// `1 / self`.
    #[inline(always)]
    pub fn reciprocal(self) -> Self {
        let one = self.re.fill(<V::Scalar as super::lanes::Scalar>::from_f64(1.0));
        let norm = one / self.re.mul_add(self.re, self.im * self.im);
        Self::new(self.re * norm, -(self.im * norm))
    }
}

impl<V: Lanes> Add for Complex<V> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl<V: Lanes> Sub for Complex<V> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl<V: Lanes> Neg for Complex<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.re, -self.im)
    }
}

impl<V: Lanes> Mul for Complex<V> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(
            (-self.im).mul_add(other.im, self.re * other.re),
            self.im.mul_add(other.re, self.re * other.im),
        )
    }
}
