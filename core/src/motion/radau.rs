//! Time integration: Radau IIA with three stages (Hairer and Wanner, _Solving Ordinary Differential Equations II_, IV.5 and
//! IV.8), constant step, written for a second-order system.
//!
//! The method has order 5 and stage order 3. It is L-stable and stiffly accurate: the last stage is the end of the step. A
//! stiff or strongly damped bushing needs no small step and costs no accuracy.
//!
//! The unknowns are the accelerations `A_i` at the three stages,
//!
//! ```text
//! V_i = v + h Σ a_ij A_j        Q_i = q + h c_i v + h² Σ (a²)_ij A_j        r(Q_i, V_i, A_i, F_i) = 0
//! ```
//!
//! with the imbalance r of inverse dynamics. Newton's method with the matrices of a frozen chain gives
//! `M δA_i + h D Σ a_ij δA_j + h² K Σ (a²)_ij δA_j = −r_i`. Along an eigenvector of a with the eigenvalue
//! `1/(h s)` this is the chain's dynamic stiffness at s: `(s²M + sD + K) δ/s² = −r̂`. It is solved once for the real
//! eigenvalue and once for the pair.

use core::error::Error;
use core::fmt;

use nalgebra::{Complex, ComplexField, Matrix3, RowVector3, Vector3, Vector6};

use super::impedance::Impedance;
use super::inverse::Imbalance;
use super::travel::Travel;
use super::{Coordinates, EquationOfMotion, Loads, State};
use crate::MAX_JOINTS;

/// Largest remaining imbalance, as a part of the loads.
const TOLERANCE: f64 = 1e-12;
/// Number of corrections after which a step fails.
const MOST_CORRECTIONS: usize = 40;
/// Number of corrections after which the matrices are renewed. In small motion two or three corrections are enough.
const STALE_AFTER: usize = 5;

/// Largest `|ry|` of a step, rad. At a quarter turn the coordinates are singular, and a motion that passes close by would
/// turn `rx` and `rz` by half a turn within a step.
const MOST_TURN: f64 = 1.55;

/// The step failed: its corrections have not converged, a bushing has turned to `ry = ±89°`, or a number has left
/// the range of floating point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotConverged;

impl fmt::Display for NotConverged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the motion leaves the range of its coordinates, or the step does not converge: shorten the step or stiffen the robot")
    }
}

impl Error for NotConverged {}

/// A robot that moves step by step.
#[derive(Clone, Debug, PartialEq)]
pub struct Radau {
    equation: EquationOfMotion,
    step_s: f64,
    method: Method,
    real: Mode<f64>,
    pair: Mode<Complex<f64>>,
    state: State,
    /// Accelerations at the stages of the last step.
    acceleration: [Coordinates; 3],
}

/// Coefficients of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Method {
    nodes: [f64; 3],
    a: Matrix3<f64>,
    a_squared: Matrix3<f64>,
    /// Matrix from values at the nodes of one step to those of the next: the parabola through them.
    extrapolation: Matrix3<f64>,
}

/// An eigenvalue of a, and its part of the stages' correction.
#[derive(Clone, Debug, PartialEq)]
struct Mode<T> {
    /// Frequency s of the eigenvalue `1/(h s)`, 1/s.
    s: T,
    /// Left eigenvector.
    left: RowVector3<T>,
    /// Right eigenvector, scaled so that `left · right` is 1 (for the pair 2, for its two halves).
    right: Vector3<T>,
    impedance: Impedance<T>,
}

