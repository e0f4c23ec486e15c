//! Sources of frames: a bus, or a recording of one. A table gives readings in their place.

mod candump;
mod frame;
mod line;
mod link;
mod logs;
mod monotonic;
mod socket;
mod stamps;
pub mod table;

use std::io;
use std::time::Duration;

use embedded_can::Id;
use flexid_wire::trouble::{BusFault, Trouble};

pub use candump::{CandumpLog, LOOK_AHEAD};
pub use frame::{Arrival, Content, Frame, FrameKind, LONGEST_DATA};
pub use line::is_frame;
pub use link::{ErrorCounts, LinkState};
pub use logs::Logs;
pub use socket::{CanSocket, OpenError};
pub use table::{Layout, Shown, TableLog, Topics};

/// Source of frames, in the order in which they were on the bus.
pub trait FrameSource: Send {
    /// Waits for frames, at most `timeout`, and appends them to `batch`: none, one or many.
    ///
    /// A link that goes down is no error. [`health`](Self::health) reports it, and frames come again when the link is up.
    ///
    /// # Errors
    /// The source is broken for good. Frames that were appended before are valid.
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow>;

    /// Returns the condition of the source.
    fn health(&self) -> SourceHealth;

    /// Converts a time on the clock of the source, s, to one since 1970. The clock of a recording mostly counts from then.
    fn since_1970_s(&self, time_s: f64) -> f64 {
        time_s
    }
}

/// End of a source, or more to come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// More frames may come.
    Open,
    /// The recording is over, or the other end is closed.
    Ended,
}

/// Condition of a source.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceHealth {
    /// State of the link.
    pub link: LinkState,
    /// Number of times since the start that the link was lost, for however short a time. 0 for a recording.
    pub link_losses: u64,
    /// Numbers of errors that the bus has reported since the start.
    pub errors: ErrorCounts,
    /// Number of frames since the start that the kernel dropped because they were not fetched in time.
    pub kernel_dropped: u64,
    /// Receive buffer that the kernel granted, bytes. 0 for a recording.
    pub receive_buffer_bytes: u64,
    /// Present fault of the bus.
    pub fault: Option<BusFault>,
    /// Troubles of recordings.
    pub troubles: Vec<Trouble>,
    /// Frames of recordings that were left out, since they came on other buses.
    pub elsewhere: Vec<Elsewhere>,
}

/// Frames of one identifier on another bus than that of the sensors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Elsewhere {
    /// Identifier of the frames.
    pub id: Id,
    /// Name of their bus.
    pub bus: String,
    /// Number of frames.
    pub frames: u64,
}

impl SourceHealth {
    /// Returns the fault of the bus, and the troubles of recordings.
    pub fn troubles(&self) -> Vec<Trouble> {
        let fault = self.fault.iter().cloned().map(Trouble::Bus);
        fault.chain(self.troubles.iter().cloned()).collect()
    }
}
