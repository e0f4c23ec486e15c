//! A robot that feeds while it mills: its records say where it was, part by part, and none holds a leap.

use flexid_core::stream::Stage;

use super::*;

/// Instants from one angle to the next: angles come at 100 Hz.
const EVERY: u32 = 20;
/// Rate of a slow feed, rad/s.
const SLOW: f64 = 0.02;

/// Sender of the angles.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sends {
    /// Each angle at 100 Hz.
    Cyclic,
    /// An angle that has changed, at 100 Hz at most.
    OnChange,
}

const SENDERS: [Sends; 2] = [Sends::Cyclic, Sends::OnChange];

/// A robot whose pose is a function of the time since its start.
struct Feeding<P> {
    bench: Bench,
    sends: Sends,
    /// Pose at a time, s, since the start.
    pose: P,
    /// Number of instants so far, and from one angle to the next.
    instants: u32,
    every: u32,
    sent: [Option<f64>; 2],
}

impl<P: Fn(f64) -> [f64; 2]> Feeding<P> {
    fn new(config: StreamConfig, sends: Sends, pose: P) -> Self {
        let mut bench = Bench::new();
        bench.stream = Box::new(Stream::new(config).expect("a good configuration"));
        Self { bench, sends, pose, instants: 0, every: EVERY, sent: [None; 2] }
    }

    fn run(&mut self, instants: u32, cutting: bool) {
        self.run_with(instants, cutting, [false; 2]);
    }

    fn run_with(&mut self, instants: u32, cutting: bool, lost: [bool; 2]) {
        for _ in 0..instants {
            // The bench sends no angle by itself.
            self.bench.sent = self.bench.sent % 199 + 1;
            let pose = (self.pose)(f64::from(self.instants) * PERIOD);
            if self.instants.is_multiple_of(self.every) {
                for (index, (value, sent)) in (0..).zip(pose.iter().zip(&mut self.sent)) {
                    if self.sends == Sends::Cyclic || *sent != Some(*value) {
                        *sent = Some(*value);
                        self.bench.push(self.bench.now, Reading::Joint { index, value: *value });
                    }
                }
            }
            self.bench.instant(cutting, lost);
            self.instants += 1;
        }
    }

    fn finish(self) -> (Vec<Record<CAPACITY>>, StreamHealth) {
        self.bench.finish()
    }
}

/// Time from the start of a run to that of a record, s.
fn start(record: &Record<CAPACITY>) -> f64 {
    record.start_s - 1000.0
}

/// Time from the start of a run to the end of a record, s.
fn end(record: &Record<CAPACITY>) -> f64 {
    start(record) + record.force[0].len() as f64 * PERIOD
}

/// Times in the middles of the parts of a record, s, each with the stage there.
fn middles(record: &Record<CAPACITY>) -> impl Iterator<Item = (f64, &Stage)> {
    let (parts, length) = (record.path.len() as f64, end(record) - start(record));
    let middle = move |part: usize| start(record) + (part as f64 + 0.5) / parts * length;
    record.path.iter().enumerate().map(move |(part, stage)| (middle(part), stage))
}

/// Joint 1 turns evenly from the start on.
fn evenly(rate: f64) -> impl Fn(f64) -> [f64; 2] {
    move |time| [0.1, -0.7 + rate * time]
}

/// Joint 1 stands, turns evenly between two times, s, and stands again.
fn between(from: f64, to: f64, rate: f64) -> impl Fn(f64) -> [f64; 2] {
    move |time| [0.1, -0.7 + rate * (time.clamp(from, to) - from)]
}

/// Asserts that the even stages of a record are where the robot is in the middle of their parts, to this angle.
fn assert_true(record: &Record<CAPACITY>, pose: impl Fn(f64) -> [f64; 2], within: f64, what: &str) {
    for (time, stage) in middles(record).filter(|(_, stage)| stage.is_even) {
        let pose = pose(time);
        let off = [0, 1].map(|joint| (stage.pose[joint] - pose[joint]).abs());
        assert!(off.iter().all(|off| *off < within), "{what}, at {time:.3} s: {off:?}");
    }
}

fn evenness(record: &Record<CAPACITY>) -> Vec<bool> {
    record.path.iter().map(|stage| stage.is_even).collect()
}

#[test]
fn the_parts_of_an_even_feed_have_the_poses_of_their_middles() {
    for (sends, rate) in
        [Sends::Cyclic, Sends::OnChange].into_iter().flat_map(|s| [(s, SLOW), (s, 0.1)])
    {
        let mut robot = Feeding::new(CONFIG, sends, evenly(rate));
        robot.run(300, false);
        robot.run(9000, true);
        let (records, health) = robot.finish();
        let what = format!("{sends:?}, {rate} rad/s");
        assert_eq!(lengths(&records)[..4], [2048; 4], "{what}");
        // The shortest record along a path has 1024 samples.
        assert!(health.samples_discarded < 1024 + 128, "{what}: {}", health.samples_discarded);
        for record in &records {
            assert_eq!(record.path.len(), record.force[0].len() / 256, "{what}");
            assert_true(record, evenly(rate), 1e-5, &what);
            let moves = rate * 256.0 * PERIOD;
            assert!(record.path.iter().all(|stage| (stage.moves - moves).abs() < 1e-5), "{what}");
        }
        // No angle shows how the robot moved before the first part, and perhaps none after the last.
        let even: Vec<bool> = records.iter().flat_map(evenness).collect();
        let known = &even[1..even.len() - 1];
        assert!(!even[0] && known.iter().all(|even| *even), "{what}");
    }
}

