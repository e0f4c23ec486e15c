//! Readings of a joint and their worth: wrong frames, steps of a signal, the half turn, silence.

use std::f64::consts::PI;

use flexid_core::stream::AngleHealth;

use super::*;

/// A tenth of a degree, rad.
const COARSE: f64 = 1.745e-3;

/// Lengths of the records of a cut in which joint 1 reads `angle` of the number of its frame, their poses and the joint's health.
fn cut(
    signal: AngleSignal,
    instants: usize,
    mut angle: impl FnMut(u32) -> f64,
) -> (Vec<usize>, Vec<f64>, AngleHealth) {
    let mut bench = Bench::new();
    let mut config = CONFIG;
    config.angles[1] = signal;
    bench.stream = Box::new(Stream::new(config).expect("a good configuration"));
    for n in 0..instants {
        bench.pose[1] = angle(bench.sent.div_ceil(200));
        bench.instant(n >= 300, [false; 2]);
    }
    let (records, health) = bench.finish();
    let poses = records.iter().map(|record| record.pose[1]).collect();
    (lengths(&records), poses, health.angles[1])
}

#[test]
fn single_wrong_angles_are_left_out_and_counted() {
    for wrong in [2_147.483_647, 0.0, f64::MAX] {
        let angle = |frame| if frame % 10 == 5 { wrong } else { -0.7 };
        let (lengths, poses, health) = cut(AngleSignal::FINE, 4100, angle);
        assert_eq!((lengths, poses), (vec![2048; 2], vec![-0.7; 2]), "{wrong}");
        assert_eq!((health.wrong, health.wrong_value, health.ended), (2, wrong, 0));
    }
    // Three in a row, 0.3 s long, are a movement, away and back. What comes after each is another stretch.
    let angle = |frame| if (8..11).contains(&frame) { 0.3 } else { -0.7 };
    let (lengths, _, health) = cut(AngleSignal::FINE, 4300, angle);
    assert_eq!(lengths, [1024, 256, 256, 2048]);
    assert_eq!((health.wrong, health.ended), (0, 2));
    assert!((health.ended_by - 1.0).abs() < 1e-12);
}

/// A corner of a path is no wrong angle.
#[test]
fn a_joint_that_feeds_may_turn_back() {
    let angle = |frame: u32| -0.7 - 1e-3 * f64::from(frame.abs_diff(10));
    let (_, _, health) = cut(AngleSignal::FINE, 4100, angle);
    assert_eq!(health.wrong, 0);
}

/// Angles come every millisecond, and rubbish for as long as `frames` of them.
#[test]
fn rubbish_may_last_for_some_frames_of_a_fast_sender() {
    for (frames, records) in [(1, vec![2048]), (200, vec![2048]), (300, vec![512, 512, 256])] {
        let mut bench = Bench::new();
        for n in 0..2048 {
            let is_wrong = (600..600 + 2 * frames).contains(&n);
            let value = if is_wrong { 0.01 * f64::from(n) } else { -0.7 };
            bench.pose[1] = value;
            bench.instant(n >= 300, [false; 2]);
            if n % 2 == 0 {
                bench.push(bench.now, Reading::Joint { index: 1, value });
            }
        }
        let (found, health) = bench.finish();
        assert_eq!(lengths(&found), records, "{frames}");
        let wrong = if frames < 300 { frames as u64 } else { 0 };
        assert!(health.angles[1].wrong >= wrong, "{frames}: {health:?}");
    }
}

#[test]
fn a_joint_that_turns_may_be_at_the_half_turn() {
    let angle = |frame| if frame % 3 == 1 { -PI } else { PI };
    let (lengths, poses, health) = cut(AngleSignal::FINE, 2100, angle);
    assert_eq!((lengths, health.wrong), (vec![2048], 0));
    assert!((poses[0].abs() - PI).abs() < 1e-12, "{}", poses[0]);
    // What slides is metres apart.
    let slides = AngleSignal { turns: false, ..AngleSignal::FINE };
    let (_, _, health) = cut(slides, 2100, |frame| if frame < 5 { -PI } else { PI });
    assert_eq!(health.ended, 1);
}

#[test]
fn a_joint_may_rest_between_two_steps_of_its_signal() {
    let mut random = Random::new(4);
    let mut dithers =
        |share: f64| -0.7 + if random.uniform(0.0, 1.0) < share { COARSE } else { 0.0 };
    // The step is known.
    let signal = AngleSignal { resolution: COARSE, ..AngleSignal::FINE };
    for share in [0.1, 0.5, 0.9] {
        let (lengths, poses, health) = cut(signal, 2100, |_| dithers(share));
        assert_eq!((lengths, health.ended), (vec![2048], 0), "{share}");
        assert!((poses[0] + 0.7 - share * COARSE).abs() < 0.4 * COARSE, "{share}: {}", poses[0]);
    }
    // It shows after a few frames.
    for share in [0.3, 0.5, 0.7] {
        let (lengths, _, health) = cut(AngleSignal::FINE, 10_000, |_| dithers(share));
        let full = lengths.iter().filter(|length| **length == 2048).count();
        assert!(full >= 3, "{share}: {lengths:?}");
        assert!((health.step / COARSE - 1.0).abs() < 1e-6, "{health:?}");
    }
}

