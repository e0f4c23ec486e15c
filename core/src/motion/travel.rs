//! Prescribed motion of the joint frames: the drives follow a path, and the bushings' elongations remain the unknowns.
//!
//! Let the frame of a joint stand at o in the link before, with the spin Ω relative to it, and its origin move at v, all along the axes of
//! that link. Imagine a *carrier*: a body without mass that the frame is fixed to, and that reaches back to the origin of the link
//! before. If that link has the spin ω and its origin the acceleration a, those of the carrier are
//!
//! ```text
//! ω′ = ω + Ω          ω̇′ = ω̇ + Ω̇ + ω × Ω
//! a′ = a + (ω̇ × o + ω × (ω × o) + 2 ω × v + v̇) − (ω̇′ × o + ω′ × (ω′ × o))
//! ```
//!
//! The bracket is the acceleration of the frame's origin beyond a; the last term takes the carrier from there to its own origin. A bushing on
//! the carrier moves its link as a bushing on a link that stands does, so that the recursions hold with ω′, ω̇′ and a′ in place of ω, ω̇ and
//! a. Loads pass unchanged: at one instant a drive only passes them on. A virtual displacement is one at a fixed time, so that the
//! generalised loads do not see the drive either.

use nalgebra::{Isometry3, Vector3};

use super::inverse::LinkMotion;
use super::kinematics::{Drive, Link};
use super::{Coordinates, EquationOfMotion};
use crate::MAX_JOINTS;
use crate::chain::{Joint, JointKind};

/// Motion of a joint's frame, relative to the link before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameMotion {
    /// Pose in the link before.
    pub pose: Isometry3<f64>,
    /// Spin Ω along the axes of the frame, rad/s.
    pub spin: Vector3<f64>,
    /// Rate of the spin, rad/s².
    pub spin_rate: Vector3<f64>,
    /// Velocity of the frame's origin along the axes of the frame, m/s.
    pub velocity: Vector3<f64>,
    /// Acceleration of the frame's origin along the axes of the frame, m/s².
    pub acceleration: Vector3<f64>,
}

/// Motion of all joint frames at one instant, and the elongations that count as rest there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Travel {
    /// Frames, base first. Those beyond the chain are ignored.
    pub frames: [FrameMotion; MAX_JOINTS],
    /// Elongations at rest, m and rad: those of a robot that stands at this pose.
    pub rest: Coordinates,
}

impl Joint {
    /// Motion of the joint's frame at joint angle `q`, rad (or stroke, m), its rate and its acceleration. A fixed joint does not move.
    pub fn frame_motion(&self, q: f64, rate: f64, acceleration: f64) -> FrameMotion {
        let axis = self.axis.into_inner();
        let standing = FrameMotion { pose: self.frame(q), ..FrameMotion::default() };
        match self.kind {
            JointKind::Revolute => {
                FrameMotion { spin: axis * rate, spin_rate: axis * acceleration, ..standing }
            }
            JointKind::Prismatic => {
                FrameMotion { velocity: axis * rate, acceleration: axis * acceleration, ..standing }
            }
            JointKind::Fixed => standing,
        }
    }
}

impl FrameMotion {
    /// Motion of a frame that is fixed at `after` in this one, seen from a link in which the link before is fixed at `before`.
    pub fn between(&self, before: &Isometry3<f64>, after: &Isometry3<f64>) -> Self {
        let (back, arm) = (after.rotation.inverse(), after.translation.vector);
        let Self { pose, spin, spin_rate, velocity, acceleration } = self;
        Self {
            pose: before * pose * after,
            spin: back * spin,
            spin_rate: back * spin_rate,
            velocity: back * (velocity + spin.cross(&arm)),
            acceleration: back
                * (acceleration + spin_rate.cross(&arm) + spin.cross(&spin.cross(&arm))),
        }
    }
}

impl EquationOfMotion {
    /// The equation of motion with its joint frames at one instant of `travel`. The TCP at rest is then that of the elongations
    /// `travel.rest`; the readings at rest stay what they were.
    pub(super) fn at(&self, travel: &Travel) -> Self {
        let mut equation = self.clone();
        for (link, frame) in equation.links.iter_mut().zip(&travel.frames) {
            let axes = frame.pose.rotation.to_rotation_matrix().into_inner();
            (link.axes, link.origin) = (axes, frame.pose.translation.vector);
            link.drive = Some(Drive {
                spin: axes * frame.spin,
                spin_rate: axes * frame.spin_rate,
                velocity: axes * frame.velocity,
                acceleration: axes * frame.acceleration,
            });
        }
        equation.rest = travel.rest;
        equation.place_rest();
        equation
    }
}

impl LinkMotion {
    /// Motion of the carrier of the joint frame of `link`, if this is that of the link before.
    pub(super) fn carrier(&self, link: &Link) -> Self {
        let Some(drive) = &link.drive else { return *self };
        let mut carrier = Self {
            spin: self.spin + drive.spin,
            spin_rate: self.spin_rate + drive.spin_rate + self.spin.cross(&drive.spin),
            acceleration: Vector3::zeros(),
        };
        let origin = self.acceleration_of(&link.origin)
            + 2.0 * self.spin.cross(&drive.velocity)
            + drive.acceleration;
        // Its own acceleration is still 0, so that `acceleration_of` gives only that due to its spin.
        carrier.acceleration = origin - carrier.acceleration_of(&link.origin);
        carrier
    }
}
