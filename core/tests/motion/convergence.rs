//! The integrator: order 5, on stiff robots and in large motion, and steps as long as the motion allows
//! where an explicit method explodes.

use flexid_core::chain::{Chain, Joint, JointKind, Link};
use flexid_core::motion::radau::Radau;
use flexid_core::motion::{EquationOfMotion, State};
use flexid_core::parameters::Bushing;
use flexid_core::sensors::Accelerometer::Inertial;
use nalgebra::{Matrix3, Translation3, Vector3, Vector6};

use crate::common::{EXPERIMENTS, Random, mill3, nominal};

const EARTH: Vector3<f64> = Vector3::new(0.0, 0.0, -9.80665);

/// From `start` for so many seconds, in so many steps.
fn moved(
    equation: &EquationOfMotion,
    start: State,
    seconds: f64,
    steps: usize,
    push: impl Fn(f64) -> Vector3<f64>,
) -> State {
    let step = seconds / steps as f64;
    let mut radau = Radau::new(equation.clone(), start, step);
    for n in 0..steps {
        radau.step(|part| push((n as f64 + part) * step)).unwrap();
    }
    *radau.state()
}

/// Largest difference of the coordinates, over the largest elongation.
fn apart(a: &State, b: &State) -> f64 {
    let size = b.elongation.iter().map(|q| q.amax()).fold(0.0, f64::max);
    let gaps = a.elongation.iter().zip(&b.elongation).map(|(a, b)| (a - b).amax());
    gaps.fold(0.0, f64::max) / size
}

/// Errors with `steps` and with each time twice as many, against 32 times as many.
fn errors(
    equation: &EquationOfMotion,
    start: State,
    seconds: f64,
    steps: usize,
    push: impl Fn(f64) -> Vector3<f64>,
) -> [f64; 3] {
    let exact = moved(equation, start, seconds, 32 * steps, &push);
    [1, 2, 4].map(|times| apart(&moved(equation, start, seconds, times * steps, &push), &exact))
}

/// Orders that the errors show.
fn orders(errors: [f64; 3]) -> [f64; 2] {
    [0, 1].map(|n| (errors[n] / errors[n + 1]).log2())
}

fn push(t: f64) -> Vector3<f64> {
    let shape = (std::f64::consts::PI * (t / 0.1).min(1.0)).sin().powi(6);
    Vector3::new(300.0, -200.0, 100.0) * shape * (1.0 + (600.0 * t).sin())
}

#[test]
fn of_order_5_on_the_robot_of_the_scenario() {
    for (pose, ..) in EXPERIMENTS {
        let equation = EquationOfMotion::new(&mill3(), &pose, EARTH, &nominal()).unwrap();
        let errors = errors(&equation, equation.rest(), 0.08, 128, push);
        let orders = orders(errors);
        println!("scenario: errors {errors:?}, orders {orders:.2?}");
        assert!(orders.iter().all(|order| (4.7..5.3).contains(order)), "{errors:?}: {orders:?}");
    }
}

/// Let go with its bushings half a radian away from rest.
#[test]
fn of_order_5_in_large_motion() {
    let mut random = Random::new(7);
    let (chain, pose) = (random.chain(3), random.pose(3));
    let bushings = [Bushing { stiffness: [3e4; 6], damping: [3e2; 6] }; 3];
    let equation = EquationOfMotion::new(&chain, &pose, EARTH, &bushings).unwrap();
    let mut start = equation.rest();
    for q in &mut start.elongation[..3] {
        *q += Vector6::from_fn(|_, _| random.uniform(-0.5, 0.5));
    }
    let push = |t: f64| Vector3::new(3e3, -2e3, 1e3) * (20.0 * t).sin();
    let errors = errors(&equation, start, 1.0, 128, push);
    let orders = orders(errors);
    println!("large motion: errors {errors:?}, orders {orders:.2?}");
    assert!(orders.iter().all(|order| (4.7..5.3).contains(order)), "{errors:?}: {orders:?}");
}

