//! The part of the tool that is in the work along a path.

/// Part of the full force over the distance along the path: straight lines between points, constant beyond the first and the last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Engagement {
    /// Distances, m, and parts from 0 to 1. Without points the tool is wholly in the work.
    points: Vec<[f64; 2]>,
}

impl Engagement {
    /// The engagement with these points, mm and parts, along a path of `length` m. The error tells what is wrong with which point.
    pub(super) fn new(points: &[[f64; 2]], length: f64) -> Result<Self, String> {
        let most = 1e3 * length;
        for (index, [mm, part]) in points.iter().enumerate() {
            let place = format!("point {} of {}", index + 1, points.len());
            // The points are rounded.
            if !(0.0..=most + 0.5).contains(mm) {
                return Err(format!("{place}: {mm} mm is off the path, 0 to {most:.0} mm"));
            }
            if !(0.0..=1.0).contains(part) {
                return Err(format!("{place}: the part {part} must lie between 0 and 1"));
            }
        }
        if let Some(at) = points.windows(2).position(|pair| pair[0][0] >= pair[1][0]) {
            let (place, last) = (at + 2, points[at][0]);
            return Err(format!("point {place} of {}: must lie beyond {last} mm", points.len()));
        }
        Ok(Self { points: points.iter().map(|[mm, part]| [1e-3 * mm, *part]).collect() })
    }

    /// The part after `distance` m of the path.
    pub fn at(&self, distance: f64) -> f64 {
        let next = self.points.partition_point(|[at, _]| *at <= distance);
        match (next.checked_sub(1).map(|last| self.points[last]), self.points.get(next)) {
            (Some([from, a]), Some([to, b])) => a + (b - a) * (distance - from) / (to - from),
            (Some([_, part]), None) | (None, Some(&[_, part])) => part,
            (None, None) => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_is_linear_between_points_and_constant_beyond() {
        let points = [[20.0, 0.2], [40.0, 1.0], [40.5, 0.0]];
        let engagement = Engagement::new(&points, 0.1).unwrap();
        for (mm, part) in
            [(0.0, 0.2), (20.0, 0.2), (25.0, 0.4), (40.0, 1.0), (40.25, 0.5), (99.0, 0.0)]
        {
            let found = engagement.at(1e-3 * mm);
            assert!((found - part).abs() < 1e-9, "{mm} mm: {found}");
        }
        assert_eq!(Engagement::default().at(0.3), 1.0);
    }
}
