//! Choice of the records that are kept: the newest of each pose and setup, for as many of these as there is room for.

use crate::record::{MAX_PER_POSE, same_pose};

/// Properties of a record that the choice depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry<'a> {
    /// Pose, rad (m).
    pub(super) pose: &'a [f64],
    /// Point at which the force acts, from the TCP, TCP axes, m.
    pub(super) point: [f64; 3],
    /// True for each axis of force and acceleration that is measured.
    pub(super) measured: [bool; 6],
    /// Spacing of the bins, rad/s. A shorter record has a wider spacing.
    pub(super) spacing: f64,
}

/// Place for a new record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Room {
    /// The record has room beside the others.
    Free,
    /// The record replaces the one at this index.
    Instead(usize),
    /// The record has no room, since the kept ones are better.
    Nowhere,
}

impl Entry<'_> {
    /// Returns whether the records are of one pose and one setup.
    fn shares_pose(&self, other: &Self) -> bool {
        let setup = |own: &Self| (own.point, own.measured);
        same_pose(self.pose, other.pose) && setup(self) == setup(other)
    }
}

/// Finds room for `new` beside `kept`, which are in the order in which they came, and at most so many.
///
/// A full pose gives up its shortest record, and of equal ones the oldest. If the new record is shorter still, it is left out:
/// it is the rest of a stretch that ended when the robot moved on. If all places are taken, the pose with the most records
/// gives up its oldest, but not for the rest of a stretch.
pub(super) fn find_room(kept: &[Entry], new: &Entry, most: usize) -> Room {
    let at_pose = || (0..kept.len()).filter(|&index| kept[index].shares_pose(new));
    // Logarithm of the new record's duration over that of a kept one, in powers of two. It does not depend on the sampling
    // rates.
    let halvings = |index: usize| (kept[index].spacing / new.spacing).log2().round();
    if at_pose().count() >= MAX_PER_POSE {
        // Of equal ones `min_by` takes the first.
        let shortest = at_pose().min_by(|&a, &b| halvings(b).total_cmp(&halvings(a)));
        return match shortest {
            Some(index) if halvings(index) >= 0.0 => Room::Instead(index),
            _ => Room::Nowhere,
        };
    }
    if kept.len() < most {
        return Room::Free;
    }
    if at_pose().any(|index| halvings(index) < 0.0) {
        return Room::Nowhere;
    }
    let alone = |entry: &Entry| kept.len() - kept.iter().filter(|k| k.shares_pose(entry)).count();
    let oldest = (0..kept.len()).min_by_key(|&index| alone(&kept[index]));
    oldest.map_or(Room::Free, Room::Instead)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::MAX_EXPERIMENTS;

    const FULL: f64 = 1.0;
    const SHORT: f64 = 2.0;

    /// Takes in records of (pose, spacing), as the solver does. Returns the numbers of the records that are kept.
    fn keep(records: &[(f64, f64)]) -> Vec<usize> {
        let all = |(pose, spacing): &(f64, f64)| (*pose, *spacing, [true; 6]);
        keep_measured(&records.iter().map(all).collect::<Vec<_>>())
    }

    /// The same of (pose, spacing, axes that are measured).
    fn keep_measured(records: &[(f64, f64, [bool; 6])]) -> Vec<usize> {
        let poses: Vec<[f64; 1]> = records.iter().map(|(pose, ..)| [*pose]).collect();
        let entry = |index: usize| Entry {
            pose: &poses[index],
            point: [0.0; 3],
            measured: records[index].2,
            spacing: records[index].1,
        };
        let mut kept: Vec<usize> = Vec::new();
        for new in 0..records.len() {
            let entries: Vec<Entry> = kept.iter().map(|&index| entry(index)).collect();
            match find_room(&entries, &entry(new), MAX_EXPERIMENTS) {
                Room::Free => kept.push(new),
                Room::Instead(index) => {
                    kept.remove(index);
                    kept.push(new);
                }
                Room::Nowhere => {}
            }
        }
        kept
    }

    #[test]
    fn the_newest_of_a_pose_are_kept_beside_each_other() {
        assert_eq!(keep(&[(0.0, FULL); 3]), [0, 1, 2]);
        assert_eq!(keep(&[(0.0, FULL); 7]), [2, 3, 4, 5, 6]);
        assert_eq!(keep(&[(0.0, FULL), (0.0, SHORT), (0.0009, FULL)]), [0, 1, 2]);
    }

    /// Three blows along each of two axes in one pose.
    #[test]
    fn blows_along_another_axis_take_no_room() {
        let along = |axis: usize| (0.0, FULL, std::array::from_fn(|own| own == axis || own > 2));
        let records: Vec<_> = [0, 0, 0, 1, 1, 1].map(along).to_vec();
        assert_eq!(keep_measured(&records), [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn a_short_record_makes_room_first_and_takes_none_from_full_ones() {
        let mut records = vec![(0.0, FULL); MAX_PER_POSE];
        records.push((0.0, SHORT));
        assert_eq!(keep(&records), [0, 1, 2, 3, 4]);
        records[1].1 = SHORT;
        records[MAX_PER_POSE].1 = FULL;
        assert_eq!(keep(&records), [0, 2, 3, 4, 5]);
    }

    #[test]
    fn a_new_pose_takes_the_oldest_of_the_pose_that_has_most() {
        // 13 poses, the sixth three times, the last twice.
        let mut records: Vec<_> = (0..13).map(|pose| (f64::from(pose), FULL)).collect();
        records.extend([(5.0, FULL), (12.0, FULL), (5.0, FULL)]);
        assert_eq!(keep(&records).len(), MAX_EXPERIMENTS);
        records.push((13.0, FULL));
        let kept = keep(&records);
        assert!(!kept.contains(&5) && kept.contains(&16), "{kept:?}");
        // Now the sixth pose and the thirteenth have two each: the older record goes.
        records.push((14.0, FULL));
        let kept = keep(&records);
        assert!(!kept.contains(&12) && kept.contains(&13) && kept.contains(&17), "{kept:?}");
    }

    #[test]
    fn with_one_record_each_the_oldest_pose_goes() {
        let records: Vec<_> = (0..17).map(|pose| (f64::from(pose), FULL)).collect();
        assert_eq!(keep(&records), (1..17).collect::<Vec<_>>());
        let mut records = records[..16].to_vec();
        records.push((3.0, SHORT));
        assert_eq!(keep(&records), (0..16).collect::<Vec<_>>());
    }
}
