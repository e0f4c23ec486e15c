//! The chain linearised about its static equilibrium, as the receptance recursion needs it.
//!
//! The drives hold the joint angles, and the bushings sag under gravity. The potential of gravity is `V = −Σ mᵢ g·xᵢ`. The
//! bushing coordinates have their kinematic order: slides along the joint axes, then turns about x, the new y and the new z.
//! About the equilibrium the second variation of V couples the rotation θ of the link before with the elongation δq of each
//! bushing, and the turns of one bushing with each other:
//!
//! ```text
//! δ²V = Σ_j θ_{j−1}ᵀ C_j δq_j + ½ δq_jᵀ Γ_j δq_j
//!       column b of C_j = M g × e_b          (slide)     Γ_ab = z_a · (g × (z_b × M c)),  a before b
//!                         g × (z_b × M c)    (turn)
//! ```
//!
//! M is the mass of all links that the joint carries, and c is their centre of mass seen from the bushing (Lagrange; any
//! textbook on small oscillations). The displacement of link j is (translation of the bushing's origin, rates of its three
//! turns), along the axes of the joint frame. In these coordinates the matrix of a bushing is diagonal for any sag.

use core::error::Error;
use core::fmt;

use heapless::Vec;
use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, SMatrix, Translation3, Vector3, Vector6};

use super::Chain;
use super::from_parent::FromParent;
use crate::parameters::Bushing;
use crate::{DOF, MAX_JOINTS};

/// One joint, linearised about the static equilibrium. Blocks act on (translation, turns).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearJoint {
    /// X: transforms a displacement of the link before to this joint.
    pub from_parent: FromParent,
    /// Spatial inertia of the link: kg, kg m, kg m².
    pub inertia: Matrix6<f64>,
    /// Γ: stiffness due to gravity among the turns of this bushing, Nm.
    pub gravity_turns: Matrix3<f64>,
    /// C_jᵀ seen from this joint, N and Nm. Rows are elongations; columns are the turns of the link before, transformed to
    /// this joint.
    pub gravity_coupling: SMatrix<f64, 6, 3>,
    /// Static elongation, m and rad.
    pub sag: Vector6<f64>,
}

/// A chain, linearised about its static equilibrium at one pose.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearChain {
    /// Linearised joints, base first.
    pub joints: Vec<LinearJoint, MAX_JOINTS>,
    /// Loads on the last link due to unit forces at the TCP along its axes, one column per force.
    pub tip_force: SMatrix<f64, 6, 3>,
    /// Loads on the last link due to unit torques about the TCP's axes, one column per torque.
    pub tip_torque: SMatrix<f64, 6, 3>,
    /// Gravity along the TCP's axes, m/s².
    pub gravity_at_tip: Vector3<f64>,
}

/// Largest number of rounds. A round reduces the distance of the sag from the equilibrium by a factor of about the largest
/// angle of sag: 1e-2 in a robot that can mill. Sixty rounds reach [`AT_REST`] for factors up to 0.6; with a larger factor a
/// bushing is no longer a spring about its place.
const EQUILIBRIUM_ROUNDS: usize = 60;
/// Change of the sag in a round, m or rad, below which the chain is at rest. It is a millionth of the smallest sag that
/// matters, a micrometre.
const AT_REST: f64 = 1e-12;
/// Smallest cosine of the turn about y at which the three turns of a bushing count as independent. There the single precision
/// of the search loses three of its seven digits.
const INDEPENDENT: f64 = 1e-3;

/// Reason why a chain has no linearisation at a pose. Joints are numbered from 0, base first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinearisationError {
    /// The number of angles of the pose, which is given here, is not the number of joints.
    Angles(usize),
    /// The number of bushings, which is given here, is not the number of joints.
    Bushings(usize),
    /// The bushing of this joint does not come to rest under gravity: it is too soft for the links that it carries.
    NoEquilibrium(usize),
    /// At rest the bushing of this joint has turned by a quarter turn about y, where two of its turns have the same axis.
    QuarterTurn(usize),
}

