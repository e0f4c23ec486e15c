//! What `watch --json` says before the first report: lines `{"status": …}` and `{"progress": …}`.

use std::time::Instant;

use anyhow::Result;
use flexid_wire::messages::{Progress, Status};
use serde_json::json;

use crate::readout::{REDRAW, View};

/// What has been said. From the first report on there are reports alone, so that the last line is one.
pub(crate) struct News {
    status: Option<Status>,
    progress: Option<Progress>,
    /// When something was said last; nothing is while a report may come at once, and none after one.
    said: Option<Instant>,
}

impl News {
    pub(crate) fn new() -> Self {
        Self { status: None, progress: None, said: Some(Instant::now()) }
    }

    /// A report has come.
    pub(crate) fn end(&mut self) {
        self.said = None;
    }

    /// A line for each of the two that has changed since it was last told, at most every [`REDRAW`].
    pub(crate) fn lines(&mut self, view: &View) -> Result<String> {
        let mut lines = String::new();
        if self.said.is_none_or(|said| said.elapsed() < REDRAW) {
            return Ok(lines);
        }
        // That it is up for longer is no news.
        let status = view.status.clone().map(|status| Status { uptime_s: 0.0, ..status });
        if status != self.status {
            lines += &serde_json::to_string(&json!({ "status": view.status }))?;
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
