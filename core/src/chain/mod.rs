//! A serial robot: joints, the rigid links that they carry, and the tool centre point (TCP).

mod carried;
mod drives;
pub mod from_parent;
mod jacobian;
pub mod linearise;
pub(crate) mod spread;

use core::error::Error;
use core::f64::consts::TAU;
use core::fmt;

use heapless::Vec;
use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

use crate::MAX_JOINTS;
pub use drives::DriveJacobian;
pub use jacobian::Jacobian;

/// Accuracy of an inertia that a file gives, and part of its largest principal moment by which that may exceed the sum of the two others:
/// files carry rounded numbers.
pub const INERTIA_TOLERANCE: f64 = 0.05;

/// A rigid link, in the frame of the joint that carries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub centre_of_mass: Vector3<f64>,
    /// Inertia about the centre of mass, along the axes of the joint frame, kg m².
    pub inertia: Matrix3<f64>,
}

/// Motion of the drive of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// The drive turns about the axis, rad.
    Revolute,
    /// The drive slides along the axis, m.
    Prismatic,
    /// There is no drive, as between ground and robot (pedestal) or at a bolted extension. A pose has no angle of it.
    Fixed,
}

/// A joint with a bushing: the drive sets the joint frame, and the bushing lets the link move relative to this frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Pose of the joint frame at joint angle 0, in the frame of the joint before (or the base).
    pub origin: Isometry3<f64>,
    /// Axis of the drive, in the joint frame. Without a meaning for a fixed joint.
    pub axis: Unit<Vector3<f64>>,
    /// Motion of the drive, if there is one.
    pub kind: JointKind,
    /// The link that the joint carries.
    pub link: Link,
}

/// Reason why a chain is invalid. Joints are numbered from 0, base first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChainError {
    /// The number of joints, which is given here, is not 1 to [`MAX_JOINTS`].
    JointCount(usize),
    /// The link of this joint has a mass that is not positive and finite.
    Mass(usize),
    /// The link of this joint has an inertia that no body has: it is not symmetric and positive, or one principal moment
    /// exceeds the sum of the two others.
    Inertia(usize),
    /// A number of the pose of the TCP (`None`) or of this joint is not finite.
    NotFinite(Option<usize>),
}

impl fmt::Display for ChainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointCount(count) => write!(f, "{count} joints: a chain has 1 to {MAX_JOINTS}"),
            Self::Mass(joint) => {
                write!(f, "mass of joint {}'s link: must be positive and finite", joint + 1)
            }
            Self::Inertia(joint) => write!(
                f,
                "inertia of joint {}'s link: must be symmetric, its principal moments positive and none above the sum of \
                 the two others",
                joint + 1
            ),
            Self::NotFinite(None) => f.write_str("pose of the TCP: must be finite"),
            Self::NotFinite(Some(joint)) => {
                write!(f, "pose, axis and centre of mass of joint {}: must be finite", joint + 1)
            }
        }
    }
}

impl Error for ChainError {}

/// A serial chain from the base to the TCP.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    pub(crate) joints: Vec<Joint, MAX_JOINTS>,
    pub(crate) tcp: Isometry3<f64>,
}

impl Joint {
    /// Degree of freedom along (or about) the axis of the drive: that of the axis' largest component. `None` for a fixed joint.
    pub fn drive(&self) -> Option<usize> {
        match self.kind {
            JointKind::Prismatic => Some(self.axis.iamax()),
            JointKind::Revolute => Some(3 + self.axis.iamax()),
            JointKind::Fixed => None,
        }
    }
}

impl Chain {
    /// A chain of `joints`, base first, with `tcp` as the pose of the TCP in the last joint's frame.
    ///
    /// # Errors
    ///
    /// Returns an error if there are not 1 to [`MAX_JOINTS`] joints, if a number is not finite, or if no body has the mass or
    /// the inertia of a link.
    pub fn new(joints: &[Joint], tcp: Isometry3<f64>) -> Result<Self, ChainError> {
        let joints = match Vec::from_slice(joints) {
            Ok(joints) if !joints.is_empty() => joints,
            _ => return Err(ChainError::JointCount(joints.len())),
        };
        let finite = |pose: &Isometry3<f64>| {
            pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite())
        };
        if !finite(&tcp) {
            return Err(ChainError::NotFinite(None));
        }
        for (index, joint) in joints.iter().enumerate() {
            let others = joint.axis.iter().chain(joint.link.centre_of_mass.iter());
            if !finite(&joint.origin) || !others.copied().all(f64::is_finite) {
                return Err(ChainError::NotFinite(Some(index)));
            }
            if !(joint.link.mass.is_finite() && joint.link.mass > 0.0) {
                return Err(ChainError::Mass(index));
            }
            if !joint.link.has_physical_inertia() {
                return Err(ChainError::Inertia(index));
            }
        }
        Ok(Self { joints, tcp })
    }

    /// Joints, base first.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Number of driven joints. A pose has one angle (or stroke) for each of them, base first.
    pub fn driven(&self) -> usize {
        self.joints.iter().filter(|joint| joint.kind != JointKind::Fixed).count()
    }

    /// Motion of each joint's drive, base first.
    pub(crate) fn kinds(&self) -> Vec<JointKind, MAX_JOINTS> {
        self.joints.iter().map(|joint| joint.kind).collect()
    }

    /// Place of a joint's angle in a pose; `None` for a fixed joint.
    pub(crate) fn place_in_pose(&self, joint: usize) -> Option<usize> {
        let (before, from) = self.joints.split_at(joint);
        let is_driven = |joint: &&Joint| joint.kind != JointKind::Fixed;
        from.first().filter(is_driven).map(|_| before.iter().filter(is_driven).count())
    }

    /// Angle (or stroke) of each joint at a pose, base first: 0 for a fixed one.
    pub fn angles(&self, pose: &[f64]) -> impl Iterator<Item = f64> {
        let mut driven = pose.iter();
        self.joints.iter().map_while(move |joint| match joint.kind {
            JointKind::Fixed => Some(0.0),
            JointKind::Revolute | JointKind::Prismatic => driven.next().copied(),
        })
    }

    /// The chain with the mass and inertia of each link multiplied by its entry of `scale`, base first. The entries must
    /// be positive. Links without an entry keep their mass and inertia.
    pub fn weighing(&self, scale: &[f64]) -> Self {
        let mut chain = self.clone();
        for (joint, &scale) in chain.joints.iter_mut().zip(scale) {
            joint.link.mass *= scale;
            joint.link.inertia *= scale;
        }
        chain
    }

    /// Pose of the TCP in the last joint's frame.
    pub fn tcp(&self) -> &Isometry3<f64> {
        &self.tcp
    }
}

