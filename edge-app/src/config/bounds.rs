//! Where the parameters may lie: section `[bounds]`, of the configuration as of a scenario.

use std::ops::RangeInclusive;

use flexid_core::parameters::Bounds;
use serde::Deserialize;

/// No bushing of a robot is softer or harder, SI units: what is beyond is a slip of the pen, and the numbers
/// that follow from it leave the range of floating point.
pub(super) const CONCEIVABLE: RangeInclusive<f64> = 1e-3..=1e12;
/// Ranges `[lower, upper]` of the parameters, for every joint the same.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoundsSection {
    /// N/m.
    pub stiffness_translation_n_per_m: [f64; 2],
    /// Nm/rad.
    pub stiffness_rotation_nm_per_rad: [f64; 2],
    /// Ns/m.
    pub damping_translation_ns_per_m: [f64; 2],
    /// Nms/rad.
    pub damping_rotation_nms_per_rad: [f64; 2],
}

impl BoundsSection {
    /// The bounds, if a robot can have such parameters.
    ///
    /// # Errors
    /// One line with the section, the key, and what would be right.
    pub fn check(&self) -> Result<Bounds, String> {
        let ranges = [
            ("stiffness_translation_n_per_m", self.stiffness_translation_n_per_m),
            ("stiffness_rotation_nm_per_rad", self.stiffness_rotation_nm_per_rad),
            ("damping_translation_ns_per_m", self.damping_translation_ns_per_m),
            ("damping_rotation_nms_per_rad", self.damping_rotation_nms_per_rad),
        ];
        for (key, [lower, upper]) in ranges {
            let both = CONCEIVABLE.contains(&lower) && CONCEIVABLE.contains(&upper);
            if !(both && lower < upper) {
                let (least, most) = CONCEIVABLE.into_inner();
                return Err(format!(
                    "[bounds] {key} is [{lower:e}, {upper:e}]: must be {least:e} <= lower < upper <= {most:e}"
                ));
            }
        }
        let [kt, kr, dt, dr] = ranges.map(|(_, range)| range);
        Bounds::new(kt, kr, dt, dr).map_err(|error| format!("[bounds]: {error:?}"))
    }
}
