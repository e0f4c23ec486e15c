//! Vectors of real numbers: one frequency bin per lane.

use core::ops::{Add, Div, Mul, Neg, Sub};

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, f32x4, f32x8, f32x16, f64x2, f64x4, f64x8};

/// Precision of a computation.
pub trait Scalar: Copy + Default + Send + Sync + 'static {
    /// Value of this precision that is nearest to `value`.
    fn from_f64(value: f64) -> Self;
    /// The value as `f64`, exact.
    fn to_f64(self) -> f64;
}

/// One or several real numbers of one precision. An operation applies to all lanes.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Number in one lane.
    type Scalar: Scalar;
    /// Number of lanes.
    const WIDTH: usize;
    /// Number of the processor's registers that the lanes fill.
    const REGISTERS: usize;
    /// One value of any type for each lane: `[T; WIDTH]`.
    type Each<T: Copy>: AsMut<[T]>;
    /// One value for all lanes.
    fn each<T: Copy>(value: T) -> Self::Each<T>;
    /// `value` in as many lanes as `self` has.
    fn fill(self, value: Self::Scalar) -> Self;
    /// `self · factor + term`, fused where a vector processor can.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// Loads the first `WIDTH` of `values`.
    fn load(self, values: &[Self::Scalar]) -> Self;
    /// Stores the lanes in the first `WIDTH` of `values`.
    fn store(self, values: &mut [Self::Scalar]);
    /// Runs `part` as a function of its own: a long part that several kernels share is compiled once for all of them. Mark `part`
    /// with `#[inline(always)]`.
    #[inline(never)]
    fn apart<R>(self, part: impl FnOnce() -> R) -> R {
        part()
    }
}

macro_rules! scalar {
    ($type:ty) => {
        impl Scalar for $type {
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $type
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
        }

        impl Lanes for $type {
            type Scalar = $type;
            const WIDTH: usize = 1;
            const REGISTERS: usize = 1;
            type Each<T: Copy> = [T; 1];
            #[inline(always)]
            fn each<T: Copy>(value: T) -> [T; 1] {
                [value]
            }
            #[inline(always)]
            fn fill(self, value: $type) -> Self {
                value
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                self * factor + term
            }
            #[inline(always)]
            fn load(self, values: &[$type]) -> Self {
                values[0]
            }
            #[inline(always)]
            fn store(self, values: &mut [$type]) {
                values[0] = self;
            }
        }
    };
}

scalar!(f32);
scalar!(f64);

macro_rules! vector {
    ($($type:ident of $scalar:ty, $width:literal, $native:ident);*) => {$(
        impl<S: Simd> Lanes for $type<S> {
            type Scalar = $scalar;
            const WIDTH: usize = $width;
            const REGISTERS: usize = size_of::<Self>().div_ceil(size_of::<S::$native>());
            type Each<T: Copy> = [T; $width];
            #[inline(always)]
            fn each<T: Copy>(value: T) -> [T; $width] {
                [value; $width]
            }
            #[inline(always)]
            fn fill(self, value: $scalar) -> Self {
                Self::splat(self.simd, value)
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                SimdFloat::mul_add(self, factor, term)
            }
            #[inline(always)]
            fn load(self, values: &[$scalar]) -> Self {
                Self::from_slice(self.simd, &values[..Self::WIDTH])
            }
            #[inline(always)]
            fn store(self, values: &mut [$scalar]) {
                values[..Self::WIDTH].copy_from_slice(self.as_slice());
            }
            #[inline(always)]
            fn apart<R>(self, part: impl FnOnce() -> R) -> R {
                self.simd.vectorize(part)
            }
        }
    )*};
}

vector!(
    f32x4 of f32, 4, f32s; f32x8 of f32, 8, f32s; f32x16 of f32, 16, f32s;
    f64x2 of f64, 2, f64s; f64x4 of f64, 4, f64s; f64x8 of f64, 8, f64s
);

/// A computation that is written once for any number of lanes. Mark `run` with `#[inline(always)]`.
pub trait Kernel<T: Scalar> {
    /// Result of the computation.
    type Output;
    /// Runs the computation with as many lanes as `like` has.
    fn run<V: Lanes<Scalar = T>>(self, like: V) -> Self::Output;
}

/// A precision in which kernels run.
pub trait Precision: Scalar {
    /// Runs `kernel` in vectors of 64 bytes if `level` has AVX-512, AVX2 or NEON, else in one lane. The program holds a copy
    /// of every kernel for each of them.
    fn dispatch<K: Kernel<Self>>(level: Level, kernel: K) -> K::Output;
    /// The same in vectors that fill one register each, for kernels that keep many of them.
    fn dispatch_in_registers<K: Kernel<Self>>(level: Level, kernel: K) -> K::Output;
}

macro_rules! dispatch {
    ($name:ident, $scalar:ty, $avx512:ident, $avx2:ident, $neon:ident) => {
        #[inline]
        fn $name<K: Kernel<Self>>(level: Level, kernel: K) -> K::Output {
            #[cfg(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64"))]
            macro_rules! run {
                ($simd:expr, $vector:ident) => {
                    if let Some(simd) = $simd {
                        return simd.vectorize(
                            #[inline(always)]
                            || kernel.run($vector::splat(simd, 0.0)),
                        );
                    }
                };
            }
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            {
                run!(level.as_avx512(), $avx512);
                run!(level.as_avx2(), $avx2);
            }
            #[cfg(target_arch = "aarch64")]
            run!(level.as_neon(), $neon);
            let _ = level;
            kernel.run::<$scalar>(0.0)
        }
    };
}

macro_rules! precision {
    ($scalar:ty, $wide:ident, $avx2:ident, $neon:ident) => {
        impl Precision for $scalar {
            dispatch!(dispatch, $scalar, $wide, $wide, $wide);
            dispatch!(dispatch_in_registers, $scalar, $wide, $avx2, $neon);
        }
    };
}

precision!(f32, f32x16, f32x8, f32x4);
precision!(f64, f64x8, f64x4, f64x2);
