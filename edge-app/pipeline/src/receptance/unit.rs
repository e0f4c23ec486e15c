//! Units of a motion per force.

use crate::units::{ACCELERATION, DISPLACEMENT, FORCE, VELOCITY};

/// Motion of a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Displacement: the responses are receptances.
    Displacement,
    /// Velocity: mobilities.
    Velocity,
    /// Acceleration: accelerances.
    Acceleration,
}

/// Unit of a motion per force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// The motion.
    pub motion: Motion,
    /// Size in SI units.
    pub size: f64,
}

impl Unit {
    /// Examples for messages.
    pub(crate) const EXAMPLES: &'static str = "m/s^2/N, g/N, m/s/N, mm/s/N, m/N, µm/N, g/lbf";

    /// Parses `m/s^2/N`, `(m/s²)/N`, `g/lbf`, `µm/N`. `None` for a unit of something else.
    pub fn parse(text: &str) -> Option<Self> {
        if matches!(text.trim(), "1/kg" | "kg^-1") {
            return Some(Self { motion: Motion::Acceleration, size: 1.0 });
        }
        let (motion, force) = text.trim().rsplit_once('/')?;
        let force = FORCE.size(force.trim_matches(['(', ')', ' ']))?;
        let motion = Self::of_motion(motion)?;
        Some(Self { size: motion.size / force, ..motion })
    }

    /// Parses the unit of a motion: `m/s^2`, `g`, `mm`.
    pub(super) fn of_motion(text: &str) -> Option<Self> {
        let text = text.trim().trim_matches(['(', ')']);
        let quantities = [
            (Motion::Acceleration, &ACCELERATION),
            (Motion::Velocity, &VELOCITY),
            (Motion::Displacement, &DISPLACEMENT),
        ];
        let of = |(motion, quantity): (Motion, &crate::units::Quantity)| {
            Some(Self { motion, size: quantity.size(text)? })
        };
        quantities.into_iter().find_map(of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_per_force_have_a_size() {
        for (text, motion, size) in [
            ("m/s^2/N", Motion::Acceleration, 1.0),
            ("(m/s²)/N", Motion::Acceleration, 1.0),
            ("1/kg", Motion::Acceleration, 1.0),
            ("g/N", Motion::Acceleration, 9.80665),
            ("mm/s/kN", Motion::Velocity, 1e-6),
            ("µm/N", Motion::Displacement, 1e-6),
            ("m/lbf", Motion::Displacement, 1.0 / 4.448_221_615_260_5),
        ] {
            let own = Unit::parse(text).unwrap_or_else(|| panic!("{text}"));
            assert_eq!(own.motion, motion, "{text}");
            assert!((own.size / size - 1.0).abs() < 1e-12, "{text}: {}", own.size);
        }
        for text in ["", "N", "m", "N/m", "m/s^2", "Pa/N", "m/s"] {
            assert_eq!(Unit::parse(text), None, "{text}");
        }
    }
}
