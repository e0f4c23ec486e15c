//! The linearised chain and its bushings in the precision of the recursion.

use heapless::Vec;
use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};

use super::lanes::Scalar;
use super::symmetric::{PACKED, at};
use super::tool::ToolTerms;
use crate::calibration::Calibration;
use crate::chain::linearise::{LinearChain, LinearJoint, LinearisationError};
use crate::mounting::{Mounting, tilts};
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
    /// Loads of unit forces at the TCP, one per axis of the force sensor.
    pub(crate) force: [[T; DOF]; 3],
    /// Loads whose displacements are what the accelerometer reads along each of its axes.
    pub(crate) reading: [[T; DOF]; 3],
    /// Loads whose elongations tell how the sensor's axis turns in gravity; zero when it does not.
    pub(crate) tilt: [[T; DOF]; 3],
    /// What the force sensor does not see of the force; none where nothing is beyond it.
    pub(crate) tool: Option<ToolTerms<T>>,
    /// Whether the acceleration is read where and along what the force is measured, at the same time, and nothing else is: the
    /// receptance tells all.
    pub(crate) collocated: bool,
    /// Whether gravity's stiffness enters.
    pub(crate) gravity: bool,
    /// Whether the accelerometer feels gravity as it turns.
    pub(crate) strapdown: bool,
    /// By how much the acceleration comes later than the force, s.
    pub(crate) delay: T,
    /// Whether derivatives in the links' masses are wanted.
    pub(crate) masses: bool,
}

impl<T: Scalar> Terms<T> {
    /// Of a linearised chain with one bushing per joint, base first. A `strapdown` accelerometer turns
    /// with the TCP and feels gravity: it reads `a + θ × g`, its reading at rest removed.
    ///
    /// # Errors
    ///
    /// If there is not one bushing per joint.
    pub fn new(
        chain: &LinearChain,
        bushings: &[Bushing],
        strapdown: bool,
    ) -> Result<Self, LinearisationError> {
        Self::calibrated(chain, bushings, strapdown, &Calibration::default())
    }

    /// The same, read by sensors that differ so from what they are taken for. Masses are the chain's, and force gains the
    /// force's own.
    ///
    /// # Errors
    ///
    /// As [`Terms::new`].
    pub fn calibrated(
        chain: &LinearChain,
        bushings: &[Bushing],
        strapdown: bool,
        calibration: &Calibration,
    ) -> Result<Self, LinearisationError> {
        Self::mounted(chain, bushings, strapdown, &Mounting::AT_TCP, calibration)
    }

    /// The same, with the sensors mounted so. The misalignment turns the accelerometer further, about its own axes.
    ///
    /// # Errors
    ///
    /// As [`Terms::new`].
    pub fn mounted(
        chain: &LinearChain,
        bushings: &[Bushing],
        strapdown: bool,
        mounting: &Mounting,
        calibration: &Calibration,
    ) -> Result<Self, LinearisationError> {
        if chain.joints.len() != bushings.len() {
            return Err(LinearisationError::Bushings(bushings.len()));
        }
        let mut joints = Vec::new();
        for (joint, bushing) in chain.joints.iter().zip(bushings) {
            let _ = joints.push(JointTerms::new(joint, bushing));
        }
        let gravity = chain.gravity_at_tip != Vector3::zeros();
        let strapdown = strapdown && gravity;
        let gain = Matrix3::from_diagonal(&calibration.acceleration_gain.into());
        let turned = Rotation3::new(calibration.misalignment.into()).matrix() * gain;
        let reading = mounting.readings(chain) * turned;
        let force = mounting.forces(chain);
        let tilt = tilts(chain, &mounting.accelerometer_axes) * turned;
        let tool = (mounting.tool_mass > 0.0).then(|| ToolTerms {
            inertia: columns(&(mounting.centres(chain) * mounting.tool_mass)),
            weight: columns(&(tilts(chain, &mounting.force_axes) * mounting.tool_mass)),
        });
        Ok(Self {
            joints,
            force: columns(&force),
            reading: columns(&reading),
            tilt: if strapdown { columns(&tilt) } else { [[T::default(); DOF]; 3] },
            collocated: reading == force
                && tool.is_none()
                && !strapdown
                && calibration.delay == 0.0,
            tool,
            gravity,
            strapdown,
            delay: T::from_f64(calibration.delay),
            masses: false,
        })
    }

    /// Of the chain at rest under a wrench (N and Nm on the TCP, along its axes): at s = 0 a response to 1 along the first
    /// axis "reads" the displacement of the TCP.
    pub(crate) fn at_rest(
        chain: &LinearChain,
        bushings: &[Bushing],
        wrench: &[f64; 6],
    ) -> Result<Self, LinearisationError> {
        let [fx, fy, fz, mx, my, mz] = *wrench;
        let load = chain.tip_force * Vector3::new(fx, fy, fz)
            + chain.tip_torque * Vector3::new(mx, my, mz);
        let mut force = SMatrix::<f64, 6, 3>::zeros();
        force.set_column(0, &load);
        Ok(Self {
            force: columns(&force),
            tilt: columns(&chain.tip_force),
            // What the elongations are read by regardless of the frequency.
            strapdown: true,
            ..Self::new(chain, bushings, false)?
        })
    }

    /// The same, with [`Response::per_mass`](super::Response::per_mass) wanted.
    pub fn with_masses(self) -> Self {
        Self { masses: true, ..self }
    }

    /// The same chain with other bushings, one per joint; the sag stays that of the first. Joints for which there is none
    /// keep theirs.
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
        let turn = joint.turn_back;
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
