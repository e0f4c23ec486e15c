//! Wire formats of flexid: the messages between the daemon and its clients, and the numbers in CAN frames.
//!
//! The crate needs neither the standard library nor an allocator, so that a microcontroller can use it.
//!
//! | module                        | holds                                                                |
//! | ----------------------------- | -------------------------------------------------------------------- |
//! | [`messages`]                  | the messages of both sides, and the version that both must have      |
//! | [`finding`]                   | a report, its confidence and its answer                              |
//! | [`answer`]                    | stiffness of the tool, lowest mode, stiffnesses of the drives        |
//! | [`report`], [`warning`]       | the identified parameters, and warnings about them                   |
//! | [`confidence`], [`residuals`], [`directions`] | how far to trust them                                |
//! | [`explanation`], [`accuracy`] | what is off on the robot, by the records                             |
//! | [`left_over`]                 | where a fit leaves more than elsewhere                               |
//! | [`spectra`]                   | the newest record beside the model, along the band                   |
//! | [`state`]                     | what the daemon waits for                                            |
//! | [`axes`], [`implausible`], [`misfits`], [`rate`], [`trouble`], [`unused`] | what warnings and states name       |
//! | [`framing`]                   | messages on a byte stream, length first, bounded                     |
//! | [`bits`]                      | integers and their scaling in CAN payloads, as DBC files define them |
//! | [`text`], [`words`]           | text of bounded length; parts of lines                               |
//!
//! Warnings, states, residuals and weak directions are numbers and names. Each has one [`Display`](core::fmt::Display), a line for
//! people, which the daemon and the tools share.
#![no_std]

pub mod accuracy;
pub mod answer;
pub mod axes;
pub mod bits;
pub mod confidence;
pub mod directions;
pub mod explanation;
pub mod finding;
pub mod framing;
pub mod implausible;
pub mod left_over;
pub mod messages;
pub mod misfits;
mod nuisance;
pub mod rate;
pub mod report;
pub mod residuals;
pub mod spectra;
pub mod state;
pub mod text;
pub mod trouble;
pub mod unused;
mod verdict;
pub mod warning;
pub mod words;
