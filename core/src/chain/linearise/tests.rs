//! Tests of equilibria under gravity: an existing equilibrium is found exactly, and an error names the joint that has none.

use std::format;

use nalgebra::Unit;

use super::super::{Joint, JointKind, Link};
use super::*;
use crate::sensors::Sensors;

const MASS: f64 = 300.0;
const LENGTH: f64 = 1.1;
const EARTH: Vector3<f64> = Vector3::new(0.0, 0.0, -9.80665);
/// Largest torque of an arm's weight, Nm.
const TORQUE: f64 = MASS * LENGTH * 9.80665;

/// Arms in series. The centre of mass of each arm lies at its elevation above the horizon, rad.
fn arms(elevations: &[f64]) -> Chain {
    let joint = |elevation: &f64| Joint {
        origin: Isometry3::identity(),
        axis: Vector3::z_axis(),
        kind: JointKind::Revolute,
        link: Link {
            mass: MASS,
            centre_of_mass: Vector3::new(libm::cos(*elevation), 0.0, libm::sin(*elevation))
                * LENGTH,
            inertia: Matrix3::from_diagonal(&Vector3::new(30.0, 40.0, 25.0)),
        },
    };
    let joints: std::vec::Vec<Joint> = elevations.iter().map(joint).collect();
    Chain::new(&joints, Isometry3::translation(LENGTH, 0.0, 0.0)).unwrap()
}

/// A bushing that is rigid except for the turn about y, whose `stiffness` is in Nm/rad.
fn soft(stiffness: f64) -> Bushing {
    let mut bushing = Bushing { stiffness: [1e12; DOF], damping: [1.0; DOF] };
    bushing.stiffness[4] = stiffness;
    bushing
}

/// The sag satisfies `k θ = m g l cos(e − θ)`, also if the rounds converge slowly.
#[test]
fn a_soft_arm_is_at_rest_where_it_is_linearised() {
    for part in [100.0, 5.0, 2.0, 1.5] {
        let linear = arms(&[0.0]).linearise(&[0.3], EARTH, &[soft(part * TORQUE)]).unwrap();
        let turn = linear.joints[0].sag[4];
        let gap = part * turn - libm::cos(turn);
        assert!(gap.abs() < 1e-9, "stiffness {part}: off by {gap:e} of the torque");
    }
}

#[test]
fn an_arm_that_does_not_come_to_rest_is_named() {
    let (stiff, limp) = (soft(100.0 * TORQUE), soft(0.1 * TORQUE));
    for (bushings, joint) in [([limp, stiff], 0), ([stiff, limp], 1)] {
        let error = arms(&[0.0, 0.0]).linearise(&[0.0; 2], EARTH, &bushings).unwrap_err();
        assert_eq!(error, LinearisationError::NoEquilibrium(joint));
        assert!(format!("{error}").starts_with(&format!("joint {} ", joint + 1)), "{error}");
    }
    for nothing in [0.0, f64::NAN] {
        let error = arms(&[0.0]).linearise(&[0.0], EARTH, &[soft(nothing)]).unwrap_err();
        assert_eq!(error, LinearisationError::NoEquilibrium(0), "stiffness {nothing}");
    }
    // Without gravity no bushing sags.
    arms(&[0.0]).linearise(&[0.0], Vector3::zeros(), &[limp]).unwrap();
}

/// An arm stands nearly upright and falls forward by a quarter turn, where a spring of this stiffness holds it.
#[test]
fn a_quarter_turn_is_an_error() {
    let (elevation, quarter) = (1.5, core::f64::consts::FRAC_PI_2);
    let stiffness = TORQUE * libm::cos(elevation - quarter) / quarter;
    let error = arms(&[elevation]).linearise(&[0.0], EARTH, &[soft(stiffness)]).unwrap_err();
    assert_eq!(error, LinearisationError::QuarterTurn(0));
}

#[test]
fn numbers_of_angles_and_bushings_are_checked() {
    let (chain, stiff) = (arms(&[0.0, 0.0]), soft(1e9));
    let linearise = |angles: &[f64], bushings: &[Bushing]| {
        chain.linearise(angles, Vector3::zeros(), bushings).err()
    };
    assert_eq!(linearise(&[0.0], &[stiff; 2]), Some(LinearisationError::Angles(1)));
    assert_eq!(linearise(&[0.0; 2], &[stiff; 3]), Some(LinearisationError::Bushings(3)));
    let linear = chain.linearise(&[0.0; 2], Vector3::zeros(), &[stiff; 2]).unwrap();
    let terms = crate::receptance::Terms::<f64>::new(&linear, &[stiff], &Sensors::default());
    assert_eq!(terms.err(), Some(LinearisationError::Bushings(1)));
}

#[test]
fn the_inverse_of_the_turns_is_one() {
    let mut bushings = [soft(3.0 * TORQUE), soft(5.0 * TORQUE)];
    bushings[0].stiffness[3] = 4.0 * TORQUE;
    let mut chain = arms(&[0.4, -0.2]);
    chain.joints[1].axis = Unit::new_normalize(Vector3::new(0.3, 1.0, 0.2));
    let linear = chain.linearise(&[0.3, 0.8], EARTH, &bushings).unwrap();
    assert!(linear.joints[1].sag[4].abs() > 0.01, "{}", linear.joints[1].sag);
    for LinearJoint { from_parent, .. } in &linear.joints {
        let gap = (from_parent.turns * from_parent.turns_inverse - Matrix3::identity()).amax();
        assert!(gap < 1e-14, "{gap:e}");
    }
}
