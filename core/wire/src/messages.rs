//! What the daemon and its clients say to each other.
//!
//! | step | client            | daemon                                                                |
//! | ---- | ----------------- | --------------------------------------------------------------------- |
//! | 1    | [`ToEdge::Hello`] |                                                                       |
//! | 2    |                   | [`FromEdge::Hello`], or [`FromEdge::Refused`] and the connection ends |
//! | then |                   | `Status`, `Progress`, `Report` and `BusHealth`, as they change;       |
//! |      |                   | after each `Report` its `Confidence`, with nothing between them       |
//!
//! The enums are append-only: a new message goes at the end, a published one never changes, since postcard knows
//! variants and fields by their position alone. [`Hello`] and [`Refusal`] stay as they are for ever, so that two programs of
//! any age can tell each other why they do not match. Any change of the others raises [`PROTOCOL_VERSION`].

use heapless::String;
use postcard_schema::Schema;
use postcard_schema::key::Key;
use serde::{Deserialize, Serialize};

use crate::confidence::Confidence;
use crate::report::Report;
use crate::text::clipped;

/// The version of the messages. Both sides must have the same.
pub const PROTOCOL_VERSION: u16 = 4;

/// A hash over names and types of all messages: tells programs apart that were built between two versions.
pub const SCHEMA_KEY: [u8; 8] = Key::for_path::<(ToEdge, FromEdge)>("flexid").to_bytes();

/// A name: at most 32 bytes of UTF-8. [`clipped`] makes one of anything.
pub type Name = String<32>;
/// A line for people: at most 400 bytes of UTF-8 (160 before version 3). [`clipped`] makes one of anything.
pub type Text = String<400>;

/// From a client to the daemon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum ToEdge {
    /// The first message.
    Hello(Hello),
}

/// From the daemon to a client.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box a report with")]
pub enum FromEdge {
    /// The answer to a client that is accepted.
    Hello(Hello),
    /// The answer to a client that is not; the daemon then closes the connection.
    Refused(Refusal),
    /// What the daemon is, and what it waits for.
    Status(Status),
    /// How the work stands.
    Progress(Progress),
    /// The parameters as they stand.
    Report(Report),
    /// What the bus delivers.
    BusHealth(BusHealth),
    /// How far to trust the report that came just before; since version 2.
    Confidence(Confidence),
}

/// Who speaks, and which messages it knows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello {
    /// The sender's [`PROTOCOL_VERSION`].
    pub protocol_version: u16,
    /// The sender's [`SCHEMA_KEY`].
    pub schema_key: [u8; 8],
    /// Name and version of the sender, such as `flexid-edge 0.1.0`.
    pub software: Name,
}

impl Hello {
    /// The Hello of this build.
    pub fn new(software: &str) -> Self {
        Self {
            protocol_version: PROTOCOL_VERSION,
            schema_key: SCHEMA_KEY,
            software: clipped(software),
        }
    }

    /// What a daemon of this build answers to a client that does not match it, `None` to one that does.
    pub fn refusal(&self) -> Option<Refusal> {
        let reason = if self.protocol_version != PROTOCOL_VERSION {
            clipped(format_args!(
                "client speaks flexid protocol {}, this daemon speaks {PROTOCOL_VERSION}: \
                 install matching versions",
                self.protocol_version
            ))
        } else if self.schema_key != SCHEMA_KEY {
            clipped(format_args!(
                "client has schema {:016x} of flexid protocol {PROTOCOL_VERSION}, this daemon {:016x}: \
                 install matching versions",
                u64::from_be_bytes(self.schema_key),
                u64::from_be_bytes(SCHEMA_KEY),
            ))
        } else {
            return None;
        };
        Some(Refusal { reason })
    }
}

/// Why the daemon does not serve a client.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Refusal {
    /// For the person at the client: what does not match, and the mend.
    pub reason: Text,
}

/// What the daemon is, and what it waits for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// Since the daemon's start, s.
    pub uptime_s: f64,
    /// Name of the robot model.
    pub model: Name,
    /// Joints of the model, 1 to 7.
    pub joints: u8,
    /// The CAN interface.
    pub interface: Name,
    /// In words, such as `waiting for joint angles: q2 not seen`.
    pub state: Text,
    /// How much of a full record has been taken of the present cut, 0 to 1; 0 while nothing is cut. Since version 3.
    pub record_fraction: f32,
}

/// What the identification is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Needs a record.
    Waiting,
    /// Random search for the basin.
    Searching,
    /// Gauss-Newton refinement.
    Refining,
    /// Nothing to do until the next record.
    Settled,
}

