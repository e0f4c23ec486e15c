//! Movements between cuts: no record has a joint in motion, and none loses the rest that follows.

use super::*;

/// Joint angles at 100 Hz. Joint 0 moves by 0.02 rad and stops first, joint 1 moves by half a radian.
#[test]
fn a_pose_begins_when_the_last_joint_has_stopped() {
    for [first_s, last_s] in [[0.05, 0.2], [0.2, 0.05], [0.1, 0.1]] {
        let mut bench = Bench::new();
        bench.run(300, false);
        bench.run(1000, true);
        let began_s = bench.now;
        for n in 0..4000 {
            let passed_s = f64::from(n) * PERIOD;
            let part = |stops_s: f64| (passed_s / stops_s).min(1.0);
            bench.pose = [0.1 + 0.02 * part(first_s), -0.7 + 0.5 * part(last_s)];
            if n % 20 == 0 {
                bench.angles();
            }
            bench.instant(true, [false; 2]);
        }
        let (records, health) = bench.finish();
        let stopped_s = began_s + first_s.max(last_s);
        let (before, after): (Vec<_>, Vec<_>) =
            records.iter().partition(|record| record.pose[1] < -0.65);
        assert_eq!(before.iter().map(|record| record.force[0].len()).sum::<usize>(), 1280);
        assert!(before.iter().all(|record| record.pose.as_slice() == [0.1, -0.7]));
        assert_eq!(after[0].force[0].len(), 2048);
        for record in &after {
            let pose = &record.pose;
            assert!((pose[0] - 0.12).abs() < 1e-3 && (pose[1] + 0.2).abs() < 1e-3, "{pose:?}");
        }
        // Up to four instants wait for their frames.
        let late_s = after[0].start_s - stopped_s;
        assert!((-5.0 * PERIOD..0.01).contains(&late_s), "{first_s} {last_s}: {late_s} s");
        assert_eq!(health.without_pose, 0);
        assert_eq!(health.angles.iter().map(|angle| angle.ended).sum::<u64>(), 1);
    }
}

/// A wrong frame of one joint comes while another one stops.
#[test]
fn a_wrong_frame_is_left_out_while_another_joint_moves() {
    let mut bench = Bench::new();
    bench.run(300, false);
    bench.run(1000, true);
    for n in 0..3000 {
        // The other joint has moved for a quarter of a second between this frame and the next.
        bench.pose = [0.2, if (480..510).contains(&n) { 214.7 } else { -0.7 }];
        if n % 30 == 0 {
            bench.angles();
        }
        // No angle but these.
        bench.sent = bench.sent % 199 + 1;
        bench.instant(true, [false; 2]);
    }
    let (records, health) = bench.finish();
    assert!(records.iter().all(|record| record.pose[1] == -0.7));
    assert_eq!(lengths(&records)[lengths(&records).len() - 2..], [2048, 256]);
    assert_eq!((health.angles[0].ended, health.angles[1].ended, health.angles[1].wrong), (1, 0, 1));
}

/// A cut that has given full records has lost none when it ends.
#[test]
fn a_full_record_is_no_cut_that_ended_early() {
    let mut bench = Bench::new();
    bench.run(300, false);
    bench.run(3000, true);
    bench.pose[1] = 0.4;
    bench.run(1000, true);
    bench.pose[1] = 0.6;
    bench.run(1000, true);
    let (records, health) = bench.finish();
    assert_eq!(lengths(&records)[0], 2048);
    assert_eq!((health.angles[1].ended, health.without_pose), (1, 0));
    assert!((health.angles[1].ended_by - 0.2).abs() < 1e-12);
}

/// Angles that stop are no movement.
#[test]
fn a_cut_whose_angles_stop_is_without_a_pose() {
    let mut bench = Bench::new();
    bench.run(1001, true);
    for _ in 0..1500 {
        bench.sent = bench.sent % 199 + 1;
        bench.instant(true, [false; 2]);
    }
    let (_, health) = bench.finish();
    assert_eq!((health.without_pose, health.angles[1].ended), (1, 0));
}
