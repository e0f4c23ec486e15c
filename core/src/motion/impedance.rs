//! Dynamic stiffness `s²M + sD + K` of the chain frozen at one elongation, factorised once and solved in O(J).
//!
//! The displacement of link j is the translation of its origin along the axes of its joint frame, and the rates of its
//! bushing's three turns. In these coordinates a bushing is the diagonal `b = k + s d`, and the recursion is like that of the
//! receptance, but from tip to base. It begins at the tip with `Z = 0` and `p = 0`; for j = J..1
//!
//! ```text
//! Z ← Z + s² I       U = (Z + b)⁻¹       u = U (ρ − p)
//! Z ← Xᵀ (b − b U b) X                   p ← p_{j−1} + Xᵀ (ρ − b u)
//! ```
//!
//! Then from base to tip `x = X y_{j−1}`, `y = u + U b x`, and the elongation is `y − x`.

use heapless::Vec;
use nalgebra::{ComplexField, Matrix3, Matrix6, Vector6};

use super::kinematics::{Link, Placed};
use super::{Coordinates, EquationOfMotion};
use crate::MAX_JOINTS;

/// One complex number per coordinate: joint by joint, base first.
pub(super) type Phasors<T> = [Vector6<T>; MAX_JOINTS];

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Impedance<T> {
    joints: Vec<Joint<T>, MAX_JOINTS>,
}

#[derive(Clone, Debug, PartialEq)]
struct Joint<T> {
    /// X: transforms a displacement of the link before to this link.
    carry: Matrix6<T>,
    /// Diagonal b of the bushing.
    bushing: Vector6<T>,
    /// U = (Z + b)⁻¹.
    compliance: Matrix6<T>,
}

impl<T: ComplexField<RealField = f64> + Copy> Impedance<T> {
    /// The dynamic stiffness at `s`, 1/s, with the bushings at `elongation`. If the stiffness cannot be inverted (numbers out
    /// of range, a bushing at `ry = ±90°`), [`solve`](Self::solve) returns numbers that are not finite.
    pub(super) fn new(equation: &EquationOfMotion, elongation: &Coordinates, s: T) -> Self {
        let mut joints = Vec::new();
        let mut before = None;
        for (index, link) in equation.links.iter().enumerate() {
            let place = link.placed(&elongation[index]);
            // A chain has no more joints than the vector holds.
            let _ = joints.push(Joint {
                carry: outward(link, &place, before.as_ref()).map(T::from_real),
                bushing: equation.stiffness[index]
                    .zip_map(&equation.damping[index], |k, d| T::from_real(k) + s.scale(d)),
                compliance: spatial_inertia(link, &place).map(|entry| s * s.scale(entry)),
            });
            before = Some(place);
        }
        let mut carried = Matrix6::zeros();
        for joint in joints.iter_mut().rev() {
            // `compliance` still holds s² I.
            let mut stiffness = carried + joint.compliance;
            stiffness.set_diagonal(&(stiffness.diagonal() + joint.bushing));
            let out_of_range = || Matrix6::repeat(T::from_real(f64::NAN));
            joint.compliance = stiffness.try_inverse().unwrap_or_else(out_of_range);
            let bushing = Matrix6::from_diagonal(&joint.bushing);
            carried =
                joint.carry.tr_mul(&(bushing - bushing * joint.compliance * bushing)) * joint.carry;
        }
        Self { joints }
    }

    pub(super) fn joints(&self) -> usize {
        self.joints.len()
    }

    /// `(s²M + sD + K)⁻¹ ρ`: elongations under the generalised loads `load`.
    pub(super) fn solve(&self, load: &Phasors<T>) -> Phasors<T> {
        let mut moved = [Vector6::zeros(); MAX_JOINTS];
        let mut passed = Vector6::zeros();
        for (index, joint) in self.joints.iter().enumerate().rev() {
            moved[index] = product(&joint.compliance, &(load[index] - passed));
            let held = load[index] - joint.bushing.component_mul(&moved[index]);
            passed = joint.carry.tr_mul(&held);
        }
        let mut elongation = [Vector6::zeros(); MAX_JOINTS];
        let mut before = Vector6::zeros();
        for (index, joint) in self.joints.iter().enumerate() {
            let carried = product(&joint.carry, &before);
            let pulled = joint.bushing.component_mul(&carried);
            before = moved[index] + product(&joint.compliance, &pulled);
            elongation[index] = before - carried;
        }
        elongation
    }
}