/// Links of 2 kg in the hardest bushings of the bounds: rates up to 1e7/s.
fn light_and_stiff() -> EquationOfMotion {
    let link = Link {
        mass: 2.0,
        centre_of_mass: Vector3::new(0.1, 0.02, -0.03),
        inertia: Matrix3::from_diagonal(&Vector3::new(0.02, 0.025, 0.03)),
    };
    let joint = |axis| Joint {
        origin: Translation3::new(0.3, 0.05, 0.1).into(),
        axis,
        kind: JointKind::Revolute,
        link,
    };
    let joints = [Vector3::z_axis(), Vector3::y_axis(), Vector3::y_axis()].map(joint);
    let chain = Chain::new(&joints, Translation3::new(0.3, 0.0, 0.1).into()).unwrap();
    let bushing = Bushing {
        stiffness: [2e8, 2e8, 2e8, 1e8, 1e8, 1e8],
        damping: [1e5, 1e5, 1e5, 5e4, 5e4, 5e4],
    };
    EquationOfMotion::new(&chain, &[0.3, -0.5, 1.0], EARTH, &[bushing; 3]).unwrap()
}

/// Runge and Kutta's method of order 4.
fn explicit(
    equation: &EquationOfMotion,
    seconds: f64,
    steps: usize,
    push: impl Fn(f64) -> Vector3<f64>,
) -> State {
    let ahead = |state: &State, step: f64, slope: &State| {
        let mut state = *state;
        for joint in 0..equation.joints() {
            state.elongation[joint] += step * slope.elongation[joint];
            state.rate[joint] += step * slope.rate[joint];
        }
        state
    };
    let slope = |state: &State, time: f64| State {
        elongation: state.rate,
        rate: equation.forward_dynamics(state, &push(time)),
    };
    let h = seconds / steps as f64;
    let mut state = equation.rest();
    for n in 0..steps {
        let t = n as f64 * h;
        let a = slope(&state, t);
        let b = slope(&ahead(&state, h / 2.0, &a), t + h / 2.0);
        let c = slope(&ahead(&state, h / 2.0, &b), t + h / 2.0);
        let d = slope(&ahead(&state, h, &c), t + h);
        for (part, slope) in [(h / 6.0, a), (h / 3.0, b), (h / 3.0, c), (h / 6.0, d)] {
            state = ahead(&state, part, &slope);
        }
    }
    state
}

#[test]
fn stiff_bushings_ask_for_no_small_steps() {
    let equation = light_and_stiff();
    let push = |t: f64| 10.0 * push(t);
    let seconds = 0.02;
    let exact = explicit(&equation, seconds, 200_000, push);
    let long = explicit(&equation, seconds, 160, push);
    let size: f64 = long.elongation.iter().map(|q| q.norm()).sum();
    assert!(size.is_nan() || size > 1.0, "an explicit method does it too: {size} m");

    let ours = moved(&equation, equation.rest(), seconds, 160, push);
    let error = apart(&ours, &exact);
    let [accelerated, expected] =
        [&ours, &exact].map(|state| equation.tcp_acceleration(state, &push(seconds), Inertial));
    let acceleration_error = (accelerated - expected).norm() / expected.norm();
    println!(
        "light and stiff, 8 kHz: displacement {error:.1e}, acceleration {acceleration_error:.1e}"
    );
    assert!(error < 1e-8, "{error:e}");
    assert!(acceleration_error < 1e-5, "{acceleration_error:e}");
}

/// An arm that turns in a plane until it points along the force.
#[test]
fn a_step_that_cannot_be_made_is_an_error() {
    let mut joint = mill3().joints()[2];
    joint.link.centre_of_mass = Vector3::x();
    let arm = Chain::new(&[joint], Translation3::new(1.0, 0.0, 0.0).into()).unwrap();
    let soft = Bushing { stiffness: [1e6, 1e6, 1e6, 1e6, 10.0, 1e6], damping: [100.0; 6] };
    let equation = EquationOfMotion::new(&arm, &[0.0], Vector3::zeros(), &[soft]).unwrap();
    let mut radau = Radau::new(equation, State::default(), 1e-4);
    let ended = (0..10_000).find(|_| radau.step(|_| Vector3::new(0.0, 0.0, 1e4)).is_err());
    assert!(ended.is_some());
    let state = *radau.state();
    assert!((1.5..1.56).contains(&-state.elongation[0][4]), "{:?}", state.elongation[0]);
    assert!(radau.step(|_| Vector3::repeat(f64::NAN)).is_err());
    assert_eq!(*radau.state(), state);
}
