//! A link and the bushing that carries it.

use flexid_core::chain::Link;
use flexid_core::parameters::Bushing;
use flexid_wire::report::JointReport;
use nalgebra::Isometry3;

/// Compliance of the ground below which it is exported as rigid, m/N and rad/Nm. Chosen: that of stiff joints is a hundred times as large, and
/// harder ground would ask for a shorter step of time. Formats that cannot leave out a degree of freedom have this compliance there.
pub(crate) const RIGID: f64 = 5e-11;

/// A link, its bushing, and the drive that carries the bushing.
pub(crate) struct Body<'a> {
    /// Name of the joint, in one line.
    pub(crate) name: String,
    /// Pose of the joint frame, with the drive locked at its angle, in the joint frame before or in the base.
    pub(crate) frame: Isometry3<f64>,
    /// The link in the joint frame.
    pub(crate) link: Link,
    /// The bushing, with what its drive and hysteresis add. A stiffness is infinite where the ground is rigid.
    pub(crate) bushing: Bushing,
    /// Values and verdicts of the bushing; `None` of the ground, which is no joint of the robot.
    pub(crate) report: Option<&'a JointReport>,
    /// Elongation of the bushing at rest under gravity, m and rad; `None` if the robot does not come to rest.
    pub(crate) sag: Option<[f64; 6]>,
    /// Lines on what differs from the model or is not identified.
    pub(crate) remarks: Vec<String>,
}

impl Body<'_> {
    /// Stiffnesses, all finite.
    pub(crate) fn finite_stiffness(&self) -> [f64; 6] {
        self.bushing.stiffness.map(|own| if own.is_finite() { own } else { 1.0 / RIGID })
    }

    /// Degrees of freedom in which the bushing gives way.
    pub(crate) fn dofs(&self) -> impl Iterator<Item = usize> {
        (0..6).filter(|dof| self.bushing.stiffness[*dof].is_finite())
    }
}
