//! Exported robots: their structure, and what other programs make of them.

#[path = "../../../core/tests/common/mod.rs"]
mod common;
mod mujoco;
mod python;
mod scenario;
mod structure;
