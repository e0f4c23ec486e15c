//! Recordings in any order: a clock that goes back, and whether the same sequence goes on.

use flexid_core::stream::{Reading, Record, StreamHealth};

use super::{Bench, CAPACITY, PERIOD, lengths};

/// Three recordings, the newest first, as `tests/recordings/nominal` in descending order: when they begin, s, and the counter
/// with which they do. Each counter lies less than half a turn ahead of where the one before it ended.
const DESCENDING: [(f64, u32); 3] = [(1200.0, 0xb08c), (1100.0, 0x141c), (1000.0, 0x89d2)];

/// Feeds them, each at its pose; before the angles of one come, so many of its instants do. `angles` says which
/// recordings have any.
fn descending(
    poses: [f64; 3],
    angles: [bool; 3],
    before_angles: usize,
) -> (Vec<Record<CAPACITY>>, StreamHealth) {
    let mut bench = Bench::new();
    for (((now, counter), pose), angles) in DESCENDING.into_iter().zip(poses).zip(angles) {
        (bench.now, bench.counter, bench.pose[1]) = (now, counter, pose);
        for n in 0..2348 {
            if angles && n == before_angles {
                bench.angles();
            }
            // Never a multiple of 200: no angle but these.
            bench.sent = 1 + bench.sent % 199;
            bench.instant(n >= 300, [false; 2]);
        }
    }
    bench.finish()
}

fn poses(records: &[Record<CAPACITY>]) -> Vec<f64> {
    records.iter().filter(|r| r.force[0].len() == 2048).map(|r| r.pose[1]).collect()
}

#[test]
fn recordings_in_descending_order_lose_nothing() {
    for before_angles in [0, 1, 40] {
        let wanted = [-0.7, 0.4, 1.0];
        let (records, health) = descending(wanted, [true; 3], before_angles);
        assert_eq!((health.frames_lost, health.restarts), (0, 2), "{before_angles}");
        assert_eq!((health.repeated, health.refused), (0, 0), "{before_angles}");
        assert_eq!(health.frames, 3 * 2 * 2348, "{before_angles}");
        assert_eq!(poses(&records), wanted, "{before_angles}");
    }
}

/// The angles of another recording do not hold: without its own there is no record of it.
#[test]
fn angles_do_not_outlive_a_clock_that_goes_back_and_a_restart() {
    let (records, health) = descending([-0.7, 0.4, 1.0], [true, false, true], 0);
    assert_eq!((health.frames_lost, health.restarts), (0, 2));
    assert_eq!(poses(&records), [-0.7, 1.0]);
    assert!(records.iter().all(|record| record.start_s < 1100.0 || record.start_s >= 1200.0));
    // At the same pose as well: nobody knows.
    let (records, _) = descending([-0.7; 3], [true, false, false], 0);
    assert_eq!(poses(&records), [-0.7]);
    assert!(records.iter().all(|record| record.start_s >= 1200.0));
}

/// The clock is set back on a running robot: it is the same sequence up to two instants that are lost, and its angles hold.
#[test]
fn a_clock_that_is_set_back_keeps_the_angles_of_the_same_sequence() {
    for lost in [0, 1, 2] {
        let mut bench = Bench::new();
        bench.angles();
        for n in 0..3000 {
            bench.sent = 1 + bench.sent % 199;
            if n == 1200 {
                bench.now -= 3600.0 - f64::from(lost) * PERIOD;
                bench.counter += lost;
            }
            bench.instant(n >= 300, [false; 2]);
        }
        // Later the sensor starts anew, on a clock that goes on: the robot has not moved.
        bench.counter = bench.counter.wrapping_add(20_000);
        for _ in 0..2400 {
            bench.sent = 1 + bench.sent % 199;
            bench.instant(true, [false; 2]);
        }
        let (records, health) = bench.finish();
        assert_eq!((health.frames_lost, health.restarts), (2 * u64::from(lost), 1), "{lost}");
        assert_eq!(lengths(&records).iter().filter(|length| **length == 2048).count(), 2, "{lost}");
    }
}

/// A frame of another time alone is refused, and a restart later on does not forget for its sake.
#[test]
fn a_lone_frame_of_another_time_leaves_no_trace() {
    let mut bench = Bench::new();
    bench.angles();
    for n in 0..4800 {
        bench.sent = 1 + bench.sent % 199;
        if n == 1000 {
            let value = [0.0; 3];
            bench.push(bench.now - 5.0, Reading::Force { counter: 20_000, value });
        }
        if n == 2400 {
            bench.counter = bench.counter.wrapping_add(20_000);
        }
        bench.instant(n >= 300, [false; 2]);
    }
    let (records, health) = bench.finish();
    assert_eq!((health.refused, health.restarts), (1, 1));
    assert_eq!(lengths(&records).iter().filter(|length| **length == 2048).count(), 2);
}

/// The counters go on: the clock of the recording was set forward, or the sensors paused.
#[test]
fn a_clock_that_is_set_forward_is_a_pause() {
    for jump_s in [1.0, 11.0, 3600.0] {
        for angles_come_first in [false, true] {
            let mut bench = Bench::new();
            bench.run(1001, true);
            bench.now += jump_s;
            if angles_come_first {
                bench.angles();
            }
            bench.run(1000, true);
            let (_, health) = bench.finish();
            assert_eq!((health.restarts, health.pauses, health.frames_lost), (1, 1, 0), "{jump_s}");
        }
        // It starts anew.
        let mut bench = Bench::new();
        bench.run(1001, true);
        (bench.now, bench.counter) = (bench.now + jump_s, 7);
        bench.run(1000, true);
        let (_, health) = bench.finish();
        assert_eq!((health.restarts, health.pauses), (1, 0), "{jump_s}");
    }
}

/// A recording that was held up misses what the sensors sent meanwhile.
#[test]
fn frames_of_a_silence_are_not_those_that_a_bus_loses() {
    for (lost, unheard) in [(100, 0), (4000, 8000)] {
        let mut bench = Bench::new();
        bench.run(1000, true);
        (bench.now, bench.counter) = (bench.now + f64::from(lost) * PERIOD, bench.counter + lost);
        bench.run(1000, true);
        let (_, health) = bench.finish();
        assert_eq!((health.frames_lost, health.restarts), (2 * u64::from(lost), 0));
        assert_eq!(health.frames_unheard, unheard);
    }
}
