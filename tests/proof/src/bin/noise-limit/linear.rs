//! The linear robot, propagated in time: the dense equation of motion and the exponential of its matrix. It uses no
//! frequencies, no recursions and no ends of records.
//!
//! The force is the same as in the nonlinear simulator: cubic between the steps of a grid 25 times as fine as the
//! samples. For this force the propagation is exact, and all the steps of one sample combine into one matrix.

use flexid_core::chain::Chain;
use flexid_core::parameters::Bushing;
use flexid_core::sensors::Accelerometer;
use flexid_simulation::experiment::Cut;
use flexid_simulation::force::OVERSAMPLING;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Vector3};

use crate::common::{Dense, add_product};

/// Number of force steps that one sample's propagation reads: one before it, and two after its last.
const READ: usize = OVERSAMPLING + 3;

/// Lagrange's cubics through -1, 0, 1 and 2: coefficients of 1, x, x², x³.
const CUBICS: [[f64; 4]; 4] = [
    [0.0, -1.0 / 3.0, 0.5, -1.0 / 6.0],
    [1.0, -0.5, -1.0, 0.5],
    [0.0, 1.0, 0.5, -0.5],
    [0.0, -1.0 / 6.0, 0.0, 1.0 / 6.0],
];

/// The motion at every sample, TCP axes at rest, without noise.
pub(crate) struct Motion {
    /// Force, N.
    pub(crate) force: Vec<Vector3<f64>>,
    /// Displacement, m.
    pub(crate) displacement: Vec<Vector3<f64>>,
    /// Acceleration as the accelerometer reads it, m/s².
    pub(crate) acceleration: Vec<Vector3<f64>>,
    /// Elongation of every degree of freedom, joint by joint, m and rad: `[dof][sample]`.
    pub(crate) elongation: Vec<Vec<f64>>,
}

/// `M q̈ + D q̇ + K q = Tᵀ f` about the static equilibrium, and what is read of it.
pub(crate) struct Equation {
    pub(crate) mass: DMatrix<f64>,
    /// Stiffness, that of gravity included.
    pub(crate) stiffness: DMatrix<f64>,
    pub(crate) damping: DMatrix<f64>,
    /// Translation of the TCP, TCP axes.
    pub(crate) tip: Matrix3xX<f64>,
    /// Reading of gravity by a strapdown accelerometer as it turns; zero for an inertial one.
    pub(crate) tilt: Matrix3xX<f64>,
}

impl Equation {
    pub(crate) fn new(chain: &Chain, bushings: &[Bushing], cut: &Cut) -> Self {
        // Without an equilibrium all values are NaN, and no limit holds.
        let sag: Vec<[f64; 6]> = match chain.linearise(&cut.pose, cut.gravity, bushings) {
            Ok(equilibrium) => equilibrium.joints.iter().map(|j| j.sag.into()).collect(),
            Err(_) => vec![[f64::NAN; 6]; bushings.len()],
        };
        let dense = Dense::new(chain, &cut.pose, cut.gravity, &sag);
        let tip = dense.tip();
        // A turn t of the tool adds t × g to the reading.
        let felt = match cut.accelerometer {
            Accelerometer::Strapdown => -dense.gravity_at_tip().cross_matrix(),
            Accelerometer::Inertial => Matrix3::zeros(),
        };
        let of = |values: fn(&Bushing) -> [f64; 6]| {
            let all: Vec<f64> = bushings.iter().flat_map(values).collect();
            DMatrix::from_diagonal(&DVector::from_vec(all))
        };
        Self {
            mass: dense.mass(),
            stiffness: dense.gravity_stiffness() + of(|bushing| bushing.stiffness),
            damping: of(|bushing| bushing.damping),
            tilt: felt * tip.fixed_rows::<3>(3),
            tip: tip.fixed_rows::<3>(0).into_owned(),
        }
    }

    /// Number of degrees of freedom.
    pub(crate) fn size(&self) -> usize {
        self.mass.nrows()
    }
}

