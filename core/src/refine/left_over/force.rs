//! Growth of the residuals with the force of the cuts.
//!
//! An error of a linear model leaves residuals that go with the force F, their mean square beyond the noise with `F²`. Friction and
//! backlash leave less than that at larger forces, springs that stiffen leave more. Records of the same pose are compared, since another
//! pose has other errors: the exponent p is fitted to
//!
//! ```text
//! ln(mean square − 1) = c_pose + 2 p ln F
//! ```
//!
//! A plant has a stiffness of its own in each record. Joints that are not linear let it go with the force, too: its growth g is fitted to
//!
//! ```text
//! ln(stiffness of the record) = c_pose + g log₂ F
//! ```

use heapless::Vec;

use super::cells::Cell;
use crate::MAX_JOINTS;
use crate::imperfection::{FoundImperfection, Imperfection};
use crate::refine::record::share_pose;

/// Least ratio of two forces that differ. Chosen: two closer forces give the exponent a standard deviation above 2: [`SCATTER`] over
/// `√2 ln 1.2`.
const UNLIKE: f64 = 1.2;
/// Least standard deviation of the left-hand side. Chosen: cuts with different spindle speeds excite the same error by other frequencies.
const SCATTER: f64 = 0.5;
/// Standard deviations of noise by which a record must exceed noise, and the exponent differ from 1. A normal value exceeds three with a chance
/// of 0.13 % on either side.
const CERTAIN: f64 = 3.0;

/// Residuals of one record.
#[derive(Clone, Debug)]
pub(super) struct OfRecord {
    pose: Vec<f64, MAX_JOINTS>,
    /// N; no number where it is not known.
    rms_force: f64,
    pub(super) left: Cell,
}

impl OfRecord {
    /// A record whose residuals are not taken yet.
    pub(super) fn new(pose: &[f64], rms_force: f64) -> Self {
        let pose = pose.iter().copied().take(MAX_JOINTS).collect();
        Self { pose, rms_force, left: Cell::default() }
    }

    fn shares_pose(&self, other: &Self) -> bool {
        share_pose(&self.pose, &other.pose)
    }

    /// Logarithms of the square of the force and of the mean square beyond noise, if there is anything.
    fn logarithms(&self) -> Option<[f64; 2]> {
        let beyond = self.left.mean_square() - 1.0;
        let is_more = beyond > CERTAIN * libm::sqrt(2.0 / self.left.count.max(1.0))
            && !self.rms_force.is_nan();
        is_more.then(|| [2.0 * libm::log(self.rms_force), libm::log(beyond)])
    }
}

/// A straight line through points `[x, y, weight]`, one at most for each record, with an ordinate of its own for each pose.
struct Line {
    slope: f64,
    /// Σ w (x − x̄)², with the mean of the pose.
    squares: f64,
    /// Σ w (y − ȳ − slope (x − x̄))².
    scatter: f64,
    /// Number of points less that of their poses.
    free: f64,
}

impl Line {
    fn through(records: &[OfRecord], point: impl Fn(usize) -> Option<[f64; 3]>) -> Self {
        let (mut xx, mut xy, mut yy, mut free) = (0.0, 0.0, 0.0, 0.0);
        let first = |own: &OfRecord| records.iter().position(|other| other.shares_pose(own));
        for pose in 0..records.len() {
            let members = || {
                (0..records.len())
                    .filter(|&it| first(&records[it]) == Some(pose))
                    .filter_map(&point)
            };
            let weight: f64 = members().map(|[.., w]| w).sum();
            let mean = |part: usize| members().map(|it| it[2] * it[part]).sum::<f64>() / weight;
            let means = [mean(0), mean(1)];
            for [x, y, w] in members() {
                let [x, y] = [x - means[0], y - means[1]];
                (xx, xy, yy) = (xx + w * x * x, xy + w * x * y, yy + w * y * y);
                free += 1.0;
            }
            free -= if weight > 0.0 { 1.0 } else { 0.0 };
        }
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        Self { slope, squares: xx, scatter: (yy - slope * xy).max(0.0), free }
    }
}

/// Returns the exponent and its standard deviation, if it is not that of a linear model. `None` without records of one pose and unlike forces.
pub(super) fn exponent(records: &[OfRecord]) -> Option<[f64; 2]> {
    let line =
        Line::through(records, |record| records[record].logarithms().map(|[x, y]| [x, y, 1.0]));
    // Two records whose squared forces differ by this have half its square.
    let least = 2.0 * libm::log(UNLIKE);
    if line.squares < 0.5 * least * least {
        return None;
    }
    let free = line.free - 1.0;
    let scatter = if free > 0.0 { libm::sqrt(line.scatter / free) } else { 0.0 };
    let deviation = scatter.max(SCATTER) / libm::sqrt(line.squares);
    ((line.slope - 1.0).abs() > CERTAIN * deviation).then_some([line.slope, deviation])
}

/// Returns the growth of all stiffnesses where the force doubles, and its standard deviation, if the stiffnesses that a fit to the plant has
/// found in the records go with their forces. `None` without records of one pose and unlike forces.
pub(super) fn stiffening(records: &[OfRecord], found: &[FoundImperfection]) -> Option<[f64; 2]> {
    let of_record = |record: usize| {
        let own = Imperfection::RecordStiffness(record);
        let own = found.iter().find(|it| it.imperfection == own)?;
        let weight = 1.0 / (own.deviation * own.deviation);
        let force = libm::log2(records[record].rms_force);
        (weight.is_finite() && force.is_finite()).then_some([force, own.value, weight])
    };
    let line = Line::through(records, of_record);
    if line.squares <= 0.0 {
        return None;
    }
    // Where the points scatter by more than their deviations, so does the slope.
    let scatter = libm::sqrt((line.scatter / (line.free - 1.0).max(1.0)).max(1.0));
    let deviation = scatter / libm::sqrt(line.squares);
    (line.slope.abs() > CERTAIN * deviation).then_some([line.slope, deviation])
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
    fn the_growth_is_that_of_the_stiffnesses() {
        let records = at_forces(1.0);
        let found = |growth: f64, deviation: f64| {
            let one = |record: usize| {
                let OfRecord { pose, rms_force, .. } = &records[record];
                FoundImperfection {
                    imperfection: Imperfection::RecordStiffness(record),
                    prior: 1e-3,
                    // Stiffnesses differ between the poses, too.
                    value: growth * rms_force.log2() + 0.1 * pose[0].floor(),
                    deviation,
                }
            };
            [3, 1, 2, 0].map(one)
        };
        let [growth, deviation] = stiffening(&records, &found(0.02, 1e-3)).unwrap();
        assert!((growth - 0.02).abs() < 1e-12, "{growth}");
        let expected = 1e-3 / (0.5 * (4.0 + 3.0_f64.log2().powi(2))).sqrt();
        assert!((deviation - expected).abs() < 1e-12, "{deviation}");
        assert_eq!(stiffening(&records, &found(0.02, 2e-2)), None);
        assert_eq!(stiffening(&records, &found(0.02, 1e-3)[..1]), None);
        assert_eq!(stiffening(&records, &[]), None);
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