/// The feed begins 0.1 s before the cut, which is 312 to 376 samples after the start of the record. Its ramp ends in the part beside that.
#[test]
fn a_feed_that_begins_before_the_cut_keeps_the_rest_before_it() {
    for sends in SENDERS {
        let pose = between(1.4, 9.0, SLOW);
        let mut robot = Feeding::new(CONFIG, sends, &pose);
        robot.run(3000, false);
        robot.run(4600, true);
        let (records, _) = robot.finish();
        let (first, before_cut) = (&records[0], 1.5 - start(&records[0]));
        assert!((0.24..=0.3).contains(&before_cut), "{sends:?}: {before_cut} s");
        assert!(first.starts_at_rest && first.force[0].len() == 2048, "{sends:?}");
        let expected = [false, false, false, true, true, true, true, true];
        assert_eq!(evenness(first), expected, "{sends:?}");
        // A sender on change says nothing until the robot has moved for one cycle.
        records.iter().for_each(|record| assert_true(record, &pose, 1e-5, &format!("{sends:?}")));
        assert!(evenness(&records[1]).iter().all(|even| *even), "{sends:?}");
    }
}

/// The feed changes within a part at the end of a record, or at the start of the next one.
#[test]
fn a_ramp_ends_in_the_part_beside_it_in_another_record() {
    for sends in SENDERS {
        let records = |change: f64| {
            let pose = move |time: f64| {
                evenly(SLOW)(time).map(|angle| angle + SLOW * (time - change).max(0.0))
            };
            let mut robot = Feeding::new(CONFIG, sends, pose);
            robot.run(300, false);
            robot.run(9000, true);
            robot.finish().0
        };
        let border = end(&records(f64::INFINITY)[1]);
        for (change, uneven) in [(border - 0.05, [2, 1]), (border + 0.05, [1, 2])] {
            let records = records(change);
            let [before, after] = [1, 2].map(|record| evenness(&records[record]));
            let last = before.iter().rev().take_while(|even| !**even).count();
            let first = after.iter().take_while(|even| !**even).count();
            assert_eq!([last, first], uneven, "{sends:?}, {change} s");
        }
    }
}

/// A robot that feeds leaps by half a radian in 0.2 s. Up to 0.03 rad, 12 ms of the leap, look like a feed.
#[test]
fn no_record_holds_a_leap() {
    for (sends, from) in
        SENDERS.into_iter().flat_map(|s| [2.0, 2.05, 2.1, 2.2, 2.3].map(|t| (s, t)))
    {
        let leap = move |time: f64| 2.5 * (time.clamp(from, from + 0.2) - from);
        let pose = move |time: f64| [0.1, evenly(SLOW)(time)[1] + leap(time)];
        let mut robot = Feeding::new(CONFIG, sends, pose);
        robot.run(300, false);
        robot.run(9000, true);
        let (records, _) = robot.finish();
        let what = format!("{sends:?}, {from} s");
        let (before, after): (Vec<_>, Vec<_>) =
            records.iter().partition(|record| start(record) < from);
        assert!(before.iter().all(|record| end(record) < from + 0.015), "{what}");
        assert!(after.iter().all(|record| start(record) > from + 0.185), "{what}");
        assert!(
            !before.is_empty() && lengths(&records).iter().filter(|n| **n == 2048).count() >= 2
        );
        records.iter().for_each(|record| assert_true(record, pose, 1e-5, &what));
    }
}

/// A joint that comes to rest reads up to 0.0005 rad less for some time, which counts as the same pose.
#[test]
fn a_robot_that_comes_to_rest_has_standing_records_again() {
    for sends in SENDERS {
        let pose = between(0.0, 3.0, SLOW);
        let mut robot = Feeding::new(CONFIG, sends, &pose);
        robot.run(300, false);
        robot.run(10_000, true);
        let (records, _) = robot.finish();
        let (fed, stood): (Vec<_>, Vec<_>) =
            records.iter().partition(|record| !record.path.is_empty());
        // A record that is full before the rest has been noticed holds the end of the feed.
        assert!(fed.iter().all(|record| start(record) < 3.0), "{sends:?}");
        assert!(stood.iter().all(|record| start(record) >= 2.999), "{sends:?}");
        let full =
            |all: &[&Record<CAPACITY>]| all.iter().filter(|r| r.force[0].len() == 2048).count();
        assert!(full(&fed) >= 2 && full(&stood) >= 1, "{sends:?}: {:?}", lengths(&records));
        for record in stood {
            let off = (record.pose[1] - pose(4.0)[1]).abs();
            assert!(off < 5e-4 && record.since_s == 0.0, "{sends:?}: {off}");
        }
        fed.iter().for_each(|record| assert_true(record, &pose, 1e-5, &format!("{sends:?}")));
    }
}

