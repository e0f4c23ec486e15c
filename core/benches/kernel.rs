//! What a bin of the receptance costs, alone and with its gradient, and what the search and the refinement make of it.
//!
//! `cargo bench -p flexid-core`; throughput is in bins: criterion prints them as elements a second.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use common::milling::experiments;
use common::{Random, nominal};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fearless_simd::Level;
use flexid_core::loss::spectral;
use flexid_core::receptance::lanes::{Kernel, Lanes, Precision};
use flexid_core::receptance::{Complex, Response, Terms, receptance};
use nalgebra::Vector3;

/// Those of one experiment of the reference scenario, up to a whole vector.
const BINS: usize = 816;
/// Between two bins, rad/s.
const SPACING: f64 = 1.534;

/// Receptance at every bin, its entries added up.
struct Values<'a, T: Precision> {
    terms: &'a Terms<T>,
    omega: &'a [T],
}

impl<T: Precision> Kernel<T> for Values<'_, T> {
    type Output = T;

    #[inline(always)]
    fn run<V: Lanes<Scalar = T>>(self, like: V) -> T {
        let mut sum = like.fill(T::default());
        for first in (0..self.omega.len()).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(T::from_f64(1.7)), like.load(&self.omega[first..]));
            for entry in receptance(self.terms, s) {
                sum = sum + entry.re + entry.im;
            }
        }
        first_lane(sum)
    }
}

/// Response and gradient at every bin, all of it added up.
struct Gradients<'a, T: Precision>(Values<'a, T>);

impl<T: Precision> Kernel<T> for Gradients<'_, T> {
    type Output = T;

    #[inline(always)]
    fn run<V: Lanes<Scalar = T>>(self, like: V) -> T {
        let Values { terms, omega } = self.0;
        let mut sum = like.fill(T::default());
        let force = [1.0, 2.0, 3.0].map(|f| {
            let force = like.fill(T::from_f64(f));
            Complex::new(force, force)
        });
        let seam = [[Complex::zero(like); 6]; 7];
        let mut found = Response::new(like);
        for first in (0..omega.len()).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(T::default()), like.load(&omega[first..]));
            found.evaluate(terms, s, &force, &seam);
            for joint in 0..3 {
                for dof in 0..6 {
                    for part in found.derivatives(terms, s, joint, dof).as_flattened() {
                        sum = sum + part.re + part.im;
                    }
                }
            }
        }
        first_lane(sum)
    }
}

fn first_lane<V: Lanes>(values: V) -> V::Scalar {
    let mut lanes = [V::Scalar::default(); 16];
    values.store(&mut lanes);
    lanes[0]
}

fn terms<T: Precision>(joints: usize) -> Terms<T> {
    let mut random = Random::new(joints as u64);
    let (chain, bushings, pose) =
        (random.chain(joints), random.bushings(joints), random.pose(joints));
    Terms::new(&chain.linearise(&pose, Vector3::zeros(), &bushings), &bushings, false)
}

fn omega<T: Precision>() -> Vec<T> {
    (1..=BINS).map(|bin| T::from_f64(SPACING * bin as f64)).collect()
}

fn by_joints(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("receptance");
    group.throughput(Throughput::Elements(BINS as u64));
    let level = Level::new();
    for joints in 1..=7 {
        let (terms, omega) = (terms::<f32>(joints), omega());
        group.bench_function(BenchmarkId::new("value f32", joints), |bencher| {
            let kernel = || Values { terms: black_box(&terms), omega: &omega };
            bencher.iter(|| f32::dispatch(level, kernel()));
        });
    }
    let (terms, omega) = (terms::<f64>(3), omega());
    let values = || Values { terms: black_box(&terms), omega: &omega };
    group.bench_function(BenchmarkId::new("value f64", 3), |bencher| {
        bencher.iter(|| f64::dispatch(level, values()));
    });
    group.bench_function(BenchmarkId::new("value and gradient f64", 3), |bencher| {
        bencher.iter(|| f64::dispatch(level, Gradients(values())));
    });
    group.finish();
}

fn sample(criterion: &mut Criterion) {
    let experiments = experiments(&nominal(), &mut Random::new(1));
    let guess = Random::new(2).bushings(3);
    criterion.bench_function("sample of the search, three experiments", |bencher| {
        bencher.iter(|| spectral::losses(black_box(&experiments), &guess, Level::new()));
    });
}

criterion_group!(benches, by_joints, sample);
criterion_main!(benches);