/// A joint that rests stays within 0.0005 rad of its first reading or, where steps are larger, reads two neighbouring values. A movement after
/// 1800 to 2000 samples ends a record that would have 2048.
#[test]
fn a_third_value_is_a_movement() {
    for (resolution, step, below) in [(0.0, 4e-4, -2.0), (COARSE, COARSE, -1.0), (0.02, 0.02, -1.0)]
    {
        let signal = AngleSignal { resolution, ..AngleSignal::FINE };
        for place in [below, 2.0] {
            let angle = |frame: u32| match frame {
                ..10 => -0.7 + step * f64::from(frame % 2),
                _ => -0.7 + step * place,
            };
            let (lengths, _, health) = cut(signal, 4000, angle);
            assert_eq!((lengths[0], health.wrong), (1024, 0), "{step} {place}");
        }
    }
}

/// Neither a movement there and back nor a signal of fine steps has steps. A feed ends no cut early, but a leap does.
#[test]
fn a_movement_is_no_step() {
    type Angle = fn(u32) -> f64;
    let angles: [(Angle, bool); 4] = [
        (|frame| -0.7 + 0.001 * f64::from(frame % 2 + 2 * (frame / 8)), false),
        (|frame| -0.7 + 0.1 * f64::from(frame / 4 % 2), true),
        (|frame| -0.7 + 0.0015 * f64::from(frame / 5 % 2), false),
        (|frame| -0.7 + 1e-6 * f64::from(frame % 2) + 0.001 * f64::from(frame / 4 % 2), false),
    ];
    for (angle, leaps) in angles {
        let (_, _, health) = cut(AngleSignal::FINE, 10_000, angle);
        assert!(health.step == 0.0 || (health.step - 0.001).abs() < 1e-9, "{health:?}");
        assert_eq!(health.ended > 0, leaps, "{health:?}");
    }
}

/// The sensors go on, and so do their counters. The robot moves between the cuts, which nobody hears of.
#[test]
fn a_cut_has_no_pose_that_is_older_than_it() {
    let mut bench = Bench::new();
    bench.run(300, false);
    bench.run(1748, true);
    for _ in 0..3 {
        // The log is made while something is cut.
        bench.now += 2000.0 * PERIOD;
        bench.counter += 2000;
        (0..2048).for_each(|n| {
            bench.sent = bench.sent % 199 + 1;
            bench.instant(n >= 300, [false; 2]);
        });
    }
    let missing = bench.stream.missing_joint();
    let (records, health) = bench.finish();
    assert_eq!((lengths(&records), missing), (vec![2048], Some(0)));
    assert_eq!(health.restarts, 0);
}

/// A cut that begins soon after the robot has come to rest keeps the rest since its first angle there.
#[test]
fn the_samples_since_the_first_angle_of_a_pose_belong_to_it() {
    let mut bench = Bench::new();
    bench.run(600, false);
    // It moves for half a second, and rests for a quarter of a second.
    for n in 0..1000 {
        bench.pose = [0.1 + 1e-3 * f64::from(n), -0.7];
        bench.run(1, false);
    }
    let arrived_s = bench.now;
    bench.run(500, false);
    bench.run(1800, true);
    let (records, health) = bench.finish();
    assert_eq!((lengths(&records), health.without_pose), (vec![2048], 0));
    let early_s = arrived_s - records[0].start_s;
    assert!(early_s.abs() < 1.5 * PERIOD, "{early_s} s");
    assert!((records[0].pose[0] - 1.099).abs() < 1e-12);
}

/// The last digit of the angle differs from frame to frame. Then the frames stop.
#[test]
fn an_angle_whose_last_digit_differs_is_missed_when_it_stops() {
    let mut bench = Bench::new();
    for n in 0..6000 {
        let digits = f64::from(bench.random.uniform(0.0, 9.0) as u32);
        bench.pose = [0.1 + 1e-6 * digits, -0.7 - 1e-6 * digits];
        bench.instant(n >= 300, [false; 2]);
    }
    assert_eq!(bench.stream.missing_joint(), None);
    for _ in 0..5000 {
        bench.sent = bench.sent % 199 + 1;
        bench.instant(true, [false; 2]);
    }
    assert_eq!(bench.stream.missing_joint(), Some(0));
    let (records, health) = bench.finish();
    let samples: usize = lengths(&records).iter().sum();
    // 5,800 samples until the last angle, in pieces whose lengths are powers of two.
    assert!((5500..6300).contains(&samples) && health.without_pose > 0, "{samples} {health:?}");
}