/// How the work stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Progress {
    /// What is going on.
    pub phase: Phase,
    /// Of the work on the newest record, 0 to 1; never falls before the next record. How many starts there will be is not
    /// known, so each takes half of what is left. Up to version 2, of the present search or refinement.
    pub fraction: f32,
    /// Searches begun.
    pub starts: u32,
    /// Samples that the searches have cost.
    pub search_evaluations: u64,
    /// Refinement iterations done.
    pub refine_iterations: u64,
    /// Smallest loss of the present search (surface similarity parameter, 0 to 2).
    pub search_loss: f32,
    /// Records so far.
    pub records: u64,
}

/// Whether the interface delivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum BusState {
    /// Frames can come.
    Up,
    /// The link is down.
    Down,
    /// The interface does not exist.
    Gone,
    /// The controller has left the bus after too many errors; since version 3.
    BusOff,
}

/// Error frames of the bus by their class, counted since the daemon's start; since version 3. One frame may be of several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct BusErrors {
    /// The controller has left the bus after too many errors.
    pub bus_off: u64,
    /// The controller has come back to the bus.
    pub restarted: u64,
    /// An error counter of the controller is above 127.
    pub controller_passive: u64,
    /// An error counter of the controller is above 96.
    pub controller_warning: u64,
    /// The controller had no room for a frame.
    pub controller_overflow: u64,
    /// Frames that break the rules of the bus: most often of another bit rate, or on bad wiring.
    pub protocol: u64,
    /// Nobody acknowledged a frame that was sent.
    pub no_acknowledgement: u64,
    /// The transceiver reports a fault of the wires.
    pub transceiver: u64,
    /// Frames that had to wait for others.
    pub lost_arbitration: u64,
    /// Frames that could not be sent in time.
    pub transmit_timeout: u64,
}

/// What the bus delivers, counted since the daemon's start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct BusHealth {
    /// Whether the interface delivers.
    pub state: BusState,
    /// Force and acceleration frames taken.
    pub frames: u64,
    /// Force and acceleration frames missing by their counters.
    pub frames_lost: u64,
    /// Missing samples that were bridged, force and acceleration each counted.
    pub bridged: u64,
    /// Counters that disagreed with the time that passed: a sensor started anew or was silent.
    pub restarts: u64,
    /// Frames whose counter had been seen before.
    pub repeated: u64,
    /// Frames of a known identifier but another length than the table says.
    pub frames_wrong_length: u64,
    /// Frames whose identifier no signal of the table has.
    pub frames_unknown: u64,
    /// Remote requests and CAN FD frames of a known identifier.
    pub frames_not_data: u64,
    /// Force and acceleration frames with a value at the limit of its signal: the sensor is overdriven.
    pub frames_clipped: u64,
    /// Frames that the kernel dropped because the receive buffer was full.
    pub kernel_dropped: u64,
    /// The receive buffer that the kernel granted, bytes.
    pub receive_buffer_bytes: u64,
    /// Samples given up because the pose moved, a gap was too long or a stretch too short.
    pub samples_discarded: u64,
    /// Readings refused: their value was not finite, or their counter had no part in the sequence.
    pub refused: u64,
    /// Records whose frames came at another rate than the daemon was told.
    pub wrong_rate: u64,
    /// Rate of the force and acceleration samples in the newest of those, Hz; 0 before the first.
    pub measured_rate_hz: f32,
    /// Frames of all kinds per second, lately.
    pub frames_per_second: f64,
    /// What is wrong with the bus now, in words; empty when nothing is.
    pub error: Text,
    /// Errors that the bus has reported; since version 3.
    pub errors: BusErrors,
    /// Records whose frames came at another rate than the daemon was told, but do not tell which; since version 3.
    pub doubtful_rate: u64,
    /// Standard deviation of `measured_rate_hz`, Hz; since version 3.
    pub measured_rate_std_hz: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_of_this_build_is_accepted() {
        assert_eq!(Hello::new("flexid 0.1.0").refusal(), None);
    }

    #[test]
    fn a_client_of_another_version_is_told_which() {
        let client = Hello { protocol_version: 2, ..Hello::new("flexid 0.2.0") };
        assert_eq!(
            client.refusal().unwrap().reason,
            "client speaks flexid protocol 2, this daemon speaks 4: install matching versions"
        );
    }

    #[test]
    fn a_client_built_between_two_versions_is_told_so_in_full() {
        let client = Hello { schema_key: [0xAB; 8], ..Hello::new("flexid 0.1.0") };
        let reason = client.refusal().unwrap().reason;
        assert!(reason.starts_with("client has schema abababababababab of flexid protocol 4"));
        assert!(reason.ends_with("install matching versions"), "{reason}");
    }
}
