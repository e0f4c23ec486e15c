//! The chain that moves, at the pose of a cut.
//!
//! It is built for each pose: the joint angles are then part of the frames, and a frame can be moved to the true elastic centre of its
//! bushing. Its mounts say how the frames follow the drives along a path.

use std::f64::consts::SQRT_2;

use flexid_core::chain::{Chain, ChainError, Joint, JointKind, Link};
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushing;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::Plant;
use super::ripple::Ripple;
use super::robot::{Bending, Pedestal};
use crate::course::guide::Mount;

/// Least second moment along an axis, over the largest. Chosen: a Cholesky factor then exists, and no reading shows it.
const FLAT: f64 = 1e-12;

/// The chain that moves, at one pose.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueChain {
    /// The chain; all its joint angles are 0.
    pub chain: Chain,
    /// One bushing per joint of [`TrueChain::chain`].
    pub bushings: Vec<Bushing>,
    /// Joint of [`TrueChain::chain`] for each joint of the model.
    pub index: Vec<usize>,
    /// How the frames of [`TrueChain::chain`] follow the drives.
    pub mounts: Vec<Mount>,
    /// Mounting of the sensors as it truly is.
    pub mounting: Mounting,
}

impl Plant {
    /// Joint angles that the robot truly has after `seconds` of a cut at `pose`.
    pub fn true_pose(&self, pose: &[f64], seconds: f64) -> Vec<f64> {
        let robot = &self.robot;
        let angle = |(joint, q): (usize, &f64)| {
            let reported = q + seconds * nth(&robot.feed_rad_per_s, joint);
            let error = |own: &Ripple| own.at([reported, 0.0, 0.0])[0];
            let ripple: f64 = self.ripple_of(joint).map(error).sum();
            reported + nth(&robot.joint_angle_rad, joint) + ripple
        };
        pose.iter().enumerate().map(angle).collect()
    }

    /// Ripple of the gear of a driven joint, from 0.
    fn ripple_of(&self, joint: usize) -> impl Iterator<Item = &Ripple> {
        self.ripple.iter().filter(move |own| own.joint == joint + 1)
    }

    /// The robot that moves, at the true joint angles `pose`.
    ///
    /// # Errors
    /// A link is no body any more, or there are more bushings than a chain can have.
    pub fn robot(
        &self,
        model: &Chain,
        pose: &[f64],
        bushings: &[Bushing],
        mounting: &Mounting,
    ) -> Result<TrueChain, ChainError> {
        let mut joints: Vec<Joint> = Vec::new();
        let mut all = Vec::new();
        let (mut index, mut mounts) = (Vec::new(), Vec::new());
        if let Some(Pedestal { mass_kg, stiffness, damping }) = self.pedestal {
            // A cube of half a metre.
            let inertia = Matrix3::identity() * mass_kg * 0.25 / 6.0;
            let link = Link { mass: mass_kg, centre_of_mass: Vector3::zeros(), inertia };
            joints.push(fixed(Isometry3::identity(), link));
            mounts.push(Mount::of_joint(&joints[0], None));
            all.push(Bushing { stiffness, damping });
        }
        // What follows, seen from the frame of the last bushing, has moved by this.
        let (mut moved, mut places) = (Isometry3::identity(), 0..);
        for ((joint, modelled), q) in model.joints().iter().enumerate().zip(model.angles(pose)) {
            let centre = Translation3::from(vector(&self.robot.elastic_centre_m, joint));
            let origin = moved * modelled.frame(q) * centre;
            let link = self.link(modelled, joint);
            let next = match model.joints().get(joint + 1) {
                Some(next) => next.origin.translation.vector,
                None => model.tcp().translation.vector,
            };
            index.push(joints.len());
            let drive = modelled.drive().and_then(|_| places.next());
            mounts.push(Mount {
                before: moved,
                after: centre.into(),
                offset: drive.map_or(0.0, |place| nth(&self.robot.joint_angle_rad, place)),
                ripple: drive.map_or(Vec::new(), |place| self.ripple_of(place).copied().collect()),
                ..Mount::of_joint(modelled, drive)
            });
            moved = centre.inverse().into();
            all.push(bushings[joint]);
            match &self.bending {
                Some(bending) if bending.joint == joint + 1 => {
                    let place = Translation3::from(bending.at * next - centre.vector);
                    joints.push(fixed(origin, part(&link, bending.at, &Vector3::zeros())));
                    let outer = part(&link, 1.0 - bending.at, &place.vector);
                    let bends = fixed(place.into(), outer);
                    joints.push(bends);
                    mounts.push(Mount::of_joint(&bends, None));
                    let Bending { stiffness, damping, .. } = *bending;
                    all.push(Bushing { stiffness, damping });
                    moved = place.inverse() * moved;
                }
                _ => joints.push(fixed(origin, link)),
            }
        }
        let tool = Isometry3::from_parts(
            Translation3::from(Vector3::from(self.tool.tcp_m)),
            UnitQuaternion::new(self.tool.angle_rad.into()),
        );
        let chain = Chain::new(&joints, moved * model.tcp() * tool)?;
        let mounting = self.mounting(mounting);
        Ok(TrueChain { chain, bushings: all, index, mounts, mounting })
    }

