//! Records that were refused.

use flexid_wire::unused::{RecordFault, Unused};

/// Counts of refused records.
#[derive(Debug, Default)]
pub(super) struct Refused {
    /// Those in which the robot hardly feeds evenly.
    uneven: u64,
    /// Number of the others, and the fault of the first.
    others: Option<(u64, RecordFault)>,
}

impl Refused {
    /// Counts a record with this fault.
    pub(super) fn note(&mut self, fault: RecordFault) {
        match fault {
            RecordFault::Uneven => self.uneven += 1,
            fault => self.others.get_or_insert((0, fault)).0 += 1,
        }
    }

    /// Returns what is to be said of them, where so many records were `taken`. A path has a start, turns and an end: uneven records are named where they
    /// are more than these.
    pub(super) fn unused(&self, taken: u64) -> Option<Unused> {
        let uneven = (self.uneven > taken).then_some((self.uneven, RecordFault::Uneven));
        let (records, first) = self.others.clone().or(uneven)?;
        Some(Unused::Refused { records, first })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_of_a_path_are_named_where_they_are_most_of_it() {
        let mut refused = Refused::default();
        (0..3).for_each(|_| refused.note(RecordFault::Uneven));
        assert_eq!(refused.unused(3), None);
        let first = RecordFault::Uneven;
        assert_eq!(refused.unused(2), Some(Unused::Refused { records: 3, first }));
        refused.note(RecordFault::NoForce);
        let first = RecordFault::NoForce;
        assert_eq!(refused.unused(3), Some(Unused::Refused { records: 1, first }));
    }
}
