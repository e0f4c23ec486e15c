//! The derivatives in the nuisances, with sensors that sit elsewhere, against central differences of the reading.

use nalgebra::{Rotation3, Vector3};
use proptest::array::{uniform3, uniform6};
use proptest::prelude::*;

use super::*;
use crate::MAX_JOINTS;
use crate::calibration::Nuisances;
use crate::chain::linearise::LinearChain;
use crate::linear::gram::WIDEST;
use crate::mounting::Mounting;
use crate::parameters::Bushings;
use crate::refine::seam::ORDERS;
use crate::refine::tests::{bushings, chain};
use crate::sensors::{Accelerometer, Sensors};

/// Two joints in gravity.
fn robot() -> (LinearChain, Bushings) {
    let (chain, bushings) = (chain(), bushings());
    let linear = chain.linearise(&[0.4, -0.3], Vector3::new(0.0, 0.0, -9.8), &bushings).unwrap();
    (linear, bushings)
}

fn mounting(numbers: &[[f64; 3]; 4], tool_mass: f64) -> Mounting {
    let [accelerometer, accelerometer_turn, force_turn, tool_centre] = numbers.map(Vector3::from);
    Mounting {
        accelerometer,
        accelerometer_axes: Rotation3::new(accelerometer_turn),
        force_axes: Rotation3::new(force_turn),
        tool_mass,
        tool_centre,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn nuisance_derivatives_equal_finite_differences(
        places in proptest::array::uniform4(uniform3(-0.6_f64..0.6)),
        tool_mass in 0.0_f64..50.0,
        omega in 20.0_f64..1200.0,
        raw in uniform6(-100.0_f64..100.0),
        load in -50.0_f64..50.0,
        delay in -1e-3_f64..1e-3,
        turn in uniform3(-0.3_f64..0.3),
        logarithms in uniform6(-0.3_f64..0.3),
    ) {
        let (linear, bushings) = robot();
        let mounting = mounting(&places, tool_mass);
        let s = Complex { re: 0.0, im: omega };
        let seam = [[Complex { re: load, im: -0.5 * load }; DOF]; MAX_JOINTS];
        let calibration = Calibration {
            delay,
            acceleration_gain: core::array::from_fn(|axis| libm::exp(logarithms[axis])),
            force_gain: core::array::from_fn(|axis| libm::exp(logarithms[3 + axis])),
            misalignment: turn,
            ..Calibration::default()
        };
        let respond = |calibration: &Calibration| {
            let sensors = Sensors { accelerometer: Accelerometer::Strapdown, mounting, calibration: *calibration, ..Sensors::default() };
            let terms = Terms::new(&linear, &bushings, &sensors).unwrap();
            let force = core::array::from_fn(|axis| {
                let gain = calibration.force_gain[axis];
                Complex { re: raw[axis] / gain, im: raw[3 + axis] / gain }
            });
            let mut response = Response::new(0.0);
            response.evaluate(&terms, s, &force, Some(&seam));
            (terms, force, response)
        };
        let (terms, force, response) = respond(&calibration);
        let widths = Nuisances {
            delay: Some(1e-3),
            acceleration_gain: Some(1.0),
            force_gain: Some(1.0),
            misalignment: Some(1.0),
            mass: None,
        };
        let sought = Sought::new(2, &widths).unwrap();
        let inverse_s = Complex { re: 0.0, im: -1.0 / omega };
        let batch = Batch { s, inverse_s, force, drift: [Complex::zero(0.0); 3], powers: [[1.0; ORDERS]; WIDEST] };
        let mut rows = [[[0.0; COLUMNS]; 6]];
        Derivatives::new(&sought, &calibration, 0).write(&mut rows, &response, &terms, &batch);
        let size = response.observed.iter().map(|a| libm::hypot(a.re, a.im)).fold(0.0, f64::max);
        for (index, unknown) in sought.nuisances() {
            const STEP: f64 = 1e-5;
            let moved = |by: f64| {
                let mut moved = calibration;
                match Coordinate::of(index) {
                    Coordinate::Delay => moved.delay += 1e-3 * by,
                    Coordinate::AccelerationGain(axis) => moved.acceleration_gain[axis] *= libm::exp(by),
                    Coordinate::ForceGain(axis) => moved.force_gain[axis] *= libm::exp(by),
                    Coordinate::Misalignment(axis) => moved.misalignment[axis] += by,
                    other => unreachable!("{other:?} is not sought"),
                }
                respond(&moved).2.observed
            };
            let (up, down) = (moved(STEP), moved(-STEP));
            for axis in 0..3 {
                let numeric = (up[axis] - down[axis]).scale(0.5 / STEP);
                let ours = [rows[0][2 * axis][unknown], rows[0][2 * axis + 1][unknown]];
                let gap = libm::hypot(ours[0] - numeric.re, ours[1] - numeric.im);
                prop_assert!(gap < 1e-6 * size, "{:?} {axis}: {ours:?} {numeric:?}", Coordinate::of(index));
            }
        }
    }
}

/// Where there is one lane, as on a microcontroller, the rows of a bin take the stack of one lane.
#[test]
fn rows_take_no_more_room_than_there_are_lanes() {
    let bytes = size_of_val(&<f64 as Lanes>::each([[0.0_f64; COLUMNS]; 6]));
    assert_eq!(bytes, 8 * 6 * COLUMNS);
    assert!(bytes < 10_000, "{bytes}");
}