impl fmt::Display for LinearisationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Angles(count) => write!(f, "a pose of {count} angles: give one per driven joint"),
            Self::Bushings(count) => write!(f, "{count} bushings: give one per joint"),
            Self::NoEquilibrium(joint) => {
                write!(f, "joint {} does not come to rest under gravity: stiffen it", joint + 1)
            }
            Self::QuarterTurn(joint) => {
                write!(f, "joint {} turns by a quarter turn under gravity: stiffen it", joint + 1)
            }
        }
    }
}

impl Error for LinearisationError {}

impl LinearChain {
    /// Static elongations of the bushings, m and rad.
    pub fn elongations(&self) -> [Vector6<f64>; MAX_JOINTS] {
        let mut elongations = [Vector6::zeros(); MAX_JOINTS];
        for (own, joint) in elongations.iter_mut().zip(&self.joints) {
            *own = joint.sag;
        }
        elongations
    }
}

impl Chain {
    /// Linearises the chain about its static equilibrium at joint angles `pose` (one per driven joint, rad or m) under `gravity`
    /// (base axes, m/s²). The bushings affect the result only through the sag: without gravity the result does not depend on
    /// them.
    ///
    /// # Errors
    ///
    /// Returns an error if there is not one angle per driven joint and one bushing per joint, or if the bushings are too soft for gravity.
    pub fn linearise(
        &self,
        pose: &[f64],
        gravity: Vector3<f64>,
        bushings: &[Bushing],
    ) -> Result<LinearChain, LinearisationError> {
        if pose.len() != self.driven() {
            return Err(LinearisationError::Angles(pose.len()));
        }
        if bushings.len() != self.joints.len() {
            return Err(LinearisationError::Bushings(bushings.len()));
        }
        let sag = self.sag(pose, gravity, bushings)?;
        Ok(self.linearise_at(pose, gravity, &sag))
    }

    /// Linearises the chain about these elongations of its bushings, m and rad. There is one angle of `pose` per driven joint.
    pub(crate) fn linearise_at(
        &self,
        pose: &[f64],
        gravity: Vector3<f64>,
        sag: &[Vector6<f64>; MAX_JOINTS],
    ) -> LinearChain {
        Sagged::new(self, pose, gravity, sag).linearise(self, sag)
    }

    /// Loads of gravity on these elongations of the bushings, N and Nm. There is one angle of `pose` per driven joint.
    pub(crate) fn gravity_loads(
        &self,
        pose: &[f64],
        gravity: Vector3<f64>,
        sag: &[Vector6<f64>; MAX_JOINTS],
    ) -> [Vector6<f64>; MAX_JOINTS] {
        let mut loads = [Vector6::zeros(); MAX_JOINTS];
        for (load, joint) in loads.iter_mut().zip(&Sagged::new(self, pose, gravity, sag).joints) {
            *load = joint.gravity_load();
        }
        loads
    }

    /// Elongations of the bushings at rest under gravity, m and rad.
    fn sag(
        &self,
        pose: &[f64],
        gravity: Vector3<f64>,
        bushings: &[Bushing],
    ) -> Result<[Vector6<f64>; MAX_JOINTS], LinearisationError> {
        let mut sag = [Vector6::zeros(); MAX_JOINTS];
        if gravity == Vector3::zeros() {
            return Ok(sag);
        }
        // Joint with the largest change in the last round; `None` at rest. A change that is not a number does not count as
        // rest.
        let mut moving = Some(0);
        for _ in 0..EQUILIBRIUM_ROUNDS {
            let loads = self.gravity_loads(pose, gravity, &sag);
            let mut largest = AT_REST;
            moving = None;
            for (index, bushing) in bushings.iter().enumerate() {
                let next = loads[index].component_div(&Vector6::from(bushing.stiffness));
                let change = (next - sag[index]).abs().sum();
                if change.is_nan() || change >= largest {
                    (largest, moving) = (change, Some(index));
                }
                sag[index] = next;
            }
            if moving.is_none() {
                break;
            }
        }
        if let Some(joint) = moving {
            return Err(LinearisationError::NoEquilibrium(joint));
        }
        // The determinant of the axes of a bushing's turns is the cosine of its second turn.
        match sag.iter().position(|sag| libm::cos(sag[4]).abs() < INDEPENDENT) {
            Some(joint) => Err(LinearisationError::QuarterTurn(joint)),
            None => Ok(sag),
        }
    }
}

