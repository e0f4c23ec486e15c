//! A plant that follows a path.

use flexid_core::motion::Coordinates;

use super::*;
use crate::course::guide::Guide;
use crate::course::{Course, Path as ToolPath, REST_S};

/// A short cut in gravity along a line that moves all joints.
fn cut() -> Cut {
    let (scenario, chain) = mill3();
    let mut experiment = scenario.experiments[0].clone();
    let points = vec![Vector3::new(0.02, 0.03, -0.02)];
    let path = ToolPath { points, feed: 0.03, acceleration: 0.3 };
    let limits = [("q", [-3.0, 3.0]); 3];
    experiment.course = Some(Course::new(&path, &chain, &experiment.pose, &limits).unwrap());
    experiment.duration_s = Some(2.6);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    Cut {
        gravity: Vector3::new(0.0, 0.0, -9.80665),
        accelerometer: flexid_core::sensors::Accelerometer::Strapdown,
        ..Cut::new(&experiment, &scenario.cutting, &scenario.measurement, &mut rng)
    }
}

/// Accelerations while the tool of a plant with these `joints` cuts.
fn cutting(joints: &str, cut: &Cut) -> Vec<Vector3<f64>> {
    let (scenario, chain) = mill3();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let spindle = vec![0.0; cut.force.len() / crate::force::OVERSAMPLING];
    let quiet = Surroundings { force_noise: 0.0, acceleration_noise: 0.0, spindle };
    let work = Work { cut, model: &chain, bushings: &scenario.truth, number: 0 };
    let plant = parse(&format!("[joints]\n{joints}")).unwrap();
    let response = plant.readings(work, &quiet, &mut rng, |_| ()).unwrap();
    response.acceleration[2500..4600].to_vec()
}

#[test]
fn a_perfect_plant_follows_the_path_as_the_model_does() {
    let (scenario, chain) = mill3();
    let cut = cut();
    let exact = cut.response(&chain, &scenario.truth).acceleration;
    let worst = error(&cutting("", &cut), &exact[2500..4600]);
    assert!(worst < 1e-9, "{worst:e}");
    let standing = Cut { course: None, ..cut.clone() };
    let change = error(&exact, &standing.response(&chain, &scenario.truth).acceleration);
    assert!((0.01..0.5).contains(&change), "the path turns and shakes the tool: {change}");
}

/// Wherever the drives are, the frames are those of the plant that stands there.
#[test]
fn the_frames_of_a_plant_follow_the_drives() {
    let (scenario, chain) = mill3();
    let plant = parse(
        "[robot]\njoint_angle_rad = [0.01, -0.02, 0.03]\n\
         elastic_centre_m = [[0.1, 0.2, -0.1], [0.0, 0.1, 0.2], [-0.1, 0.0, 0.1]]\n\
         [pedestal]\nmass_kg = 500.0\nstiffness = [1e9, 1e9, 1e9, 1e9, 1e9, 1e9]\n\
         damping = [1e5, 1e5, 1e5, 1e5, 1e5, 1e5]\n\
         [bending]\njoint = 2\nat = 0.4\nstiffness = [1e9, 1e9, 1e9, 1e9, 1e9, 1e9]\n\
         damping = [1e5, 1e5, 1e5, 1e5, 1e5, 1e5]\n\
         [[ripple]]\njoint = 3\nratio = 121\norder = 2\namplitude_rad = 1e-3\nphase_rad = 1.0\n",
    )
    .unwrap();
    let cut = cut();
    let course = cut.course.as_ref().unwrap();
    let at = |pose: &[f64]| {
        let pose = plant.true_pose(pose, 0.0);
        plant.robot(&chain, &pose, &scenario.truth, &cut.mounting).unwrap()
    };
    let no_sag = |_: &[f64]| Ok::<_, ()>(Coordinates::default());
    let guide = Guide::new(course, at(&cut.pose).mounts, no_sag).unwrap();
    for time in [0.0, REST_S + 0.05, REST_S + 0.7, 9.0] {
        let pose = course.at(time).map(|[angle, ..]| angle);
        let standing = at(&pose[..3]).chain;
        assert_eq!(standing.joints().len(), 5);
        for (joint, frame) in standing.joints().iter().zip(guide.travel(time).frames) {
            let apart = joint.origin.to_homogeneous() - frame.pose.to_homogeneous();
            assert!(apart.amax() < 1e-14, "{apart}");
        }
    }
}

/// The drives feed at 10 mrad/s and vibrate at 1 mrad/s: their friction keeps its sign. Those of a robot that stands stick.
#[test]
fn friction_drops_out_of_the_vibration_of_drives_that_feed() {
    let feeding = cut();
    let standing = Cut { course: None, ..feeding.clone() };
    let change = |cut: &Cut| {
        let friction = cutting("friction = 20.0", cut);
        error(&friction, &cutting("", cut))
    };
    let [feeding, standing] = [change(&feeding), change(&standing)];
    assert!(feeding < 0.01 && standing > 0.05, "{feeding:e}, {standing:e}");
}

/// Drives that stick are as stiff as their gears alone.
#[test]
fn drives_that_stick_are_stiffer() {
    let (mut scenario, chain) = mill3();
    let standing = Cut { course: None, ..cut() };
    let stuck = cutting("friction = 1e5\nfriction_stiffness = 0.1", &standing);
    let softer = cutting("", &standing);
    for (bushing, drive) in scenario.truth.iter_mut().zip(chain.joints()) {
        bushing.stiffness[drive.drive().unwrap()] *= 1.1;
    }
    let gears = standing.response(&chain, &scenario.truth).acceleration;
    let worst = error(&stuck, &gears[2500..4600]);
    // The stiffer robot sags less.
    assert!(worst < 1e-3 && error(&stuck, &softer) > 0.05, "{worst:e}");
}
