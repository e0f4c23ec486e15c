//! Wire formats of flexid: the messages between the daemon and its clients, and the numbers in CAN frames.
//!
//! The crate needs neither the standard library nor an allocator, so that a microcontroller can use it.
//!
//! | module         | holds                                                                |
//! | -------------- | -------------------------------------------------------------------- |
//! | [`messages`]   | the messages of both sides, and the version that both must have      |
//! | [`report`]     | the identified parameters; with `serde_json`, the result file        |
//! | [`confidence`] | how far to trust them; in the result file, under `confidence`        |
//! | [`framing`]    | messages on a byte stream, length first, bounded                     |
//! | [`signal`]     | integers and their scaling in CAN payloads, as DBC files define them |
//! | [`text`]       | text of bounded length                                               |
#![no_std]

pub mod confidence;
pub mod framing;
pub mod messages;
pub mod report;
pub mod signal;
pub mod text;
