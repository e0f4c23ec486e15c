//! Log lines about the estimate: one line when the fit settles, and each warning once.

use std::collections::HashSet;

use flexid_wire::report::Report;
use tracing::{info, warn};

use super::state_log::kind;

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
        for warning in self.new_warnings(report.warnings.iter().map(ToString::to_string)) {
            warn!("{warning}");
        }
    }

    /// Returns the warnings that the report before did not have. A warning that differs in its numbers only is the same. A
    /// warning that comes back after it was gone is new.
    fn new_warnings(&mut self, warnings: impl Iterator<Item = String>) -> Vec<String> {
        let before = std::mem::take(&mut self.warned);
        warnings
            .filter(|warning| {
                let kind = kind(warning);
                let is_new = !before.contains(&kind);
                self.warned.insert(kind);
                is_new
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_written_when_it_comes() {
        let mut log = ReportLog::default();
        let mut new_warnings =
            |warnings: &[&str]| log.new_warnings(warnings.iter().map(ToString::to_string));
        let first = ["3 frames of another length", "the robot has changed"];
        assert_eq!(new_warnings(&first).len(), 2);
        let counted_on = ["the robot has changed", "17 frames of another length"];
        assert_eq!(new_warnings(&counted_on), [""; 0]);
        assert_eq!(new_warnings(&["a new one"]), ["a new one"]);
        assert_eq!(new_warnings(&first).len(), 2);
    }
}
