//! From readings to records: what arrives comes out, whatever is lost, late, doubled or moved.

mod angles;
mod any;
mod clock;
mod feed;
mod invalid;
mod movements;
mod restarts;
mod senders;
mod spikes;

use std::f64::consts::TAU;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::{
    AngleSignal, Reading, Record, Setup, Stream, StreamConfig, StreamError, StreamHealth,
};

use crate::common::Random;

const CAPACITY: usize = 4096;
const PERIOD: f64 = 5e-4;

const CONFIG: StreamConfig = StreamConfig {
    rate_hz: 2000.0,
    record_samples: 2048,
    joints: 2,
    counter_bits: 16,
    force_resolution: 0.1,
    acceleration_resolution: 0.002,
    angles: [AngleSignal::FINE; MAX_JOINTS],
};

/// A sensor and a robot that feed a stream.
struct Bench {
    stream: Box<Stream<CAPACITY>>,
    random: Random,
    records: Vec<Record<CAPACITY>>,
    pose: [f64; 2],
    now: f64,
    counter: u32,
    sent: u32,
    /// 0 along an axis of the force or the acceleration that is not measured, else 1.
    measured: [[f32; 3]; 2],
}

impl Bench {
    fn new() -> Self {
        Self {
            stream: Box::new(Stream::new(CONFIG).expect("a good configuration")),
            random: Random::new(3),
            records: Vec::new(),
            pose: [0.1, -0.7],
            now: 1000.0,
            counter: 65_000,
            sent: 0,
            measured: [[1.0; 3]; 2],
        }
    }

    /// From now on a channel measures the force along one axis.
    fn measure(&mut self, force: usize, acceleration: [bool; 3]) {
        let force = std::array::from_fn(|axis| axis == force);
        self.measured =
            [force, acceleration].map(|sensor| sensor.map(|axis| f32::from(u8::from(axis))));
        let setup = Setup { force, acceleration, ..Setup::default() };
        self.push(self.now, Reading::Setup(setup));
    }

    fn push(&mut self, time_s: f64, reading: Reading) {
        let records = &mut self.records;
        self.stream.push(time_s, reading, |record| records.push(record.clone()));
    }

    /// One instant of cutting (or quiet), of which `lost` says what does not arrive; joint angles at 10 Hz.
    fn instant(&mut self, cutting: bool, lost: [bool; 2]) {
        let counter = self.counter & 0xffff;
        let phase = f64::from(self.sent);
        let size = if cutting { 300.0 } else { 0.0 };
        let force = [0.31, 0.47, 0.13]
            .map(|w| (size * (w * phase).sin() + 0.2 * self.random.normal()) as f32);
        let motion = [0.05, 0.11, 0.02]
            .map(|w| ((w * phase).sin() * size / 100.0 + 0.02 * self.random.normal()) as f32);
        let of = |sensor: usize, value: [f32; 3]| {
            std::array::from_fn(|axis| self.measured[sensor][axis] * value[axis])
        };
        let (force, motion) = (of(0, force), of(1, motion));
        if !lost[0] {
            self.push(self.now, Reading::Force { counter, value: force });
        }
        if !lost[1] {
            self.push(self.now + 1.3e-4, Reading::Acceleration { counter, value: motion });
        }
        if self.sent.is_multiple_of(200) {
            self.angles();
        }
        self.counter = self.counter.wrapping_add(1);
        self.sent += 1;
        self.now += PERIOD;
    }

    /// One instant with this force beside the sensors' noise, and joint angles at 10 Hz.
    fn push_force(&mut self, force: [f64; 3]) {
        let counter = self.counter & 0xffff;
        let value = force.map(|force| (force + 0.2 * self.random.normal()) as f32);
        self.push(self.now, Reading::Force { counter, value });
        let value = [0; 3].map(|_| 0.02 * self.random.normal() as f32);
        self.push(self.now + 1.3e-4, Reading::Acceleration { counter, value });
        if self.sent.is_multiple_of(200) {
            self.angles();
        }
        self.counter = self.counter.wrapping_add(1);
        self.sent += 1;
        self.now += PERIOD;
    }

    fn angles(&mut self) {
        for (index, value) in self.pose.into_iter().enumerate() {
            self.push(self.now, Reading::Joint { index: index as u8, value });
        }
    }

    fn run(&mut self, instants: usize, cutting: bool) {
        (0..instants).for_each(|_| self.instant(cutting, [false; 2]));
    }

