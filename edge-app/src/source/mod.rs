//! Where frames come from: a bus, or a recording of one.

mod frame;
mod link;
mod log;
mod monotonic;
mod padding;
mod socket;

use std::io;
use std::time::Duration;

pub use frame::{Arrival, Frame, FrameKind};
pub use link::ErrorCounts;
pub use log::{CandumpLog, Logs};
pub use socket::{CanSocket, OpenError};

/// Brings frames in the order in which they were on the bus.
pub trait FrameSource: Send {
    /// Waits until frames come, at most `timeout`, and appends them to `batch`: none, one or many.
    ///
    /// A link that goes down is no error: it shows in [`health`](Self::health) and frames come again
    /// when it is up.
    ///
    /// # Errors
    /// The source is broken for good. Frames appended before stay good.
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow>;

    /// How the source does.
    fn health(&self) -> SourceHealth;
}

/// Whether more may come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Read again.
    Open,
    /// The recording is over, or the other end is closed.
    Ended,
}

/// Whether a bus can deliver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkState {
    /// Frames can come.
    #[default]
    Up,
    /// The link is down.
    Down,
    /// The controller has left the bus after too many errors.
    BusOff,
    /// The interface does not exist any more.
    Gone,
}

/// How a source does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceHealth {
    /// Whether frames can come.
    pub link: LinkState,
    /// Times since the start that frames could come and then could not, however short; 0 for a recording.
    pub link_losses: u64,
    /// Errors that the bus has reported since the start.
    pub errors: ErrorCounts,
    /// Frames that the kernel dropped since the start because nobody fetched them in time.
    pub kernel_dropped: u64,
    /// Receive buffer that the kernel granted, bytes; 0 for a recording.
    pub receive_buffer_bytes: u64,
    /// What is wrong now with a bus, or was with a recording, in one line for people; empty when nothing is.
    pub trouble: String,
}
