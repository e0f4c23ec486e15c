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
use nalgebra::{Complex, DMatrix, DVector, Matrix6};

use crate::dynamics::Place;

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
        let s = match place {
            Place::At(s) => receptance::Complex { re: s.re, im: s.im },
            Place::Static(omega) => receptance::Complex { re: 0.0, im: omega },
        };
        // What dissipates gives no load at rest. Hysteresis and drives leave the stiffness that they have at this frequency.
        let own = |value: receptance::Complex<f64>| match place {
            Place::At(_) => Complex::new(value.re, value.im),
            Place::Static(_) => Complex::from(value.re),
        };
        let [mut springs, mut dampers] = [Vec::new(), Vec::new()];
        for joint in 0..mechanics.joints() {
            let [of_springs, of_dampers] = mechanics.impedance(joint, s);
            springs.extend(of_springs.map(own));
            dampers.extend(of_dampers.map(own));
        }
        let [springs, dampers] = [springs, dampers].map(DVector::from_vec);
        let part = mechanics.ground(s).and_then(|ground| {
            let x = mechanics.chain().joints[0].from_parent.matrix().map(Complex::from);
            let g = x * Matrix6::from_diagonal(&ground.map(own).into()) * x.transpose();
            let z = (springs.fixed_rows::<6>(0) + dampers.fixed_rows::<6>(0)).into_owned();
            (Matrix6::identity() + g * Matrix6::from_diagonal(&z)).try_inverse()
        });
        Self { springs, dampers, part }
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