impl Joint {
    /// Pose of the joint frame in the frame of the joint before, at joint angle `q`, rad (or stroke, m). That of a fixed joint does not
    /// depend on it.
    pub fn frame(&self, q: f64) -> Isometry3<f64> {
        self.origin
            * match self.kind {
                JointKind::Revolute => Isometry3::from_parts(
                    Translation3::identity(),
                    UnitQuaternion::from_axis_angle(&self.axis, q),
                ),
                JointKind::Prismatic => Translation3::from(self.axis.into_inner() * q).into(),
                JointKind::Fixed => Isometry3::identity(),
            }
    }
}

/// True if two poses (rad, m) differ by at most `within` in each angle, and by whole turns. No joint that slides has two poses that are a whole
/// turn, 6.28 m, apart and otherwise alike.
pub fn poses_agree(one: &[f64], other: &[f64], within: f64) -> bool {
    let agree = |(one, other): (&f64, &f64)| libm::remainder(one - other, TAU).abs() <= within;
    one.len() == other.len() && one.iter().zip(other).all(agree)
}

/// Moment by which no body has these principal moments, kg m²: that by which the largest exceeds the sum of the two others. It is above 0
/// if one of them is below 0, too.
pub fn inertia_excess(moments: [f64; 3]) -> f64 {
    2.0 * moments.into_iter().fold(f64::MIN, f64::max) - moments.iter().sum::<f64>()
}

impl Link {
    /// True if a distribution of mass can have this inertia: it is symmetric and finite, its principal moments are positive,
    /// and none of them exceeds the sum of the two others by more than [`INERTIA_TOLERANCE`].
    pub fn has_physical_inertia(&self) -> bool {
        let inertia = self.inertia;
        if !inertia.iter().all(|moment| moment.is_finite())
            || (inertia - inertia.transpose()).amax() > 1e-9 * inertia.amax()
        {
            return false;
        }
        let moments = inertia.symmetric_eigenvalues();
        moments.min() > 0.0 && inertia_excess(moments.into()) <= INERTIA_TOLERANCE * moments.max()
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    /// Two and three digits round the moments of a flat body by so much.
    #[test]
    fn an_inertia_is_physical_within_its_accuracy() {
        let chain = crate::refine::tests::chain();
        let is_physical = |moments: [f64; 3]| {
            let inertia = Matrix3::from_diagonal(&moments.into());
            Link { inertia, ..chain.joints[0].link }.has_physical_inertia()
        };
        assert!(is_physical([14.0, 95.05, 81.0]) && is_physical([0.012, 0.013, 0.026]));
        assert!(!is_physical([1.0, 1.0, 2.2]) && !is_physical([0.0, 1.0, 1.0]));
    }

    #[test]
    fn a_pose_is_the_same_after_a_whole_turn() {
        use core::f64::consts::PI;
        let agrees = |other: [f64; 2]| poses_agree(&[PI, 0.2], &other, 1e-3);
        assert!(agrees([PI, 0.2]) && agrees([-PI + 5e-4, 0.1995]) && agrees([3.0 * PI, 0.2]));
        assert!(!agrees([0.0, 0.2]) && !agrees([-PI, 0.202]));
        assert!(!poses_agree(&[0.2], &[0.2, 0.0], 1e-3));
    }

    #[test]
    fn a_pose_has_an_angle_for_each_driven_joint() {
        use JointKind::{Fixed, Prismatic, Revolute};
        let chain = crate::refine::tests::chain();
        let joint = |kind| Joint { kind, ..chain.joints[0] };
        let joints = [Fixed, Revolute, Fixed, Prismatic].map(joint);
        let chain = Chain::new(&joints, chain.tcp).unwrap();
        assert_eq!(chain.driven(), 2);
        assert_eq!(chain.angles(&[0.3, -0.1]).collect::<Vec<_>>(), [0.0, 0.3, 0.0, -0.1]);
        let places = [0, 1, 2, 3].map(|joint| chain.place_in_pose(joint));
        assert_eq!(places, [None, Some(0), None, Some(1)]);
        assert_eq!(joints.map(|joint| joint.drive().is_some()), [false, true, false, true]);
    }
}
