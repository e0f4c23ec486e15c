//! Exported robots: their structure, and what other programs make of them.

#[path = "../../../core/tests/common/mod.rs"]
mod common;
mod mujoco;
#[path = "../../tests/common/python.rs"]
mod packages;
mod python;
mod scenario;
mod structure;

/// Folder of files that the tests write.
pub(crate) const FOLDER: &str = env!("CARGO_TARGET_TMPDIR");
