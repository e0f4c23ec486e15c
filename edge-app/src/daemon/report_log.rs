//! Log lines about the estimate: one line when the fit settles, and each warning when it comes.

use std::collections::HashSet;
use std::time::Instant;

use flexid_pipeline::report::Summary;
use flexid_wire::report::Report;
use tracing::info;

use crate::tally::{Line, Tally, kind};

/// Holds the warnings of the newest report, and the tally of those that are in the log.
#[derive(Debug, Default)]
pub(super) struct ReportLog {
    warned: HashSet<String>,
    tally: Tally<String>,
}

impl ReportLog {
    /// Logs the verdicts of a report on one line, and those of its warnings that are new.
    pub(super) fn log(&mut self, report: &Report) {
        info!("{}", Summary(report).line());
        let warnings = report.warnings.iter().map(ToString::to_string);
        self.new_warnings(warnings, Instant::now()).iter().for_each(Line::log);
        self.log_counts();
    }

    /// Logs the counts that are a minute old.
    pub(super) fn log_counts(&mut self) {
        self.tally.counts(Instant::now()).iter().for_each(Line::log);
    }

    /// Returns the warnings that the report before did not have, as the tally allows. A warning that differs in its numbers only is the
    /// same. A warning that comes back after it was gone is new.
    fn new_warnings(&mut self, warnings: impl Iterator<Item = String>, now: Instant) -> Vec<Line> {
        let before = std::mem::take(&mut self.warned);
        let mut lines = Vec::new();
        for warning in warnings {
            let kind = kind(&warning);
            if !before.contains(&kind) {
                lines.extend(self.tally.line(kind.clone(), Line::Warning(warning), now));
            }
            self.warned.insert(kind);
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_warning_is_written_when_it_comes() {
        let (mut log, begun) = (ReportLog::default(), Instant::now());
        let mut new_warnings = |minutes: u64, warnings: &[&str]| {
            let now = begun + Duration::from_secs(60 * minutes);
            log.tally.counts(now);
            log.new_warnings(warnings.iter().map(ToString::to_string), now)
        };
        let first = ["3 frames of another length", "the robot has changed"];
        assert_eq!(new_warnings(0, &first).len(), 2);
        let counted_on = ["the robot has changed", "17 frames of another length"];
        assert_eq!(new_warnings(0, &counted_on), []);
        assert_eq!(new_warnings(0, &["a new one"]), [Line::Warning("a new one".into())]);
        // Those that come and go are counted.
        assert_eq!(new_warnings(0, &first), []);
        assert_eq!(new_warnings(1, &[]), []);
        assert_eq!(new_warnings(2, &first).len(), 2);
    }
}
