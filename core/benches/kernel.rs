//! The cost of a bin of the receptance, alone and with its gradient, and what the search and the refinement make of it.
//!
//! `cargo bench -p flexid-core`; throughput is in bins: criterion prints them as elements a second.

#[path = "../tests/common/mod.rs"]
mod common;
mod kernels;

use std::hint::black_box;

use common::fits::targets;
use common::milling::experiments;
use common::{MEASUREMENT, Random, mill3, nominal};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fearless_simd::Level;
use flexid_core::loss::spectral;
use flexid_core::receptance::lanes::Precision;
use kernels::{BINS, Bins, Gradients, Values};

fn by_joints(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("receptance");
    group.throughput(Throughput::Elements(BINS as u64));
    let level = Level::new();
    for joints in 1..=7 {
        let bins = Bins::<f32>::new(joints);
        group.bench_function(BenchmarkId::new("value f32", joints), |bencher| {
            bencher.iter(|| f32::dispatch(level, Values(black_box(&bins))));
        });
    }
    let bins = Bins::<f64>::new(3);
    group.bench_function(BenchmarkId::new("value f64", 3), |bencher| {
        bencher.iter(|| f64::dispatch(level, Values(black_box(&bins))));
    });
    for (name, seam) in [("value and gradient f64", false), ("the same with a seam", true)] {
        group.bench_function(BenchmarkId::new(name, 3), |bencher| {
            bencher.iter(|| f64::dispatch(level, Gradients { bins: black_box(&bins), seam }));
        });
    }
    group.finish();
}

fn sample(criterion: &mut Criterion) {
    let experiments = experiments(&nominal(), &mut Random::new(1));
    let targets = targets(&mill3(), &MEASUREMENT, &experiments);
    let guess = Random::new(2).bushings(3);
    criterion.bench_function("sample of the search, three experiments", |bencher| {
        bencher.iter(|| spectral::losses(&targets, black_box(&experiments), &guess, Level::new()));
    });
}

criterion_group!(benches, by_joints, sample);
criterion_main!(benches);
