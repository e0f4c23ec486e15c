//! The robot's motion at its TCP, integrated in time: `M q̈ + D q̇ + K q = Jᵀ F` about the static pose.
//!
//! Shares nothing with the receptance recursion that identifies: dense matrices over all 6J bushing
//! coordinates, from each link's Jacobian.
//!
//! The force runs in straight lines from one step to the next, and for such a force the matrix exponential
//! gives the exact motion: rounding is the only error, whatever the step. Stiff modes cost nothing.

use flexid_core::chain::Chain;
use flexid_core::parameters::Bushing;
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Matrix3xX, Vector3};

/// Scales velocities to the size of displacements, which balances the exponential; rad/s.
const BALANCE: f64 = 600.0;

/// Motion of the TCP along its axes at the static pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// m.
    pub displacement: Vector3<f64>,
    /// m/s².
    pub acceleration: Vector3<f64>,
}

/// The matrices of the equation of motion; rows and columns are bushing coordinates, joint by joint from
/// the base, `tx ty tz rx ry rz` along the axes of the turned joint frame.
#[derive(Clone, Debug, PartialEq)]
pub struct EquationOfMotion {
    /// kg, kg m, kg m²; N×N, symmetric positive definite.
    pub mass: DMatrix<f64>,
    /// Diagonal, N/m and Nm/rad.
    pub stiffness: DVector<f64>,
    /// Diagonal, Ns/m and Nms/rad.
    pub damping: DVector<f64>,
    /// TCP displacement along TCP axes per coordinate, 3×N, m/m and m/rad.
    pub tcp: Matrix3xX<f64>,
}

/// A robot that is being pushed.
#[derive(Clone, Debug)]
pub struct Plant {
    /// `state ← transition·state + start·F(n) + end·F(n+1)`.
    transition: DMatrix<f64>,
    start: DMatrix<f64>,
    end: DMatrix<f64>,
    /// `[displacement; acceleration]` (6) of the state, and the acceleration's share of the force.
    output: DMatrix<f64>,
    mobility: Matrix3<f64>,
    /// Coordinates, then their rates over [`BALANCE`].
    state: DVector<f64>,
    scratch: DVector<f64>,
    force: Vector3<f64>,
}

impl EquationOfMotion {
    /// At joint angles `pose`, rad (m): one angle and one bushing a joint.
    pub fn new(chain: &Chain, pose: &[f64], bushings: &[Bushing]) -> Self {
        let joints = chain.joints();
        let n = 6 * joints.len();
        let mut frames = Vec::with_capacity(joints.len());
        let mut frame = Isometry3::identity();
        for (joint, &angle) in joints.iter().zip(pose) {
            frame *= joint.frame(angle);
            frames.push(frame);
        }

        let mut mass = DMatrix::zeros(n, n);
        for (index, joint) in joints.iter().enumerate() {
            let link = &joint.link;
            let centre = frames[index] * nalgebra::Point3::from(link.centre_of_mass);
            let (slide, turn) = jacobian(&frames[..=index], n, centre.coords);
            let rotation = frames[index].rotation.to_rotation_matrix().into_inner();
            let inertia = rotation * link.inertia * rotation.transpose();
            mass += link.mass * slide.tr_mul(&slide) + turn.tr_mul(&(inertia * &turn));
        }
        let tcp = frame * chain.tcp();
        let (slide, _) = jacobian(&frames, n, tcp.translation.vector);
        let axes = tcp.rotation.to_rotation_matrix().into_inner();
        let diagonal = |part: fn(&Bushing) -> &[f64; 6]| {
            DVector::from_iterator(n, bushings.iter().flat_map(|bushing| *part(bushing)))
        };
        Self {
            mass,
            stiffness: diagonal(|bushing| &bushing.stiffness),
            damping: diagonal(|bushing| &bushing.damping),
            tcp: axes.transpose() * slide,
        }
    }
}

/// Velocity of `point` and angular velocity of the last of `frames`, base axes, per bushing rate: 3×n each.
fn jacobian(
    frames: &[Isometry3<f64>],
    n: usize,
    point: Vector3<f64>,
) -> (Matrix3xX<f64>, Matrix3xX<f64>) {
    let (mut slide, mut turn) = (Matrix3xX::zeros(n), Matrix3xX::zeros(n));
    for (joint, frame) in frames.iter().enumerate() {
        let lever = point - frame.translation.vector;
        for dof in 0..3 {
            let axis = frame.rotation * Vector3::ith(dof, 1.0);
            slide.set_column(6 * joint + dof, &axis);
            slide.set_column(6 * joint + 3 + dof, &axis.cross(&lever));
            turn.set_column(6 * joint + 3 + dof, &axis);
        }
    }
    (slide, turn)
}