impl Method {
    fn radau_iia() -> Self {
        let r = libm::sqrt(6.0);
        let nodes = [(4.0 - r) / 10.0, (4.0 + r) / 10.0, 1.0];
        #[rustfmt::skip]
        let a = Matrix3::new(
            (88.0 - 7.0 * r) / 360.0,     (296.0 - 169.0 * r) / 1800.0, (-2.0 + 3.0 * r) / 225.0,
            (296.0 + 169.0 * r) / 1800.0, (88.0 + 7.0 * r) / 360.0,     (-2.0 - 3.0 * r) / 225.0,
            (16.0 - r) / 36.0,            (16.0 + r) / 36.0,            1.0 / 9.0,
        );
        let extrapolation = Matrix3::from_fn(|to, from| {
            let others = (0..3).filter(|&other| other != from).map(|other| nodes[other]);
            others.map(|other| (1.0 + nodes[to] - other) / (nodes[from] - other)).product()
        });
        Self { nodes, a, a_squared: a * a, extrapolation }
    }

    /// `1/λ` of the real eigenvalue λ of a, and of one eigenvalue of the pair. They are roots of `z³ − 9z² + 36z − 60`, the
    /// denominator of the stability function.
    fn inverse_eigenvalues() -> (f64, Complex<f64>) {
        let real = 3.0 + libm::cbrt(9.0) - libm::cbrt(3.0);
        let half = 0.5 * (9.0 - real);
        (real, Complex::new(half, libm::sqrt(60.0 / real - half * half)))
    }
}

impl<T: ComplexField<RealField = f64> + Copy> Mode<T> {
    /// The mode of the eigenvalue `1/z` of `a`. `halves` is 1 for the real eigenvalue and 2 for the pair.
    fn new(
        a: &Matrix3<f64>,
        z: T,
        halves: f64,
        equation: &EquationOfMotion,
        start: &State,
        step_s: f64,
    ) -> Self {
        // Rows of a − λ are normal to the right eigenvector, columns to the left one.
        let mut singular = a.map(T::from_real);
        for stage in 0..3 {
            singular[(stage, stage)] -= z.recip();
        }
        let row = |row: usize| singular.row(row).transpose();
        let right = row(0).cross(&row(1));
        let left = singular.column(0).cross(&singular.column(1));
        let scale = T::from_real(halves) / left.dot(&right);
        let s = z.unscale(step_s);
        Self {
            s,
            left: left.transpose(),
            right: right * scale,
            impedance: Impedance::new(equation, &start.elongation, s),
        }
    }

    /// Adds this mode's part of the correction that cancels the imbalances.
    fn correct(&self, imbalances: &[Imbalance; 3], acceleration: &mut [Coordinates; 3]) {
        let joints = self.impedance.joints();
        let mut load = [Vector6::zeros(); MAX_JOINTS];
        for (joint, load) in load.iter_mut().enumerate().take(joints) {
            let [first, second, third] = imbalances.each_ref().map(|one| &one.load[joint]);
            *load = Vector6::from_fn(|dof, _| {
                let two = self.left[0].scale(first[dof]) + self.left[1].scale(second[dof]);
                -(two + self.left[2].scale(third[dof]))
            });
        }
        let solution = self.impedance.solve(&load);
        for (stage, acceleration) in acceleration.iter_mut().enumerate() {
            let part = self.right[stage] * self.s * self.s;
            for (acceleration, elongation) in acceleration.iter_mut().zip(&solution).take(joints) {
                *acceleration += elongation.map(|elongation| (part * elongation).real());
            }
        }
    }
}

impl Radau {
    /// A robot that starts from `start` and moves in steps of `step_s` seconds.
    pub fn new(equation: EquationOfMotion, start: State, step_s: f64) -> Self {
        let method = Method::radau_iia();
        let (real, pair) = Method::inverse_eigenvalues();
        Self {
            real: Mode::new(&method.a, real, 1.0, &equation, &start, step_s),
            pair: Mode::new(&method.a, pair, 2.0, &equation, &start, step_s),
            equation,
            step_s,
            method,
            state: start,
            acceleration: Default::default(),
        }
    }

    /// Makes one step. `force` gives the force on the TCP, N, along its axes at rest, at a part 0 to 1 of the step.
    ///
    /// # Errors
    ///
    /// Returns an error if the corrections do not converge, or if the motion leaves the range of the coordinates or of floating
    /// point. The state is then unchanged.
    pub fn step(&mut self, force: impl Fn(f64) -> Vector3<f64>) -> Result<(), NotConverged> {
        self.step_against(force, |_, _| Coordinates::default())
    }

