//! The output of `watch --json` before the first report: lines `{"status": …}` and `{"progress": …}`.

use std::time::Instant;

use anyhow::Result;
use flexid_wire::messages::{Progress, Status};
use serde_json::json;

use crate::json::StatusJson;
use crate::show::view::{REDRAW, View};

/// The messages printed so far. From the first report on only reports are printed, so that the last line is a report.
pub(crate) struct News {
    status: Option<Status>,
    progress: Option<Progress>,
    /// Time of the last output. It begins as the time of the start, since a report may come at once. It is `None` after
    /// a report.
    said: Option<Instant>,
}

impl News {
    pub(crate) fn new() -> Self {
        Self { status: None, progress: None, said: Some(Instant::now()) }
    }

    /// Ends the output, since a report has come.
    pub(crate) fn end(&mut self) {
        self.said = None;
    }

    /// A line for each of status and progress that has changed since its last line, at most every [`REDRAW`].
    pub(crate) fn lines(&mut self, view: &View) -> Result<String> {
        let mut lines = String::new();
        if self.said.is_none_or(|said| said.elapsed() < REDRAW) {
            return Ok(lines);
        }
        // A longer uptime is not a change.
        let status = view.status.clone().map(|status| Status { uptime_s: 0.0, ..status });
        if status != self.status {
            lines += &serde_json::to_string(
                &json!({ "status": view.status.as_ref().map(StatusJson::from) }),
            )?;
            lines.push('\n');
            self.status = status;
        }
        if view.progress != self.progress {
            lines += &serde_json::to_string(&json!({ "progress": view.progress }))?;
            lines.push('\n');
            self.progress = view.progress;
        }
        if !lines.is_empty() {
            self.said = Some(Instant::now());
        }
        Ok(lines)
    }
}