impl Plant {
    /// A robot at rest, to be advanced by steps of `step_s` seconds.
    ///
    /// `None` if its mass matrix is not positive definite, which a [`Chain`]'s always is, or if its numbers
    /// leave the range of floating point.
    pub fn new(motion: &EquationOfMotion, step_s: f64) -> Option<Self> {
        let n = motion.stiffness.len();
        let inverse = motion.mass.clone().cholesky()?.inverse();
        let spring = &inverse * DMatrix::from_diagonal(&motion.stiffness);
        let damper = &inverse * DMatrix::from_diagonal(&motion.damping);
        let push = &inverse * motion.tcp.transpose();

        // d/dt of (q, q̇/B, F, slope·step): the force is part of the state while a step lasts.
        let mut flow = DMatrix::zeros(2 * n + 6, 2 * n + 6);
        flow.view_mut((0, n), (n, n)).fill_diagonal(BALANCE * step_s);
        flow.view_mut((n, 0), (n, n)).copy_from(&(-step_s / BALANCE * &spring));
        flow.view_mut((n, n), (n, n)).copy_from(&(-step_s * &damper));
        flow.view_mut((n, 2 * n), (n, 3)).copy_from(&(step_s / BALANCE * &push));
        flow.view_mut((2 * n, 2 * n + 3), (3, 3)).fill_diagonal(1.0);
        if !flow.iter().all(|number: &f64| number.is_finite()) {
            return None;
        }
        let flow = flow.exp();
        let held = flow.view((0, 2 * n), (2 * n, 3)).into_owned();
        let ramp = flow.view((0, 2 * n + 3), (2 * n, 3)).into_owned();

        let mut output = DMatrix::zeros(6, 2 * n);
        output.view_mut((0, 0), (3, n)).copy_from(&motion.tcp);
        output.view_mut((3, 0), (3, n)).copy_from(&(-&motion.tcp * spring));
        output.view_mut((3, n), (3, n)).copy_from(&(-BALANCE * &motion.tcp * damper));
        let mobility = &motion.tcp * push;
        Some(Self {
            transition: flow.view((0, 0), (2 * n, 2 * n)).into_owned(),
            start: held - &ramp,
            end: ramp,
            output,
            mobility,
            state: DVector::zeros(2 * n),
            scratch: DVector::zeros(2 * n),
            force: Vector3::zeros(),
        })
    }

    /// One step, during which the force on the TCP (its axes, N) goes straight from the last one to
    /// `force`; before the first step it is 0.
    pub fn advance(&mut self, force: Vector3<f64>) {
        self.scratch.gemv(1.0, &self.transition, &self.state, 0.0);
        self.scratch.gemv(1.0, &self.start, &self.force, 1.0);
        self.scratch.gemv(1.0, &self.end, &force, 1.0);
        std::mem::swap(&mut self.state, &mut self.scratch);
        self.force = force;
    }

    /// How the TCP moves now.
    pub fn motion(&self) -> Motion {
        let output = &self.output * &self.state;
        Motion {
            displacement: output.fixed_rows::<3>(0).into_owned(),
            acceleration: output.fixed_rows::<3>(3) + self.mobility * self.force,
        }
    }
}

#[cfg(test)]
mod tests {
    use flexid_edge::model::Kind;
    use nalgebra::{Point3, Translation3, UnitQuaternion};
    use rand_core::{Rng as _, SeedableRng as _};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::simulation::scenario::tests::mill3;

    const POSE: [f64; 3] = [0.7, -1.1, 1.9];

    fn nominal() -> EquationOfMotion {
        let (scenario, chain) = mill3();
        EquationOfMotion::new(&chain, &POSE, &scenario.truth)
    }

    /// A push that is smooth, so that the straight lines between steps are its only error.
    fn push(t: f64) -> Vector3<f64> {
        let shape = (std::f64::consts::PI * (t / 0.2).min(1.0)).sin().powi(4);
        Vector3::new(300.0, -200.0, 100.0) * shape * (1.0 + (2.0 * t * 300.0).sin())
    }

    /// One that has been pushed for so long.
    fn pushed(motion: &EquationOfMotion, step: f64, seconds: f64) -> Plant {
        let mut plant = Plant::new(motion, step).unwrap();
        let steps = (seconds / step).round() as usize;
        (1..=steps).for_each(|n| plant.advance(push(n as f64 * step)));
        plant
    }