    /// Ends the recording.
    fn end(&mut self) {
        let records = &mut self.records;
        self.stream.finish(|record| records.push(record.clone()));
    }

    fn forget_angles(&mut self) {
        let records = &mut self.records;
        self.stream.forget_angles(|record| records.push(record.clone()));
    }

    fn finish(mut self) -> (Vec<Record<CAPACITY>>, StreamHealth) {
        self.end();
        (self.records, self.stream.health())
    }
}

fn lengths(records: &[Record<CAPACITY>]) -> Vec<usize> {
    records.iter().map(|record| record.force[0].len()).collect()
}

#[test]
fn an_experiment_becomes_one_record() {
    let mut bench = Bench::new();
    bench.run(300, false);
    bench.run(1748, true);
    let (records, health) = bench.finish();
    assert_eq!(lengths(&records), [2048]);
    let record = &records[0];
    assert_eq!(record.pose.as_slice(), [0.1, -0.7]);
    assert!((record.start_s - 1000.0).abs() < 1e-9);
    assert!(record.starts_at_rest);
    assert!(record.force_noise.iter().all(|noise| (noise / 0.2 - 1.0).abs() < 0.1));
    assert!(record.acceleration_noise.iter().all(|noise| (noise / 0.02 - 1.0).abs() < 0.1));
    assert_eq!((health.frames, health.frames_lost, health.samples_discarded), (4096, 0, 0));
}

/// The noise along the other axes is what it is without them.
#[test]
fn an_axis_that_is_not_measured_has_no_noise_or_no_weight() {
    for struck in 0..3 {
        let mut bench = Bench::new();
        bench.measure(struck, [true, true, false]);
        bench.run(300, false);
        bench.run(1748, true);
        let (records, health) = bench.finish();
        assert_eq!((lengths(&records), health.held, health.clipped), (vec![2048], [0; 6], [0; 6]));
        let record = &records[0];
        assert!(record.starts_at_rest);
        for axis in (0..3).filter(|axis| *axis != struck) {
            assert_eq!(record.force_noise[axis], 0.0);
        }
        let [x, y, z] = record.acceleration_noise;
        assert_eq!(z, f32::INFINITY);
        for noise in [record.force_noise[struck] / 0.2, x / 0.02, y / 0.02] {
            assert!((noise - 1.0).abs() < 0.15, "{struck}: {noise}");
        }
    }
}

/// A blow that no rest comes before has the noise of its own axis, and not that of a blow along another one.
#[test]
fn the_noise_of_another_axis_is_not_taken_over() {
    let mut bench = Bench::new();
    bench.measure(0, [true; 3]);
    bench.run(300, false);
    bench.run(1748, true);
    bench.measure(2, [true; 3]);
    bench.run(2048, true);
    let (records, _) = bench.finish();
    let noise: Vec<[f32; 3]> = records.iter().map(|record| record.force_noise).collect();
    assert!(noise.len() == 2 && noise[0][2] == 0.0 && noise[1][0] == 0.0, "{noise:?}");
    assert!(noise[1][2] > 0.1, "{noise:?}");
}

/// A record is of one point, that of the newest reading before it.
#[test]
fn another_point_begins_another_record() {
    let mut bench = Bench::new();
    let at = |point| Reading::Setup(Setup { point, ..Setup::default() });
    bench.push(bench.now, at([0.1, 0.0, 0.0]));
    bench.run(300, false);
    bench.run(1748, true);
    bench.push(bench.now, at([0.1, 0.0, 0.2]));
    bench.run(300, false);
    bench.run(1748, true);
    let (records, _) = bench.finish();
    let points: Vec<[f64; 3]> = records.iter().map(|record| record.point).collect();
    assert_eq!(points, [[0.1, 0.0, 0.0], [0.1, 0.0, 0.2]]);
}

#[test]
fn a_record_that_fills_says_how_full_it_is() {
    let mut bench = Bench::new();
    bench.run(5000, false);
    assert_eq!(bench.stream.record_fraction(), 0.0, "nothing is cut");
    let mut last = 0.0;
    for _ in 0..7 {
        bench.run(200, true);
        let fraction = bench.stream.record_fraction();
        assert!(fraction > last, "{fraction} after {last}");
        last = fraction;
    }
    // 1400 instants of the cut, and the 512 to 576 that are kept from before it, of 2048.
    assert!((0.93..0.97).contains(&last), "{last}");
    bench.run(400, true);
    assert_eq!(bench.records.len(), 1);
    assert!(bench.stream.record_fraction() < 0.3, "the next has begun");
}

