//! H₁ recovers the receptance of a robot-like system that is integrated in time, step by step, by equations that the report does not have.

use std::f64::consts::TAU;

use flexid_report::evidence::{Signals, estimate};
use nalgebra::{Complex, Matrix3, Vector3};
use rand_core::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const RATE_HZ: f64 = 1000.0;
const SAMPLES: usize = 1 << 19;
/// A line is 0.12 Hz, an eighth of the width of the narrowest resonance.
const SEGMENT: usize = 8192;
/// Steps of the integration in a sample.
const STEPS: usize = 4;

/// Three coupled masses with modes near 10, 20 and 34 Hz, damped by some per cent.
struct System {
    mass: Matrix3<f64>,
    damping: Matrix3<f64>,
    stiffness: Matrix3<f64>,
}

impl System {
    fn new() -> Self {
        let mass = Matrix3::new(12.0, 1.0, 0.5, 1.0, 9.0, -0.8, 0.5, -0.8, 7.0);
        let stiffness = 1e5 * Matrix3::new(1.2, -0.5, 0.1, -0.5, 1.4, -0.4, 0.1, -0.4, 2.6);
        Self { mass, damping: 1e-3 * stiffness + 2.0 * mass, stiffness }
    }

    /// `(K + iωD − ω²M)⁻¹`.
    fn receptance(&self, frequency_hz: f64) -> Matrix3<Complex<f64>> {
        let omega = TAU * frequency_hz;
        let z = Matrix3::from_fn(|row, column| {
            let at = (row, column);
            Complex::new(
                self.stiffness[at] - omega * omega * self.mass[at],
                omega * self.damping[at],
            )
        });
        z.try_inverse().expect("a damped system")
    }

    /// Acceleration at each sample under forces that go straight from sample to sample: Runge and Kutta's method of fourth order.
    fn accelerations(&self, force: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
        let inverse = self.mass.try_inverse().expect("masses");
        let acceleration = |x: &Vector3<f64>, v: &Vector3<f64>, f: &Vector3<f64>| {
            inverse * (f - self.damping * v - self.stiffness * x)
        };
        let at = |sample: usize| Vector3::from_fn(|axis, _| force[axis][sample]);
        let h = 1.0 / (RATE_HZ * STEPS as f64);
        let (mut x, mut v) = (Vector3::zeros(), Vector3::zeros());
        let mut out = [const { Vec::new() }; 3];
        for sample in 0..SAMPLES {
            let (now, next) = (at(sample), at((sample + 1).min(SAMPLES - 1)));
            let a = acceleration(&x, &v, &now);
            (0..3).for_each(|axis| out[axis].push(a[axis]));
            for step in 0..STEPS {
                let f = |part: f64| now + (next - now) * ((step as f64 + part) / STEPS as f64);
                let (a1, v1) = (acceleration(&x, &v, &f(0.0)), v);
                let v2 = v + 0.5 * h * a1;
                let a2 = acceleration(&(x + 0.5 * h * v1), &v2, &f(0.5));
                let v3 = v + 0.5 * h * a2;
                let a3 = acceleration(&(x + 0.5 * h * v2), &v3, &f(0.5));
                let v4 = v + h * a3;
                let a4 = acceleration(&(x + h * v3), &v4, &f(1.0));
                x += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
                v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            }
        }
        out
    }
}

/// Forces of three directions that go together by a half.
fn forces(generator: &mut Xoshiro256PlusPlus) -> [Vec<f64>; 3] {
    let mut forces = [const { Vec::new() }; 3];
    // A filter of first order at 80 Hz keeps the force smooth between the samples.
    let keep = (-TAU * 80.0 / RATE_HZ).exp();
    let mut state = [0.0; 3];
    for _ in 0..SAMPLES {
        let common: f64 = StandardNormal.sample(generator);
        for (axis, force) in forces.iter_mut().enumerate() {
            let own: f64 = StandardNormal.sample(generator);
            state[axis] = keep * state[axis] + (1.0 - keep) * 100.0 * (own + 0.6 * common);
            force.push(state[axis]);
        }
    }
    forces
}

#[test]
fn h1_recovers_the_receptance_of_a_simulated_system() {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(5);
    let system = System::new();
    let force = forces(&mut generator);
    let mut reading = system.accelerations(&force);
    // Noise of the sensor: 2 % of the acceleration.
    let size = (reading[0].iter().map(|own| own * own).sum::<f64>() / SAMPLES as f64).sqrt();
    for value in reading.iter_mut().flatten() {
        let noise: f64 = StandardNormal.sample(&mut generator);
        *value += 0.02 * size * noise;
    }
    let estimated = estimate(&[Signals { force, reading }], RATE_HZ, SEGMENT);
    assert_eq!(estimated.len(), SEGMENT / 2 - 1);
    let mut worst = 0.0_f64;
    let mut least_coherence = 1.0_f64;
    for own in estimated.iter().filter(|own| (5.0..60.0).contains(&own.frequency_hz)) {
        let omega = TAU * own.frequency_hz;
        let truth = system.receptance(own.frequency_hz);
        let largest = truth.iter().map(|entry| entry.norm()).fold(0.0, f64::max);
        for column in 0..3 {
            for row in 0..3 {
                let receptance = own.h[(row, column)] / -(omega * omega);
                worst = worst.max((receptance - truth[(row, column)]).norm() / largest);
            }
        }
        least_coherence = own.coherence.iter().copied().fold(least_coherence, f64::min);
    }
    // 127 segments.
    assert!(worst < 0.05, "{worst}");
    assert!(least_coherence > 0.9, "{least_coherence}");
}
