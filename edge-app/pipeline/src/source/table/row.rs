//! Rows of a recording with one clock: what each kind of file gives.

use std::io;

use flexid_core::MAX_JOINTS;

/// An instant of force, acceleration and joint angles. Numbers that are missing are NaN.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// Number of its line in a text, or of the row, from 1.
    pub(super) line: u64,
    /// True if another cut begins with it, whatever its time.
    pub(super) begins: bool,
    /// Time, s. `None` if the file has none.
    pub(super) time_s: Option<f64>,
    /// Force x, y, z, N, and acceleration x, y, z, m/s². 0 along an axis that is not measured.
    pub(super) axes: [f32; 6],
    /// Angles or strokes, rad (m), base first.
    pub(super) joints: heapless::Vec<f64, MAX_JOINTS>,
}

/// The rows of a file.
pub(super) trait RowSource: Send {
    /// Returns the next row, or `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read, or its content is wrong. The error is one line with the file and the place.
    fn next(&mut self) -> io::Result<Option<Row>>;

    /// Makes the error of a row, by the number of its line.
    fn error(&self, line: u64, message: &str) -> io::Error;

    /// Returns whether the rows have times.
    fn has_times(&self) -> bool;

    /// Returns whether force and acceleration have clocks of their own, and a row holds one of them.
    fn has_own_clocks(&self) -> bool {
        false
    }

    /// Returns the sampling period that the file states, s; that of the slower sensor if each has a clock of its own.
    fn period_s(&self) -> Option<f64>;

    /// Returns whether an error is the early end of a file, before which all rows are good.
    fn is_early_end(&self) -> bool {
        false
    }
}