/// Angles come every 0.1 s: the one that shows a record's end comes when the stretch has been full for long.
#[test]
fn a_record_may_be_as_long_as_the_capacity() {
    let mut bench = Bench::new();
    let config = StreamConfig { record_samples: CAPACITY, ..CONFIG };
    bench.stream = Box::new(Stream::new(config).expect("a good configuration"));
    bench.run(300, false);
    bench.run(3 * CAPACITY, true);
    let (records, health) = bench.finish();
    assert_eq!(lengths(&records)[..2], [CAPACITY; 2]);
    let apart = records[1].start_s - records[0].start_s - CAPACITY as f64 * PERIOD;
    assert!((0.0..=0.1 + PERIOD).contains(&apart), "{apart} s between the records");
    let whole: usize = lengths(&records).iter().sum();
    assert_eq!(whole as u64 + health.samples_discarded, 300 + 3 * CAPACITY as u64);

    // Angles that stop in mid-record cost the samples after the last angle.
    let mut bench = Bench::new();
    *bench.stream = Stream::new(config).expect("a good configuration");
    bench.run(1700, true);
    (0..5000).for_each(|_| {
        bench.sent = bench.sent % 199 + 1;
        bench.instant(true, [false; 2]);
    });
    assert_eq!(lengths(&bench.records), [1024, 512]);
}

#[test]
fn lost_samples_are_bridged_counted_and_paid_for_in_noise() {
    let run = |loss: f64| {
        let mut bench = Bench::new();
        let mut lost = 0;
        for n in 0..2048 {
            let drop = [0, 1].map(|_| n > 300 && n < 2040 && bench.random.uniform(0.0, 1.0) < loss);
            lost += u64::from(drop[0]) + u64::from(drop[1]);
            bench.instant(n >= 300, drop);
        }
        let (records, health) = bench.finish();
        (records, health, lost)
    };
    let (whole, ..) = run(0.0);
    let (holed, health, lost) = run(0.01);
    assert!(lost > 20);
    assert_eq!((health.frames_lost, health.bridged), (lost, lost));
    assert_eq!(lengths(&holed), [2048]);
    assert!(holed[0].force[0].iter().all(|value| value.is_finite()));
    assert!(holed[0].force_noise[0] > whole[0].force_noise[0]);
}

#[test]
fn a_sample_lost_at_either_end_does_not_cost_the_record() {
    for lost in [0, 2047] {
        let mut bench = Bench::new();
        for n in 0..2048 {
            bench.instant(n >= 300, if n == lost { [true, false] } else { [false; 2] });
        }
        let (records, health) = bench.finish();
        assert_eq!(lengths(&records), [2048], "lost {lost}");
        assert_eq!(health.frames_lost, 1);
    }
}

#[test]
fn a_long_gap_splits_and_keeps_both_sides() {
    let mut bench = Bench::new();
    bench.run(300, false);
    bench.run(1000, true);
    (0..3).for_each(|_| bench.instant(true, [true; 2]));
    bench.run(1100, true);
    let (records, health) = bench.finish();
    assert_eq!(lengths(&records), [1024, 256, 1024]);
    assert_eq!(health.frames_lost, 6);
    assert_eq!(health.samples_discarded, 20 + 76);
    assert!(records.iter().all(|record| record.pose.as_slice() == [0.1, -0.7]));
}

/// Angles come every 0.1 s: what lies between the last standing one and the first moved one is not trusted.
#[test]
fn a_movement_ends_the_record_where_the_robot_last_stood() {
    let mut bench = Bench::new();
    bench.run(200, false);
    bench.run(1050, true);
    for _ in 0..1000 {
        bench.pose[1] += 1e-5;
        bench.instant(true, [false; 2]);
    }
    bench.run(2200, true);
    let (records, health) = bench.finish();
    assert_eq!(health.without_pose, 0);
    let still = records
        .iter()
        .filter(|record| record.pose[1] == -0.7)
        .map(|r| r.force[0].len())
        .sum::<usize>();
    assert!((1024..=1201).contains(&still), "{still}");
    let after: Vec<&Record<CAPACITY>> =
        records.iter().filter(|record| record.pose[1] > -0.695).collect();
    assert!(after.iter().map(|record| record.force[0].len()).sum::<usize>() >= 2048);
    let at = |record: &&Record<CAPACITY>, angle: f64| (record.pose[1] - angle).abs() < 6e-4;
    let moving = records.iter().filter(|record| !(at(record, -0.7) || at(record, -0.69)));
    for record in moving {
        let pose = &record.pose;
        assert!(!record.path.is_empty() && (-0.7..-0.69).contains(&pose[1]), "{pose:?}");
    }
}

