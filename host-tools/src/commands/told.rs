//! How a command ends that tells of what lies beyond chance: `history`, `fleet`.

use anyhow::Result;
use flexid_console::exit::{BadArgument, Told as Failed};
use flexid_edge::console::{PrintError, print};
use flexid_prediction::document::SCHEMA;
use serde::Serialize;

use crate::window;

#[derive(Serialize)]
struct Json<'a, T> {
    schema: u32,
    #[serde(flatten)]
    told: &'a T,
}

/// Refuses a level that is no chance of a false alarm.
pub(super) fn check_level(level: f64) -> Result<(), BadArgument> {
    match level > 0.0 && level <= 0.5 {
        true => Ok(()),
        false => Err(BadArgument(format!("--level is {level}: must be above 0 and at most 0.5"))),
    }
}

/// Prints JSON or the text, and fails if there is something to tell, also where a reader has closed the pipe.
pub(super) fn tell<T: Serialize>(
    told: &T,
    text: impl FnOnce(&T) -> String,
    json: bool,
    fails: bool,
) -> Result<()> {
    let text = match json {
        true => serde_json::to_string_pretty(&Json { schema: SCHEMA, told })? + "\n",
        false => window::fit(&text(told)),
    };
    match print(&text) {
        Ok(()) | Err(PrintError::Closed) if fails => Err(Failed.into()),
        printed => Ok(printed?),
    }
}
