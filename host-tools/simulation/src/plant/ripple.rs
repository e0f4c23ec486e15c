//! Ripple of a gear: an error of its ratio that repeats with the turns of its motor.
//!
//! The drive turns its motor as prescribed, by the angle `n q` at the reported joint angle q. What is mounted on the gear turns by q + e, and
//!
//! ```text
//! e(q) = A sin(k n q + φ)      ė = e′ q̇      ë = e″ q̇² + e′ q̈
//! ```
//!
//! shakes the robot behind its bushing at `k n q̇/2π`. A motor's ripple of torque is one, too: the position loop turns it into an error of the
//! motor's angle of the same order.

use flexid_pipeline::model::Model;
use serde::Deserialize;

use super::range::between;

/// One order of one gear.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ripple {
    /// Driven joint whose gear it is, from 1.
    pub joint: usize,
    /// n: turn of the motor over that of the joint (rad over m of a linear axis). Typical: 50 to 160, strain-wave gears; 80 to 250, RV gears.
    pub ratio: f64,
    /// k: periods a turn of the motor. Typical: 2 and 4, strain-wave gears, whose wave generator has two lobes (Tuttle and Seering, IEEE Transactions
    /// on Robotics and Automation 12, 1996).
    pub order: f64,
    /// A, rad (m) of the joint. Typical: 1e-4 (20 arcsec): data sheets of strain-wave gears above a ratio of 50 allow 1.5e-4 to 2.9e-4 (0.5 to
    /// 1 arcmin) from the least to the largest error.
    pub amplitude_rad: f64,
    /// φ, rad.
    #[serde(default)]
    pub phase_rad: f64,
}

impl Ripple {
    /// e where a joint is, with its rate and acceleration, from the `[q, q̇, q̈]` that is reported: rad, rad/s and rad/s² (m).
    pub fn at(&self, [q, rate, acceleration]: [f64; 3]) -> [f64; 3] {
        let per_angle = self.order * self.ratio;
        let (sin, cos) = (per_angle * q + self.phase_rad).sin_cos();
        let slope = self.amplitude_rad * per_angle * cos;
        let bend = -self.amplitude_rad * per_angle * per_angle * sin;
        [self.amplitude_rad * sin, slope * rate, bend * rate * rate + slope * acceleration]
    }

    pub(super) fn check(&self, model: &Model) -> Result<(), String> {
        let driven = model.driven().count() as f64;
        between("[[ripple]] joint", self.joint as f64, [1.0, driven])?;
        between("[[ripple]] ratio", self.ratio, [0.1, 1e5])?;
        between("[[ripple]] order", self.order, [1e-3, 1e3])?;
        between("[[ripple]] amplitude_rad", self.amplitude_rad, [0.0, 0.01])?;
        between("[[ripple]] phase_rad", self.phase_rad, [-1e3, 1e3])
    }
}
