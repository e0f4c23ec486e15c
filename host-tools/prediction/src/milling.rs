//! A milling cutter in its cut: the force per displacement of the tool, averaged over a turn.
//!
//! ```text
//! h = x sin φ + y cos φ        F_x = −F_t cos φ − F_r sin φ        F_t = K_t b h
//!                              F_y = +F_t sin φ − F_r cos φ        F_r = K_r F_t
//!
//! α_xx = ½ [ cos 2φ − 2 K_r φ + K_r sin 2φ]        α_xy = ½ [−sin 2φ − 2φ + K_r cos 2φ]
//! α_yx = ½ [−sin 2φ + 2φ + K_r cos 2φ]             α_yy = ½ [−cos 2φ − 2 K_r φ − K_r sin 2φ]     from φ_st to φ_ex
//! ```
//!
//! φ is the angle of a tooth from the normal y towards the feed x, b is the depth of cut along the axis, h is the thickness of the chip, and N/4π α is the
//! mean over a turn of all N teeth (Altintas and Budak, "Analytical prediction of stability lobes in milling", CIRP Annals 44, 1995).

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3x2, Vector3};

/// Least sine of the angle between the feed and the axis of the cutter. Chosen: below, the feed is a plunge.
const ACROSS: f64 = 0.1;

/// A cutter with evenly spaced teeth, and the arc in which they cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutter {
    /// Number of teeth.
    pub teeth: u32,
    /// Tangential force per area of the chip K_t, N/m².
    pub tangential: f64,
    /// Radial over tangential force K_r.
    pub radial_ratio: f64,
    /// Angles of entry and exit φ_st and φ_ex, rad, from 0 to π.
    pub engagement: [f64; 2],
}

/// How the teeth meet the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Milling {
    /// Chips begin thin.
    Up,
    /// Chips end thin.
    Down,
}

impl Milling {
    /// Angles of entry and exit, rad, where the cut is `immersion` times the diameter wide, above 0 and up to 1.
    pub fn engagement(self, immersion: f64) -> [f64; 2] {
        let arc = (1.0 - 2.0 * immersion).acos();
        match self {
            Self::Up => [0.0, arc],
            Self::Down => [PI - arc, PI],
        }
    }
}

impl Cutter {
    /// α.
    pub fn directional(&self) -> Matrix2<f64> {
        let ratio = self.radial_ratio;
        let at = |angle: f64| {
            let (sin, cos) = (2.0 * angle).sin_cos();
            Matrix2::new(
                cos - 2.0 * ratio * angle + ratio * sin,
                -sin - 2.0 * angle + ratio * cos,
                -sin + 2.0 * angle + ratio * cos,
                -cos - 2.0 * ratio * angle - ratio * sin,
            )
        };
        let [entry, exit] = self.engagement;
        (at(exit) - at(entry)) / 2.0
    }
}

/// Directions of the feed and of its normal, along the axes of the tool centre point, as columns. `axis` points from the spindle to the
/// tip. Seen along it, the cutter turns clockwise. `None` where the feed is along the axis, or one of them has no direction.
pub fn plane(feed: [f64; 3], axis: [f64; 3]) -> Option<Matrix3x2<f64>> {
    let axis = Vector3::from(axis).try_normalize(0.0)?;
    let feed = Vector3::from(feed).try_normalize(0.0)?;
    let across = (feed - axis * feed.dot(&axis)).try_normalize(ACROSS)?;
    Some(Matrix3x2::from_columns(&[across, across.cross(&axis)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of the teeth's forces, tooth by tooth, against α.
    #[test]
    fn directional_coefficients_are_the_mean_over_a_turn() {
        let engagement = Milling::Down.engagement(0.3);
        let cutter = Cutter { teeth: 3, tangential: 1.0, radial_ratio: 0.4, engagement };
        let mut mean = Matrix2::zeros();
        let steps = 200_000;
        for step in 0..steps {
            let angle = 2.0 * PI * (step as f64 + 0.5) / f64::from(steps);
            if (engagement[0]..engagement[1]).contains(&angle) {
                let (sin, cos) = angle.sin_cos();
                let force = nalgebra::Vector2::new(-cos - 0.4 * sin, sin - 0.4 * cos);
                mean += force * nalgebra::RowVector2::new(sin, cos) / f64::from(steps);
            }
        }
        // Of one tooth: α / 4π, since the products of sines have a half before them.
        let expected = cutter.directional() / (4.0 * PI);
        assert!((mean - expected).amax() < 1e-5, "{mean} {expected}");
    }

    #[test]
    fn a_slot_is_either_way_of_milling_and_the_plane_is_right_handed() {
        for way in [Milling::Up, Milling::Down] {
            let [entry, exit] = way.engagement(1.0);
            assert!(entry.abs() < 1e-12 && (exit - PI).abs() < 1e-12);
        }
        let [x, y] = [0, 1]
            .map(|own| plane([2.0, 0.0, 0.1], [0.0, 0.0, 1.0]).unwrap().column(own).into_owned());
        assert_eq!((x, y), (Vector3::x(), -Vector3::y()));
        assert!(plane([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]).is_none());
        assert!(plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).is_none());
    }
}