#[test]
fn a_restart_begins_a_new_record_and_loses_nothing() {
    let mut bench = Bench::new();
    for (pose, counter) in [(-0.7, 65_000), (0.4, 12), (1.0, 40_000)] {
        bench.pose[1] = pose;
        bench.counter = counter;
        bench.run(300, false);
        bench.run(1748, true);
        bench.now += 1.0;
        bench.sent = 0;
    }
    let (records, health) = bench.finish();
    assert_eq!(lengths(&records), [2048; 3]);
    assert_eq!(records.iter().map(|record| record.pose[1]).collect::<Vec<_>>(), [-0.7, 0.4, 1.0]);
    assert_eq!((health.frames_lost, health.restarts, health.samples_discarded), (0, 2, 0));
}

#[test]
fn a_long_quiet_is_let_go_but_for_what_lies_just_before_the_cut() {
    let mut bench = Bench::new();
    bench.run(10_000, false);
    bench.run(2048, true);
    let (records, health) = bench.finish();
    assert_eq!(lengths(&records)[0], 2048);
    let before_cut = 1000.0 + 5.0 - records[0].start_s;
    // A quarter of these short records; a second of the usual ones.
    assert!((0.24..=0.3).contains(&before_cut), "{before_cut} s");
    assert!(health.samples_discarded > 9000);
}

/// The robot rests after the cut: what follows is no record, however long it lasts.
#[test]
fn rest_after_the_cut_is_no_record() {
    let mut bench = Bench::new();
    bench.run(300, false);
    bench.run(1500, true);
    bench.run(9000, false);
    bench.run(300, true);
    bench.run(2000, false);
    let (records, _) = bench.finish();
    let loudest =
        |record: &Record<CAPACITY>| record.force[0].iter().fold(0.0_f32, |a, b| a.max(b.abs()));
    assert!(records.iter().all(|record| loudest(record) > 100.0));
    assert_eq!(lengths(&records)[0], 2048);
}

/// A sensor of fine resolution: its noise is thousands of steps, and still no cut.
#[test]
fn noise_of_many_steps_is_no_cut() {
    let mut bench = Bench::new();
    let config = StreamConfig { force_resolution: 1e-5, ..CONFIG };
    bench.stream = Box::new(Stream::new(config).expect("a good configuration"));
    bench.run(6000, false);
    let (records, _) = bench.finish();
    assert!(records.is_empty());
}

/// Teeth that pass above the band, at 700 Hz, look like white noise to the differences of neighbours.
#[test]
fn chatter_above_the_band_is_a_cut() {
    let mut bench = Bench::new();
    bench.run(300, false);
    for n in 0..1748 {
        bench.push_force(
            [0.0, 1.0, 2.0].map(|phase| 300.0 * (TAU * 0.35 * f64::from(n) + phase).sin()),
        );
    }
    let (records, _) = bench.finish();
    assert_eq!(lengths(&records), [2048]);
    let noise = records[0].force_noise;
    assert!(noise.iter().all(|noise| (noise / 0.2 - 1.0).abs() < 0.15), "{noise:?}");
}

/// Readings of a sensor before it has started are no measure of what is quiet.
#[test]
fn a_start_up_does_not_make_all_that_follows_a_cut() {
    let mut bench = Bench::new();
    for _ in 0..650 {
        let (counter, value) = (bench.counter & 0xffff, [0.0; 3]);
        bench.push(bench.now, Reading::Force { counter, value });
        bench.push(bench.now, Reading::Acceleration { counter, value });
        bench.counter += 1;
        bench.now += PERIOD;
    }
    bench.run(5000, false);
    bench.run(2048, true);
    let (records, _) = bench.finish();
    let before_cut = 1000.0 + 5650.0 * PERIOD - records[0].start_s;
    assert!((0.24..=0.3).contains(&before_cut), "{before_cut} s");
}