    /// The true link, in the frame of its elastic centre.
    fn link(&self, joint: &Joint, index: usize) -> Link {
        let robot = &self.robot;
        let factor = |list: &[f64]| list.get(index).copied().unwrap_or(1.0);
        let mass = factor(&robot.mass);
        Link {
            mass: joint.link.mass * mass,
            centre_of_mass: joint.link.centre_of_mass + vector(&robot.centre_of_mass_m, index)
                - vector(&robot.elastic_centre_m, index),
            inertia: self.inertia(&joint.link.inertia, index) * mass * factor(&robot.inertia),
        }
    }

    /// The inertia of a link whose second moment `S = C Cᵀ` becomes `C e^P Cᵀ`, by one symmetric P after the other.
    fn inertia(&self, inertia: &Matrix3<f64>, index: usize) -> Matrix3<f64> {
        let Some(spread) = self.robot.spread.get(index) else { return *inertia };
        // A flat link has no spread along some axis, or rounding makes it less than none.
        let mut axes =
            (Matrix3::from_diagonal_element(0.5 * inertia.trace()) - inertia).symmetric_eigen();
        let least = FLAT * axes.eigenvalues.max();
        axes.eigenvalues.apply(|own| *own = own.max(least));
        let mut second = axes.recompose();
        for (entry, value) in spread.iter().enumerate() {
            let (i, j) = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)][entry];
            let mut p = Matrix3::zeros();
            p[(i, j)] = if i == j { *value } else { value / SQRT_2 };
            p[(j, i)] = p[(i, j)];
            let Some(c) = second.cholesky() else { return *inertia };
            second = c.l() * p.exp() * c.l().transpose();
        }
        Matrix3::from_diagonal_element(second.trace()) - second
    }

    /// The true places and axes of the sensors, seen from the true TCP.
    fn mounting(&self, mounting: &Mounting) -> Mounting {
        let turn = Rotation3::new(self.tool.angle_rad.into());
        // The sensors turn with the tool, but do not move with the TCP's error.
        let place = |point: Vector3<f64>| point - turn.inverse() * Vector3::from(self.tool.tcp_m);
        let axes = |axes: Rotation3<f64>, angle: [f64; 3]| axes * Rotation3::new(angle.into());
        Mounting {
            accelerometer: place(mounting.accelerometer)
                + Vector3::from(self.accelerometer.offset_m),
            accelerometer_axes: axes(mounting.accelerometer_axes, self.accelerometer.angle_rad),
            force_axes: axes(mounting.force_axes, self.force_sensor.angle_rad),
            tool_mass: mounting.tool_mass,
            tool_centre: place(mounting.tool_centre),
        }
    }
}

/// A joint without a drive.
fn fixed(origin: Isometry3<f64>, link: Link) -> Joint {
    Joint { origin, axis: Vector3::z_axis(), kind: JointKind::Revolute, link }
}

/// A part of a link, as heavy as `share` of it and of the same shape, seen from a frame at `place`.
fn part(link: &Link, share: f64, place: &Vector3<f64>) -> Link {
    Link {
        mass: share * link.mass,
        centre_of_mass: link.centre_of_mass - place,
        inertia: share * link.inertia,
    }
}

/// A joint's entry of a list; 0 where the list is left out.
fn nth(list: &[f64], joint: usize) -> f64 {
    list.get(joint).copied().unwrap_or(0.0)
}

fn vector(list: &[[f64; 3]], joint: usize) -> Vector3<f64> {
    list.get(joint).copied().unwrap_or([0.0; 3]).into()
}
