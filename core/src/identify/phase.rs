//! Phases of an identifier.

/// Present work of an [`Identifier`](super::Identifier).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Needs a record.
    Waiting,
    /// A descent into the basin, or a random search for it.
    Searching,
    /// Gauss-Newton refinement.
    Refining,
    /// Nothing to do until the next record.
    Settled,
}
