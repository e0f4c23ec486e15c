//! Two sampling rates in one table.

/// Part by which two sampling periods differ if they are two. The stream follows smaller differences (`DRIFT` in
/// `core/src/stream/align.rs`).
pub(super) const DIFFERS: f64 = 0.1;

/// Says that a table has two rates, Hz.
pub(super) fn two_rates(one_hz: f64, other_hz: f64) -> String {
    format!(
        "comes at {other_hz:.1} Hz, and what is before at {one_hz:.1} Hz: export each rate into a table of its own"
    )
}
