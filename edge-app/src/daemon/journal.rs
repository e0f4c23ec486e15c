//! What the daemon writes into its log about its numbers: one line when the fit settles, and each warning once.

use std::collections::HashSet;

use flexid_wire::report::Report;
use tracing::{info, warn};

use crate::summary::Summary;

/// Remembers which warnings stand in the log.
#[derive(Debug, Default)]
pub(super) struct Journal {
    warned: HashSet<String>,
}

impl Journal {
    /// Writes the verdicts of a report on one line, and those of its warnings that are new.
    pub(super) fn settled(&mut self, report: &Report) {
        info!("{}", Summary(report).line());
        for warning in self.new_warnings(report) {
            warn!("{warning}");
        }
    }

    /// Warnings that the report before did not have. One that differs in its numbers alone is the same; one that comes
    /// back after it was gone is new.
    fn new_warnings<'a>(&mut self, report: &'a Report) -> Vec<&'a str> {
        let kind = |text: &str| text.replace(|c: char| c.is_ascii_digit() || c == '.', "");
        let warnings = report.warnings.iter().map(|warning| warning.as_str());
        let before = std::mem::take(&mut self.warned);
        self.warned = warnings.clone().map(kind).collect();
        warnings.filter(|warning| !before.contains(&kind(warning))).collect()
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::text::clipped;

    use super::*;
    use crate::summary::tests::report;

    #[test]
    fn a_warning_is_written_when_it_comes() {
        let mut journal = Journal::default();
        let with = |texts: &[&str]| {
            let warnings = texts.iter().map(clipped).collect();
            Report { warnings, ..report() }
        };
        let first = with(&["3 frames of another length", "the robot has changed"]);
        assert_eq!(journal.new_warnings(&first).len(), 2);
        let counted_on = with(&["the robot has changed", "17 frames of another length"]);
        assert_eq!(journal.new_warnings(&counted_on), [""; 0]);
        assert_eq!(journal.new_warnings(&with(&["a new one"])), ["a new one"]);
        assert_eq!(journal.new_warnings(&first).len(), 2);
    }
}
