use std::path::Path as File;

use flexid_core::chain::Chain;
use flexid_pipeline::model::Model;
use nalgebra::{Isometry3, Vector3};

use super::guide::{Guide, Mount};
use super::{Course, Path, REST_S};
use crate::reference::mill3;

/// A corner and a line back through space.
fn path() -> Path {
    let points = [[60.0, 0.0, 0.0], [60.0, 30.0, -20.0], [0.0, 5.0, 10.0]];
    let points = points.map(|mm| 1e-3 * Vector3::from(mm)).to_vec();
    Path { points, feed: 0.02, acceleration: 0.2 }
}

fn mill6() -> Chain {
    let folder = File::new(env!("CARGO_MANIFEST_DIR")).join("../scenario");
    Model::load(&folder.join("mill6-model.toml")).unwrap().chain().unwrap()
}

const POSE3: [f64; 3] = [0.2, -0.45, 0.95];
const POSE6: [f64; 6] = [0.1, -0.5, 0.6, 0.3, 0.8, 0.2];

fn course(chain: &Chain, pose: &[f64]) -> Course {
    Course::new(&path(), chain, pose, &vec![("q", [-9.0, 9.0]); pose.len()]).unwrap()
}

fn tool(chain: &Chain, course: &Course, time: f64) -> Isometry3<f64> {
    chain.tool(&course.at(time).map(|[angle, ..]| angle)[..chain.driven()])
}

