//! Where a force acts.

use nalgebra::Vector3;

/// Where a force acts: the pose of the robot, and the point of its tool.
#[derive(Clone, Copy, Debug)]
pub struct Site<'a> {
    /// Joint angles, rad (m).
    pub pose: &'a [f64],
    /// Their rates, rad/s (m/s); empty where the robot stands.
    pub rates: &'a [f64],
    /// Point at which the force acts, from the TCP, TCP axes, m.
    pub point: Vector3<f64>,
    /// True if the force is not read by the sensor of the [mounting](crate::mounting::Mounting): it is that of a modal test, along the TCP's axes.
    pub is_of_test: bool,
}

impl<'a> Site<'a> {
    /// The TCP at a pose, rad (m).
    pub fn tcp(pose: &'a [f64]) -> Self {
        Self { pose, rates: &[], point: Vector3::zeros(), is_of_test: false }
    }
}