/// Product of a matrix and a vector. The operator of nalgebra also multiplies each entry by two factors of one, which of complex numbers is
/// three times the work.
fn product<T: ComplexField + Copy>(matrix: &Matrix6<T>, vector: &Vector6<T>) -> Vector6<T> {
    let mut sum = matrix.column(0) * vector[0];
    for column in 1..6 {
        for row in 0..6 {
            sum[row] += matrix[(row, column)] * vector[column];
        }
    }
    sum
}

/// `S⁻¹ X S₋` with the motion subspaces S of this bushing and S₋ of the bushing `before`.
fn outward(link: &Link, place: &Placed, before: Option<&Placed>) -> Matrix6<f64> {
    let (axes, turns) = before.map_or((Matrix3::identity(), Matrix3::identity()), |before| {
        (before.turned.transpose(), before.turns)
    });
    let back = link.axes.transpose();
    let mut carry = Matrix6::zeros();
    carry.fixed_view_mut::<3, 3>(0, 0).copy_from(&(back * axes));
    carry.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-back * place.lever.cross_matrix() * turns));
    carry
        .fixed_view_mut::<3, 3>(3, 3)
        .copy_from(&(place.turns_inverse() * place.rotation.transpose() * turns));
    carry
}

/// `Sᵀ I S`, kg, kg m and kg m².
fn spatial_inertia(link: &Link, place: &Placed) -> Matrix6<f64> {
    let coupling = place.turned * (link.centre * link.mass).cross_matrix() * place.turns;
    let mut inertia = Matrix6::zeros();
    inertia.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(link.mass);
    inertia.fixed_view_mut::<3, 3>(0, 3).copy_from(&-coupling);
    inertia.fixed_view_mut::<3, 3>(3, 0).copy_from(&-coupling.transpose());
    inertia
        .fixed_view_mut::<3, 3>(3, 3)
        .copy_from(&(place.turns.tr_mul(&link.inertia) * place.turns));
    inertia
}

#[cfg(test)]
mod tests {
    use nalgebra::{Complex, DMatrix, DVector, Vector3};

    use super::*;
    use crate::motion::State;
    use crate::motion::tests::equation;

    /// The mass matrix, column by column from inverse dynamics.
    fn mass(equation: &EquationOfMotion, elongation: &Coordinates) -> DMatrix<f64> {
        let state = State { elongation: *elongation, rate: Coordinates::default() };
        let size = 6 * equation.joints();
        let loads = |acceleration: &Coordinates| {
            let loads = equation.inverse_dynamics(&state, acceleration, &Vector3::zeros());
            DVector::from_iterator(size, loads.iter().flatten().copied().take(size))
        };
        let still = loads(&Coordinates::default());
        DMatrix::from_columns(&std::vec::Vec::from_iter((0..size).map(|dof| {
            let mut unit = Coordinates::default();
            unit[dof / 6][dof % 6] = 1.0;
            loads(&unit) - &still
        })))
    }

    #[test]
    fn solves_what_the_mass_matrix_of_inverse_dynamics_says() {
        let equation = equation();
        let size = 6 * equation.joints();
        let mut elongation = Coordinates::default();
        for (dof, q) in elongation.iter_mut().take(3).flat_map(|q| q.iter_mut()).enumerate() {
            *q = 0.7 * (1.0 + dof as f64).sin();
        }
        for s in [Complex::new(900.0, 0.0), Complex::new(300.0, -700.0)] {
            let mut dense = mass(&equation, &elongation).map(Complex::from) * s * s;
            let mut load = [Vector6::zeros(); MAX_JOINTS];
            for dof in 0..size {
                let (joint, dof) = (dof / 6, dof % 6);
                dense[(6 * joint + dof, 6 * joint + dof)] +=
                    equation.stiffness[joint][dof] + s * equation.damping[joint][dof];
                load[joint][dof] = Complex::new((dof as f64).cos(), joint as f64 - 1.0);
            }
            let ours = Impedance::new(&equation, &elongation, s).solve(&load);
            let flat = |all: &Phasors<Complex<f64>>| {
                DVector::from_iterator(size, all.iter().flatten().copied().take(size))
            };
            let error = (&dense * flat(&ours) - flat(&load)).norm();
            assert!(error < 1e-8, "{error:e} at {s}");
        }
    }
}