    /// A [step](Radau::step) against bushings that resist beside their springs and dampers. `resistance` gives these loads, N and
    /// Nm, at a part 0 to 1 of the step and in the state there. A load that changes with the state by as much as the inertia
    /// over a step slows the iteration down, and the step may fail.
    ///
    /// # Errors
    /// As [`Radau::step`].
    pub fn step_against(
        &mut self,
        force: impl Fn(f64) -> Vector3<f64>,
        resistance: impl Fn(f64, &State) -> Coordinates,
    ) -> Result<(), NotConverged> {
        self.solve(None, force, resistance)
    }

    /// A [step against](Radau::step_against) resistance during which the joint frames move as `travel` gives it at a part 0 to 1 of the step. The
    /// TCP's axes at rest are those of the moment.
    ///
    /// # Errors
    /// As [`Radau::step`].
    pub fn step_along(
        &mut self,
        travel: impl Fn(f64) -> Travel,
        force: impl Fn(f64) -> Vector3<f64>,
        resistance: impl Fn(f64, &State) -> Coordinates,
    ) -> Result<(), NotConverged> {
        let ahead = self.method.nodes.map(|node| self.equation.at(&travel(node)));
        self.solve(Some(&ahead), force, resistance)?;
        let [.., end] = ahead;
        self.equation = end;
        Ok(())
    }

    /// Makes a step. `ahead` are the equations at the nodes where the joint frames move.
    fn solve(
        &mut self,
        ahead: Option<&[EquationOfMotion; 3]>,
        force: impl Fn(f64) -> Vector3<f64>,
        resistance: impl Fn(f64, &State) -> Coordinates,
    ) -> Result<(), NotConverged> {
        let nodes = self.method.nodes;
        let forces = nodes.map(force);
        let mut acceleration =
            combine(&self.method.extrapolation, &self.acceleration, self.equation.joints());
        let mut before = 0.0;
        for correction in 0..MOST_CORRECTIONS {
            let stages = self.stages(&acceleration);
            let imbalances = [0, 1, 2].map(|stage| {
                let (force, state) = (forces[stage], &stages[stage]);
                let loads = Loads { force, resistance: resistance(nodes[stage], state) };
                let equation = ahead.map_or(&self.equation, |ahead| &ahead[stage]);
                equation.imbalance(state, &acceleration[stage], &loads)
            });
            // A sum propagates NaN; a maximum would ignore it.
            let size: f64 = imbalances.iter().map(|one| one.size).sum();
            let left: f64 =
                imbalances.iter().flat_map(|one| &one.load).map(|load| load.norm()).sum();
            let done = left <= TOLERANCE * size;
            if !done {
                if correction % STALE_AFTER == STALE_AFTER - 1 {
                    self.renew(ahead.map(|[.., end]| end), &stages[2].elongation);
                }
                self.real.correct(&imbalances, &mut acceleration);
                self.pair.correct(&imbalances, &mut acceleration);
            }
            // With linear convergence this correction leaves an imbalance of left²/before.
            if done || left * left <= TOLERANCE * size * before {
                let end = self.stages(&acceleration)[2];
                if !end.elongation.iter().all(|q| q[4].abs() <= MOST_TURN) || !size.is_finite() {
                    break;
                }
                self.state = end;
                self.acceleration = acceleration;
                return Ok(());
            }
            before = left;
        }
        // After a failed step the matrices must not be those of an elongation that was not reached.
        self.renew(None, &self.state.elongation.clone());
        Err(NotConverged)
    }

