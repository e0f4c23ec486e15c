//! Orders of the reader to the solver, and the records that the solver does not use.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use flexid_pipeline::config::Config;
use flexid_pipeline::{Counts, Record};
use flexid_wire::unused::Unused;

/// Records that are not used, if there is no estimate although there are records.
pub(super) type UnusedRecords = Mutex<Option<Unused>>;

/// Order of the reader to the solver.
pub(super) enum Order {
    /// A record, with the counts of what had come in when it was cut.
    Record(Box<Record>, Counts),
    /// A config that holds from here on, with the counts of what had come in. `anew` is true if the stream begins anew.
    Reload { config: Arc<Config>, counts: Counts, anew: bool },
}

/// Locks the unused records. Their value is whole between any two statements, so that a panic leaves it valid.
pub(super) fn lock(unused: &UnusedRecords) -> MutexGuard<'_, Option<Unused>> {
    unused.lock().unwrap_or_else(PoisonError::into_inner)
}
