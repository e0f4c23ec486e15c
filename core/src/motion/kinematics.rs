//! Kinematics of a bushing: pose of its link, motion subspace, and rate of the motion subspace.
//!
//! A bushing slides by `tx ty tz` along the axes of the joint frame, then turns by `rx` about x, `ry` about the new y and
//! `rz` about the new z. Along the link axes its rates move the link by `(Bᵀ ṫ, W ṙ)`. This motion subspace is square, and
//! singular only at `ry = ±90°`.

use libm::sincos;
use nalgebra::{Matrix3, Vector3, Vector6};

use crate::chain::{self, Joint};

/// A link and the joint frame that carries it: the quantities that no motion of the bushings changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    /// Axes of the joint frame, in the axes of the link before.
    pub(super) axes: Matrix3<f64>,
    /// Origin of the joint frame, in the link before, m.
    pub(super) origin: Vector3<f64>,
    /// Mass, kg.
    pub(super) mass: f64,
    /// Centre of mass, link axes, m.
    pub(super) centre: Vector3<f64>,
    /// Inertia about the centre of mass, kg m².
    pub(super) central_inertia: Matrix3<f64>,
    /// Inverse of the inertia about the centre of mass, 1/(kg m²).
    pub(super) central_mobility: Matrix3<f64>,
    /// Inertia about the link's origin, kg m².
    pub(super) inertia: Matrix3<f64>,
    /// Motion of the joint frame; `None` where it stands.
    pub(super) drive: Option<Drive>,
}

/// Motion of a joint's frame relative to the link before, along the axes of that link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Drive {
    /// Spin Ω, rad/s.
    pub(super) spin: Vector3<f64>,
    /// Rate of the spin, rad/s².
    pub(super) spin_rate: Vector3<f64>,
    /// Velocity v of the frame's origin, m/s.
    pub(super) velocity: Vector3<f64>,
    /// Acceleration of the frame's origin, m/s².
    pub(super) acceleration: Vector3<f64>,
}

/// A link at the elongation of its bushing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Placed {
    /// B: link axes in joint axes.
    pub(super) turned: Matrix3<f64>,
    /// Link axes in the axes of the link before.
    pub(super) rotation: Matrix3<f64>,
    /// Vector from the origin of the link before to the origin of this link, in the axes of the link before, m.
    pub(super) lever: Vector3<f64>,
    /// W: axes of the three turns as columns, along the link axes.
    pub(super) turns: Matrix3<f64>,
    /// Sine and cosine of `ry`.
    ry: (f64, f64),
    /// Sine and cosine of `rz`.
    rz: (f64, f64),
}

impl Link {
    /// The link of `joint` at joint angle (or stroke) `angle`.
    pub(super) fn new(joint: &Joint, angle: f64) -> Self {
        let frame = joint.frame(angle);
        let chain::Link { mass, centre_of_mass: centre, inertia } = joint.link;
        let lever = centre.cross_matrix();
        Self {
            axes: frame.rotation.to_rotation_matrix().into_inner(),
            origin: frame.translation.vector,
            mass,
            centre,
            central_inertia: inertia,
            // The inertias of a chain are positive. A link whose inertia underflows gets NaN, so that it does not count as
            // rigid.
            central_mobility: inertia.try_inverse().unwrap_or(Matrix3::repeat(f64::NAN)),
            inertia: inertia - lever * lever * mass,
            drive: None,
        }
    }

    /// The link at the `elongation` of its bushing.
    pub(super) fn placed(&self, elongation: &Vector6<f64>) -> Placed {
        let [tx, ty, tz, rx, ry, rz] = (*elongation).into();
        let ((sx, cx), (sy, cy), (sz, cz)) = (sincos(rx), sincos(ry), sincos(rz));
        let turned = Matrix3::new(
            cy * cz,
            -cy * sz,
            sy,
            cx * sz + sx * sy * cz,
            cx * cz - sx * sy * sz,
            -sx * cy,
            sx * sz - cx * sy * cz,
            sx * cz + cx * sy * sz,
            cx * cy,
        );
        Placed {
            turned,
            rotation: self.axes * turned,
            lever: self.origin + self.axes * Vector3::new(tx, ty, tz),
            turns: Matrix3::new(cz * cy, sz, 0.0, -sz * cy, cz, 0.0, sy, 0.0, 1.0),
            ry: (sy, cy),
            rz: (sz, cz),
        }
    }
}

