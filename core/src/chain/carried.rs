//! Inertia that each joint carries.

use heapless::Vec;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::Chain;
use crate::{DOF, MAX_JOINTS};

/// Lower limit of the radius of gyration, m. Files that describe a flange without its tool have a smaller one.
const LEAST_RADIUS: f64 = 0.1;

impl Chain {
    /// Inertia of all links that each joint carries, at the six degrees of freedom of its bushing, base first. The first
    /// three entries are the mass, kg. The last three are the moments of inertia about the axes of the joint frame, kg m², at
    /// least those of the mass at 0.1 m from the axes. All joint angles and strokes are zero.
    pub fn carried(&self) -> Vec<[f64; DOF], MAX_JOINTS> {
        let carried = |first: usize| {
            let (mut mass, mut moments) = (0.0, Matrix3::zeros());
            let mut pose = Isometry3::identity();
            for (index, joint) in self.joints.iter().enumerate().skip(first) {
                if index > first {
                    pose *= joint.frame(0.0);
                }
                let link = &joint.link;
                let turn = pose.rotation.to_rotation_matrix();
                let centre: Vector3<f64> = (pose * Point3::from(link.centre_of_mass)).coords;
                moments += turn.matrix() * link.inertia * turn.matrix().transpose();
                moments += (Matrix3::identity() * centre.norm_squared()
                    - centre * centre.transpose())
                    * link.mass;
                mass += link.mass;
            }
            let least = mass * LEAST_RADIUS * LEAST_RADIUS;
            let moment = |axis: usize| moments[(axis, axis)].max(least);
            core::array::from_fn(|dof| if dof < 3 { mass } else { moment(dof - 3) })
        };
        (0..self.joints.len()).map(carried).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Unit;

    use super::*;
    use crate::chain::{Joint, JointKind, Link};

    /// Two small masses lie on a line: 3 kg at 2 m and 5 kg at 6 m from the first joint. The second joint is at 5 m.
    #[test]
    fn masses_on_a_line_have_their_moments() {
        let joint = |offset: f64, mass: f64, centre: f64| Joint {
            origin: Isometry3::translation(offset, 0.0, 0.0),
            axis: Unit::new_normalize(Vector3::z()),
            kind: JointKind::Revolute,
            link: Link {
                mass,
                centre_of_mass: Vector3::new(centre, 0.0, 0.0),
                inertia: Matrix3::identity() * 1e-3,
            },
        };
        let joints = [joint(9.0, 3.0, 2.0), joint(5.0, 5.0, 1.0)];
        let chain = Chain::new(&joints, Isometry3::identity()).unwrap();
        let carried = chain.carried();
        let about = 3.0 * 2.0 * 2.0 + 5.0 * 6.0 * 6.0 + 2e-3;
        // The moment about the line itself is that of the masses at 0.1 m.
        for (found, expected) in [
            (carried[0], [8.0, 8.0, 8.0, 8.0 * 0.1 * 0.1, about, about]),
            (carried[1], [5.0, 5.0, 5.0, 5.0 * 0.1 * 0.1, 5.001, 5.001]),
        ] {
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
            }
        }
    }
}
