//! The pose of a command that works in a single one.

use std::path::Path;

use anyhow::Result;
use flexid_pipeline::input::BadInput;
use flexid_prediction::document::Found;

use crate::exit::BadArgument;
use crate::numbers::Numbers;

/// The pose that was given, or that of the first record in the result `file`.
///
/// # Errors
/// There is none, or it has another number of angles than the robot has driven joints.
pub(super) fn given_or_first(
    file: &Path,
    found: &Found,
    given: Option<&Numbers>,
) -> Result<Vec<f64>> {
    let pose = match given {
        Some(Numbers(pose)) => pose.clone(),
        None => found.robot.found().poses.first().cloned().ok_or_else(|| {
            BadInput::new(file, "rests on static tests alone, and names no pose: give --pose")
        })?,
    };
    check(found, &pose)?;
    Ok(pose)
}

/// # Errors
/// The pose has another number of angles than the robot has driven joints.
pub(super) fn check(found: &Found, pose: &[f64]) -> Result<(), BadArgument> {
    let driven = found.robot.model().driven().count();
    if pose.len() == driven {
        return Ok(());
    }
    let given = pose.len();
    Err(BadArgument(format!("--pose has {given} angles: this robot has {driven} driven joints")))
}
