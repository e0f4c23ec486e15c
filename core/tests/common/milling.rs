//! Records of a milling robot, simulated in time with the dense model: no frequency domain, no recursion.

use flexid_core::chain::Chain;
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushings;
use flexid_core::spectrum::Experiment;
use flexid_core::stream::Record;
use nalgebra::{DMatrix, DVector, Vector3};

use super::{BINS, Dense, EXPERIMENTS, MEASUREMENT, Random, add_product, mill3};

/// Hz.
pub(crate) const RATE: f64 = 2000.0;
/// Samples of a record, 4.096 s.
pub(crate) const SAMPLES: usize = 8192;
/// Steps of the integration per sample.
pub(crate) const STEPS: usize = 20;
/// Noise of a sample: 5e-3 N/√Hz and 5e-5 g/√Hz up to half the rate.
pub(crate) const FORCE_NOISE: f64 = 0.158_114;
pub(crate) const ACCELERATION_NOISE: f64 = 0.015_505_7;

/// The scenario's cutter: force on the tool along x y z, N, at every sample; band-limited to 0.35 of the rate.
pub(crate) fn cut(random: &mut Random, spindle_rpm: [f64; 2], feed: usize) -> Vec<[f64; 3]> {
    let (enter, leave) = (0.05 * SAMPLES as f64, 0.8 * SAMPLES as f64);
    let mut angle = 0.0;
    let mut raw = vec![[0.0; 3]; SAMPLES];
    for (n, force) in raw.iter_mut().enumerate() {
        let part = (n as f64 - enter) / (leave - enter);
        if !(0.0..1.0).contains(&part) {
            continue;
        }
        angle += (spindle_rpm[0] + part * (spindle_rpm[1] - spindle_rpm[0])) / 60.0 / RATE;
        for tooth in 0..2 {
            let phi = (angle + 0.5 * f64::from(tooth)).fract() * std::f64::consts::TAU;
            if phi < std::f64::consts::FRAC_PI_2 {
                let tangential = 400.0 * phi.sin() * (1.0 + 0.05 * random.normal());
                let radial = 0.4 * tangential;
                force[feed] += tangential * phi.cos() + radial * phi.sin();
                force[(feed + 1) % 3] += tangential * phi.sin() - radial * phi.cos();
                force[(feed + 2) % 3] += 0.3 * tangential;
            }
        }
    }
    let kernel: Vec<f64> =
        (-24..=24).map(|k| windowed_sinc(f64::from(k) * 0.7, f64::from(k) / 25.0)).collect();
    let sum: f64 = kernel.iter().sum();
    (0..SAMPLES)
        .map(|n| {
            std::array::from_fn(|axis| {
                kernel
                    .iter()
                    .enumerate()
                    .map(|(k, w)| w * at(&raw, n as isize + k as isize - 24, axis))
                    .sum::<f64>()
                    / sum
            })
        })
        .collect()
}

/// Blackman's window: a Hamming window's ripple would bias dampings by two standard deviations.
fn windowed_sinc(x: f64, window: f64) -> f64 {
    use std::f64::consts::PI;
    let sinc = if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
    sinc * (0.42 + 0.5 * (PI * window).cos() + 0.08 * (2.0 * PI * window).cos())
}

fn at(series: &[[f64; 3]], n: isize, axis: usize) -> f64 {
    usize::try_from(n).ok().and_then(|n| series.get(n)).map_or(0.0, |v| v[axis])
}

/// The start and the disturbance of a record.
pub(crate) struct Conditions {
    /// Factor on the scenario's noise.
    pub(crate) noise: f64,
    /// Samples at the start that are simulated but not recorded: the record starts in the cut.
    pub(crate) skipped: usize,
    pub(crate) gravity: Vector3<f64>,
    pub(crate) strapdown: bool,
    pub(crate) mounting: Mounting,
    /// By how many steps of the integration the acceleration comes late: less than a sample.
    pub(crate) late: usize,
}

impl Default for Conditions {
    fn default() -> Self {
        Self {
            noise: 1.0,
            skipped: 0,
            gravity: Vector3::zeros(),
            strapdown: false,
            mounting: Mounting::AT_TCP,
            late: 0,
        }
    }
}

