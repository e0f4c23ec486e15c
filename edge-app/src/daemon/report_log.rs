//! Log lines about the estimate: one line when the fit settles, and each warning once.

use std::collections::HashSet;

use flexid_wire::report::Report;
use tracing::{info, warn};

use flexid_pipeline::report::Summary;

/// Holds the warnings that are in the log.
#[derive(Debug, Default)]
pub(super) struct ReportLog {
    warned: HashSet<String>,
}

impl ReportLog {
    /// Logs the verdicts of a report on one line, and those of its warnings that are new.
    pub(super) fn log(&mut self, report: &Report) {
        info!("{}", Summary(report).line());
        let warnings: Vec<&str> = report.warnings.iter().map(|warning| warning.as_str()).collect();
        for warning in self.new_warnings(&warnings) {
            warn!("{warning}");
        }
    }

    /// Returns the warnings that the report before did not have. A warning that differs in its numbers only is the same. A
    /// warning that comes back after it was gone is new.
    fn new_warnings<'a>(&mut self, warnings: &[&'a str]) -> Vec<&'a str> {
        let kind = |text: &str| text.replace(|c: char| c.is_ascii_digit() || c == '.', "");
        let warnings = warnings.iter().copied();
        let before = std::mem::take(&mut self.warned);
        self.warned = warnings.clone().map(kind).collect();
        warnings.filter(|warning| !before.contains(&kind(warning))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_written_when_it_comes() {
        let mut log = ReportLog::default();
        let first = ["3 frames of another length", "the robot has changed"];
        assert_eq!(log.new_warnings(&first).len(), 2);
        let counted_on = ["the robot has changed", "17 frames of another length"];
        assert_eq!(log.new_warnings(&counted_on), [""; 0]);
        assert_eq!(log.new_warnings(&["a new one"]), ["a new one"]);
        assert_eq!(log.new_warnings(&first).len(), 2);
    }
}
