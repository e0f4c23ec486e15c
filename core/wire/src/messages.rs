//! Messages between the daemon and its clients.
//!
//! | step | client            | daemon                                                                |
//! | ---- | ----------------- | --------------------------------------------------------------------- |
//! | 1    | [`ToEdge::Hello`] |                                                                       |
//! | 2    |                   | [`FromEdge::Hello`], or [`FromEdge::Refused`] and the connection ends |
//! | then |                   | `Status`, `Progress`, `Spectra`, `Finding` and `BusHealth`, as they change |
//!
//! Postcard identifies variants and fields by their position alone, so that both sides must have the same messages. Any change of
//! a message, or of a type that it holds, raises [`PROTOCOL_VERSION`]. [`Hello`], [`Refusal`] and their places in the enums never
//! change, so that two programs of any age can exchange the reason why they do not match.

use postcard_schema::Schema;
use postcard_schema::key::Key;
use serde::{Deserialize, Serialize};

use crate::finding::Finding;
use crate::spectra::Spectra;
use crate::state::State;
use crate::text::{Name, Text, clipped};
use crate::trouble::BusFault;

/// Version of the messages. Both sides must have the same version.
pub const PROTOCOL_VERSION: u16 = 15;

/// Hash of the names and types of all messages. It distinguishes programs that were built between two versions.
pub const SCHEMA_KEY: [u8; 8] = Key::for_path::<(ToEdge, FromEdge)>("flexid").to_bytes();

/// Message from a client to the daemon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum ToEdge {
    /// First message of a client.
    Hello(Hello),
}

/// Message from the daemon to a client.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box a finding with")]
pub enum FromEdge {
    /// Answer to a client that is accepted.
    Hello(Hello),
    /// Answer to a client that is rejected; the daemon then closes the connection.
    Refused(Refusal),
    /// Identity and state of the daemon.
    Status(Status),
    /// Progress of the identification.
    Progress(Progress),
    /// Present parameters, and how far they can be trusted.
    Finding(Finding),
    /// State of the bus, and its counters.
    BusHealth(BusHealth),
    /// Measured and modelled spectra of the newest record. It comes before the finding of the same estimate, if that rests on records.
    Spectra(Spectra),
}

/// Identity of the sender, and the version of its messages.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello {
    /// [`PROTOCOL_VERSION`] of the sender.
    pub protocol_version: u16,
    /// [`SCHEMA_KEY`] of the sender.
    pub schema_key: [u8; 8],
    /// Name and version of the sender, for example `flexid-edge 0.1.0`.
    pub software: Name,
}

impl Hello {
    /// Hello of this build; `software` is the name and version of the program.
    pub fn new(software: &str) -> Self {
        Self {
            protocol_version: PROTOCOL_VERSION,
            schema_key: SCHEMA_KEY,
            software: clipped(software),
        }
    }

    /// Answer of a daemon of this build to a client that does not match it; `None` for a client that does.
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

/// Reason why the daemon rejects a client.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Refusal {
    /// Text for the user of the client: the mismatch, and how to remove it.
    pub reason: Text,
}

/// Identity and state of the daemon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// Time since the start of the daemon, s.
    pub uptime_s: f64,
    /// Name of the robot model.
    pub model: Name,
    /// Number of joints of the model, 1 to 7.
    pub joints: u8,
    /// Name of the CAN interface.
    pub interface: Name,
    /// The state of its intake: what it awaits, or what keeps it from records.
    pub state: State,
    /// Part of a full record that has been taken of the present cut, 0 to 1; 0 without a cut.
    pub record_fraction: f32,
    /// Time from the start of the daemon to its newest record, s; `None` before the first.
    pub newest_record_s: Option<f64>,
}

/// Phase of the identification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// The identification waits for a record.
    Waiting,
    /// A descent or a random search looks for the basin.
    Searching,
    /// The Gauss-Newton refinement makes steps.
    Refining,
    /// The identification has nothing to do until the next record.
    Settled,
}