/// A joint of the sagged chain and the mass that it carries, along the axes of the joint frame at the moved bushing.
struct SaggedJoint {
    /// Pose of this link's frame (joint axes, at the bushing's moved origin) in the link before.
    step: Isometry3<f64>,
    /// Rotation from the joint axes to the turned link.
    turned: Rotation3<f64>,
    /// Axes of the three turns as columns, along the joint axes.
    turn_axes: Matrix3<f64>,
    /// Gravity along the joint axes, m/s².
    gravity: Vector3<f64>,
    /// Mass of all links that the joint carries, kg.
    mass: f64,
    /// First moment of all links that the joint carries, about the bushing's origin, along the joint axes, kg m.
    moment: Vector3<f64>,
}

struct Sagged {
    joints: Vec<SaggedJoint, MAX_JOINTS>,
}

impl SaggedJoint {
    /// Matrix from a rotation of the link, along the joint axes, to the three turns at this sag. The axes of the turns are x,
    /// y turned by the first turn a, and z turned by the first two turns a and b. They are the columns of the matrix to
    /// invert:
    ///
    /// ```text
    ///     [ 1   0      sin b       ]          1    [ cos b   sin a sin b   −cos a sin b ]
    ///     [ 0  cos a  −sin a cos b ]⁻¹  =   -----  [   0     cos a cos b    sin a cos b ]
    ///     [ 0  sin a   cos a cos b ]        cos b  [   0       −sin a          cos a    ]
    /// ```
    fn turn_axes_inverse(sag: &Vector6<f64>) -> Matrix3<f64> {
        let ((sin_a, cos_a), (sin_b, cos_b)) = (libm::sincos(sag[3]), libm::sincos(sag[4]));
        Matrix3::new(
            cos_b,
            sin_a * sin_b,
            -cos_a * sin_b, //
            0.0,
            cos_a * cos_b,
            sin_a * cos_b, //
            0.0,
            -sin_a,
            cos_a,
        ) / cos_b
    }

    /// Generalised force of gravity on the six elongations, N and Nm.
    fn gravity_load(&self) -> Vector6<f64> {
        let force = self.gravity * self.mass;
        let torque = self.turn_axes.transpose() * self.moment.cross(&self.gravity);
        Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
    }
}

impl Sagged {
    fn new(
        chain: &Chain,
        pose: &[f64],
        gravity: Vector3<f64>,
        sag: &[Vector6<f64>; MAX_JOINTS],
    ) -> Self {
        let mut joints: Vec<SaggedJoint, MAX_JOINTS> = Vec::new();
        let mut before = Rotation3::identity();
        let mut gravity = gravity;
        for ((joint, q), sag) in chain.joints.iter().zip(chain.angles(pose)).zip(sag) {
            let drive = joint.frame(q);
            let slide = Translation3::new(sag[0], sag[1], sag[2]);
            let step =
                Isometry3::from_parts(Translation3::identity(), before.into()) * drive * slide;
            let about_x = Rotation3::from_axis_angle(&Vector3::x_axis(), sag[3]);
            let about_xy = about_x * Rotation3::from_axis_angle(&Vector3::y_axis(), sag[4]);
            let turned = about_xy * Rotation3::from_axis_angle(&Vector3::z_axis(), sag[5]);
            let turn_axes = Matrix3::from_columns(&[
                Vector3::x(),
                about_x * Vector3::y(),
                about_xy * Vector3::z(),
            ]);
            gravity = step.rotation.inverse() * gravity;
            // A chain has no more joints than the vector holds.
            let _ = joints.push(SaggedJoint {
                step,
                turned,
                turn_axes,
                gravity,
                mass: 0.0,
                moment: Vector3::zeros(),
            });
            before = turned;
        }
        let (mut mass, mut moment) = (0.0, Vector3::zeros());
        for (joint, frame) in chain.joints.iter().zip(joints.iter_mut()).rev() {
            mass += joint.link.mass;
            moment += frame.turned * joint.link.centre_of_mass * joint.link.mass;
            frame.mass = mass;
            frame.moment = moment;
            moment = frame.step.rotation * moment + frame.step.translation.vector * mass;
        }
        Self { joints }
    }

