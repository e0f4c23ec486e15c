//! Test of the gradient that the steps follow against central differences of their cost.

use nalgebra::Vector3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

use super::*;
use crate::linear::normal::Normal;
use crate::mounting::Mounting;
use crate::refine::tests::{BINS, SAMPLES, bounds, bushings, chain, problem, record, sought};
use crate::sensors::Accelerometer;
use crate::sought::MAX_UNKNOWNS;
use crate::spectrum::Measurement;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(8) })]

    /// The test covers half of the band, the whole band and the last level, with fixed and tied parameters, separate sensors,
    /// and records that start within a cut.
    #[test]
    fn the_gradient_equals_finite_differences(seed in 0_u64..1000, tool_mass in prop_oneof![Just(0.0), Just(30.0)], starts_at_rest: bool) {
        // Single precision has an error of 1e-7 of the cost, which is some thousands.
        const STEP: f64 = 0.01;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let chain = chain();
        let measurement = Measurement {
            band_hz: [5.0, 60.0],
            gravity: [0.0; 3],
            accelerometer: Accelerometer::Inertial,
            mounting: Mounting { accelerometer: Vector3::new(0.1, -0.2, 0.05), tool_mass, ..Mounting::AT_TCP },
        };
        let record = crate::stream::Record { starts_at_rest, ..record(&mut random) };
        let experiment = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
        let experiments = [experiment.unwrap()];
        let (bounds, sought) = (bounds(), sought());
        let problem = problem(&chain, &measurement, &bounds, &sought);
        for level in [WIDENING - 2, WIDENING, LAST] {
            let mut continuation = Continuation::new(sought.coordinates(&bushings()));
            continuation.begin(level);
            let start = sought.coordinates(&bushings());
            let mut at = |unknown: usize, by: f64| {
                let mut step = [0.0; MAX_UNKNOWNS];
                step[unknown] = by;
                continuation.coordinates = start;
                sought.advance(&mut continuation.coordinates, &step);
                let mut normal = Normal::new();
                continuation.assemble(&problem, &experiments, &mut normal);
                normal
            };
            let standing = at(0, 0.0);
            let scale = (0..sought.unknowns()).map(|i| standing.right()[i].abs()).fold(0.0, f64::max);
            prop_assert!(scale > 1.0, "level {level}: {scale}");
            for unknown in 0..sought.unknowns() {
                let mut cost = |by| at(unknown, by).sum_of_squares();
                let [near, far] = [STEP, 2.0 * STEP].map(|by| (cost(by) - cost(-by)) / (2.0 * by));
                // Richardson's extrapolation.
                let difference = -0.5 * (4.0 * near - far) / 3.0;
                let ours = standing.right()[unknown];
                prop_assert!(
                    (ours - difference).abs() < 4e-3 * scale,
                    "level {level}, unknown {unknown}: {ours} instead of {difference}, scale {scale}"
                );
            }
        }
    }
}
