//! Log lines that may come often: each kind at once, and then at most one a minute with a count, so that they do not flood the log.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use flexid_pipeline::text::count;
use tracing::{info, warn};

/// Shortest interval between two lines of one kind.
const INTERVAL: Duration = Duration::from_secs(60);

/// A line for the log. A warning needs somebody to act.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    Info(String),
    Warning(String),
}

impl Line {
    pub(crate) fn log(&self) {
        match self {
            Self::Info(text) => info!("{text}"),
            Self::Warning(text) => warn!("{text}"),
        }
    }

    #[cfg(test)]
    pub(crate) fn text(&self) -> &str {
        let (Self::Info(text) | Self::Warning(text)) = self;
        text
    }

    /// Returns the line with the number of others that it stands for.
    fn counted(self, more: u64) -> Self {
        let counted =
            |text| format!("{text} ({} more since the last such line)", count(more, "time"));
        match self {
            Self::Info(text) => Self::Info(counted(text)),
            Self::Warning(text) => Self::Warning(counted(text)),
        }
    }
}

/// Counts of lines that have come since the last of each kind in the log.
#[derive(Debug)]
pub(crate) struct Tally<K>(BTreeMap<K, Entry>);

#[derive(Debug)]
struct Entry {
    logged: Instant,
    /// Number of lines since then, and the newest of them.
    more: u64,
    newest: Line,
}

impl<K> Default for Tally<K> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<K: Ord> Tally<K> {
    /// Notes a line. Returns it if there was none of its kind for a minute.
    pub(crate) fn line(&mut self, kind: K, line: Line, now: Instant) -> Option<Line> {
        if let Some(entry) = self.0.get_mut(&kind) {
            (entry.more, entry.newest) = (entry.more + 1, line);
            return None;
        }
        self.0.insert(kind, Entry { logged: now, more: 0, newest: line.clone() });
        Some(line)
    }

    /// Returns the newest line of each kind that has come since the last one in the log, a minute ago or earlier, with their number.
    pub(crate) fn counts(&mut self, now: Instant) -> Vec<Line> {
        let mut lines = Vec::new();
        self.0.retain(|_, Entry { logged, more, newest }| {
            if now.saturating_duration_since(*logged) < INTERVAL {
                return true;
            }
            let times = std::mem::take(more);
            if times > 0 {
                lines.push(newest.clone().counted(times));
                *logged = now;
            }
            times > 0
        });
        lines
    }
}

/// Returns the kind of a text: its words without the numbers. Texts of one kind differ in their counts only.
pub(crate) fn kind(text: &str) -> String {
    let is_number = |word: &&str| {
        word.contains(|c: char| c.is_ascii_digit())
            && !word.contains(|c: char| c.is_alphabetic() || c == '_')
    };
    text.split_whitespace().filter(|word| !is_number(word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_has_one_line_a_minute_with_a_count() {
        let (mut tally, begun) = (Tally::default(), Instant::now());
        let mut lines = Vec::new();
        // Ten refusals a second for 90 s, and one other event.
        for tenth in 0..1800 {
            let now = begun + tenth * Duration::from_millis(100);
            if tenth < 900 {
                lines.extend(tally.line("refused", Line::Warning(format!("full {tenth}")), now));
            }
            if tenth == 5 {
                lines.extend(tally.line("dropped", Line::Info("garbage".into()), now));
            }
            lines.extend(tally.counts(now));
        }
        let expected = [
            Line::Warning("full 0".into()),
            Line::Info("garbage".into()),
            Line::Warning("full 600 (600 times more since the last such line)".into()),
            Line::Warning("full 899 (299 times more since the last such line)".into()),
        ];
        assert_eq!(lines, expected);
    }
}