    /// Of the bushing coordinates, per second.
    fn rates(plant: &Plant) -> DVector<f64> {
        let n = plant.state.len() / 2;
        BALANCE * plant.state.rows(n, n)
    }

    /// Of the TCP along its axes, m/s.
    fn velocity(plant: &Plant, motion: &EquationOfMotion) -> Vector3<f64> {
        (&motion.tcp * rates(plant)).fixed_rows::<3>(0).into_owned()
    }

    /// Kinetic energy and that of the springs, and the power that the dampers take: J and W.
    fn energy(plant: &Plant, motion: &EquationOfMotion) -> (f64, f64) {
        let (q, rate) = (plant.state.rows(0, motion.stiffness.len()), rates(plant));
        let kinetic = 0.5 * rate.dot(&(&motion.mass * &rate));
        let elastic = 0.5 * q.component_mul(&q).dot(&motion.stiffness);
        (kinetic + elastic, rate.component_mul(&rate).dot(&motion.damping))
    }

    /// The same equation by Runge and Kutta's method at a step of 5 µs: nothing shared but M, K, D, J.
    fn runge_kutta(motion: &EquationOfMotion, seconds: f64) -> Vector3<f64> {
        let n = motion.stiffness.len();
        let inverse = motion.mass.clone().try_inverse().unwrap();
        let rate = |t: f64, (q, v): (&DVector<f64>, &DVector<f64>)| {
            let load = motion.tcp.tr_mul(&push(t))
                - motion.stiffness.component_mul(q)
                - motion.damping.component_mul(v);
            (v.clone(), &inverse * load)
        };
        let h = 5e-6;
        let (mut q, mut v) = (DVector::zeros(n), DVector::zeros(n));
        for step in 0..(seconds / h).round() as usize {
            let t = step as f64 * h;
            let a = rate(t, (&q, &v));
            let b = rate(t + h / 2.0, (&(&q + h / 2.0 * &a.0), &(&v + h / 2.0 * &a.1)));
            let c = rate(t + h / 2.0, (&(&q + h / 2.0 * &b.0), &(&v + h / 2.0 * &b.1)));
            let d = rate(t + h, (&(&q + h * &c.0), &(&v + h * &c.1)));
            q += h / 6.0 * (a.0 + 2.0 * b.0 + 2.0 * c.0 + d.0);
            v += h / 6.0 * (a.1 + 2.0 * b.1 + 2.0 * c.1 + d.1);
        }
        &motion.tcp * q
    }

    #[test]
    fn the_motion_does_not_depend_on_the_step() {
        let motion = nominal();
        let at = |step| pushed(&motion, step, 0.25).motion().displacement;
        let exact = at(2.5e-6);
        // Straight lines between steps err with the square of the step.
        let errors = [1e-4, 5e-5, 2e-5].map(|step| (at(step) - exact).norm() / exact.norm());
        assert!(errors[2] < 1e-4, "{errors:?}");
        assert!((3.7..4.3).contains(&(errors[0] / errors[1])), "{errors:?}");
    }

    #[test]
    fn another_integrator_finds_the_same_motion() {
        let motion = nominal();
        let here = pushed(&motion, 2e-6, 0.1).motion().displacement;
        let there = runge_kutta(&motion, 0.1);
        assert!((here - there).norm() < 1e-6 * there.norm(), "{here} {there}");
    }

    #[test]
    fn the_work_of_the_force_is_stored_or_turned_to_heat() {
        let motion = nominal();
        let step = 1e-5;
        let mut plant = Plant::new(&motion, step).unwrap();
        let (mut work, mut heat) = (0.0, 0.0);
        let (mut power, mut loss) = (0.0, 0.0);
        for n in 1..=30_000 {
            let force = push(f64::from(n) * step);
            plant.advance(force);
            let now = velocity(&plant, &motion).dot(&force);
            let (_, taken) = energy(&plant, &motion);
            work += 0.5 * step * (power + now);
            heat += 0.5 * step * (loss + taken);
            (power, loss) = (now, taken);
        }
        let (stored, _) = energy(&plant, &motion);
        assert!(stored > 0.05 * work && heat > 0.05 * work, "{work} J is {stored} and {heat}");
        assert!((work - stored - heat).abs() < 1e-5 * work, "{work} J is not {stored} + {heat}");
    }

    #[test]
    fn velocity_and_acceleration_are_the_slopes() {
        let motion = nominal();
        let step = 1e-5;
        for at in [0.02, 0.05, 0.09] {
            let [before, now, after] =
                [at - step, at, at + step].map(|seconds| pushed(&motion, step, seconds));
            let moved = after.motion().displacement - before.motion().displacement;
            let speed = velocity(&now, &motion);
            assert!((moved / (2.0 * step) - speed).norm() < 1e-4 * speed.norm());
            let gained = velocity(&after, &motion) - velocity(&before, &motion);
            let acceleration = now.motion().acceleration;
            assert!((gained / (2.0 * step) - acceleration).norm() < 1e-3 * acceleration.norm());
        }
    }