/// Three joints follow the positions of the path alone, six keep the orientation as well.
#[test]
fn the_tool_follows_the_path() {
    for (chain, pose) in [(mill3().1, &POSE3[..]), (mill6(), &POSE6[..])] {
        let course = course(&chain, pose);
        let start = chain.tool(pose);
        let way = |time| {
            let tool = tool(&chain, &course, time);
            (tool.translation.vector - start.translation.vector, tool.rotation)
        };
        let corners: Vec<_> =
            std::iter::once(Vector3::zeros()).chain(path().points.iter().copied()).collect();
        for n in 0..=500 {
            let (place, rotation) = way(course.ends_s() * f64::from(n) / 500.0);
            let apart = |ends: &[Vector3<f64>]| {
                let along = ends[1] - ends[0];
                let share = ((place - ends[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (place - ends[0] - share * along).norm()
            };
            let apart = corners.windows(2).map(apart).fold(f64::MAX, f64::min);
            assert!(apart < 1e-12, "{apart:e} m beside the path");
            if pose.len() == 6 {
                assert!(rotation.angle_to(&start.rotation) < 1e-10);
            }
        }
        let (end, _) = way(course.ends_s() + 1.0);
        assert!((end - corners[3]).norm() < 1e-12, "{end}");
        assert_eq!(way(0.9 * REST_S).0.norm(), 0.0, "it rests at first");
        assert!((way(course.ends_s()).0 - corners[3]).norm() < 1e-12, "it stays at the end");
    }
}

#[test]
fn rates_and_accelerations_are_slopes() {
    let chain = mill6();
    let course = course(&chain, &POSE6);
    const H: f64 = 1e-5;
    for n in 0..400 {
        let time = 0.9 + (course.ends_s() - 0.8) * f64::from(n) / 400.0;
        let [back, now, ahead] = [time - H, time, time + H].map(|time| course.at(time));
        for joint in 0..7 {
            for order in 0..2 {
                let slope = (ahead[joint][order] - back[joint][order]) / (2.0 * H);
                let apart = (slope - now[joint][order + 1]).abs();
                assert!(apart < 3e-5, "{apart:e} at {time} s, joint {joint}, order {order}");
            }
        }
    }
    let fastest = (0..4000).map(|n| course.at(f64::from(n) * 1e-3)[1][1].abs()).fold(0.0, f64::max);
    assert!((5e-3..0.1).contains(&fastest), "{fastest} rad/s");
}

#[test]
fn the_cut_is_where_the_feed_is_up_to_speed() {
    let course = course(&mill3().1, &POSE3);
    // A ramp to 20 mm/s at 200 mm/s² takes 0.2 s.
    let [enters, leaves] = course.cut_s();
    assert!((enters - REST_S - 0.2).abs() < 1e-12);
    assert!((course.ends_s() - leaves - 0.2).abs() < 1e-12);
    let length: f64 = 0.06 + 1300_f64.sqrt() * 1e-3 + (3600.0_f64 + 625.0 + 900.0).sqrt() * 1e-3;
    assert!((course.ends_s() - REST_S - length / 0.02 - 3.0 * 0.2).abs() < 1e-9);
    assert!((course.length() - length).abs() < 1e-12);
    // A ramp covers half of what the full feed does.
    for (time, distance) in [(0.5, 0.0), (2.1, 0.02), (4.2, 0.06), (99.0, length)] {
        assert!((course.distance(time) - distance).abs() < 1e-12, "at {time} s");
    }
}

/// The frames of a guide are those of the chain, and their rates are slopes.
#[test]
fn frames_follow_the_drives() {
    let chain = mill6();
    let course = course(&chain, &POSE6);
    let no_sag = |_: &[f64]| Ok::<_, ()>(Default::default());
    let guide = Guide::new(&course, Mount::of(&chain), no_sag).unwrap();
    const H: f64 = 1e-4;
    for time in [0.5, 1.1, 2.7, 4.05, 5.5] {
        let [back, now, ahead] = [time - H, time, time + H].map(|time| guide.travel(time));
        let angles = course.at(time).map(|[angle, ..]| angle);
        for (index, (joint, q)) in chain.joints().iter().zip(chain.angles(&angles[..6])).enumerate()
        {
            let [back, now, ahead] = [&back, &now, &ahead].map(|one| one.frames[index]);
            let frame = joint.frame(q);
            assert!((now.pose.to_homogeneous() - frame.to_homogeneous()).norm() < 1e-14);
            let turned = (back.pose.rotation.inverse() * ahead.pose.rotation).scaled_axis();
            assert!((turned / (2.0 * H) - now.spin).norm() < 1e-6);
            let gained = (ahead.spin - back.spin) / (2.0 * H);
            assert!((gained - now.spin_rate).norm() < 1e-4, "{gained} {}", now.spin_rate);
        }
        let driven = guide.driven(time);
        for (index, joint) in chain.joints().iter().enumerate() {
            let along = joint.axis[joint.drive().unwrap() % 3];
            let expected = along * (angles[index] - POSE6[index]);
            assert!((driven[index] - expected).abs() < 1e-12, "{} {expected}", driven[index]);
        }
    }
}

#[test]
fn a_path_that_cannot_be_followed_is_named() {
    let chain = mill3().1;
    let error = |points: &[[f64; 3]], pose: &[f64], limits: [f64; 2]| {
        let points = points.iter().map(|mm| 1e-3 * Vector3::from(*mm)).collect();
        let path = Path { points, feed: 0.01, acceleration: 0.1 };
        let limits = [("joint_1", limits), ("joint_2", limits), ("joint_3", limits)];
        Course::new(&path, &chain, pose, &limits).map(|_| ()).unwrap_err()
    };
    let wide = [-3.0, 3.0];
    let far = error(&[[10.0, 0.0, 0.0], [2000.0, 0.0, 0.0]], &POSE3, wide);
    assert!(
        far.starts_with("point 2 of 2: after ") && far.contains("the tool is out of reach"),
        "{far}"
    );
    let turned = error(&[[-400.0, 0.0, 0.0]], &POSE3, [-0.5, 1.0]);
    assert!(turned.contains("of the way to it joint_"), "{turned}");
    assert!(turned.contains("leaves its limits, -0.5 to 1"), "{turned}");
    assert!(error(&[[0.0; 3]], &POSE3, wide).contains("moves nowhere"));
    // Stretched out, the arm cannot lengthen.
    let elbow = -(0.3_f64 / 1.35).atan();
    let stretched = error(&[[0.0, 0.0, 10.0], [0.0, 0.0, 0.0]], &[0.0, 0.0, elbow], wide);
    assert!(stretched.contains("point 1 of 2: after 0 mm"), "{stretched}");
}