    fn stages(&self, acceleration: &[Coordinates; 3]) -> [State; 3] {
        let (h, Method { nodes, a, a_squared, .. }) = (self.step_s, &self.method);
        let joints = self.equation.joints();
        let gained = combine(a, acceleration, joints);
        let moved = combine(a_squared, acceleration, joints);
        core::array::from_fn(|stage| {
            let mut state = self.state;
            for joint in 0..joints {
                state.elongation[joint] += h * nodes[stage] * state.rate[joint];
                state.elongation[joint] += h * h * moved[stage][joint];
                state.rate[joint] += h * gained[stage][joint];
            }
            state
        })
    }

    /// Renews the matrices at this elongation; `equation` is another one than that of the present state.
    fn renew(&mut self, equation: Option<&EquationOfMotion>, elongation: &Coordinates) {
        let equation = equation.unwrap_or(&self.equation);
        self.real.impedance = Impedance::new(equation, elongation, self.real.s);
        self.pair.impedance = Impedance::new(equation, elongation, self.pair.s);
    }

    /// Present state of the robot.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Equation of motion of the robot.
    pub fn equation(&self) -> &EquationOfMotion {
        &self.equation
    }
}

/// Linear combinations of the stages' values, one per row of `weights`, for the first `joints` joints.
fn combine(weights: &Matrix3<f64>, values: &[Coordinates; 3], joints: usize) -> [Coordinates; 3] {
    let mut combined = [Coordinates::default(); 3];
    for (to, combined) in combined.iter_mut().enumerate() {
        for (from, values) in values.iter().enumerate() {
            for joint in 0..joints {
                combined[joint] += weights[(to, from)] * values[joint];
            }
        }
    }
    combined
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::tests::equation;

    /// At stage order 3 polynomials of degree 2 are integrated exactly up to every node.
    #[test]
    fn the_coefficients_integrate_parabolas() {
        let Method { nodes, a, a_squared, extrapolation } = Method::radau_iia();
        let nodes = Vector3::from(nodes);
        for degree in 0..3 {
            let values = nodes.map(|c| c.powi(degree));
            let integral = |times: i32| {
                let divisor: i32 = (degree + 1..=degree + times).product();
                nodes.map(|c| c.powi(degree + times) / f64::from(divisor))
            };
            assert!((a * values - integral(1)).norm() < 1e-15);
            // The integral of a parabola has degree 3, which `a` does not integrate exactly.
            if degree < 2 {
                assert!((a_squared * values - integral(2)).norm() < 1e-15);
            }
            let ahead = nodes.map(|c| (1.0 + c).powi(degree));
            assert!((extrapolation * values - ahead).norm() < 1e-14);
        }
    }

    /// `a = Σ right λ left` over the eigenvalues.
    #[test]
    fn the_modes_make_up_the_coefficients() {
        let equation = equation();
        let radau = Radau::new(equation.clone(), equation.rest(), 0.01);
        let Mode { s, left, right, .. } = radau.real;
        let real = right * left / (0.01 * s);
        let Mode { s, left, right, .. } = radau.pair;
        let pair = (right * left / (s * 0.01)).map(|entry| entry.re);
        assert!((real + pair - radau.method.a).norm() < 1e-14);
    }

    /// One correction cancels the imbalance of small motion. With a wrong matrix Newton's method would still converge, but
    /// slowly.
    #[test]
    fn small_motion_takes_one_correction() {
        let equation = equation();
        let radau = Radau::new(equation.clone(), equation.rest(), 1e-3);
        let forces = [1.0, 2.0, 3.0].map(|force| Loads::from(&Vector3::new(force, -force, 0.5)));
        let left = |acceleration: &[Coordinates; 3]| {
            let stages = radau.stages(acceleration);
            [0, 1, 2].map(|n| radau.equation.imbalance(&stages[n], &acceleration[n], &forces[n]))
        };
        let mut acceleration = Default::default();
        let first = left(&acceleration);
        radau.real.correct(&first, &mut acceleration);
        radau.pair.correct(&first, &mut acceleration);
        for imbalance in left(&acceleration) {
            let left: f64 = imbalance.load.iter().map(|load| load.norm()).sum();
            assert!(left < 1e-6 * imbalance.size, "{left:e} of {}", imbalance.size);
        }
    }
}