    /// Under a constant force the robot comes to rest where the springs of all bushings in series say.
    #[test]
    fn a_constant_force_ends_in_the_static_deflection() {
        let (scenario, chain) = mill3();
        let mut bushings = scenario.truth.clone();
        for bushing in &mut bushings {
            bushing.damping = bushing.damping.map(|damping| 20.0 * damping);
        }
        let motion = EquationOfMotion::new(&chain, &POSE, &bushings);
        let force = Vector3::new(100.0, 200.0, -50.0);
        let mut plant = Plant::new(&motion, 1e-3).unwrap();
        (0..20_000).for_each(|_| plant.advance(force));
        let compliance = motion.tcp.clone()
            * DMatrix::from_diagonal(&motion.stiffness.map(f64::recip))
            * motion.tcp.transpose();
        let rest = compliance * force;
        assert!((plant.motion().displacement - rest).norm() < 1e-9 * rest.norm());
    }

    /// Poses of all links and of the TCP with the bushings displaced by `q`: the chain, not linearised.
    fn poses(chain: &Chain, pose: &[f64], q: &[f64]) -> Vec<Isometry3<f64>> {
        let mut frame = Isometry3::identity();
        let mut poses = Vec::new();
        for (index, joint) in chain.joints().iter().enumerate() {
            let q = &q[6 * index..6 * index + 6];
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(q[3], q[4], q[5]));
            let bushing = Isometry3::from_parts(Translation3::new(q[0], q[1], q[2]), turn);
            frame *= joint.frame(pose[index]) * bushing;
            poses.push(frame);
        }
        poses.push(frame * chain.tcp());
        poses
    }

    /// Kinetic energy and TCP velocity (TCP axes) of the bushing rates, from differences of the poses.
    fn moving(chain: &Chain, pose: &[f64], rate: &[f64]) -> (f64, Vector3<f64>) {
        const H: f64 = 1e-5;
        let at = |time: f64| {
            let q: Vec<_> = rate.iter().map(|rate| time * rate).collect();
            poses(chain, pose, &q)
        };
        let (before, now, after) = (at(-H), at(0.0), at(H));
        let mut energy = 0.0;
        for (index, joint) in chain.joints().iter().enumerate() {
            let centre =
                |frame: &Isometry3<f64>| (frame * Point3::from(joint.link.centre_of_mass)).coords;
            let velocity = (centre(&after[index]) - centre(&before[index])) / (2.0 * H);
            let turn = before[index].rotation.inverse() * after[index].rotation;
            // In the link's axes, like the inertia.
            let spin = turn.scaled_axis() / (2.0 * H);
            energy += 0.5 * joint.link.mass * velocity.norm_squared();
            energy += 0.5 * spin.dot(&(joint.link.inertia * spin));
        }
        let tcp = chain.joints().len();
        let velocity = (after[tcp].translation.vector - before[tcp].translation.vector) / (2.0 * H);
        (energy, now[tcp].rotation.inverse() * velocity)
    }

    /// Mass matrix and Jacobian against energy and velocity of the chain that is not linearised: seven
    /// turning joints, and a slide among them.
    #[test]
    fn energy_and_velocity_are_those_of_the_chain() {
        let text = include_str!("../../tests/urdf/kuka_iiwa14.urdf");
        let mut model = crate::urdf::import(text, "iiwa_link_ee").unwrap().model;
        model.joints[3].kind = Kind::Prismatic;
        let chain = model.chain().unwrap();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut draw = |count: usize| -> Vec<f64> {
            (0..count)
                .map(|_| 2.0 * (f64::from(rng.next_u32()) / f64::from(u32::MAX)) - 1.0)
                .collect()
        };
        for _ in 0..20 {
            let (pose, rate) = (draw(7), draw(42));
            let motion = EquationOfMotion::new(&chain, &pose, &[Bushing::default(); 7]);
            let rates = DVector::from_column_slice(&rate);
            let (energy, velocity) = moving(&chain, &pose, &rate);
            let linear = 0.5 * rates.dot(&(&motion.mass * &rates));
            assert!((linear - energy).abs() < 1e-6 * energy, "{linear} J is not {energy} J");
            assert!((&motion.tcp * &rates - velocity).norm() < 1e-6 * velocity.norm());
        }
    }
}
