//! Rates, clocks and joint angles: what the arrival of readings says.

use flexid_core::stream::{Reading, Record, Stream, StreamConfig, StreamHealth};

use super::{Bench, CAPACITY, CONFIG, PERIOD, lengths};
use crate::common::Random;

/// A sensor on a bus, instant by instant.
struct Sensor<'a> {
    config: StreamConfig,
    instants: u32,
    /// When an instant arrives, s.
    arrival: &'a mut dyn FnMut(u32) -> f64,
    lost: &'a dyn Fn(u32) -> bool,
    /// Before which instants the angles come.
    angles: &'a dyn Fn(u32) -> bool,
}

impl Sensor<'_> {
    /// Rests for 300 instants, and then cuts.
    fn records(&mut self) -> (Vec<Record<CAPACITY>>, StreamHealth) {
        let mut stream = Box::new(Stream::<CAPACITY>::new(self.config).expect("good"));
        let mut records = Vec::new();
        let mut random = Random::new(9);
        let mask = u32::MAX >> (32 - self.config.counter_bits);
        for n in 0..self.instants {
            let time_s = (self.arrival)(n);
            let mut push = |time_s, reading| {
                stream.push(time_s, reading, |record| records.push(record.clone()));
            };
            if (self.angles)(n) {
                for index in 0..2 {
                    push(time_s, Reading::Joint { index, value: 0.5 });
                }
            }
            let size = if n < 300 { 0.0 } else { 300.0 };
            let wave = |w: f64| size * (w * f64::from(n)).sin() + 0.2 * random.normal();
            let value = [0.31, 0.47, 0.13].map(wave).map(|force| force as f32);
            if !(self.lost)(n) {
                let counter = n & mask;
                push(time_s, Reading::Force { counter, value });
                push(time_s + 1.3e-4, Reading::Acceleration { counter, value });
            }
        }
        stream.finish(|record| records.push(record.clone()));
        (records, stream.health())
    }
}

fn each_200(n: u32) -> bool {
    n.is_multiple_of(200)
}

/// The configuration says 2000 Hz. A rate that is wrong by ε makes every stiffness wrong by about 2 ε.
#[test]
fn a_record_has_the_rate_at_which_its_samples_arrive() {
    for off in [0.0, 54e-6, -150e-6, 2e-3, 0.01, 0.05, -0.05, -0.5] {
        let rate_hz = 2000.0 * (1.0 + off);
        let mut random = Random::new(5);
        let mut arrival = |n| 1000.0 + f64::from(n) / rate_hz + random.uniform(0.0, 1e-4);
        let mut sensor = Sensor {
            config: CONFIG,
            instants: 2348,
            arrival: &mut arrival,
            lost: &|n| n % 97 == 3,
            angles: &each_200,
        };
        let (records, health) = sensor.records();
        let record = &records[0];
        assert_eq!(record.force[0].len(), 2048);
        let error = record.rate_hz / rate_hz - 1.0;
        println!(
            "{:8.0} ppm off, taken for {:.2} Hz: {:.1} ppm",
            off * 1e6,
            record.rate_hz,
            error * 1e6
        );
        assert!(error.abs() < 10e-6 && !record.has_doubtful_rate, "{off}: {:.1} ppm", error * 1e6);
        let expected = if off.abs() > 2e-4 { records.len() as u64 } else { 0 };
        assert_eq!((health.wrong_rate, health.doubtful_rate, health.too_fast), (expected, 0, 0));
        if expected > 0 {
            assert!((f64::from(health.measured_rate_hz) / rate_hz - 1.0).abs() < 10e-6);
        }
    }
}

/// An eighth of a second with a jitter of 0.3 ms determines a rate to a per mille: enough to see that 2000 Hz is wrong.
#[test]
fn a_rate_that_is_off_and_uncertain_is_doubtful() {
    for off in [0.0, 0.01] {
        let mut random = Random::new(5);
        let mut arrival =
            |n| 1000.0 + f64::from(n) / (2000.0 * (1.0 + off)) + random.uniform(0.0, 3e-4);
        let config = StreamConfig { record_samples: 256, ..CONFIG };
        let lost = |_| false;
        let mut sensor =
            Sensor { config, instants: 560, arrival: &mut arrival, lost: &lost, angles: &each_200 };
        let (records, health) = sensor.records();
        let doubtful = off != 0.0;
        assert_eq!((records.len() as u64, health.doubtful_rate), (1, u64::from(doubtful)));
        assert_eq!(records[0].has_doubtful_rate, doubtful);
        assert!((records[0].rate_hz / 2000.0 - 1.0).abs() < 50e-6, "{}", records[0].rate_hz);
    }
}

/// The clock is set by NTP in the midst of a record: the record is whole, and its rate is right.
#[test]
fn a_clock_that_is_set_costs_nothing() {
    for set_s in [-3600.0, -0.2, 0.3] {
        let mut random = Random::new(5);
        let mut arrival = |n| {
            let set_s = if n < 1200 { 0.0 } else { set_s };
            1e5 + set_s + f64::from(n) * PERIOD + random.uniform(0.0, 1e-4)
        };
        let (lost, instants) = (|_| false, 4200);
        let mut sensor = Sensor {
            config: CONFIG,
            instants,
            arrival: &mut arrival,
            lost: &lost,
            angles: &each_200,
        };
        let (records, health) = sensor.records();
        assert_eq!(lengths(&records), [2048, 2048], "{set_s}");
        for record in &records {
            assert!((record.rate_hz / 2000.0 - 1.0).abs() < 20e-6, "{set_s}: {}", record.rate_hz);
        }
        assert_eq!((health.restarts, health.wrong_rate, health.doubtful_rate), (0, 0, 0));
        assert_eq!((health.frames_lost, health.refused), (0, 0));
    }
}

