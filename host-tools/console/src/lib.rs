//! Shared by every program on the host: its exit status, its result files, its progress.
#![forbid(unsafe_code)]

pub mod exit;
pub mod output;
pub mod progress;
