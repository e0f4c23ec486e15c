//! The packed lower triangle of a symmetric matrix: its rows one after the other, each up to its diagonal.

/// Number of entries of a triangle of `n` rows, which is also the index at which row `n` begins.
pub(crate) const fn packed(n: usize) -> usize {
    n * (n + 1) / 2
}
