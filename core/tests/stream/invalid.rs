//! Samples that are no measurement: clipped and repeated ones.

use flexid_core::stream::{Reading, StreamHealth};

use super::{Bench, CAPACITY, CONFIG, PERIOD, Record};

/// Readings of force and acceleration at an instant, changed by `spoil`, which also gets those before: a record of 2048 samples at each of
/// so many poses.
fn spoilt(
    records: u32,
    mut spoil: impl FnMut(u32, &mut [f32; 6], &[f32; 6]),
) -> (Vec<Record<CAPACITY>>, StreamHealth) {
    let mut bench = Bench::new();
    let mut before = [0.0; 6];
    for n in 0..2048 * records {
        let size = if n % 2048 >= 300 { 300.0 } else { 0.0 };
        let counter = bench.counter & 0xffff;
        let phase = f64::from(bench.sent);
        let mut noise = |size: f64| size * bench.random.normal();
        let force = [0.31, 0.47, 0.13].map(|w: f64| size * (w * phase).sin() + noise(0.2));
        let motion = [0.05, 0.11, 0.02].map(|w: f64| size / 20.0 * (w * phase).sin() + noise(0.02));
        let rounded = |value: f64, step: f32| (value / f64::from(step)).round() as f32 * step;
        let mut values: [f32; 6] = std::array::from_fn(|axis| match axis {
            0..3 => rounded(force[axis], CONFIG.force_resolution),
            _ => rounded(motion[axis - 3], CONFIG.acceleration_resolution),
        });
        spoil(n, &mut values, &before);
        before = values;
        let [fx, fy, fz, ax, ay, az] = values;
        bench.push(bench.now, Reading::Force { counter, value: [fx, fy, fz] });
        bench.push(bench.now + 1.3e-4, Reading::Acceleration { counter, value: [ax, ay, az] });
        if n % 200 == 0 {
            bench.angles();
        }
        bench.counter = bench.counter.wrapping_add(1);
        bench.sent += 1;
        bench.now += PERIOD;
    }
    bench.finish()
}

#[test]
fn right_records_stay_as_they_are() {
    let (records, health) = spoilt(2, |_, _, _| {});
    assert_eq!((records.len(), health.clipped, health.held), (2, [0; 6], [0; 6]));
    // No force along z, and a coarse accelerometer.
    let (records, health) = spoilt(2, |_, values, _| {
        values[2] = 0.0;
        values[3..].iter_mut().for_each(|value| *value = (*value / 0.2).round() * 0.2);
    });
    assert_eq!((records.len(), health.clipped, health.held), (2, [0; 6], [0; 6]));
}

#[test]
fn a_record_of_clipped_peaks_is_refused() {
    let (records, health) = spoilt(2, |n, values, _| {
        if n < 2048 {
            values[1] = values[1].min(200.0);
        }
    });
    assert_eq!((records.len(), health.refused_clipped, health.refused_held), (1, 1, 0));
    assert_eq!(health.samples_discarded, 2048);
    assert!(health.clipped[1] > 80 && health.clipped.iter().sum::<u64>() == health.clipped[1]);
}

#[test]
fn a_record_of_an_axis_that_sticks_is_refused_and_so_are_those_after_it() {
    let (records, health) = spoilt(3, |n, values, before| {
        if n >= 2048 + 1000 {
            values[4] = before[4];
        }
    });
    assert_eq!((records.len(), health.refused_clipped, health.refused_held), (1, 0, 2));
    assert!(health.held[4] > 2500 && health.held.iter().sum::<u64>() == health.held[4]);
}

#[test]
fn a_record_of_a_sensor_at_half_of_the_rate_is_refused() {
    let (records, health) = spoilt(1, |n, values, before| {
        if n % 2 == 1 {
            values[3..].copy_from_slice(&before[3..]);
        }
    });
    assert_eq!((records.len(), health.refused_held), (0, 1));
    assert!(health.held[3] > 500, "{health:?}");
}

/// A sensor that is late for its frame now and then costs a few bridged samples.
#[test]
fn few_repeated_samples_are_bridged() {
    let (whole, _) = spoilt(1, |_, _, _| {});
    let (records, health) = spoilt(1, |n, values, before| {
        if n > 300 && n % 200 == 7 {
            values[..3].copy_from_slice(&before[..3]);
        }
    });
    assert_eq!((records.len(), health.refused_held, health.bridged), (1, 0, 0));
    assert_eq!(health.held, [9, 9, 9, 0, 0, 0]);
    for (own, other) in records[0].force.iter().zip(&whole[0].force) {
        let worst = own.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 3.0, "{worst} of 300 N");
    }
}