impl Placed {
    /// `Ẇ` for a bushing that turns at `rates`, rad/s.
    pub(super) fn turns_rate(&self, rates: Vector3<f64>) -> Matrix3<f64> {
        let ((sy, cy), (sz, cz)) = (self.ry, self.rz);
        Matrix3::new(
            -sz * cy * rates.z - cz * sy * rates.y,
            cz * rates.z,
            0.0,
            -cz * cy * rates.z + sz * sy * rates.y,
            -sz * rates.z,
            0.0,
            cy * rates.y,
            0.0,
            0.0,
        )
    }

    /// `W⁻¹`; not finite at `ry = ±90°`.
    pub(super) fn turns_inverse(&self) -> Matrix3<f64> {
        let ((sy, cy), (sz, cz)) = (self.ry, self.rz);
        Matrix3::new(cz / cy, -sz / cy, 0.0, sz, cz, 0.0, -sy * cz / cy, sy * sz / cy, 1.0)
    }
}

/// Slides and turns of one joint's six coordinates.
pub(super) fn halves(coordinates: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let [tx, ty, tz, rx, ry, rz] = (*coordinates).into();
    (Vector3::new(tx, ty, tz), Vector3::new(rx, ry, rz))
}

/// Six coordinates from slides and turns.
pub(super) fn joined(slide: Vector3<f64>, turn: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(slide.x, slide.y, slide.z, turn.x, turn.y, turn.z)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Rotation3};
    use proptest::prelude::*;

    use super::*;
    use crate::chain::JointKind;

    fn link() -> Link {
        let link = chain::Link {
            mass: 3.0,
            centre_of_mass: Vector3::new(0.1, -0.2, 0.3),
            inertia: Matrix3::from_diagonal(&Vector3::new(1.0, 1.2, 0.9)),
        };
        let origin = Isometry3::new(Vector3::new(0.3, 0.2, -0.5), Vector3::new(0.4, -1.0, 0.7));
        let joint = Joint { origin, axis: Vector3::y_axis(), kind: JointKind::Revolute, link };
        Link::new(&joint, 0.8)
    }

    /// Product of the elementary rotations about x, the new y and the new z.
    fn turned(turns: Vector3<f64>) -> Matrix3<f64> {
        (Rotation3::from_axis_angle(&Vector3::x_axis(), turns.x)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), turns.y)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), turns.z))
        .into_inner()
    }

    fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
        let one = move || -size..size;
        (one(), one(), one()).prop_map(|(x, y, z)| Vector3::new(x, y, z))
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 256, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn the_motion_subspace_and_its_rate_are_slopes(turns in vector(1.2), rates in vector(3.0)) {
            let at = |time: f64| link().placed(&joined(Vector3::zeros(), turns + time * rates));
            const H: f64 = 1e-5;
            let [before, now, after] = [-H, 0.0, H].map(at);
            prop_assert!((now.turned - turned(turns)).norm() < 1e-14);
            // Spin in link axes: the skew part of Bᵀ Ḃ.
            let skew = turned(turns).transpose()
                * (turned(turns + H * rates) - turned(turns - H * rates)) / (2.0 * H);
            let spin = Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]);
            prop_assert!((now.turns * rates - spin).norm() < 1e-8);
            let slope = (after.turns - before.turns) / (2.0 * H);
            prop_assert!((now.turns_rate(rates) - slope).norm() < 1e-8);
            prop_assert!((now.turns * now.turns_inverse() - Matrix3::identity()).norm() < 1e-12);
        }
    }
}
