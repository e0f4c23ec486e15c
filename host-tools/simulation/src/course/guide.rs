//! The motion of the joint frames along a course, as the equation of motion takes it.

use flexid_core::MAX_JOINTS;
use flexid_core::chain::{Chain, Joint};
use flexid_core::motion::Coordinates;
use flexid_core::motion::travel::{FrameMotion, Travel};
use nalgebra::Isometry3;

use super::{Course, Motion};
use crate::plant::ripple::Ripple;

/// Time between the poses whose elongations at rest are computed, s. Chosen: linear interpolation between them misses by 1e-12 rad where the sag
/// changes by 1e-4 rad over 0.2 m.
const RESTS_S: f64 = 0.01;

/// How a joint frame of the chain that moves follows the drives.
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    /// The frame that carries the joint's frame, in the link before.
    pub before: Isometry3<f64>,
    /// The joint as modelled.
    pub joint: Joint,
    /// Frame of the bushing in the joint's frame.
    pub after: Isometry3<f64>,
    /// Place of the drive in a pose; `None` for a joint without one.
    pub drive: Option<usize>,
    /// True less reported angle, without ripple, rad (m).
    pub offset: f64,
    /// Ripple of its gear.
    pub ripple: Vec<Ripple>,
}

/// Motion of all joint frames of a robot on a course.
#[derive(Clone, Debug)]
pub struct Guide<'a> {
    course: &'a Course,
    mounts: Vec<Mount>,
    rests: Vec<Coordinates>,
}

impl Mount {
    /// The mounts of a robot that is as modelled.
    pub fn of(chain: &Chain) -> Vec<Self> {
        let mut places = 0..;
        let mount =
            |joint: &Joint| Self::of_joint(joint, joint.drive().and_then(|_| places.next()));
        chain.joints().iter().map(mount).collect()
    }

    /// The mount of a joint as modelled, with the place of its drive in a pose.
    pub fn of_joint(joint: &Joint, drive: Option<usize>) -> Self {
        let (before, after) = (Isometry3::identity(), Isometry3::identity());
        Self { before, joint: *joint, after, drive, offset: 0.0, ripple: Vec::new() }
    }
}

impl<'a> Guide<'a> {
    /// The guide of a robot with these mounts, base first. `rest` gives its elongations at rest at reported joint angles.
    ///
    /// # Errors
    /// That of `rest`.
    pub fn new<E>(
        course: &'a Course,
        mounts: Vec<Mount>,
        rest: impl Fn(&[f64]) -> Result<Coordinates, E>,
    ) -> Result<Self, E> {
        let driven = mounts.iter().filter(|mount| mount.drive.is_some()).count();
        let count = (course.ends_s() / RESTS_S).ceil() as usize + 1;
        let at = |n: usize| course.at(n as f64 * RESTS_S).map(|[angle, ..]| angle);
        let rests = (0..count).map(|n| rest(&at(n)[..driven])).collect::<Result<_, E>>()?;
        Ok(Self { course, mounts, rests })
    }

    /// Motion of the joint frames after `time` seconds.
    pub fn travel(&self, time: f64) -> Travel {
        let motion = self.course.at(time);
        let mut travel = Travel { rest: self.rest(time), ..Travel::default() };
        for (frame, mount) in travel.frames.iter_mut().zip(&self.mounts) {
            *frame = mount.frame(&motion);
        }
        travel
    }

    /// How far each drive has moved from the start after `time` seconds, along its degree of freedom, rad (m), joint by joint.
    pub fn driven(&self, time: f64) -> [f64; MAX_JOINTS] {
        let (now, start) = (self.course.at(time), self.course.at(0.0));
        let mut driven = [0.0; MAX_JOINTS];
        for (driven, mount) in driven.iter_mut().zip(&self.mounts) {
            if let (Some(place), Some(dof)) = (mount.drive, mount.joint.drive()) {
                let [now, start] = [now, start].map(|motion| mount.turned(&motion[place])[0]);
                *driven = (now - start) * mount.joint.axis[dof % 3].signum();
            }
        }
        driven
    }

    /// Elongations at rest where the robot is after `time` seconds, m and rad.
    pub fn rest(&self, time: f64) -> Coordinates {
        let place = (time / RESTS_S).clamp(0.0, (self.rests.len() - 1) as f64);
        let (first, part) = (place as usize, place.fract());
        let mut rest = self.rests[first];
        if let Some(next) = self.rests.get(first + 1) {
            rest.iter_mut().zip(next).for_each(|(rest, next)| *rest += part * (next - *rest));
        }
        rest
    }
}

impl Mount {
    fn frame(&self, motion: &Motion) -> FrameMotion {
        let reported = self.drive.map_or([0.0; 3], |place| motion[place]);
        let [angle, rate, acceleration] = self.turned(&reported);
        let own = self.joint.frame_motion(angle, rate, acceleration);
        own.between(&self.before, &self.after)
    }

    /// True angle, rate and acceleration of the joint where these are reported: rad, rad/s and rad/s² (m).
    fn turned(&self, reported: &[f64; 3]) -> [f64; 3] {
        let mut turned = *reported;
        turned[0] += self.offset;
        for error in self.ripple.iter().map(|own| own.at(*reported)) {
            turned.iter_mut().zip(error).for_each(|(turned, error)| *turned += error);
        }
        turned
    }
}
