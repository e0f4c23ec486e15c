//! What an identifier is doing.

/// What an [`Identifier`](super::Identifier) is doing.
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
