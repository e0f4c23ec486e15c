//! Parameters of the joints, and whether two results are of the same ones.

use flexid_pipeline::dynamics::OF_JOINT;
use flexid_pipeline::text::count;
use flexid_wire::report::{JointReport, Verdict};
use serde::Serialize;

use crate::document::Found;

/// Standard deviations of a logarithm that a fit can have. Chosen: what is beyond is no number of a fit, and its square may be none.
const STDS: std::ops::Range<f64> = 1e-12..1e3;

/// Parameters of a degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// N/m or Nm/rad.
    Stiffness,
    /// Ns/m or Nms/rad.
    Damping,
}

/// Why two fits cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IncomparableError {
    /// The robots have other joints.
    #[error(
        "is of another robot than the first, and nothing can be compared: it has {after}, the first {before}: name two results of one robot"
    )]
    Joints {
        /// Number of the first robot's joints, with names and kinds where the numbers are equal.
        before: String,
        /// Number of the second robot's joints, likewise.
        after: String,
    },
    /// No parameter is determined by both fits.
    #[error("has no parameter in common with the first: none is identified or weak in both")]
    Nothing,
}

/// A parameter and its place among the coordinates of the robot.
pub(crate) struct Place {
    pub(crate) joint: usize,
    pub(crate) dof: usize,
    pub(crate) quantity: Quantity,
}

impl Place {
    pub(crate) fn coordinate(&self) -> usize {
        let first = if self.quantity == Quantity::Damping { OF_JOINT / 2 } else { 0 };
        OF_JOINT * self.joint + first + self.dof
    }

    /// Value, standard deviation of the logarithm, and verdict.
    pub(crate) fn of(&self, joints: &[JointReport]) -> (f64, Option<f64>, Verdict) {
        let (joint, dof) = (&joints[self.joint], self.dof);
        let (value, std, verdict) = match self.quantity {
            Quantity::Stiffness => {
                (joint.stiffness[dof], joint.stiffness_std[dof], joint.stiffness_verdict[dof])
            }
            Quantity::Damping => {
                (joint.damping[dof], joint.damping_std[dof], joint.damping_verdict[dof])
            }
        };
        (value, std.map(|std| std / value), verdict)
    }

    /// Standard deviation of the logarithm where the fit determines it.
    pub(crate) fn determined(&self, joints: &[JointReport]) -> Option<f64> {
        let (_, std, verdict) = self.of(joints);
        let is_determined = matches!(verdict, Verdict::Identified | Verdict::Weak);
        std.filter(|std| is_determined && STDS.contains(std))
    }
}

/// Checks that two results are of a robot with the same joints.
///
/// # Errors
/// They are not.
pub(crate) fn same_joints(before: &Found, after: &Found) -> Result<(), IncomparableError> {
    let [of_before, of_after] = [before, after].map(joints);
    if of_before == of_after {
        return Ok(());
    }
    let has_as_many = of_before.len() == of_after.len();
    let [before, after] = [of_before, of_after].map(|own| {
        let number = count(own.len() as u64, "joint");
        if has_as_many { format!("the joints {}", own.join(", ")) } else { number }
    });
    Err(IncomparableError::Joints { before, after })
}

/// All parameters of so many joints.
pub(crate) fn places(joints: usize) -> Vec<Place> {
    let of_joint = |joint| {
        [Quantity::Stiffness, Quantity::Damping]
            .into_iter()
            .flat_map(move |quantity| (0..6).map(move |dof| Place { joint, dof, quantity }))
    };
    (0..joints).flat_map(of_joint).collect()
}

/// Names and kinds of the joints, in words.
fn joints(found: &Found) -> Vec<String> {
    let joints = found.robot.model().joints.iter();
    let kinds = joints.map(|joint| {
        let kind = format!("{:?}", joint.kind).to_lowercase();
        format!("{} ({kind})", joint.name)
    });
    kinds.collect()
}