/// Noise behind a sensor's own filter, of thousands of steps.
#[test]
fn coloured_noise_of_many_steps_is_no_cut() {
    let mut bench = Bench::new();
    let config = StreamConfig { force_resolution: 1e-5, ..CONFIG };
    bench.stream = Box::new(Stream::new(config).expect("a good configuration"));
    let mut filtered = [0.0; 3];
    for n in 0..8048 {
        let cut = if n < 6000 { 0.0 } else { 100.0 * (0.3 * f64::from(n)).sin() };
        filtered = filtered.map(|value| value + 0.4 * (5.0 * bench.random.normal() - value));
        bench.push_force(filtered.map(|value| value + cut));
    }
    let (records, _) = bench.finish();
    let before_cut = 1000.0 + 6000.0 * PERIOD - records[0].start_s;
    assert!((0.24..=0.3).contains(&before_cut), "{before_cut} s");
}

#[test]
fn angles_that_stop_coming_make_no_record_at_a_wrong_pose() {
    let mut bench = Bench::new();
    bench.sent = 1;
    bench.pose = [0.3, 0.4];
    // Beyond the capacity, and no angle in all that time.
    for _ in 0..5000 {
        bench.instant(true, [false; 2]);
        bench.sent = 1 + bench.sent % 199;
    }
    let (records, health) = bench.finish();
    assert!(records.is_empty(), "{:?}", records[0].pose);
    assert_eq!(health.samples_discarded, 5000);
}

#[test]
fn without_joint_angles_there_is_no_record_and_the_missing_joint_is_named() {
    let mut bench = Bench::new();
    bench.sent = 1;
    bench.run(150, true);
    assert_eq!(bench.stream.missing_joint(), Some(0));
    bench.push(bench.now, Reading::Joint { index: 0, value: 0.1 });
    assert_eq!(bench.stream.missing_joint(), Some(1));
    bench.push(bench.now, Reading::Joint { index: 7, value: 0.1 });
    bench.push(bench.now, Reading::Joint { index: 1, value: f64::NAN });
    let (records, health) = bench.finish();
    assert!(records.is_empty());
    assert_eq!(health.refused, 2);
}

/// Readings at 2 kHz: much faster than configured is refused.
#[test]
fn another_rate_than_configured_is_counted() {
    for (rate_hz, kept) in [(1000.0, 0), (2050.0, 2), (4000.0, 2)] {
        let config = StreamConfig { rate_hz, ..CONFIG };
        let mut stream = Box::new(Stream::<CAPACITY>::new(config).expect("good"));
        let mut records = 0;
        for n in 0..4300_u32 {
            let (time_s, phase) = (f64::from(n) * PERIOD, f64::from(n) * 0.3);
            let value = [100.0 * phase.sin() as f32; 3];
            stream.push(time_s, Reading::Force { counter: n, value }, |_| records += 1);
            stream.push(time_s, Reading::Acceleration { counter: n, value }, |_| records += 1);
            let angle = Reading::Joint { index: (n % 2) as u8, value: 0.5 };
            stream.push(time_s, angle, |_| records += 1);
        }
        let health = stream.health();
        assert_eq!(records, kept, "{rate_hz}");
        let expected = (2, 2000.0, 2 - kept);
        let health = (health.wrong_rate, health.measured_rate_hz.round(), health.too_fast);
        assert_eq!(health, expected, "{rate_hz}");
    }
}

#[test]
fn refuses_configurations_that_make_no_sense() {
    let refused = |change: fn(&mut StreamConfig)| {
        let mut config = CONFIG;
        change(&mut config);
        Stream::<CAPACITY>::new(config).err()
    };
    assert_eq!(refused(|_| {}), None);
    assert_eq!(refused(|c| c.rate_hz = f64::NAN), Some(StreamError::Rate));
    assert_eq!(refused(|c| c.record_samples = 3000), Some(StreamError::RecordSamples));
    assert_eq!(refused(|c| c.record_samples = 8192), Some(StreamError::RecordSamples));
    assert_eq!(refused(|c| c.joints = 8), Some(StreamError::Joints));
    assert_eq!(refused(|c| c.counter_bits = 40), Some(StreamError::CounterBits));
    assert_eq!(refused(|c| c.force_resolution = 0.0), Some(StreamError::Resolution));
    assert_eq!(refused(|c| c.acceleration_resolution = f32::NAN), Some(StreamError::Resolution));
}