/// The motion of a robot of `bushings` in `cut`, from rest.
pub(crate) fn motion(chain: &Chain, bushings: &[Bushing], cut: &Cut) -> Motion {
    let equation = Equation::new(chain, bushings, cut);
    let n = equation.size();
    // Links have mass: the matrix is positive definite.
    let inverse_mass = equation.mass.clone().try_inverse().unwrap_or_default();
    let mut state_matrix = DMatrix::zeros(2 * n, 2 * n);
    state_matrix.view_mut((0, n), (n, n)).fill_with_identity();
    state_matrix.view_mut((n, 0), (n, n)).copy_from(&(-&inverse_mass * &equation.stiffness));
    state_matrix.view_mut((n, n), (n, n)).copy_from(&(-&inverse_mass * &equation.damping));
    let mut force_matrix = DMatrix::zeros(2 * n, 3);
    force_matrix.rows_mut(n, n).copy_from(&(&inverse_mass * equation.tip.transpose()));

    let step = 1.0 / (cut.rate_hz * OVERSAMPLING as f64);
    let [own, drive] = over_one_sample(&(&state_matrix * step), &(&force_matrix * step));
    // The reading is the tip's part of q̈, plus the tilt.
    let mut read = &equation.tip * state_matrix.rows(n, n);
    let mut tilt = read.columns_mut(0, n);
    tilt += &equation.tilt;
    let read_force = &equation.tip * force_matrix.rows(n, n);

    let samples = cut.force.len() / OVERSAMPLING;
    let mut motion = Motion {
        force: Vec::with_capacity(samples),
        displacement: Vec::with_capacity(samples),
        acceleration: Vec::with_capacity(samples),
        elongation: vec![Vec::with_capacity(samples); n],
    };
    let mut state = DVector::zeros(2 * n);
    let mut next = state.clone();
    let mut forces = DVector::zeros(3 * READ);
    for sample in 0..samples {
        let first = sample * OVERSAMPLING;
        let force = cut.force[first];
        motion.force.push(force);
        motion.displacement.push(&equation.tip * state.rows(0, n));
        motion.acceleration.push(&read * &state + &read_force * force);
        for (series, value) in motion.elongation.iter_mut().zip(&state) {
            series.push(*value);
        }
        for k in 0..READ {
            let at = (first + k).checked_sub(1).and_then(|at| cut.force.get(at));
            forces.fixed_rows_mut::<3>(3 * k).copy_from(&at.copied().unwrap_or_default());
        }
        next.fill(0.0);
        add_product(&own, &state, &mut next);
        add_product(&drive, &forces, &mut next);
        std::mem::swap(&mut state, &mut next);
    }
    motion
}

/// `x(t + 25 h) = own x + drive [f(t − h), f(t), ..]`, from `A h` and `B h` of `ẋ = A x + B f`.
fn over_one_sample(a: &DMatrix<f64>, b: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
    let n = a.nrows();
    // The force and its first three derivatives follow the state. Each is the integral of the next one.
    let mut chained = DMatrix::zeros(n + 12, n + 12);
    chained.view_mut((0, 0), (n, n)).copy_from(a);
    chained.view_mut((0, n), (n, 3)).copy_from(b);
    chained.view_mut((n, n + 3), (9, 9)).fill_with_identity();
    let exponential = chained.exp();
    let own = exponential.view((0, 0), (n, n)).into_owned();
    // A derivative of x^p at 0 is p! times its coefficient.
    let by_derivative = [1.0, 1.0, 2.0, 6.0];
    let by_node = CUBICS.map(|cubic| {
        (0..4).fold(DMatrix::zeros(n, 3), |sum, p| {
            sum + exponential.view((0, n + 3 * p), (n, 3)) * (cubic[p] * by_derivative[p])
        })
    });
    let mut drive = DMatrix::zeros(n, 3 * READ);
    let mut passed = DMatrix::identity(n, n);
    for step in (0..OVERSAMPLING).rev() {
        for (node, input) in by_node.iter().enumerate() {
            let mut columns = drive.columns_mut(3 * (step + node), 3);
            columns += &passed * input;
        }
        passed *= &own;
    }
    [passed, drive]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Study;

    /// The test compares with the nonlinear reference, which shares neither matrices nor integrator, for a force so
    /// small that the reference is linear. It has gravity, and an accelerometer that reads it.
    #[test]
    fn is_the_nonlinear_robot_under_a_small_force() {
        let study = Study::load().unwrap();
        let mut cut = study.unseen(1).swap_remove(0);
        cut.gravity = Vector3::new(0.0, 0.0, -9.80665);
        cut.accelerometer = Accelerometer::Strapdown;
        cut.force.truncate(1000 * OVERSAMPLING);
        cut.force.iter_mut().for_each(|force| *force *= 1e-3);
        let bushings = study.robot(0);
        let ours = motion(&study.chain, &bushings, &cut);
        let other = cut.response(&study.chain, &bushings);
        let apart = |a: &[Vector3<f64>], b: &[Vector3<f64>]| {
            let sum = |of: &dyn Fn(usize) -> f64| (0..a.len()).map(of).sum::<f64>();
            (sum(&|n| (a[n] - b[n]).norm_squared()) / sum(&|n| b[n].norm_squared())).sqrt()
        };
        let place = apart(&ours.displacement, &other.displacement);
        let reading = apart(&ours.acceleration, &other.acceleration);
        assert!(place < 1e-5 && reading < 1e-5, "{place:e} {reading:e}");
        assert!(place > 0.0);
    }
}
