//! A motion that is slower than a part of a record, simulated in time.

use std::boxed::Box;

use super::*;
use crate::motion::EquationOfMotion;
use crate::motion::radau::Radau;
use crate::stream::Stage;

const PARTS: usize = 4;
const RATE_HZ: f64 = 500.0;
/// A part lasts 0.51 s, and the softest mode about twice as long.
const SOFTER: f64 = 200.0;
/// Time before the record in which the force of the start ends, s.
const BEFORE_S: f64 = 1.0;

/// A force of 0.3 N that ends before the record, and sines of 0.01 N from 7 to 51 Hz: so small that the robot is linear.
fn force(time: f64) -> Vector3<f64> {
    let start = (-time / BEFORE_S).clamp(0.0, 1.0);
    let sine = |axis: usize| {
        (0..5).map(|n| libm::sin((44.0 + 61.0 * n as f64 + 17.0 * axis as f64) * time)).sum::<f64>()
    };
    Vector3::from_fn(|axis, _| 0.3 * start * start * (3.0 - 2.0 * start) + 0.01 * sine(axis))
}

/// What the sensors read without any noise.
fn readings(chain: &Chain, pose: &[f64], bushings: &Bushings) -> Record<SAMPLES> {
    const STEPS: usize = 2;
    let equation = EquationOfMotion::new(chain, pose, Vector3::zeros(), bushings).unwrap();
    let start = equation.rest();
    let mut robot = Box::new(Radau::new(equation, start, 1.0 / (RATE_HZ * STEPS as f64)));
    let mut record = record(&mut Xoshiro256PlusPlus::seed_from_u64(1));
    let before = (2.0 * BEFORE_S * RATE_HZ) as usize;
    for sample in 0..before + SAMPLES {
        let at = |part: f64| (sample as f64 - before as f64 + part) / RATE_HZ;
        if let Some(place) = sample.checked_sub(before) {
            let measurement = slow();
            let reading = robot.equation().reading(
                robot.state(),
                &force(at(0.0)),
                measurement.accelerometer,
                &measurement.mounting,
            );
            for axis in 0..3 {
                record.force[axis][place] = force(at(0.0))[axis] as f32;
                record.acceleration[axis][place] = reading.acceleration[axis] as f32;
            }
        }
        for step in 0..STEPS {
            robot.step(|part| force(at((step as f64 + part) / STEPS as f64))).unwrap();
        }
    }
    record
}

fn slow() -> Measurement {
    Measurement { band_hz: [1.0, 60.0], ..measurement() }
}

/// There is no noise. What is left is the cost of the seam's prior: less than 1 % of what noise would leave, where a prior as narrow as that of a whole
/// record leaves 4 %.
#[test]
fn a_part_of_a_slow_motion_is_explained() {
    let mut bushings = bushings();
    bushings.iter_mut().flat_map(|own| &mut own.stiffness).for_each(|own| *own /= SOFTER);
    let (chain, bounds, measurement, sought) = (chain(), bounds(), slow(), Sought::new(2).unwrap());
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let mut record =
        readings(&chain, &record(&mut Xoshiro256PlusPlus::seed_from_u64(1)).pose, &bushings);
    record.force_noise = [1e-5; 3];
    record.acceleration_noise = [1e-7; 3];
    record.starts_at_rest = false;
    let stage = Stage { pose: record.pose.clone(), moves: 0.0, is_even: true };
    record.path = core::iter::repeat_n(stage, PARTS).collect();
    let experiment =
        Experiment::<{ 2 * BINS }>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
    let experiment = experiment.unwrap();
    assert_eq!(experiment.path.len(), PARTS);
    let mut refinement = Box::new(Refinement::new(&sought, &bushings));
    let fit = refinement.fit(&problem, &[experiment]);
    let (left, degrees) = (fit.sum_of_squares, fit.degrees_of_freedom);
    assert!(left < 0.01 * degrees, "{left} of {degrees}");
}
