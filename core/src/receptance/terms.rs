//! The linearised chain and its bushings in the precision of the recursion.

use heapless::Vec;
use nalgebra::{Matrix3, SMatrix, Vector3};

use super::lanes::Scalar;
use super::symmetric::{PACKED, at};
use crate::chain::linearise::{LinearChain, LinearJoint};
use crate::parameters::Bushing;
use crate::{DOF, MAX_JOINTS};

/// One joint as the recursion reads it; the meaning of the others is [`LinearJoint`]'s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct JointTerms<T> {
    /// `X⁻¹ = [[rotate, lever], [0, turn]]` takes what this bushing is carried by to the link before.
    pub(crate) rotate: [[T; 3]; 3],
    pub(crate) lever: [[T; 3]; 3],
    pub(crate) turn: [[T; 3]; 3],
    pub(crate) inertia: [T; PACKED],
    pub(crate) gravity_turns: [[T; 3]; 3],
    pub(crate) gravity_coupling: [[T; 3]; DOF],
    pub(crate) stiffness: [T; DOF],
    pub(crate) damping: [T; DOF],
}

/// A chain at one pose with its bushings, ready for the recursion.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms<T> {
    /// Base first.
    pub(crate) joints: Vec<JointTerms<T>, MAX_JOINTS>,
    /// Loads of unit forces at the TCP, one per axis.
    pub(crate) force: [[T; DOF]; 3],
    /// Loads whose elongations tell how the sensor's axis turns in gravity; zero when it does not.
    pub(crate) tilt: [[T; DOF]; 3],
    /// Whether gravity's stiffness enters.
    pub(crate) gravity: bool,
    /// Whether the accelerometer feels gravity as it turns.
    pub(crate) strapdown: bool,
}

impl<T: Scalar> Terms<T> {
    /// Of a linearised chain with one bushing per joint, base first. A `strapdown` accelerometer turns
    /// with the TCP and feels gravity: it reads `a + θ × g`, its reading at rest removed.
    pub fn new(chain: &LinearChain, bushings: &[Bushing], strapdown: bool) -> Self {
        debug_assert_eq!(chain.joints.len(), bushings.len());
        let mut joints = Vec::new();
        for (joint, bushing) in chain.joints.iter().zip(bushings) {
            let _ = joints.push(JointTerms::new(joint, bushing));
        }
        let mut tilt = SMatrix::<f64, 6, 3>::zeros();
        if strapdown {
            for axis in 0..3 {
                let torque = chain.gravity_at_tip.cross(&Vector3::ith(axis, 1.0));
                tilt.set_column(axis, &(chain.tip_torque * torque));
            }
        }
        Self {
            joints,
            force: columns(&chain.tip_force),
            tilt: columns(&tilt),
            gravity: chain.gravity_at_tip != Vector3::zeros(),
            strapdown: strapdown && chain.gravity_at_tip != Vector3::zeros(),
        }
    }

    /// The same chain with other bushings; the sag stays that of the first.
    pub fn set_bushings(&mut self, bushings: &[Bushing]) {
        for (terms, bushing) in self.joints.iter_mut().zip(bushings) {
            terms.stiffness = bushing.stiffness.map(T::from_f64);
            terms.damping = bushing.damping.map(T::from_f64);
        }
    }
}

impl<T: Scalar> JointTerms<T> {
    fn new(joint: &LinearJoint, bushing: &Bushing) -> Self {
        let mut inertia = [T::default(); PACKED];
        for i in 0..DOF {
            for j in 0..=i {
                inertia[at(i, j)] = T::from_f64(joint.inertia[(i, j)]);
            }
        }
        // The axes of the turns coincide only at a sag of a quarter turn.
        let turn = joint.turn.try_inverse().unwrap_or_else(Matrix3::identity);
        let rotate = joint.rotate.transpose();
        Self {
            rotate: rows(&rotate),
            lever: rows(&(-rotate * joint.lever * turn)),
            turn: rows(&turn),
            inertia,
            gravity_turns: rows(&joint.gravity_turns),
            gravity_coupling: rows(&joint.gravity_coupling),
            stiffness: bushing.stiffness.map(T::from_f64),
            damping: bushing.damping.map(T::from_f64),
        }
    }
}

fn rows<T: Scalar, const R: usize>(matrix: &SMatrix<f64, R, 3>) -> [[T; 3]; R] {
    core::array::from_fn(|i| core::array::from_fn(|j| T::from_f64(matrix[(i, j)])))
}

fn columns<T: Scalar>(matrix: &SMatrix<f64, 6, 3>) -> [[T; DOF]; 3] {
    core::array::from_fn(|j| core::array::from_fn(|i| T::from_f64(matrix[(i, j)])))
}
