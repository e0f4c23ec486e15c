//! The bushings of a robot, the first of them on its ground.
//!
//! ```text
//! B = diag z        B₁ = z (I + G z)⁻¹        q₁ = (I + G z)⁻¹ e₁        G = X₁ diag(c(s)) X₁ᵀ
//! ```
//!
//! z are the impedances of the bushings. On ground that gives way, with compliances c of its own, B₁ of the first joint is the series of
//! both, and the elongation q of its bushing is a part of e.

use flexid_core::receptance;
use flexid_core::refine::Mechanics;
use nalgebra::{Complex, DMatrix, DVector, Matrix6, Vector6};

use super::place::Place;

/// B at a place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bushings {
    /// Impedances of the springs.
    pub(crate) springs: DVector<Complex<f64>>,
    /// Impedances of the dampers.
    pub(crate) dampers: DVector<Complex<f64>>,
    /// `(I + G z)⁻¹`; `None` on rigid ground.
    part: Option<Matrix6<Complex<f64>>>,
}

impl Bushings {
    /// Those of a robot, N/m and Nm/rad, joint by joint.
    pub(crate) fn new(mechanics: &Mechanics, place: Place) -> Self {
        let [mut springs, mut dampers] = [0, 1].map(|_| DVector::zeros(6 * mechanics.joints()));
        for joint in 0..mechanics.joints() {
            let [of_springs, of_dampers] = impedances(mechanics, joint, place);
            springs.fixed_rows_mut::<6>(6 * joint).copy_from(&of_springs);
            dampers.fixed_rows_mut::<6>(6 * joint).copy_from(&of_dampers);
        }
        let z = (springs.fixed_rows::<6>(0) + dampers.fixed_rows::<6>(0)).into_owned();
        let part = part(mechanics, place, &z);
        Self { springs, dampers, part }
    }

    /// Returns whether the bushing of a joint differs from that of `other`.
    pub(crate) fn differs(&self, other: &Self, joint: usize) -> bool {
        let of = |own: &DVector<Complex<f64>>| own.fixed_rows::<6>(6 * joint).into_owned();
        of(&self.springs) != of(&other.springs)
            || of(&self.dampers) != of(&other.dampers)
            || (joint == 0 && self.part != other.part)
    }

    /// Elongations of the bushings, by columns, of the displacements `e`.
    pub(crate) fn elongations(&self, e: &DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
        let mut q = e.clone();
        if let Some(part) = &self.part {
            let first = part * e.fixed_rows::<6>(0);
            q.fixed_rows_mut::<6>(0).copy_from(&first);
        }
        q
    }

    /// `B e`.
    pub(crate) fn loads(&self, e: &DMatrix<Complex<f64>>) -> DMatrix<Complex<f64>> {
        let mut loads = self.elongations(e);
        for (mut row, (spring, damper)) in
            loads.row_iter_mut().zip(self.springs.iter().zip(&self.dampers))
        {
            row *= spring + damper;
        }
        loads
    }

    /// B.
    pub(crate) fn matrix(&self) -> DMatrix<Complex<f64>> {
        let n = self.springs.len();
        self.loads(&DMatrix::identity(n, n))
    }
}

/// Impedances of the springs and of the dampers of a joint.
pub(crate) fn impedances(
    mechanics: &Mechanics,
    joint: usize,
    place: Place,
) -> [Vector6<Complex<f64>>; 2] {
    mechanics.impedance(joint, frequency(place)).map(|all| all.map(|own| at(place, own)).into())
}

/// `(I + G z)⁻¹` for these impedances of the first joint; `None` on rigid ground.
pub(crate) fn part(
    mechanics: &Mechanics,
    place: Place,
    z: &Vector6<Complex<f64>>,
) -> Option<Matrix6<Complex<f64>>> {
    let ground = mechanics.ground(frequency(place))?.map(|own| at(place, own));
    let x = mechanics.chain().joints[0].from_parent.matrix();
    let of = |i: usize, j: usize| -> Complex<f64> {
        ground.iter().enumerate().map(|(dof, own)| own * (x[(i, dof)] * x[(j, dof)])).sum()
    };
    let unit = |i: usize, j: usize| if i == j { Complex::from(1.0) } else { Complex::default() };
    Matrix6::from_fn(|i, j| unit(i, j) + of(i, j) * z[j]).try_inverse()
}

/// Frequencies at which impedances are read, rad/s.
fn frequency(place: Place) -> receptance::Complex<f64> {
    match place {
        Place::At(s) => receptance::Complex { re: s.re, im: s.im },
        Place::Static(omega) => receptance::Complex { re: 0.0, im: omega },
    }
}

/// Dampers give no load at rest. Hysteresis and drives leave the stiffness that they have at this frequency.
fn at(place: Place, value: receptance::Complex<f64>) -> Complex<f64> {
    match place {
        Place::At(_) => Complex::new(value.re, value.im),
        Place::Static(_) => Complex::from(value.re),
    }
}
