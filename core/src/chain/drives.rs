//! The tool of a robot whose bushings are not elongated, and how its drives move it.

use nalgebra::{Isometry3, SMatrix, Vector3, Vector6};

use super::{Chain, JointKind};
use crate::MAX_JOINTS;

/// Geometric Jacobian of the driven joints: a column per angle of a pose, translation (m), then rotation (rad), per rad (m). Columns beyond
/// the driven joints are zero.
pub type DriveJacobian = SMatrix<f64, 6, MAX_JOINTS>;

impl Chain {
    /// Pose of the TCP in the base at joint angles `pose` (one per driven joint, rad or m), without sag.
    pub fn tool(&self, pose: &[f64]) -> Isometry3<f64> {
        let joints = self.joints.iter().zip(self.angles(pose));
        joints.fold(Isometry3::identity(), |tip, (joint, q)| tip * joint.frame(q)) * self.tcp
    }

    /// How the driven joints move the TCP, along its axes, without sag.
    ///
    /// ```text
    /// J = [ z × (p − o) ]  a joint that turns about the axis z through o,      [ z ]  one that slides along z
    ///     [      z      ]  with the TCP at p                                   [ 0 ]
    /// ```
    pub fn drive_jacobian(&self, pose: &[f64]) -> DriveJacobian {
        let tool = self.tool(pose);
        let to_tool = tool.rotation.inverse();
        let mut jacobian = DriveJacobian::zeros();
        let mut frame = Isometry3::identity();
        let mut columns = jacobian.column_iter_mut();
        for (joint, q) in self.joints.iter().zip(self.angles(pose)) {
            frame *= joint.frame(q);
            let axis = to_tool * (frame.rotation * joint.axis.into_inner());
            let arm = to_tool * (tool.translation.vector - frame.translation.vector);
            let [translation, rotation] = match joint.kind {
                JointKind::Revolute => [axis.cross(&arm), axis],
                JointKind::Prismatic => [axis, Vector3::zeros()],
                JointKind::Fixed => continue,
            };
            if let Some(mut column) = columns.next() {
                let both = translation.iter().chain(&rotation).copied();
                column.copy_from(&Vector6::from_iterator(both));
            }
        }
        jacobian
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::chain::Joint;

    #[test]
    fn the_jacobian_is_the_slope_of_the_tool() {
        use JointKind::{Fixed, Prismatic, Revolute};
        let chain = crate::refine::tests::chain();
        let kinds = [Revolute, Fixed, Prismatic, Revolute];
        let joint = |(n, kind)| Joint { kind, ..chain.joints[n % chain.joints.len()] };
        let joints: Vec<_> = kinds.into_iter().enumerate().map(joint).collect();
        let chain = Chain::new(&joints, chain.tcp).unwrap();
        let pose = [0.3, -0.4, 0.8];
        let (jacobian, to_tool) =
            (chain.drive_jacobian(&pose), chain.tool(&pose).rotation.inverse());
        const H: f64 = 1e-6;
        for angle in 0..3 {
            let at = |step: f64| {
                let mut moved = pose;
                moved[angle] += step;
                chain.tool(&moved)
            };
            let (back, ahead) = (at(-H), at(H));
            let translation = (ahead.translation.vector - back.translation.vector) / (2.0 * H);
            let rotation = (ahead.rotation * back.rotation.inverse()).scaled_axis() / (2.0 * H);
            let column = jacobian.column(angle);
            assert!((column.fixed_rows::<3>(0) - to_tool * translation).norm() < 1e-8);
            assert!((column.fixed_rows::<3>(3) - to_tool * rotation).norm() < 1e-8);
        }
        assert_eq!(jacobian.columns(3, MAX_JOINTS - 3).amax(), 0.0);
    }
}
