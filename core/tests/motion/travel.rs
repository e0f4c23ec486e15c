//! Joint frames that move as prescribed, against Lagrange's equations by differences of the energy, and against closed forms.

use flexid_core::chain::{Chain, Joint, JointKind, Link};
use flexid_core::motion::radau::Radau;
use flexid_core::motion::travel::{FrameMotion, Travel};
use flexid_core::motion::{Coordinates, EquationOfMotion, State};
use flexid_core::parameters::Bushing;
use nalgebra::{Complex, DVector, Isometry3, Matrix3, Point3, Vector3};

use super::mechanics::poses;
use crate::common::Random;

const EARTH: Vector3<f64> = Vector3::new(0.3, -0.7, -9.8);

/// Joint angles, rates and accelerations that are quadratic in time.
#[derive(Clone)]
struct Drives {
    angle: Vec<f64>,
    rate: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Drives {
    fn random(random: &mut Random, joints: usize) -> Self {
        let mut draw = |size: f64| (0..joints).map(|_| random.uniform(-size, size)).collect();
        Self { angle: draw(1.5), rate: draw(2.0), acceleration: draw(8.0) }
    }

    fn at(&self, time: f64) -> [Vec<f64>; 2] {
        let joints = 0..self.angle.len();
        let rate = |n: usize| self.rate[n] + self.acceleration[n] * time;
        let angle = |n: usize| self.angle[n] + 0.5 * (self.rate[n] + rate(n)) * time;
        [joints.clone().map(angle).collect(), joints.map(rate).collect()]
    }

    fn travel(&self, chain: &Chain, time: f64, rest: Coordinates) -> Travel {
        let [angle, rate] = self.at(time);
        let mut travel = Travel { rest, ..Travel::default() };
        for (n, (joint, frame)) in chain.joints().iter().zip(&mut travel.frames).enumerate() {
            *frame = joint.frame_motion(angle[n], rate[n], self.acceleration[n]);
        }
        travel
    }
}

/// `L = T − V` of the elongations and their rates at one instant of the drives: nothing but poses, at two instants.
fn lagrangian(chain: &Chain, drives: &Drives, time: f64, state: &State) -> f64 {
    const H: f64 = 1e-3;
    let at = |steps: f64| {
        let mut moved = state.elongation;
        moved.iter_mut().zip(&state.rate).for_each(|(q, rate)| *q += steps * H * rate);
        // The rate of the drives is that of the instant, as the rate of the bushings is.
        let [angle, rate] = drives.at(time);
        let angle: Vec<f64> = angle.iter().zip(&rate).map(|(q, v)| q + steps * H * v).collect();
        poses(chain, &angle, &moved)
    };
    let all = [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0].map(at);
    // Order 6.
    let slope = |of: &dyn Fn(&Isometry3<f64>) -> Vector3<f64>, link: usize| {
        let one = |n: usize| of(&all[n][link]);
        (45.0 * (one(4) - one(2)) - 9.0 * (one(5) - one(1)) + (one(6) - one(0))) / (60.0 * H)
    };
    let mut energy = 0.0;
    for (index, joint) in chain.joints().iter().enumerate() {
        let now = all[3][index];
        let centre =
            |frame: &Isometry3<f64>| (frame * Point3::from(joint.link.centre_of_mass)).coords;
        let turn = |frame: &Isometry3<f64>| (now.rotation.inverse() * frame.rotation).scaled_axis();
        let (velocity, spin) = (slope(&centre, index), slope(&turn, index));
        energy += 0.5 * joint.link.mass * velocity.norm_squared();
        energy += 0.5 * spin.dot(&(joint.link.inertia * spin));
        energy += joint.link.mass * EARTH.dot(&centre(&now));
    }
    energy
}

/// `d/dt ∂L/∂q̇ − ∂L/∂q` along a motion of constant acceleration, by differences.
fn loads(
    chain: &Chain,
    drives: &Drives,
    state: &State,
    acceleration: &Coordinates,
) -> DVector<f64> {
    const H: f64 = 1e-3;
    let size = 6 * chain.joints().len();
    // L is quadratic in the rates, so that any step gives the exact slope.
    let momentum = |time: f64, dof: usize| {
        let mut there = *state;
        for (n, a) in acceleration.iter().enumerate() {
            there.elongation[n] += time * state.rate[n] + 0.5 * time * time * a;
            there.rate[n] += time * a;
        }
        let at = |step: f64| {
            let mut there = there;
            there.rate[dof / 6][dof % 6] += step;
            lagrangian(chain, drives, time, &there)
        };
        (at(1.0) - at(-1.0)) / 2.0
    };
    let force = |dof: usize| {
        let at = |step: f64| {
            let mut there = *state;
            there.elongation[dof / 6][dof % 6] += step;
            lagrangian(chain, drives, 0.0, &there)
        };
        (8.0 * (at(H) - at(-H)) - (at(2.0 * H) - at(-2.0 * H))) / (12.0 * H)
    };
    DVector::from_fn(size, |dof, _| {
        let of = |steps: f64| momentum(steps * H, dof);
        (8.0 * (of(1.0) - of(-1.0)) - (of(2.0) - of(-2.0))) / (12.0 * H) - force(dof)
    })
}

fn flat(all: &Coordinates, joints: usize) -> DVector<f64> {
    DVector::from_iterator(6 * joints, all.iter().flatten().copied().take(6 * joints))
}

fn coordinates(random: &mut Random, joints: usize, size: f64) -> Coordinates {
    let mut all = Coordinates::default();
    all[..joints].iter_mut().flatten().for_each(|x| *x = random.uniform(-size, size));
    all
}

/// The equation at an instant of the drives: that after a step during which they have stayed there.
fn equation(chain: &Chain, drives: &Drives) -> EquationOfMotion {
    let free = vec![Bushing::default(); chain.joints().len()];
    let [pose, _] = drives.at(0.0);
    let rest = Coordinates::default();
    let about = EquationOfMotion::about(chain, &pose, EARTH, &free, rest).unwrap();
    let mut robot = Radau::new(about, State::default(), 1e-6);
    let travel = |_: f64| drives.travel(chain, 0.0, rest);
    // Without any load the links would fall freely, and nothing would tell the step that it has converged.
    robot.step_along(travel, |_| Vector3::repeat(1e3), |_, _| rest).unwrap();
    robot.equation().clone()
}

#[test]
fn loads_are_those_of_lagrange() {
    for (seed, joints) in [(1, 1), (2, 2), (3, 3), (4, 3), (5, 4)] {
        let mut random = Random::new(seed);
        let chain = random.chain(joints);
        let drives = Drives::random(&mut random, joints);
        let state = State {
            elongation: coordinates(&mut random, joints, 0.8),
            rate: coordinates(&mut random, joints, 1.0),
        };
        let acceleration = coordinates(&mut random, joints, 3.0);
        let equation = equation(&chain, &drives);
        let ours = equation.inverse_dynamics(&state, &acceleration, &Vector3::zeros());
        let dense = loads(&chain, &drives, &state, &acceleration);
        let error = (flat(&ours, joints) - &dense).norm() / dense.norm();
        assert!(error < 1e-7, "{joints} joints: {error:e}");
        assert!(error > 1e-14, "{error:e} is too good to be a comparison");
        let back = equation.forward_dynamics(&state, &Vector3::zeros());
        let still = equation.inverse_dynamics(&state, &back, &Vector3::zeros());
        assert!(flat(&still, joints).norm() < 1e-9 * dense.norm());
    }
}

/// A frame that is fixed on another moves as the product of their poses.
#[test]
fn a_frame_on_a_frame_moves_as_the_poses_say() {
    let mut random = Random::new(7);
    let chain = random.chain(1);
    let drives = Drives::random(&mut random, 1);
    let pose =
        |random: &mut Random| Isometry3::from_parts(random.vector(1.0).into(), random.rotation());
    let (before, after) = (pose(&mut random), pose(&mut random));
    let at = |time: f64| {
        let frame = drives.travel(&chain, time, Coordinates::default()).frames[0];
        frame.between(&before, &after)
    };
    const H: f64 = 1e-4;
    let [back, now, ahead] = [-H, 0.0, H].map(at);
    let to = now.pose.rotation.inverse();
    let place = |frame: FrameMotion| frame.pose.translation.vector;
    let velocity = to * (place(ahead) - place(back)) / (2.0 * H);
    let acceleration = to * (place(ahead) - 2.0 * place(now) + place(back)) / (H * H);
    let turned = ahead.pose.rotation * back.pose.rotation.inverse();
    let spin = to * turned.scaled_axis() / (2.0 * H);
    let spin_of = |one: FrameMotion| one.pose.rotation * one.spin;
    let spin_rate = to * (spin_of(ahead) - spin_of(back)) / (2.0 * H);
    for (found, expected) in [
        (now.velocity, velocity),
        (now.acceleration, acceleration),
        (now.spin, spin),
        (now.spin_rate, spin_rate),
    ] {
        assert!(expected.norm() > 0.1 && (found - expected).norm() < 1e-5, "{found} {expected}");
    }
}

/// A mass on a spring of the same stiffness in all directions, the other end of which turns about the base with the spin Ω at the radius a.
/// In the plane `W = (a + x + iy) e^(iΩt)` obeys `Ẅ = −κ (W − a e^(iΩt))` with κ = k/m:
///
/// ```text
/// W = p e^(iΩt) + c e^(i√κ t) + d e^(−i√κ t)          p = a κ / (κ − Ω²)
/// ```
#[test]
fn a_mass_on_a_turning_spring_moves_as_in_closed_form() {
    const MASS: f64 = 3.0;
    let (radius, spin, stiffness) = (0.8, 5.0, 600.0);
    let link =
        Link { mass: MASS, centre_of_mass: Vector3::zeros(), inertia: Matrix3::identity() * 0.1 };
    let (origin, axis, kind) = (Isometry3::identity(), Vector3::z_axis(), JointKind::Revolute);
    let joint = Joint { origin, axis, kind, link };
    let chain = Chain::new(&[joint], Isometry3::identity()).unwrap();
    let bushing = Bushing { stiffness: [stiffness; 6], damping: [0.0; 6] };
    let at_rest = Coordinates::default();
    let about =
        EquationOfMotion::about(&chain, &[0.0], Vector3::zeros(), &[bushing], at_rest).unwrap();
    let arm = Isometry3::translation(radius, 0.0, 0.0);
    const STEP: f64 = 1e-3;
    let mut robot = Radau::new(about, State::default(), STEP);
    let natural = (stiffness / MASS).sqrt();
    let carried = radius * natural * natural / (natural * natural - spin * spin);
    // W = a and Ẇ = iΩa at the start.
    let (sum, difference) = (radius - carried, spin * (radius - carried) / natural);
    let (ahead, back) = (0.5 * (sum + difference), 0.5 * (sum - difference));
    let mut most = 0.0_f64;
    for step in 0..2000 {
        let travel = |part: f64| {
            let time = (f64::from(step) + part) * STEP;
            let mut travel = Travel::default();
            let frame = joint.frame_motion(spin * time, spin, 0.0);
            travel.frames[0] = frame.between(&Isometry3::identity(), &arm);
            travel
        };
        robot.step_along(travel, |_| Vector3::zeros(), |_, _| Coordinates::default()).unwrap();
        let time = f64::from(step + 1) * STEP;
        let turned = |size: f64, rate: f64| Complex::from_polar(size, rate * time);
        let whole = turned(carried, spin) + turned(ahead, natural) + turned(back, -natural);
        let expected = whole * turned(1.0, -spin) - radius;
        let found = robot.state().elongation[0];
        assert!((found[0] - expected.re).abs() + (found[1] - expected.im).abs() < 1e-9);
        assert!(found.rows(2, 4).amax() < 1e-12, "nothing else moves");
        most = most.max(found[0]);
    }
    assert!(most > 0.1, "the spring gives way by {most} m");
}

/// An integrator of order 5: half the step leaves a thirty-second of the error.
#[test]
fn the_integration_along_a_path_keeps_its_order() {
    let mut random = Random::new(11);
    let chain = random.chain(3);
    let drives = Drives::random(&mut random, 3);
    let bushing = Bushing { stiffness: [3e4; 6], damping: [1e3; 6] };
    let [pose, _] = drives.at(0.0);
    let end = |steps: u32| {
        let rest = Coordinates::default();
        let about = EquationOfMotion::about(&chain, &pose, EARTH, &[bushing; 3], rest).unwrap();
        let step_s = 0.1 / f64::from(steps);
        let mut robot = Radau::new(about, State::default(), step_s);
        for step in 0..steps {
            let travel = |part: f64| drives.travel(&chain, (f64::from(step) + part) * step_s, rest);
            robot.step_along(travel, |_| Vector3::repeat(50.0), |_, _| rest).unwrap();
        }
        flat(&robot.state().elongation, 3)
    };
    let exact = end(160);
    let [coarse, fine] = [10, 20].map(|steps| (end(steps) - &exact).norm());
    let order = (coarse / fine).log2();
    assert!(coarse < 1e-2 * exact.norm() && (4.5..5.7).contains(&order), "{coarse:e} {order}");
}
