//! Geometry and masses that differ from the model, and further bushings.

use flexid_pipeline::model::Model;
use serde::Deserialize;

use super::range::{all_between, between};

/// Errors of the whole tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tool {
    /// Rotation vector from the model's TCP axes to those of tool and sensors, rad. Typical: 2.4e-3 (0.14°), the flange of a tool changer.
    pub angle_rad: [f64; 3],
    /// True place of the TCP less that of the model, TCP axes, m; the sensors keep their places. Typical: 1e-3, a four-point calibration of
    /// the TCP; 5e-3, another cutter's length.
    pub tcp_m: [f64; 3],
}

/// Errors of the model. Lists hold one entry per joint (those of angles one per driven joint), base first; an empty list holds none.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Robot {
    /// True over modelled mass and inertia of each link. Typical: 1 ± 0.05 (assumed: CAD without cables, grease and paint).
    pub mass: Vec<f64>,
    /// True over modelled inertia of each link, beside [`Robot::mass`]. Typical: 1 ± 0.1.
    pub inertia: Vec<f64>,
    /// Errors of the spread of each link's mass, one after the other: logarithms of its second moments along x, y, z of the link, then shears xy, xz,
    /// yz. Typical: 0 ± 0.07.
    pub spread: Vec<[f64; 6]>,
    /// True less modelled centre of mass, link axes, m. Typical: 0.01.
    pub centre_of_mass_m: Vec<[f64; 3]>,
    /// True less reported joint angle, rad (m). Typical: 3.5e-3 (0.2°; encoder offsets of robots that are not calibrated: Nubiola and Bonev,
    /// Robotics and Computer-Integrated Manufacturing 29, 2013).
    pub joint_angle_rad: Vec<f64>,
    /// Delay of the joint angles: each is that of so many seconds before. Typical: 4e-3, a cycle of the controller.
    pub joint_delay_s: f64,
    /// Elastic centre of each bushing less the joint's origin, link axes, m. Typical: 0.01 to 0.05, a bearing beside its gear.
    pub elastic_centre_m: Vec<[f64; 3]>,
    /// Rates of the joints in a cut, rad/s (m/s): the feed. Typical of a creeping drive: 1e-5 to
    /// 1e-4; from 1.2e-4 a record of 4.1 s ends early, since the pose is no longer static.
    pub feed_rad_per_s: Vec<f64>,
}

/// A bushing between the ground and the base, beside what the model may have there.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pedestal {
    /// Mass of base and pedestal, kg. Typical: 500.
    pub mass_kg: f64,
    /// Stiffnesses, N/m and Nm/rad, `tx ty tz rx ry rz` of the base. Typical: 1e9 and 5e8, a steel pedestal of 0.5 m; 1e8 and 1e7, a
    /// wooden or raised floor.
    pub stiffness: [f64; 6],
    /// Dampings, Ns/m and Nms/rad.
    pub damping: [f64; 6],
}

/// A link that bends at one place.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bending {
    /// Joint that carries the link, from 1.
    pub joint: usize,
    /// Place of the bushing on the way to the next joint (or the TCP), and the part of the link's mass that is before it, 0 to 1.
    pub at: f64,
    /// Stiffnesses, N/m and Nm/rad, link axes. Typical: ten times those of the joint (assumed).
    pub stiffness: [f64; 6],
    /// Dampings, Ns/m and Nms/rad.
    pub damping: [f64; 6],
}

/// A hose or cable from the ground to the TCP.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hose {
    /// Stiffness along each axis of the TCP, N/m. Typical: 2e3, a dress pack that takes 20 N at 10 mm.
    pub stiffness_n_per_m: f64,
    /// Damping, Ns/m. Typical: 50.
    pub damping_ns_per_m: f64,
}

impl Tool {
    pub(super) fn check(&self) -> Result<(), String> {
        all_between("[tool] angle_rad", &self.angle_rad, [-3.2, 3.2])?;
        all_between("[tool] tcp_m", &self.tcp_m, [-10.0, 10.0])
    }
}

impl Robot {
    pub(super) fn check(&self, model: &Model) -> Result<(), String> {
        let (joints, driven) = (model.joints.len(), model.driven().count());
        let flat = |vectors: &[[f64; 3]]| vectors.as_flattened().to_vec();
        for (key, count, values, limits) in [
            ("joint_delay_s", 0, vec![self.joint_delay_s], [0.0, 1.0]),
            ("mass", self.mass.len(), self.mass.clone(), [0.01, 100.0]),
            ("inertia", self.inertia.len(), self.inertia.clone(), [0.01, 100.0]),
            ("spread", self.spread.len(), self.spread.as_flattened().to_vec(), [-5.0, 5.0]),
            (
                "centre_of_mass_m",
                self.centre_of_mass_m.len(),
                flat(&self.centre_of_mass_m),
                [-5.0, 5.0],
            ),
            (
                "joint_angle_rad",
                self.joint_angle_rad.len(),
                self.joint_angle_rad.clone(),
                [-3.2, 3.2],
            ),
            (
                "elastic_centre_m",
                self.elastic_centre_m.len(),
                flat(&self.elastic_centre_m),
                [-5.0, 5.0],
            ),
            ("feed_rad_per_s", self.feed_rad_per_s.len(), self.feed_rad_per_s.clone(), [-1.0, 1.0]),
        ] {
            let (wanted, which) = match key {
                "joint_angle_rad" | "feed_rad_per_s" => (driven, "driven joint"),
                _ => (joints, "joint"),
            };
            if count != 0 && count != wanted {
                return Err(format!(
                    "[robot] {key} has {count}, but the model has {wanted} {which}s: one per {which}"
                ));
            }
            all_between(&format!("[robot] {key}"), &values, limits)?;
        }
        Ok(())
    }
}

impl Pedestal {
    pub(super) fn check(&self) -> Result<(), String> {
        between("[pedestal] mass_kg", self.mass_kg, [1e-3, 1e7])?;
        all_between("[pedestal] stiffness", &self.stiffness, [1.0, 1e15])?;
        all_between("[pedestal] damping", &self.damping, [0.0, 1e12])
    }
}

impl Hose {
    pub(super) fn check(&self) -> Result<(), String> {
        between("[hose] stiffness_n_per_m", self.stiffness_n_per_m, [0.0, 1e9])?;
        between("[hose] damping_ns_per_m", self.damping_ns_per_m, [0.0, 1e9])
    }
}

impl Bending {
    pub(super) fn check(&self, model: &Model) -> Result<(), String> {
        let joints = model.joints.len();
        between("[bending] joint", self.joint as f64, [1.0, joints as f64])?;
        between("[bending] at", self.at, [0.05, 0.95])?;
        all_between("[bending] stiffness", &self.stiffness, [1.0, 1e15])?;
        all_between("[bending] damping", &self.damping, [0.0, 1e12])
    }
}
