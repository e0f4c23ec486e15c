//! Senders of joint angles: slow ones, those that send on change, and those whose silence proves nothing.

use super::*;

/// Feeds a cut of so many instants, in which joint 1 sends `angle` of the number of the instant, where there is one, and joint 0 with it.
fn cut(bench: &mut Bench, instants: u32, mut angle: impl FnMut(u32) -> Option<f64>) {
    for n in 0..instants {
        // No angle but these.
        bench.sent = bench.sent % 199 + 1;
        if let Some(value) = angle(n) {
            bench.pose[1] = value;
            bench.angles();
        }
        bench.instant(true, [false; 2]);
    }
}

#[test]
fn a_wrong_frame_of_a_slow_sender_is_left_out() {
    for every in [500, 1000, 2000] {
        for wrong in [2, 6] {
            let mut bench = Bench::new();
            cut(&mut bench, 10 * every, |n| {
                let value = if n / every == wrong { 2_147.483_647 } else { -0.7 };
                (n % every == 0).then_some(value)
            });
            let (records, health) = bench.finish();
            let health = health.angles[1];
            assert_eq!((health.wrong, health.ended), (1, 0), "every {every}, {wrong}");
            assert!(records.iter().all(|record| record.pose[1] == -0.7));
            let samples: usize = lengths(&records).iter().sum();
            assert!(samples >= 7 * every as usize, "every {every}: {:?}", lengths(&records));
        }
    }
}

/// Changes are looked for every 10 ms. The encoder stands between two counts, and then on one of them.
#[test]
fn an_angle_that_flickers_and_comes_to_rest_holds() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let mut bench = Bench::new();
        let (mut last, mut joint_0_has_come) = (0.0, false);
        for n in 0..20_000 {
            bench.sent = bench.sent % 199 + 1;
            if !joint_0_has_come {
                bench.push(bench.now, Reading::Joint { index: 0, value: 0.1 });
                joint_0_has_come = true;
            }
            if n < 5000 && n % 20 == 0 {
                let value = -0.7 + if random.uniform(0.0, 1.0) < 0.5 { 1e-5 } else { 0.0 };
                if value != last {
                    bench.push(bench.now, Reading::Joint { index: 1, value });
                    last = value;
                }
            }
            bench.instant(n >= 300, [false; 2]);
        }
        assert_eq!(bench.stream.missing_joint(), None, "{seed}");
        let (records, health) = bench.finish();
        assert!(lengths(&records).len() >= 9, "{seed}: {:?}", lengths(&records));
        assert_eq!(lengths(&records)[..9], [2048; 9], "{seed}");
        assert_eq!(health.without_pose, 0, "{seed}");
    }
}

/// It repeats its first angle four times, as at a start, and sends on change from then on.
#[test]
fn a_sender_whose_angle_changes_after_a_silence_sends_on_change() {
    let mut bench = Bench::new();
    cut(&mut bench, 8000, |n| (n < 1000 && n % 200 == 0).then_some(-0.7));
    assert_eq!(bench.stream.missing_joint(), Some(0));
    let silent = lengths(&bench.records).iter().sum::<usize>();
    let began_s = bench.now;
    for n in 0..10_000 {
        if n == 0 {
            bench.pose = [0.2, 0.5];
            bench.angles();
        }
        bench.sent = bench.sent % 199 + 1;
        bench.instant(true, [false; 2]);
    }
    assert_eq!(bench.stream.missing_joint(), None);
    let (records, _) = bench.finish();
    // The joint may have moved at any time of its silence, up to the new angle.
    let (before, after): (Vec<_>, Vec<_>) =
        records.iter().partition(|record| record.pose[1] == -0.7);
    assert!(before.iter().map(|record| record.force[0].len()).sum::<usize>() <= silent);
    assert!(silent <= 1500, "{silent}");
    assert!(after.iter().all(|record| record.pose.as_slice() == [0.2, 0.5]));
    assert!(after.iter().all(|record| record.start_s > began_s - 5.0 * PERIOD));
    assert_eq!(lengths(&records).iter().filter(|length| **length == 2048).count(), 4);
}

/// Angles in steps of a tenth of a degree, in radians with four decimals or as numbers of 32 bits. Two steps are not equally long.
#[test]
fn steps_differ_by_their_rounding() {
    let decimals = |angle: f64| (1e4 * angle).round() / 1e4;
    let short = |angle: f64| f64::from(angle as f32);
    for round in [decimals, short] {
        for places in [[0, 1], [1, 0], [1790, 1791]] {
            let mut random = Random::new(7);
            let mut bench = Bench::new();
            cut(&mut bench, 16_000, |n| {
                let place = places[n as usize / 8000];
                let step = place + i32::from(random.uniform(0.0, 1.0) < 0.5);
                (n % 200 == 0).then(|| round(f64::from(step) * 0.1_f64.to_radians()))
            });
            let (records, health) = bench.finish();
            let full = lengths(&records).iter().filter(|length| **length == 2048).count();
            assert!(full >= 5, "{places:?}: {:?}", lengths(&records));
            let step = health.angles[1].step;
            assert!((step / 0.1_f64.to_radians() - 1.0).abs() < 0.04, "{step}");
        }
    }
}

/// An angle that comes before the cut, and the next when the robot has moved, are no cycle: the new pose holds after a quarter of a second.
#[test]
fn the_first_interval_of_a_sender_on_change_is_no_cycle() {
    let mut bench = Bench::new();
    cut(&mut bench, 6000, |n| match n {
        0 => Some(-0.2),
        3000 => Some(-0.7),
        _ => None,
    });
    let (records, _) = bench.finish();
    let is_full = |record: &&Record<CAPACITY>| record.force[0].len() == 2048;
    assert!(
        records.iter().filter(is_full).any(|record| record.pose[1] == -0.7),
        "{:?}",
        lengths(&records)
    );
}
