use flexid_core::sensors::Accelerometer;
use flexid_simulation::plant::motion::{Surroundings, Work};
use realfft::RealFftPlanner;

use super::*;
use crate::linear::motion;
use crate::records::SAMPLES;
use crate::study::{Purpose, Study, random};

/// The plant of three joints whose only imperfection has this value.
fn imperfect(imperfection: Imperfection, value: f64) -> Plant {
    with(|plant| {
        // The damping is over the square of a stiffness.
        if let Imperfection::GroundDamping(dof) = imperfection {
            plant.add(Imperfection::Ground(dof), 1.0 / 3e10, 3);
        }
        plant.add(imperfection, value, 3);
    })
}

/// The test compares with differences of what the simulated sensors read in time: of the acceleration, less what the model makes
/// of the difference of the force. Both are unknowns of the same records, so that the information about the two says by which part
/// they differ beyond the ends. The force is so small that the robot is linear.
#[test]
fn columns_are_differences_of_the_simulated_readings() {
    let study = Study::load().unwrap();
    let mut cut = study.unseen(1).swap_remove(0);
    cut.gravity = Vector3::new(0.0, 0.0, -9.80665);
    cut.accelerometer = Accelerometer::Strapdown;
    cut.force.iter_mut().for_each(|force| *force *= 1e-3);
    let bushings = study.robot(0);
    let (chain, motion) = (&study.chain, motion(&study.chain, &bushings, &cut));
    let milled = Milled { study: &study, chain, bushings: &bushings, cut: &cut, motion: &motion };
    let read = |imperfection, value| {
        let spindle = vec![0.0; SAMPLES];
        let still = Surroundings { force_noise: 0.0, acceleration_noise: 0.0, spindle };
        let work = Work { cut: &cut, model: chain, bushings: &bushings, number: 0 };
        let plant = imperfect(imperfection, value);
        let read = plant.readings(work, &still, &mut random(Purpose::Plant, 0).0, |_| ()).unwrap();
        [read.force, read.acceleration].map(|series| spectrum(&series))
    };
    use Imperfection as I;
    // The growths of drives are the same for all in the simulator.
    for (all, deviation, has_negative) in [
        (vec![I::Delay], 20e-6, true),
        (vec![I::DelayDrift], 5e-6, true),
        (vec![I::Turn(Sensor::Force, 1)], 1e-3, true),
        (vec![I::ToolTurn(0)], 1e-3, true),
        (vec![I::ToolCentrePoint(2)], 1e-3, true),
        (vec![I::AccelerometerPlace(0)], 1e-3, true),
        (vec![I::Mass(1)], 0.01, true),
        (vec![I::Inertia(2, 0)], 0.01, true),
        (vec![I::Inertia(1, 4)], 0.01, true),
        (vec![I::CentreOfMass(1, 2)], 1e-3, true),
        (vec![I::JointAngle(1)], 1e-3, true),
        (vec![I::ElasticCentre(2, 1)], 1e-3, true),
        (vec![I::Hysteresis], 1e-3, false),
        (vec![I::Servo(0), I::Servo(1), I::Servo(2)], 1e-3, false),
        (vec![I::Load], 1e-7, false),
        (vec![I::Ground(1)], 1e-11, false),
        (vec![I::Ground(3)], 1e-11, false),
        (vec![I::GroundDamping(1)], 3e-16, false),
        (vec![I::Hose], 1.0, false),
        (vec![I::HoseDamping], 0.02, false),
    ] {
        let first = all[0];
        let up = read(first, deviation);
        let (down, times) =
            if has_negative { (read(first, -deviation), 0.5) } else { (read(first, 0.0), 1.0) };
        let hz_per_bin = cut.rate_hz / SAMPLES as f64;
        let simulated: Column = Box::new(move |bin| {
            let index = (bin.s.im / TAU / hz_per_bin).round() as usize;
            let [force, acceleration] =
                [0, 1].map(|of| (up[of][index] - down[of][index]) * Complex::from(times));
            acceleration - three(&bin.accelerance * force)
        });
        let each = all.iter().map(|one| column(&milled, 0, *one, deviation).unwrap());
        let each: Vec<Column> = each.collect();
        let ours: Column = Box::new(move |bin| each.iter().map(|column| column(bin)).sum());
        let gram = milled.information(0..SAMPLES, &[ours, simulated]).unwrap();
        let [a, b] = [36, 37];
        let apart = gram[(a, a)] - 2.0 * gram[(a, b)] + gram[(b, b)];
        let apart = (apart / gram[(b, b)]).sqrt();
        println!("{first:?}: {apart:e}");
        assert!(apart < 0.01, "{first:?}: {apart:e}");
    }
}

fn spectrum(series: &[Vector3<f64>]) -> Vec<Vector3<Complex<f64>>> {
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(series.len());
    let axes = [0, 1, 2].map(|axis| {
        let mut along: Vec<f64> = series.iter().map(|value| value[axis]).collect();
        let mut spectrum = transform.make_output_vec();
        transform.process(&mut along, &mut spectrum).unwrap();
        spectrum
    });
    (0..axes[0].len()).map(|bin| Vector3::from_fn(|axis, _| axes[axis][bin])).collect()
}
