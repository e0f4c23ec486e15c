//! The cost of a whole identification: from records in memory to the estimate, on one core.
//!
//! `cargo bench -p flexid-core --bench identification`. Robots whose basin the first search finds.

#[path = "../tests/common/mod.rs"]
mod common;

use std::time::Duration;

use common::fits::settle;
use common::milling::{Conditions, SAMPLES, cut, record};
use common::{BINS, EXPERIMENTS, MEASUREMENT, Random, bounds, mill3, nominal};
use criterion::{Criterion, criterion_group, criterion_main};
use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::identify::{Acceptance, Estimate, Identifier};
use flexid_core::parameters::Bushings;
use flexid_core::spectrum::Experiment;
use flexid_core::stream::Record;

/// A robot and its records.
struct Recorded {
    chain: Chain,
    records: Vec<Record<SAMPLES>>,
}

impl Recorded {
    /// The reference scenario: three joints, three experiments.
    fn scenario() -> Self {
        Self::new(mill3(), &nominal(), &EXPERIMENTS, Random::new(1))
    }

    /// Six joints drawn at random, and eight experiments like the scenario's.
    fn six_joints() -> Self {
        let mut random = Random::new(0);
        let (chain, bushings) = (random.chain(6), random.bushings(6));
        let experiments: Vec<_> = (0..8)
            .map(|index| {
                let speeds = [random.uniform(600.0, 900.0), random.uniform(3000.0, 5400.0)];
                (random.pose(6), speeds, index % 3)
            })
            .collect();
        Self::new(chain, &bushings, &experiments, random)
    }

    /// `experiments`: pose, spindle speeds, feed axis.
    fn new(
        chain: Chain,
        bushings: &Bushings,
        experiments: &[(impl AsRef<[f64]>, [f64; 2], usize)],
        mut random: Random,
    ) -> Self {
        let mut records = Vec::new();
        for (pose, speeds, feed) in experiments {
            let force = cut(&mut random, *speeds, *feed);
            let (pose, conditions) = (pose.as_ref(), Conditions::default());
            records.push(record(&chain, pose, bushings, &force, &conditions, &mut random));
        }
        Self { chain, records }
    }

    fn identify(&self) -> Estimate {
        let mut buffer = [0.0; SAMPLES];
        let mut experiments = Vec::new();
        for record in &self.records {
            let experiment =
                Experiment::<BINS>::new(&self.chain, &MEASUREMENT, record, &mut buffer);
            experiments.push(experiment.expect("a good record"));
        }
        let generator = Random::new(1).0;
        let mut identifier = Box::new(Identifier::new(
            self.chain.clone(),
            bounds(),
            MEASUREMENT,
            Level::new(),
            generator,
        ));
        let estimate = settle(&mut identifier, &experiments);
        assert_eq!(identifier.progress().effort.starts, 1, "the first search misses the basin");
        estimate
    }
}

fn identification(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("identification");
    group.sample_size(10).measurement_time(Duration::from_secs(20));
    for (name, robot) in [
        ("three joints, 36 parameters, three experiments", Recorded::scenario()),
        ("six joints, 72 parameters, eight experiments", Recorded::six_joints()),
    ] {
        assert_eq!(robot.identify().acceptance, Acceptance::Consistent, "{name}");
        group.bench_function(name, |bencher| bencher.iter(|| robot.identify()));
    }
    group.finish();
}

criterion_group!(benches, identification);
criterion_main!(benches);