/// At 2 kHz a counter of 8 bits turns in 128 ms. What is lost of a whole turn must not be joined.
#[test]
fn a_lost_turn_of_the_counter_is_no_splice() {
    let mut arrival = |n| 1000.0 + f64::from(n) * PERIOD;
    let config = StreamConfig { counter_bits: 8, ..CONFIG };
    let lost = |n| (1200..1456).contains(&n);
    let mut sensor =
        Sensor { config, instants: 2604, arrival: &mut arrival, lost: &lost, angles: &each_200 };
    let (records, health) = sensor.records();
    assert_eq!(lengths(&records), [1024, 1024]);
    assert_eq!((health.frames_lost, health.restarts, health.refused), (512, 0, 0));
}

/// Joints that do not move are sent once: their angles hold until one differs.
#[test]
fn angles_that_are_sent_on_change_alone_hold() {
    let mut bench = on_change();
    run_silent(&mut bench, 4500);
    assert_eq!(lengths(&bench.records), [2048, 2048]);
    assert_eq!(bench.stream.missing_joint(), None);
    // The force sensor starts anew; nobody moves.
    bench.counter = 12;
    bench.now += 0.3;
    run_silent(&mut bench, 2400);
    assert_eq!(lengths(&bench.records).last(), Some(&2048));
    assert!(bench.records.iter().all(|record| record.pose.as_slice() == [0.1, -0.7]));
    // One joint moves; of the other nothing is heard.
    let before = bench.records.len();
    bench.pose[1] = 0.3;
    let (now, value) = (bench.now, bench.pose[1]);
    bench.push(now, Reading::Joint { index: 1, value });
    run_silent(&mut bench, 2400);
    let moved = bench.records.split_off(before);
    assert_eq!(moved.last().map(|record| record.pose.to_vec()), Some(vec![0.1, 0.3]));
    assert_eq!(moved.last().map(|record| record.force[0].len()), Some(2048));
    // Another recording: the robot may stand anywhere.
    bench.now += 60.0;
    run_silent(&mut bench, 2400);
    let (records, _) = bench.finish();
    assert_eq!(
        lengths(&records)[before..],
        [256],
        "what was taken before the silence, and no more"
    );
}

/// An angle that is forgotten holds no more until it comes again, however often the stream begins anew.
#[test]
fn forgotten_angles_do_not_come_back() {
    let mut bench = on_change();
    run_silent(&mut bench, 2400);
    bench.end();
    let before = bench.records.len();
    assert_eq!(lengths(&bench.records)[0], 2048);
    // The link is lost, and the robot moves.
    bench.forget_angles();
    bench.end();
    let came = [None, Some((0, 0.5)), Some((1, 0.3))];
    for (reading, missing) in came.into_iter().zip([Some(0), Some(1), None]) {
        if let Some((index, value)) = reading {
            bench.push(bench.now, Reading::Joint { index, value });
        }
        run_silent(&mut bench, 2400);
        assert_eq!(bench.stream.missing_joint(), missing);
        bench.end();
        assert_eq!(bench.stream.missing_joint(), missing);
        assert_eq!(bench.records.len() > before, missing.is_none(), "missing {missing:?}");
    }
    assert!(bench.records[before..].iter().all(|record| record.pose.as_slice() == [0.5, 0.3]));
}

/// After a long silence one joint moves: that shows nothing of the others.
#[test]
fn a_joint_that_moves_brings_no_forgotten_angle_back() {
    let mut bench = on_change();
    run_silent(&mut bench, 100);
    bench.now += 11.0;
    for value in [0.1, 0.2] {
        bench.push(bench.now, Reading::Joint { index: 0, value });
    }
    run_silent(&mut bench, 2400);
    assert_eq!(bench.stream.missing_joint(), Some(1));
    let (records, _) = bench.finish();
    assert!(records.is_empty(), "{:?}", records[0].pose);
}

/// A robot at rest, whose angles have been sent once.
fn on_change() -> Bench {
    let mut bench = Bench::new();
    bench.angles();
    bench.sent = 1;
    bench
}

/// So many instants of a cut, in which no angle comes.
fn run_silent(bench: &mut Bench, instants: usize) {
    for _ in 0..instants {
        bench.instant(true, [false; 2]);
        bench.sent = 1 + bench.sent % 199;
    }
}

/// An angle that used to come ten times a second and does not any more is awaited: the joint may move.
#[test]
fn angles_that_stop_coming_are_awaited() {
    let mut bench = Bench::new();
    bench.run(1001, true);
    for n in 0..6000_u32 {
        bench.sent = 1;
        bench.instant(true, [false; 2]);
        if n.is_multiple_of(200) {
            bench.push(bench.now, Reading::Joint { index: 0, value: 0.1 });
        }
        if !(3990..4010).contains(&n) {
            assert_eq!(bench.stream.missing_joint().is_some(), n > 4000, "{n}");
        }
    }
    assert_eq!(bench.stream.missing_joint(), Some(1));
}
