//! The nonlinear motion against the receptance, at the amplitudes of milling.
//!
//! Spectra are taken on the line `s = α + iω`, where a start from rest makes `X(s) = H(s) F(s)` exact but for
//! what `e^(−αT)` leaves of the end of the record.
//!
//! What remains is the robot's own nonlinearity, most of it quadratic: 1e-4 to 8e-4, in proportion to the
//! amplitude. A tenth of the force leaves a tenth of it. Pushed the other way the robot shows the same
//! quadratic part; in half the difference it is gone.

use std::f64::consts::{PI, TAU};

use flexid_core::motion::EquationOfMotion;
use flexid_core::motion::radau::Radau;
use flexid_core::mounting::Mounting;
use flexid_core::receptance::{Complex, Response, Terms, receptance};
use flexid_core::sensors::Accelerometer::{self, Inertial, Strapdown};
use flexid_core::sensors::Sensors;
use nalgebra::{Rotation3, Vector3};

use crate::common::milling::{RATE, SAMPLES, cut};
use crate::common::{EXPERIMENTS, Random, mill3, nominal};

const EARTH: Vector3<f64> = Vector3::new(0.0, 0.0, -9.80665);
/// Steps of the integration a sample.
const STEPS: usize = 4;
/// αT.
const WEIGHT: f64 = 14.0;
/// Displacement, inertial and strapdown reading.
const QUANTITIES: usize = 3;

/// The motion at the samples: m, m/s².
type Seen = [Vec<Vector3<f64>>; QUANTITIES];

/// A value of a band-limited signal between its samples, `at` in samples: a sinc under Blackman's window.
fn between(samples: &[[f64; 3]], at: f64) -> Vector3<f64> {
    const HALF: isize = 32;
    let (before, part) = (at.floor() as isize, at.fract());
    let mut sum = Vector3::zeros();
    for k in 1 - HALF..=HALF {
        let Some(sample) = usize::try_from(before + k).ok().and_then(|n| samples.get(n)) else {
            continue;
        };
        let x = k as f64 - part;
        let sinc = if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
        let turn = PI * x / (HALF as f64 + 1.0);
        let window = 0.42 + 0.5 * turn.cos() + 0.08 * (2.0 * turn).cos();
        sum += Vector3::from(*sample) * sinc * window;
    }
    sum
}

fn milled(experiment: usize, force: &[[f64; 3]], gravity: Vector3<f64>) -> Seen {
    let (pose, ..) = EXPERIMENTS[experiment];
    let equation = EquationOfMotion::new(&mill3(), &pose, gravity, &nominal()).unwrap();
    let start = equation.rest();
    let mut radau = Radau::new(equation, start, 1.0 / (RATE * STEPS as f64));
    let mut seen = Seen::default();
    for sample in 0..SAMPLES {
        let (equation, state, now) = (radau.equation(), radau.state(), force[sample].into());
        seen[0].push(equation.tcp_displacement(state));
        seen[1].push(equation.tcp_acceleration(state, &now, Inertial));
        seen[2].push(equation.tcp_acceleration(state, &now, Strapdown));
        for step in 0..STEPS {
            let at = |part: f64| sample as f64 + (step as f64 + part) / STEPS as f64;
            radau.step(|part| between(force, at(part))).unwrap();
        }
    }
    seen
}

/// Away from the TCP, turned, with a heavy tool beyond the force sensor.
fn elsewhere() -> Mounting {
    Mounting {
        accelerometer: Vector3::new(0.2, -0.3, 0.25),
        accelerometer_axes: Rotation3::from_euler_angles(0.4, -0.3, 1.2),
        force_axes: Rotation3::from_euler_angles(-0.2, 0.5, -0.7),
        tool_mass: 30.0,
        tool_centre: Vector3::new(-0.1, 0.2, 0.15),
    }
}

/// The readings of sensors elsewhere: force and acceleration.
fn sensed(
    experiment: usize,
    force: &[[f64; 3]],
    accelerometer: Accelerometer,
) -> [Vec<Vector3<f64>>; 2] {
    let (pose, ..) = EXPERIMENTS[experiment];
    let equation = EquationOfMotion::new(&mill3(), &pose, EARTH, &nominal()).unwrap();
    let start = equation.rest();
    let mut radau = Radau::new(equation, start, 1.0 / (RATE * STEPS as f64));
    let mut seen = [Vec::new(), Vec::new()];
    for sample in 0..SAMPLES {
        let (equation, state, now) = (radau.equation(), radau.state(), force[sample].into());
        let reading = equation.reading(state, &now, accelerometer, &elsewhere());
        seen[0].push(reading.force);
        seen[1].push(reading.acceleration);
        for step in 0..STEPS {
            let at = |part: f64| sample as f64 + (step as f64 + part) / STEPS as f64;
            radau.step(|part| between(force, at(part))).unwrap();
        }
    }
    seen
}

/// `Σ x(n) e^(−s n / rate)` of each axis.
fn transform(series: &[Vector3<f64>], s: Complex<f64>) -> [Complex<f64>; 3] {
    let turn = (nalgebra::Complex::new(-s.re, -s.im) / RATE).exp();
    let mut weight = nalgebra::Complex::new(1.0, 0.0);
    let mut sums = [nalgebra::Complex::new(0.0, 0.0); 3];
    for sample in series {
        (0..3).for_each(|axis| sums[axis] += weight * sample[axis]);
        weight *= turn;
    }
    sums.map(|sum| Complex { re: sum.re, im: sum.im })
}

