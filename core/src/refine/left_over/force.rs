//! How what is left goes with the force of the cuts.
//!
//! An error of a linear model leaves residuals that go with the force F, their mean square beyond the noise with `F²`. Friction and
//! backlash leave less than that at larger forces, springs that stiffen leave more. Records of the same pose are compared, since another
//! pose has other errors: the exponent p is fitted to
//!
//! ```text
//! ln(mean square − 1) = c_pose + 2 p ln F
//! ```

use heapless::Vec;

use super::cells::Cell;
use crate::MAX_JOINTS;
use crate::search::MAX_EXPERIMENTS;

/// Largest difference of two joint angles of the same pose, rad (m). Chosen: it changes a receptance by about 1 %.
const SAME: f64 = 0.01;
/// Least ratio of two forces that differ.
const UNLIKE: f64 = 1.2;
/// Least standard deviation of the left-hand side. Chosen: cuts with different spindle speeds excite the same error by other frequencies.
const SCATTER: f64 = 0.5;
/// Standard deviations of noise that a record has to leave beyond noise, and by which the exponent has to differ from 1.
const CERTAIN: f64 = 3.0;

/// What is left of one record.
#[derive(Clone, Debug)]
pub(super) struct OfRecord {
    pose: Vec<f64, MAX_JOINTS>,
    /// N.
    rms_force: f64,
    pub(super) left: Cell,
}

impl OfRecord {
    /// Of a record of which nothing has been taken yet.
    pub(super) fn new(pose: &[f64], rms_force: f64) -> Self {
        let pose = pose.iter().copied().take(MAX_JOINTS).collect();
        Self { pose, rms_force, left: Cell::default() }
    }

    fn shares_pose(&self, other: &Self) -> bool {
        self.pose.iter().zip(&other.pose).all(|(one, other)| (one - other).abs() <= SAME)
    }

    /// Logarithms of the square of the force and of the mean square beyond noise, if there is anything.
    fn logarithms(&self) -> Option<[f64; 2]> {
        let beyond = self.left.mean_square() - 1.0;
        let is_more = beyond > CERTAIN * libm::sqrt(2.0 / self.left.count.max(1.0));
        is_more.then(|| [2.0 * libm::log(self.rms_force), libm::log(beyond)])
    }
}

/// The exponent and its standard deviation, if it is not that of a linear model. `None` without records of one pose and unlike forces.
pub(super) fn exponent(records: &[OfRecord]) -> Option<[f64; 2]> {
    let mut groups: Vec<(&OfRecord, Vec<[f64; 2], MAX_EXPERIMENTS>), MAX_EXPERIMENTS> = Vec::new();
    for record in records {
        let Some(logarithms) = record.logarithms() else { continue };
        match groups.iter_mut().find(|(first, _)| first.shares_pose(record)) {
            // There is room for as many as there are records.
            Some((_, group)) => {
                let _ = group.push(logarithms);
            }
            None => {
                let _ = groups.push((record, [logarithms].into_iter().collect()));
            }
        }
    }
    let (mut xx, mut xy, mut yy, mut free) = (0.0, 0.0, 0.0, -1.0);
    for (_, group) in &groups {
        let size = group.len() as f64;
        let mean = |part: usize| group.iter().map(|values| values[part]).sum::<f64>() / size;
        let [x, y] = [mean(0), mean(1)];
        for values in group {
            let [x, y] = [values[0] - x, values[1] - y];
            (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
        }
        free += size - 1.0;
    }
    // Two records whose squared forces differ by this have half its square.
    let least = 2.0 * libm::log(UNLIKE);
    if xx < 0.5 * least * least {
        return None;
    }
    let exponent = xy / xx;
    let scatter = if free > 0.0 { libm::sqrt(((yy - exponent * xy) / free).max(0.0)) } else { 0.0 };
    let deviation = scatter.max(SCATTER) / libm::sqrt(xx);
    ((exponent - 1.0).abs() > CERTAIN * deviation).then_some([exponent, deviation])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A record of five thousand residuals.
    fn record(pose: f64, rms_force: f64, beyond: f64) -> OfRecord {
        let left = Cell { squares: 5000.0 * (1.0 + beyond), count: 5000.0 };
        OfRecord { left, ..OfRecord::new(&[pose, 0.0], rms_force) }
    }

    /// Records of two poses, one of which leaves ten times as much, with forces of one to four.
    fn at_forces(power: f64) -> [OfRecord; 4] {
        let left = |force: f64| 0.5 * force.powf(2.0 * power);
        [(0.0, 1.0), (0.005, 4.0), (1.0, 1.0), (1.0, 3.0)]
            .map(|(pose, force)| record(pose, force, left(force) * (1.0 + 9.0 * pose.floor())))
    }

    #[test]
    fn the_exponent_is_that_of_the_misfit() {
        assert_eq!(exponent(&at_forces(1.0)), None);
        for power in [0.0, 3.0] {
            let [exponent, deviation] = exponent(&at_forces(power)).unwrap();
            assert!((exponent - power).abs() < 1e-9, "{exponent}");
            // Sums of squares of 2 ln 4 and 2 ln 3, halved.
            let expected = 0.5 / (0.5 * (4.0_f64.ln().powi(2) + 3.0_f64.ln().powi(2)) * 4.0).sqrt();
            assert!((deviation - expected).abs() < 1e-9, "{deviation}");
        }
    }

    #[test]
    fn unlike_poses_and_like_forces_say_nothing() {
        assert_eq!(exponent(&[record(0.0, 1.0, 0.5), record(1.0, 4.0, 100.0)]), None);
        assert_eq!(exponent(&[record(0.0, 1.0, 0.5), record(0.0, 1.1, 100.0)]), None);
        // What noise leaves has no exponent.
        assert_eq!(exponent(&[record(0.0, 1.0, 0.01), record(0.0, 4.0, 100.0)]), None);
        assert_eq!(exponent(&[]), None);
    }
}