/// No sensor measures what starts and stops a robot. Ten angles come a second, so that a joint which starts or stops is at first read as if it stood.
#[test]
fn no_even_part_and_no_standing_record_holds_a_start_or_a_stop() {
    for rate in [0.002, SLOW] {
        for (from, to) in [0.03, 0.05, 0.071, 0.1].map(|late| (2.0 + late, 5.0 + late)) {
            let mut robot = Feeding::new(CONFIG, Sends::Cyclic, between(from, to, rate));
            robot.every = 200;
            robot.run(300, false);
            robot.run(17_000, true);
            let (records, _) = robot.finish();
            let (what, mut stood) = (format!("{rate} rad/s from {from} s"), [0; 2]);
            for record in &records {
                let half = 0.5 * (end(record) - start(record)) / record.path.len().max(1) as f64;
                let whole = 0.5 * (start(record) + end(record));
                let even = middles(record).filter(|(_, stage)| stage.is_even).map(|own| own.0);
                let times: Vec<f64> =
                    if record.path.is_empty() { vec![whole] } else { even.collect() };
                for middle in times {
                    let holds = |time: f64| (time - middle).abs() < half - PERIOD;
                    assert!(!holds(from) && !holds(to), "{what}: {middle} ± {half} s");
                }
                if record.path.is_empty() {
                    stood[usize::from(start(record) > to - PERIOD)] += record.force[0].len();
                }
            }
            assert!(stood[0] >= 2048 && stood[1] >= 4096, "{what}: {stood:?}");
        }
    }
}

#[test]
fn the_time_along_a_path_goes_on_until_a_gap() {
    for sends in SENDERS {
        let mut robot = Feeding::new(CONFIG, sends, evenly(SLOW));
        robot.run(300, false);
        robot.run(6000, true);
        let gap_s = f64::from(robot.instants) * PERIOD;
        robot.run_with(3, true, [true; 2]);
        robot.run(6000, true);
        let (records, _) = robot.finish();
        let (before, after): (Vec<_>, Vec<_>) =
            records.iter().partition(|record| start(record) < gap_s);
        for records in [before, after] {
            let mut since_s = 0.0;
            assert!(records.len() >= 3, "{sends:?}");
            for record in records {
                assert!((record.since_s - since_s).abs() < 1e-9, "{sends:?}: {}", record.since_s);
                since_s += record.force[0].len() as f64 * PERIOD;
            }
        }
    }
}

/// Records of 4096 samples are 2.048 s long. A joint moves by 0.2 rad until its movement is seen, at the next of blocks of 64 samples
/// and readings of 20 samples: 0.009 rad later.
#[test]
fn a_record_ends_before_a_joint_has_moved_far() {
    let config = StreamConfig { record_samples: CAPACITY, ..CONFIG };
    for (rate, samples) in [(0.09, 4096), (0.15, 2048), (0.19, 2048), (0.22, 1024)] {
        for sends in SENDERS {
            let mut robot = Feeding::new(config, sends, evenly(rate));
            robot.run(300, false);
            robot.run(12_000, true);
            let (records, _) = robot.finish();
            let most = lengths(&records).into_iter().max();
            assert_eq!(most, Some(samples), "{sends:?}, {rate} rad/s");
            assert!(rate * samples as f64 * PERIOD < 0.21);
        }
    }
}

/// The samples that come while a full stretch waits for an angle are lost. What follows is another stretch, not shifted by these.
#[test]
fn a_record_along_a_path_may_be_as_long_as_the_capacity() {
    let config = StreamConfig { record_samples: CAPACITY, ..CONFIG };
    for sends in SENDERS {
        let mut robot = Feeding::new(config, sends, evenly(0.05));
        robot.run(300, false);
        robot.run(16_000, true);
        let (records, health) = robot.finish();
        assert_eq!(lengths(&records)[..3], [CAPACITY; 3], "{sends:?}");
        records.iter().for_each(|r| assert_true(r, evenly(0.05), 1e-5, &format!("{sends:?}")));
        let kept = lengths(&records).iter().sum::<usize>() as u64;
        assert_eq!(kept + health.samples_discarded, 16_300, "{sends:?}");
    }
}

/// Angles come every half second, of a sender that has shown its cycle at rest. From one to the next a joint moves by 0.1 rad, or by 0.02.
#[test]
fn a_path_of_which_too_little_is_known_has_no_records() {
    for (rate, is_known) in [(0.2, false), (0.04, true)] {
        let mut robot = Feeding::new(CONFIG, Sends::Cyclic, between(6.0, 20.0, rate));
        robot.every = 1000;
        robot.run(12_000, false);
        robot.run(12_000, true);
        let (records, _) = robot.finish();
        let along = records.iter().filter(|record| end(record) > 6.05).count();
        assert_eq!(along > 0, is_known, "{rate} rad/s: {along} records");
    }
}
