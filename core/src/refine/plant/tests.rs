//! The columns of the imperfections, against differences of the reading of a plant that has them.

use nalgebra::{Rotation3, Vector3};
use proptest::array::{uniform3, uniform6};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::super::batch::Batch;
use super::super::further::Further as _;
use super::super::seam::ORDERS;
use super::super::tests::{bounds, bushings, chain, problem};
use super::*;
use crate::imperfection::Sensor;
use crate::linear::gram::WIDEST;
use crate::mounting::Mounting;
use crate::parameters::Bushings;
use crate::receptance::{Complex, Response};
use crate::sensors::Accelerometer;
use crate::sought::Sought;
use crate::spectrum::Measurement;
use crate::{DOF, MAX_JOINTS};

const POSE: [f64; 2] = [0.4, -0.3];
type Three = [Complex<f64>; 3];

/// The reading of a chain with these bushings and this mounting.
fn reading(
    problem: &Problem<'_>,
    bushings: &Bushings,
    model: &Imperfect,
    s: Complex<f64>,
    raw: &Three,
) -> Three {
    let terms = model.terms(problem, bushings).unwrap();
    let gain = model.calibration().force_gain;
    let force = core::array::from_fn(|axis| raw[axis].scale(1.0 / gain[axis]));
    let mut response = Response::new(0.0);
    response.evaluate(&terms, s, &force, None);
    response.observed
}

/// The reading of a plant with an imperfection, of which the model has none.
fn of_plant(
    problem: &Problem<'_>,
    imperfection: Imperfection,
    value: f64,
    omega: f64,
    raw: &Three,
) -> Three {
    let s = Complex { re: 0.0, im: omega };
    let [s2, inverse] =
        [Complex { re: -omega * omega, im: 0.0 }, Complex { re: 0.0, im: -1.0 / omega }];
    let bushings = bushings();
    let mut model = Imperfect::new(problem, &Calibration::default(), &POSE);
    let mut raw = *raw;
    let plus =
        |factor: Complex<f64>| Complex { re: 1.0 + value * factor.re, im: value * factor.im };
    match imperfection {
        Imperfection::Crosstalk(Sensor::Force, of, by) => {
            raw[of] = raw[of] - raw[by].scale(value);
        }
        Imperfection::Resonance(Sensor::Force) => raw = raw.map(|f| f * plus(s2)),
        Imperfection::HighPass(Sensor::Force) => raw = raw.map(|f| f * plus(inverse)),
        _ => model.add(imperfection, value),
    }
    let mut observed = reading(problem, &bushings, &model, s, &raw);
    let clean = observed;
    match imperfection {
        Imperfection::Crosstalk(Sensor::Accelerometer, of, by) => {
            observed[of] = observed[of] + clean[by].scale(value);
        }
        Imperfection::Resonance(Sensor::Accelerometer) => {
            observed = clean.map(|a| a - a * s2.scale(value));
        }
        Imperfection::HighPass(Sensor::Accelerometer) => {
            observed = clean.map(|a| a - a * inverse.scale(value));
        }
        _ => {}
    }
    observed
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(2), ..ProptestConfig::with_cases(24) })]

    #[test]
    fn columns_equal_differences_of_the_plant(
        places in proptest::array::uniform4(uniform3(-0.5_f64..0.5)),
        tool_mass in prop_oneof![Just(0.0), Just(30.0)],
        omega in 40.0_f64..800.0,
        raw in uniform6(-100.0_f64..100.0),
    ) {
        let [accelerometer, accelerometer_turn, force_turn, tool_centre] = places.map(Vector3::from);
        let measurement = Measurement {
            band_hz: [5.0, 60.0],
            gravity: [0.3, -0.5, -9.8],
            accelerometer: Accelerometer::Strapdown,
            mounting: Mounting {
                accelerometer,
                accelerometer_axes: Rotation3::new(accelerometer_turn),
                force_axes: Rotation3::new(force_turn),
                tool_mass,
                tool_centre,
            },
        };
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2, &Default::default()).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let raw: Three = core::array::from_fn(|axis| Complex { re: raw[axis], im: raw[3 + axis] });
        let s = Complex { re: 0.0, im: omega };

        let mut plant = Plant::new(&Accuracies::typical(), 2);
        let (terms, _) = plant.linearise(&problem, &sought.coordinates(&bushings()), &POSE).unwrap();
        let mut response = Response::new(0.0);
        response.evaluate(&terms, s, &raw, None);
        let inverse_s = Complex { re: 0.0, im: -1.0 / omega };
        let batch = Batch { s, inverse_s, force: raw, powers: [[1.0; ORDERS]; WIDEST] };
        let mut rows = [[[0.0; MAX_IMPERFECTIONS]; 6]];
        let none = [[Complex { re: 0.0, im: 0.0 }; DOF]; MAX_JOINTS];
        (&mut plant.imperfections).write(&mut rows, 0, &response, &batch, &none);

        let size = |all: &Three| all.iter().map(|a| libm::hypot(a.re, a.im)).fold(0.0, f64::max);
        for (index, &(imperfection, deviation)) in plant.imperfections.all.iter().enumerate() {
            let by = 1e-3;
            let plus = of_plant(&problem, imperfection, by * deviation, omega, &raw);
            let minus = of_plant(&problem, imperfection, -by * deviation, omega, &raw);
            let numeric: Three = core::array::from_fn(|axis| (plus[axis] - minus[axis]).scale(0.5 / by));
            let gap: Three = core::array::from_fn(|axis| Complex {
                re: rows[0][2 * axis][index] - numeric[axis].re,
                im: rows[0][2 * axis + 1][index] - numeric[axis].im,
            });
            let allowed = 1e-3 * size(&numeric) + 1e-9 * size(&response.observed);
            prop_assert!(size(&gap) <= allowed, "{imperfection:?}: {gap:?} of {numeric:?}");
        }
    }
}
