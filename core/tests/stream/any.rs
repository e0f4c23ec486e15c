//! Records are whole, whatever arrives.

use flexid_core::stream::{Reading, Record, Stream, StreamConfig};
use proptest::prelude::*;

use super::{CAPACITY, CONFIG};

fn any_reading() -> impl Strategy<Value = (f64, Reading)> {
    let value = prop_oneof![9 => -1e3_f32..1e3, 1 => prop::num::f32::ANY];
    let values = [value.clone(), value.clone(), value];
    // Mostly in sequence, so that records come about.
    let step = prop_oneof![20 => Just(1_u32), 1 => 0..6_u32, 1 => prop::num::u32::ANY];
    (0.0..2e-3_f64, step, values, 0..40_u8).prop_map(|(wait, step, value, kind)| {
        let reading = match kind {
            0 => Reading::Joint { index: (step % 3) as u8, value: f64::from(value[0]) },
            1 => Reading::Joint { index: 0, value: 0.0 },
            2 => Reading::Joint { index: 1, value: 0.0 },
            n if n % 2 == 0 => Reading::Force { counter: step, value },
            _ => Reading::Acceleration { counter: step, value },
        };
        (wait, reading)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, rng_seed: proptest::test_runner::RngSeed::Fixed(11), failure_persistence: None, ..ProptestConfig::default() })]

    /// No panic, every record whole and of finite values, every frame counted once.
    #[test]
    fn any_readings_give_whole_records(readings in prop::collection::vec(any_reading(), 0..6000)) {
        let config = StreamConfig { record_samples: 256, ..CONFIG };
        let mut stream = Box::new(Stream::<CAPACITY>::new(config).expect("good"));
        let (mut now, mut counter, mut frames) = (0.0, 0_u32, 0);
        let mut whole = true;
        for (wait, reading) in readings {
            now += wait;
            let reading = match reading {
                Reading::Force { counter: step, value } => {
                    counter = counter.wrapping_add(step) & 0xffff;
                    Reading::Force { counter, value }
                }
                Reading::Acceleration { value, .. } => Reading::Acceleration { counter, value },
                joint => joint,
            };
            frames += u64::from(!matches!(reading, Reading::Joint { .. }));
            stream.push(now, reading, |record| whole &= is_whole(record));
        }
        stream.finish(|record| whole &= is_whole(record));
        prop_assert!(whole);
        let health = stream.health();
        prop_assert!(health.frames <= frames && health.frames + health.refused >= frames);
    }
}

fn is_whole(record: &Record<CAPACITY>) -> bool {
    let length = record.force[0].len();
    let noise = record.force_noise.iter().chain(&record.acceleration_noise);
    length.is_power_of_two()
        && record.pose.len() == 2
        && record
            .force
            .iter()
            .chain(&record.acceleration)
            .all(|signal| signal.len() == length && signal.iter().all(|value| value.is_finite()))
        && noise.copied().all(|noise| noise.is_finite() && noise > 0.0)
}