/// The readings of the sensors at one sample, without noise, and how far the TCP is from rest.
struct Sensed {
    force: Vector3<f64>,
    acceleration: Vector3<f64>,
    displacement: Vector3<f64>,
}

/// The motion of the TCP under `force` at `pose`, at every sample, TCP axes: acceleration as the accelerometer reads it,
/// without noise, and displacement.
pub(crate) fn motion(
    chain: &Chain,
    pose: &[f64],
    bushings: &Bushings,
    force: &[[f64; 3]],
    conditions: &Conditions,
) -> Vec<([f64; 3], [f64; 3])> {
    sense(chain, pose, bushings, force, conditions)
        .into_iter()
        .map(|sensed| (sensed.acceleration.into(), sensed.displacement.into()))
        .collect()
}

/// Exact integration of the linear equation of motion; the force is
/// interpolated between samples by a windowed sinc and linear between the steps.
fn sense(
    chain: &Chain,
    pose: &[f64],
    bushings: &Bushings,
    force: &[[f64; 3]],
    conditions: &Conditions,
) -> Vec<Sensed> {
    let sag: Vec<[f64; 6]> = chain
        .linearise(pose, conditions.gravity, bushings)
        .unwrap()
        .joints
        .iter()
        .map(|joint| joint.sag.into())
        .collect();
    let dense = Dense::new(chain, pose, conditions.gravity, &sag);
    let n = 6 * bushings.len();
    let inverse_mass = dense.mass().try_inverse().expect("links have mass");
    let mut stiffness = dense.gravity_stiffness();
    let mut damping = DMatrix::zeros(n, n);
    let parameters = bushings.iter().flat_map(|b| b.stiffness.into_iter().zip(b.damping));
    for (dof, (k, d)) in parameters.enumerate() {
        stiffness[(dof, dof)] += k;
        damping[(dof, dof)] = d;
    }
    let tip = dense.tip();
    // State (q, q̇), and two inputs that make the force linear over a step: exponential of the augmented matrix.
    let step = 1.0 / (RATE * STEPS as f64);
    let mut a = DMatrix::zeros(2 * n + 6, 2 * n + 6);
    a.view_mut((0, n), (n, n)).fill_with_identity();
    a.view_mut((n, 0), (n, n)).copy_from(&(-&inverse_mass * &stiffness));
    a.view_mut((n, n), (n, n)).copy_from(&(-&inverse_mass * &damping));
    a.view_mut((n, 2 * n), (n, 3)).copy_from(&(&inverse_mass * tip.rows(0, 3).transpose()));
    a.view_mut((2 * n, 2 * n + 3), (3, 3)).fill_with_identity();
    let exponential = (a * step).exp();
    let (phi, input) = (
        exponential.view((0, 0), (2 * n, 2 * n)).into_owned(),
        exponential.view((0, 2 * n), (2 * n, 6)).into_owned(),
    );
    let phases: Vec<[f64; 64]> = (0..STEPS)
        .map(|phase| {
            std::array::from_fn(|k| {
                let distance = phase as f64 / STEPS as f64 - (k as f64 - 31.0);
                windowed_sinc(distance, distance / 33.0)
            })
        })
        .collect();
    let fine = |m: usize| -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for (k, weight) in phases[m % STEPS].iter().enumerate() {
            for axis in 0..3 {
                sum[axis] += weight * at(force, (m / STEPS + k) as isize - 31, axis);
            }
        }
        sum
    };
    let g = dense.gravity_at_tip();
    let mut series = Vec::new();
    let mut state = DVector::zeros(2 * n);
    let mut after = state.clone();
    let mut now = fine(0);
    let mut acceleration = Vector3::zeros();
    for m in 0..STEPS * (SAMPLES + conditions.skipped) {
        let samples = m.is_multiple_of(STEPS);
        let accelerates = (m + conditions.late).is_multiple_of(STEPS);
        if samples || accelerates {
            let (q, v) = (state.rows(0, n), state.rows(n, n));
            let load = tip.rows(0, 3).transpose() * now - &stiffness * q - &damping * v;
            let motion = &tip * (&inverse_mass * load);
            let displacement = &tip * q;
            let halves = |six: &DVector<f64>| {
                [0, 3].map(|first| Vector3::from_fn(|axis, _| six[first + axis]))
            };
            let ([slide, turn], [linear, angular]) = (halves(&displacement), halves(&motion));
            let of_point = |point: Vector3<f64>| linear + angular.cross(&point);
            let tilt = turn.cross(&g);
            let felt = if conditions.strapdown { tilt } else { Vector3::zeros() };
            let Mounting { accelerometer, accelerometer_axes, force_axes, tool_mass, tool_centre } =
                conditions.mounting;
            if accelerates {
                acceleration = accelerometer_axes.inverse() * (of_point(accelerometer) + felt);
            }
            if samples && m / STEPS >= conditions.skipped {
                let force =
                    force_axes.inverse() * (now - tool_mass * (of_point(tool_centre) + tilt));
                series.push(Sensed { force, acceleration, displacement: slide });
            }
        }
        let next = fine(m + 1);
        let slope = (next - now) / step;
        let drive = DVector::from_iterator(6, now.iter().chain(slope.iter()).copied());
        after.fill(0.0);
        add_product(&phi, &state, &mut after);
        add_product(&input, &drive, &mut after);
        std::mem::swap(&mut state, &mut after);
        now = next;
    }
    series
}

