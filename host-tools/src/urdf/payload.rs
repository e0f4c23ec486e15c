//! The body of what a flange carries beside the file: spindle, clamp, sensor and tool.

use nalgebra::{Matrix3, Translation3, Vector3};

use super::body::Body;
use super::spread;

/// Density of spindle, clamp, sensor and tool together, kg/m³. Chosen: half of steel.
pub(super) const PAYLOAD_DENSITY: f64 = 4000.0;

/// The form of what a flange carries.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Payload {
    /// A cylinder from the last joint to the tip.
    Cylinder,
    /// A ball halfway to a tip that is nearer than a cylinder would be wide.
    Ball,
}

impl Payload {
    pub(super) fn named(self) -> &'static str {
        match self {
            Self::Cylinder => "cylinder up to the TCP",
            Self::Ball => "ball between flange and TCP",
        }
    }
}

/// Body that a flange carries up to its tip.
pub(super) fn payload(mass: f64, tip: Vector3<f64>) -> (Body, Payload) {
    use std::f64::consts::PI;
    let volume = mass / PAYLOAD_DENSITY;
    let length = tip.norm();
    let radius = (volume / (PI * length)).sqrt();
    let (inertia, form) = if radius < length {
        (spread::cylinder(mass, tip, radius), Payload::Cylinder)
    } else {
        let radius = (0.75 * volume / PI).cbrt();
        (Matrix3::identity() * (0.4 * mass * radius * radius), Payload::Ball)
    };
    (Body::new(mass, &Translation3::from(0.5 * tip).into(), &inertia), form)
}
