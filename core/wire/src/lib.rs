//! What flexid says on the wire: the messages between the daemon and its clients, and the numbers in CAN frames.
//!
//! Plain numbers, without the standard library and without an allocator, so that a microcontroller can speak it.
//!
//! | module         | holds                                                                |
//! | -------------- | -------------------------------------------------------------------- |
//! | [`messages`]   | who says what, and the version that both sides must share            |
//! | [`report`]     | the identified parameters; with `serde_json`, the result file        |
//! | [`confidence`] | how far to trust them; in the result file, under `confidence`        |
//! | [`framing`]    | messages on a byte stream, length first, bounded                     |
//! | [`signal`]     | integers and their scaling in CAN payloads, as DBC files define them |
//! | [`text`]       | text that always fits                                                |
#![no_std]

pub mod confidence;
pub mod framing;
pub mod messages;
pub mod report;
pub mod signal;
pub mod text;