/// RMS of the differences over RMS in 2 to 200 Hz, by quantity and axis.
fn errors(
    experiment: usize,
    force: &[[f64; 3]],
    gravity: Vector3<f64>,
    seen: &Seen,
) -> [[f64; 3]; QUANTITIES] {
    let (pose, ..) = EXPERIMENTS[experiment];
    let linear = mill3().linearise(&pose, gravity, &nominal()).unwrap();
    let [inertial, strapdown] = [Inertial, Strapdown].map(|accelerometer| {
        let sensors = Sensors { accelerometer, ..Sensors::default() };
        Terms::new(&linear, &nominal(), &sensors).unwrap()
    });
    let force: Vec<_> = force.iter().map(|&force| force.into()).collect();
    let seconds = SAMPLES as f64 / RATE;
    let mut powers = [[[0.0; 2]; 3]; QUANTITIES];
    let mut response = Response::new(0.0);
    for bin in (8..820).step_by(7) {
        let s = Complex { re: WEIGHT / seconds, im: TAU * f64::from(bin) / seconds };
        let pushed = transform(&force, s);
        let [xx, xy, yy, xz, yz, zz] = receptance(&inertial, s);
        let moved = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
            .map(|row| row[0] * pushed[0] + row[1] * pushed[1] + row[2] * pushed[2]);
        let [fixed, turning] = [&inertial, &strapdown].map(|terms| {
            response.evaluate(terms, s, &pushed, None);
            response.observed
        });
        for (quantity, expected) in [moved, fixed, turning].into_iter().enumerate() {
            let found = transform(&seen[quantity], s);
            for axis in 0..3 {
                let gap = found[axis] - expected[axis];
                powers[quantity][axis][0] += gap.re * gap.re + gap.im * gap.im;
                powers[quantity][axis][1] += found[axis].re.powi(2) + found[axis].im.powi(2);
            }
        }
    }
    powers.map(|quantity| quantity.map(|[gap, size]| (gap / size).sqrt()))
}

#[test]
fn milling_moves_the_robot_as_the_receptance_says() {
    let (mut whole, mut tenth, mut odd) = (0.0_f64, 0.0_f64, 0.0_f64);
    for experiment in 0..EXPERIMENTS.len() {
        let (_, rpm, feed) = EXPERIMENTS[experiment];
        let force = cut(&mut Random::new(experiment as u64), rpm, feed);
        let opposite: Vec<_> = force.iter().map(|force| force.map(|force| -force)).collect();
        for gravity in [Vector3::zeros(), EARTH] {
            let mut seen = milled(experiment, &force, gravity);
            let found = errors(experiment, &force, gravity, &seen);
            whole = found.iter().flatten().fold(whole, |worst, &error| worst.max(error));
            for (seen, other) in seen.iter_mut().zip(milled(experiment, &opposite, gravity)) {
                seen.iter_mut().zip(other).for_each(|(seen, other)| *seen = 0.5 * (*seen - other));
            }
            let found = errors(experiment, &force, gravity, &seen);
            let little: Vec<_> = force.iter().map(|force| force.map(|force| 0.1 * force)).collect();
            let slight = milled(experiment, &little, gravity);
            let slight = errors(experiment, &little, gravity, &slight);
            tenth = slight.iter().flatten().fold(tenth, |worst, &error| worst.max(error));
            odd = found.iter().flatten().fold(odd, |worst, &error| worst.max(error));
        }
    }
    println!(
        "milling against the receptance: {whole:.1e}, with a tenth of the force {tenth:.1e}, without the quadratic part \
         {odd:.1e}"
    );
    assert!(whole < 1e-3, "{whole:e}");
    assert!(tenth < 1e-4, "{tenth:e}");
    assert!(odd < 1e-5, "{odd:e}");
}

/// From the force that the sensor reads to the acceleration, both elsewhere than at the TCP; half the difference of a cut and
/// its opposite.
#[test]
fn sensors_elsewhere_read_what_the_response_says() {
    let mut worst = 0.0_f64;
    for (experiment, accelerometer) in [(0, Inertial), (1, Strapdown)] {
        let (pose, rpm, feed) = EXPERIMENTS[experiment];
        let force = cut(&mut Random::new(experiment as u64), rpm, feed);
        let opposite: Vec<_> = force.iter().map(|force| force.map(|force| -force)).collect();
        let mut seen = sensed(experiment, &force, accelerometer);
        for (seen, other) in seen.iter_mut().zip(sensed(experiment, &opposite, accelerometer)) {
            seen.iter_mut().zip(other).for_each(|(seen, other)| *seen = 0.5 * (*seen - other));
        }
        let linear = mill3().linearise(&pose, EARTH, &nominal()).unwrap();
        let sensors = Sensors { accelerometer, mounting: elsewhere(), ..Sensors::default() };
        let terms = Terms::new(&linear, &nominal(), &sensors).unwrap();
        let seconds = SAMPLES as f64 / RATE;
        let mut response = Response::new(0.0);
        let mut powers = [[0.0; 2]; 3];
        for bin in (8..820).step_by(7) {
            let s = Complex { re: WEIGHT / seconds, im: TAU * f64::from(bin) / seconds };
            let [measured, found] = seen.each_ref().map(|series| transform(series, s));
            response.evaluate(&terms, s, &measured, None);
            for axis in 0..3 {
                let gap = found[axis] - response.observed[axis];
                powers[axis][0] += gap.re * gap.re + gap.im * gap.im;
                powers[axis][1] += found[axis].re.powi(2) + found[axis].im.powi(2);
            }
        }
        worst = powers.iter().fold(worst, |worst, [gap, size]| worst.max((gap / size).sqrt()));
    }
    println!("sensors elsewhere against the response: {worst:.1e}");
    assert!(worst < 1e-5, "{worst:e}");
}