/// Progress of the identification.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Progress {
    /// Present phase.
    pub phase: Phase,
    /// Part of the work on the newest record that is done, 0 to 1. It does not fall before the next record. The number of
    /// starts is not known in advance, so that each start takes half of the rest.
    pub fraction: f32,
    /// Number of searches begun.
    pub starts: u32,
    /// Number of steps of the descents and samples of the random searches.
    pub search_evaluations: u64,
    /// Number of refinement iterations.
    pub refine_iterations: u64,
    /// Loss at the centre of the newest random search (surface similarity parameter, 0 to 2); infinite before its first
    /// evaluation.
    pub search_loss: f32,
    /// Number of records so far.
    pub records: u64,
}

/// State of the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum BusState {
    /// The interface can deliver frames.
    Up,
    /// The link is down.
    Down,
    /// The interface does not exist.
    Gone,
    /// The controller has left the bus after too many errors.
    BusOff,
}

/// Number of error frames of each class since the start of the daemon. One frame may be of several classes.
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
    /// A frame violates the protocol of the bus, most often because of another bit rate or bad wiring.
    pub protocol: u64,
    /// No node acknowledged a frame that was sent.
    pub no_acknowledgement: u64,
    /// The transceiver reports a fault of the wires.
    pub transceiver: u64,
    /// A frame had to wait for another one.
    pub lost_arbitration: u64,
    /// A frame could not be sent in time.
    pub transmit_timeout: u64,
}

/// State of the bus, and counters since the start of the daemon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct BusHealth {
    /// State of the interface.
    pub state: BusState,
    /// Number of force and acceleration frames taken.
    pub frames: u64,
    /// Number of force and acceleration frames that are missing by their counters.
    pub frames_lost: u64,
    /// Number of missing samples that were bridged, force and acceleration each counted.
    pub bridged: u64,
    /// Number of counters that disagreed with the time that passed: a sensor started anew or was silent.
    pub restarts: u64,
    /// Number of frames whose counter had been seen before.
    pub repeated: u64,
    /// Number of frames with an identifier of the table but another length than in the table.
    pub frames_wrong_length: u64,
    /// Number of frames with an identifier that no signal of the table has.
    pub frames_unknown: u64,
    /// Number of remote requests and CAN FD frames with an identifier of the table.
    pub frames_not_data: u64,
    /// Number of force and acceleration frames with a value at the limit of its signal: the sensor is overdriven.
    pub frames_clipped: u64,
    /// Number of frames that the kernel dropped because the receive buffer was full.
    pub kernel_dropped: u64,
    /// Size of the receive buffer that the kernel granted, bytes.
    pub receive_buffer_bytes: u64,
    /// Number of samples discarded because the pose moved, a gap was too long or a stretch too short.
    pub samples_discarded: u64,
    /// Number of rejected readings: their value was not finite, or their counter had no part in the sequence.
    pub refused: u64,
    /// Number of records whose frames came at another rate than the configured one.
    pub wrong_rate: u64,
    /// Rate of the force and acceleration samples in the newest record of a wrong or doubtful rate, Hz; 0 before the first.
    pub measured_rate_hz: f32,
    /// Present rate of frames of all kinds, 1/s.
    pub frames_per_second: f64,
    /// Present fault of the bus.
    pub fault: Option<BusFault>,
    /// Number of errors that the bus has reported, by class.
    pub errors: BusErrors,
    /// Number of records whose frames came at another rate than the configured one but do not determine it.
    pub doubtful_rate: u64,
    /// Standard deviation of `measured_rate_hz`, Hz.
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
    fn a_client_of_another_version_gets_both_versions() {
        let client = Hello { protocol_version: 2, ..Hello::new("flexid 0.2.0") };
        assert_eq!(
            client.refusal().unwrap().reason,
            "client speaks flexid protocol 2, this daemon speaks 15: install matching versions"
        );
    }

    #[test]
    fn a_client_built_between_two_versions_gets_the_whole_reason() {
        let client = Hello { schema_key: [0xAB; 8], ..Hello::new("flexid 0.1.0") };
        let reason = client.refusal().unwrap().reason;
        assert!(reason.starts_with("client has schema abababababababab of flexid protocol 15"));
        assert!(reason.ends_with("install matching versions"), "{reason}");
    }
}
