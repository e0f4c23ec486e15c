//! The matrices of a robot without its bushings, over the elongations e of its bushings, joint by joint.
//!
//! ```text
//! η_j = T_j e       T_j = X_j T_{j−1} + E_j       M = Σ T_jᵀ I_j T_j
//! K = Σ E_jᵀ Γ_j E_j + E_jᵀ C_jᵀ x_j + (E_jᵀ C_jᵀ x_j)ᵀ + k P_f P_fᵀ         x_j: turns of X_j T_{j−1}
//! D = d P_f P_fᵀ
//! P = T_Jᵀ [ forces | torques ] = [ P_f | P_t ]
//! ```
//!
//! E_j selects the elongations of joint j. M is the mass matrix. K is the stiffness due to gravity ([`flexid_core::chain::linearise`]) and
//! of a hose at the tool, whose stiffness is k and whose damping d. P has the loads of unit forces and torques at the tool centre point.

use flexid_core::refine::Mechanics;
use nalgebra::{DMatrix, Matrix6xX};

/// M, K, D and P: kg; N/m; Ns/m; each with the units of its rows and columns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Matrices {
    pub(crate) mass: DMatrix<f64>,
    pub(crate) stiffness: DMatrix<f64>,
    pub(crate) damping: DMatrix<f64>,
    pub(crate) tip: DMatrix<f64>,
}

impl Matrices {
    pub(crate) fn new(mechanics: &Mechanics) -> Self {
        let chain = mechanics.chain();
        let n = 6 * chain.joints.len();
        let (mut mass, mut stiffness) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        // A link moves with the elongations of its joint and of those before it.
        let mut link = Matrix6xX::<f64>::zeros(0);
        for (joint, linear) in chain.joints.iter().enumerate() {
            let first = 6 * joint;
            let carried = linear.from_parent.matrix() * &link;
            let coupling = linear.gravity_coupling * carried.rows(3, 3);
            let mut rows = stiffness.view_mut((first, 0), (6, first));
            rows += &coupling;
            let mut columns = stiffness.view_mut((0, first), (first, 6));
            columns += coupling.transpose();
            let mut turns = stiffness.view_mut((first + 3, first + 3), (3, 3));
            turns += linear.gravity_turns;
            link = carried.resize_horizontally(first + 6, 0.0);
            link.fixed_columns_mut::<6>(first).fill_with_identity();
            let moved = linear.inertia * &link;
            let mut before = mass.view_mut((0, 0), (first + 6, first + 6));
            before += link.transpose() * moved;
        }
        let mut loads = DMatrix::<f64>::zeros(6, 6);
        loads.columns_mut(0, 3).copy_from(&chain.tip_force);
        loads.columns_mut(3, 3).copy_from(&chain.tip_torque);
        let tip = link.transpose() * loads;
        let [k, d] = mechanics.hose();
        let forces = tip.columns(0, 3);
        let hose = forces * forces.transpose();
        Self { mass, stiffness: stiffness + k * &hose, damping: d * hose, tip }
    }

    /// `self − other`, over `by`.
    pub(crate) fn difference(self, other: &Self, by: f64) -> Self {
        Self {
            mass: (self.mass - &other.mass) / by,
            stiffness: (self.stiffness - &other.stiffness) / by,
            damping: (self.damping - &other.damping) / by,
            tip: (self.tip - &other.tip) / by,
        }
    }
}