    fn linearise(&self, chain: &Chain, sag: &[Vector6<f64>; MAX_JOINTS]) -> LinearChain {
        let (mut before, mut before_inverse) = (Matrix3::identity(), Matrix3::identity());
        let mut joints = Vec::new();
        for (index, frame) in self.joints.iter().enumerate() {
            let back = frame.step.rotation.inverse().to_rotation_matrix().into_inner();
            let (axes, axes_inverse) =
                (frame.turn_axes, SaggedJoint::turn_axes_inverse(&sag[index]));
            let _ = joints.push(LinearJoint {
                from_parent: FromParent {
                    rotation: back,
                    lever: -back * frame.step.translation.vector.cross_matrix() * before,
                    turns: axes_inverse * back * before,
                    turns_inverse: before_inverse * back.transpose() * axes,
                },
                inertia: spatial_inertia(&chain.joints[index].link, &frame.turned, &axes),
                gravity_turns: gravity_turns(frame),
                gravity_coupling: gravity_coupling(frame),
                sag: sag[index],
            });
            (before, before_inverse) = (axes, axes_inverse);
        }
        let last = &self.joints[self.joints.len() - 1];
        let tcp_axes = last.turned * chain.tcp.rotation.to_rotation_matrix();
        let lever = last.turned * chain.tcp.translation.vector;
        let mut tip_force = SMatrix::<f64, 6, 3>::zeros();
        let mut tip_torque = SMatrix::<f64, 6, 3>::zeros();
        for axis in 0..3 {
            let direction: Vector3<f64> = tcp_axes.matrix().column(axis).into();
            let torque = last.turn_axes.transpose() * lever.cross(&direction);
            tip_force.fixed_view_mut::<3, 1>(0, axis).copy_from(&direction);
            tip_force.fixed_view_mut::<3, 1>(3, axis).copy_from(&torque);
            tip_torque
                .fixed_view_mut::<3, 1>(3, axis)
                .copy_from(&(last.turn_axes.transpose() * direction));
        }
        LinearChain {
            joints,
            tip_force,
            tip_torque,
            gravity_at_tip: tcp_axes.inverse() * last.gravity,
        }
    }
}

/// Spatial inertia about the bushing's origin, on (translation, turns about `axes`).
fn spatial_inertia(
    link: &super::Link,
    turned: &Rotation3<f64>,
    axes: &Matrix3<f64>,
) -> Matrix6<f64> {
    let moment = (turned * link.centre_of_mass).cross_matrix() * link.mass;
    let rotated = turned.matrix() * link.inertia * turned.matrix().transpose();
    let about_origin = rotated - moment * (turned * link.centre_of_mass).cross_matrix();
    let mut inertia = Matrix6::zeros();
    inertia.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(link.mass);
    inertia.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-moment * axes));
    inertia.fixed_view_mut::<3, 3>(3, 0).copy_from(&(axes.transpose() * moment));
    inertia.fixed_view_mut::<3, 3>(3, 3).copy_from(&(axes.transpose() * about_origin * axes));
    inertia
}

fn gravity_turns(frame: &SaggedJoint) -> Matrix3<f64> {
    let mut stiffness = Matrix3::zeros();
    for b in 0..3 {
        let swing = frame.turn_axes.column(b).cross(&frame.moment);
        for a in 0..=b {
            let moment = frame.turn_axes.column(a).dot(&frame.gravity.cross(&swing));
            stiffness[(a, b)] = moment;
            stiffness[(b, a)] = moment;
        }
    }
    stiffness
}

fn gravity_coupling(frame: &SaggedJoint) -> SMatrix<f64, 6, 3> {
    let mut coupling = SMatrix::<f64, 3, 6>::zeros();
    for b in 0..DOF {
        let first_moment = if b < 3 {
            Vector3::ith(b, frame.mass)
        } else {
            frame.turn_axes.column(b - 3).cross(&frame.moment)
        };
        coupling.set_column(b, &frame.gravity.cross(&first_moment));
    }
    coupling.transpose() * frame.turn_axes
}

#[cfg(test)]
mod tests;
