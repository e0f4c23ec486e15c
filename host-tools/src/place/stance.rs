//! The places of tool and joints in a pose.

use std::f64::consts::FRAC_1_SQRT_2;

use flexid_core::chain::{Chain, JointKind};
use nalgebra::{Isometry3, Unit, Vector3};

/// Places of a pose, m.
pub(super) struct Stance {
    /// Tool, along the axes of the base.
    pub(super) tool: Vector3<f64>,
    /// Height of the tool.
    pub(super) height: f64,
    /// Height of the lowest of tool and joints.
    pub(super) lowest: f64,
    /// Height of the shoulder: the first joint that turns about an axis more level than upright, and so lifts the arm. The first without one.
    pub(super) shoulder: f64,
    /// Length of the arm, from joint to joint and to the tool.
    pub(super) arm: f64,
}

impl Stance {
    /// The places of `pose`, heights along `up`.
    pub(super) fn of(chain: &Chain, up: &Unit<Vector3<f64>>, pose: &[f64]) -> Self {
        let mut tip = Isometry3::identity();
        let (mut places, mut shoulder) = (Vec::new(), None);
        let height = |place: &Vector3<f64>| place.dot(up);
        for (joint, angle) in chain.joints().iter().zip(chain.angles(pose)) {
            tip *= joint.frame(angle);
            let place = tip.translation.vector;
            let axis = tip.rotation * joint.axis.into_inner();
            if joint.kind == JointKind::Revolute && axis.dot(up).abs() < FRAC_1_SQRT_2 {
                shoulder = shoulder.or(Some(height(&place)));
            }
            places.push(place);
        }
        let tool = (tip * chain.tcp()).translation.vector;
        places.push(tool);
        Self {
            tool,
            height: height(&tool),
            lowest: places.iter().map(height).fold(f64::INFINITY, f64::min),
            shoulder: shoulder.unwrap_or_else(|| height(&places[0])),
            arm: places.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum(),
        }
    }
}

/// Place of the tool along the axes of the base, m.
pub(crate) fn tool(chain: &Chain, pose: &[f64]) -> Vector3<f64> {
    Stance::of(chain, &Vector3::z_axis(), pose).tool
}
