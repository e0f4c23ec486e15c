//! Ripple of a gear at a constant feed, against the closed form of a carriage that its drive shakes.

use flexid_core::chain::{Chain, Joint, JointKind, Link};
use flexid_core::sensors::Accelerometer;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3};

use super::*;
use crate::course::{Course, Path as ToolPath, REST_S};

/// Masses of three carriages, one on the other, that slide along x, y and z, kg.
const MASSES: [f64; 3] = [100.0, 50.0, 20.0];
/// Spring, N/m, and damper, Ns/m, of the first one along x. All others are as good as rigid.
const SPRING: (f64, f64) = (2e6, 1100.0);
/// m/s and m/s².
const FEED: f64 = 0.05;
const ACCELERATION: f64 = 1.0;

fn portal() -> (Chain, [Bushing; 3]) {
    let inertia = Matrix3::identity();
    let joint = |(axis, mass)| Joint {
        origin: Isometry3::identity(),
        axis,
        kind: JointKind::Prismatic,
        link: Link { mass, centre_of_mass: Vector3::zeros(), inertia },
    };
    let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    let joints: Vec<_> = axes.into_iter().zip(MASSES).map(joint).collect();
    let mut bushings = [Bushing { stiffness: [1e12; 6], damping: [1e6; 6] }; 3];
    (bushings[0].stiffness[0], bushings[0].damping[0]) = SPRING;
    (Chain::new(&joints, Isometry3::identity()).unwrap(), bushings)
}

/// The first carriage feeds evenly, so that an order is a line at ω = k n q̇. The tool follows the drive by `(K + iωD)/(K − Mω² + iωD)`; here that
/// is a textbook formula, where the plant integrates the equation of motion in time.
#[test]
fn an_order_is_a_line_that_the_bushing_passes_on() {
    let (chain, bushings) = portal();
    let plant = Plant {
        ripple: vec![
            Ripple { joint: 1, ratio: 1500.0, order: 1.0, amplitude_rad: 3e-5, phase_rad: 0.7 },
            Ripple { joint: 1, ratio: 1500.0, order: 2.0, amplitude_rad: 1e-5, phase_rad: -2.0 },
        ],
        ..Plant::default()
    };
    let path = ToolPath {
        points: vec![Vector3::new(0.3, 0.0, 0.0)],
        feed: FEED,
        acceleration: ACCELERATION,
    };
    let limits = [("q", [-1.0, 1.0]); 3];
    let rate_hz = 2000.0;
    let samples = 7 * 2000;
    let cut = Cut {
        pose: vec![0.0; 3],
        course: Some(Course::new(&path, &chain, &[0.0; 3], &limits).unwrap()),
        gravity: Vector3::zeros(),
        accelerometer: Accelerometer::Strapdown,
        mounting: Mounting::AT_TCP,
        rate_hz,
        force: vec![Vector3::zeros(); samples * crate::force::OVERSAMPLING],
    };
    let quiet =
        Surroundings { force_noise: 0.0, acceleration_noise: 0.0, spindle: vec![0.0; samples] };
    let work = Work { cut: &cut, model: &chain, bushings: &bushings, number: 0 };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let found = plant.readings(work, &quiet, &mut rng, |_| ()).unwrap().acceleration;
    // What the ramp has shaken up has died away by e^-13.
    let evenly = 10_000..13_600;
    let begins = REST_S + FEED / ACCELERATION;
    let (spring, damper) = SPRING;
    let mass: f64 = MASSES.iter().sum();
    let mut columns = Vec::new();
    let mut expected = Vec::new();
    for own in &plant.ripple {
        let omega = own.order * own.ratio * FEED;
        let phase = |n: usize| omega * (n as f64 / rate_hz - begins) + own.phase_rad;
        columns.extend(evenly.clone().map(|n| phase(n).sin()));
        columns.extend(evenly.clone().map(|n| phase(n).cos()));
        // -ω² A (a + ib)/(c + ib): in phase, and a quarter ahead.
        let (b, c) = (omega * damper, spring - mass * omega * omega);
        let size = -omega * omega * own.amplitude_rad / (c * c + b * b);
        expected.extend([size * (spring * c + b * b), size * (b * c - spring * b)]);
    }
    let lines = DMatrix::from_vec(evenly.len(), expected.len(), columns);
    let along = DVector::from_iterator(evenly.len(), evenly.clone().map(|n| found[n].x));
    let fitted = lines.clone().svd(true, true).solve(&along, 1e-12).unwrap();
    for (found, expected) in fitted.iter().zip(&expected) {
        assert!((found - expected).abs() < 1e-5 * fitted.amax(), "{fitted} is not {expected}");
    }
    let rest = &along - lines * fitted;
    assert!(rest.amax() < 1e-5 * along.amax(), "there is more than lines: {}", rest.amax());
    let beside = found[evenly].iter().map(|a| a.y.hypot(a.z)).fold(0.0, f64::max);
    assert!(beside < 1e-9, "{beside:e}");
}

/// A robot that stands does not feel its gears.
#[test]
fn a_robot_that_stands_has_no_ripple() {
    let text = "[[ripple]]\njoint = 2\nratio = 121\norder = 2\namplitude_rad = 1e-4";
    let [_, exact] = readings(&Plant::default());
    let change = error(&readings(&parse(text).unwrap())[1], &exact);
    // Its pose is off by as much as the ripple.
    assert!(change < 1e-3, "{change:e}");
}