/// A record of [`motion`], with noise. `force` is longer than a record by what is skipped.
pub(crate) fn record(
    chain: &Chain,
    pose: &[f64],
    bushings: &Bushings,
    force: &[[f64; 3]],
    conditions: &Conditions,
    random: &mut Random,
) -> Record<SAMPLES> {
    let mut record = Record {
        start_s: 0.0,
        pose: heapless::Vec::from_slice(pose).expect("a pose fits"),
        path: heapless::Vec::new(),
        since_s: 0.0,
        rate_hz: RATE,
        force: [const { heapless::Vec::new() }; 3],
        acceleration: [const { heapless::Vec::new() }; 3],
        force_noise: [(conditions.noise * FORCE_NOISE) as f32; 3],
        acceleration_noise: [(conditions.noise * ACCELERATION_NOISE) as f32; 3],
        force_noise_shape: Default::default(),
        acceleration_noise_shape: Default::default(),
        has_doubtful_rate: false,
        starts_at_rest: conditions.skipped == 0,
        point: [0.0; 3],
    };
    for sensed in sense(chain, pose, bushings, force, conditions) {
        for axis in 0..3 {
            let force_noise = conditions.noise * FORCE_NOISE * random.normal();
            let acceleration_noise = conditions.noise * ACCELERATION_NOISE * random.normal();
            let _ = record.force[axis].push((sensed.force[axis] + force_noise) as f32);
            let _ = record.acceleration[axis]
                .push((sensed.acceleration[axis] + acceleration_noise) as f32);
        }
    }
    record
}

/// RMS(x − x̂) / RMS(x) of two displacements along each axis, within `band_hz`.
pub(crate) fn displacement_error(
    truth: &[([f64; 3], [f64; 3])],
    model: &[([f64; 3], [f64; 3])],
    band_hz: [f64; 2],
) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let power = |of: &dyn Fn(usize) -> f64| -> f64 {
            let mut samples: Vec<f32> = (0..truth.len()).map(|n| (of(n) * 1e6) as f32).collect();
            let bins =
                flexid_core::spectrum::fft::real_transform(&mut samples).expect("a power of two");
            // Those that a fit takes.
            let [first, last] = band_hz.map(|hz| hz * truth.len() as f64 / RATE);
            let band = first.ceil() as usize..=last.floor() as usize;
            bins[band].iter().map(|bin| f64::from(bin.norm_sqr())).sum()
        };
        let error = power(&|n| truth[n].1[axis] - model[n].1[axis]);
        (error / power(&|n| truth[n].1[axis])).sqrt()
    })
}

/// The scenario's three experiments with a robot of these `bushings`.
pub(crate) fn experiments(bushings: &Bushings, random: &mut Random) -> Vec<Experiment<BINS>> {
    let chain = mill3();
    let mut buffer = [0.0; SAMPLES];
    EXPERIMENTS
        .iter()
        .map(|(pose, rpm, feed)| {
            let force = cut(random, *rpm, *feed);
            let record = record(&chain, pose, bushings, &force, &Conditions::default(), random);
            Experiment::new(&chain, &MEASUREMENT, &record, &mut buffer).expect("a good record")
        })
        .collect()
}
