//! The work of the benchmarks: the receptance of a random robot over the bins of one experiment, alone and with its
//! gradient.
#![allow(dead_code)]

pub(crate) mod counted;
pub(crate) mod step;

use fearless_simd::Level;
use flexid_core::receptance::lanes::{Kernel, Lanes, Precision, Scalar};
use flexid_core::receptance::{Complex, Response, Terms, receptance};
use flexid_core::sensors::Sensors;
use flexid_core::{DOF, MAX_JOINTS};
use nalgebra::Vector3;

use crate::common::Random;

/// Those of one experiment of the reference scenario, up to a whole vector.
pub(crate) const BINS: usize = 816;
/// Between two bins, rad/s.
const SPACING: f64 = 1.534;
/// Real part of the complex frequencies, 1/s.
const ALPHA: f64 = 1.7;

/// A robot and the frequencies at which it is asked for.
pub(crate) struct Bins<T: Precision> {
    pub(crate) joints: usize,
    pub(crate) terms: Terms<T>,
    /// rad/s.
    pub(crate) omega: Vec<T>,
}

impl<T: Precision> Bins<T> {
    /// The kernel of a random robot with so many joints, without gravity.
    pub(crate) fn new(joints: usize) -> Self {
        let mut random = Random::new(joints as u64);
        let (chain, bushings, pose) =
            (random.chain(joints), random.bushings(joints), random.pose(joints));
        let linear = chain.linearise(&pose, Vector3::zeros(), &bushings).unwrap();
        let omega = (1..=BINS).map(|bin| T::from_f64(SPACING * bin as f64)).collect();
        Self { joints, terms: Terms::new(&linear, &bushings, &Sensors::default()).unwrap(), omega }
    }
}

/// Receptance at every bin, its entries added up.
pub(crate) struct Values<'a, T: Precision>(pub(crate) &'a Bins<T>);

impl<T: Precision> Kernel<T> for Values<'_, T> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes<Scalar = T>>(self, like: V) -> f64 {
        let Bins { terms, omega, .. } = self.0;
        let mut sum = like.fill(T::default());
        for first in (0..omega.len()).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(T::from_f64(ALPHA)), like.load(&omega[first..]));
            for entry in receptance(terms, s) {
                sum = sum + entry.re + entry.im;
            }
        }
        total(sum)
    }
}

/// Response and gradient at every bin, all of it added up.
pub(crate) struct Gradients<'a, T: Precision> {
    pub(crate) bins: &'a Bins<T>,
    /// True if the record has a seam, as in the refinement.
    pub(crate) seam: bool,
}

impl<T: Precision> Kernel<T> for Gradients<'_, T> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes<Scalar = T>>(self, like: V) -> f64 {
        let Self { bins: Bins { joints, terms, omega }, seam } = self;
        let mut sum = like.fill(T::default());
        let force = [1.0, 2.0, 3.0].map(|f| {
            let force = like.fill(T::from_f64(f));
            Complex::new(force, force)
        });
        let load = like.fill(T::from_f64(0.5));
        let loads = [[Complex::new(load, load); DOF]; MAX_JOINTS];
        let loads = seam.then_some(&loads);
        let mut found = Response::new(like);
        for first in (0..omega.len()).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(T::default()), like.load(&omega[first..]));
            found.evaluate(terms, s, &force, loads);
            // One loop, or the compiler unrolls the inner one, and the code outgrows the cache of instructions.
            for index in 0..DOF * joints {
                for part in found.derivatives(terms, index / DOF, index % DOF).as_flattened() {
                    sum = sum + part.re + part.im;
                }
            }
        }
        total(sum)
    }
}

/// The sum over all lanes: the compiler would leave out the part that is not looked at.
fn total<V: Lanes>(values: V) -> f64 {
    let mut lanes = [V::Scalar::default(); 16];
    values.store(&mut lanes);
    lanes.iter().map(|lane| lane.to_f64()).sum()
}

/// AVX2 where the processor has it and AVX-512 too; what it has, where it has neither.
pub(crate) fn at_most_avx2() -> Level {
    let level = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = level.as_avx2() {
        return Level::Avx2(avx2);
    }
    level
}
