//! Log lines about clients that are not served: each kind at once, and then at most one a minute with a count, so that many clients
//! do not flood the log.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tracing::warn;

/// Shortest interval between two lines of one kind.
const INTERVAL: Duration = Duration::from_secs(60);

/// What happened to a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Event {
    /// Its connection cannot be accepted, or has no thread.
    NotAccepted,
    /// It is refused, since there is no slot.
    Refused,
    /// It does not keep to the protocol.
    Dropped,
    /// No client can come, since the socket's file is gone and cannot be made again.
    NoSocket,
}

/// Counts of what has happened since the last line of each kind.
#[derive(Debug, Default)]
pub(super) struct Tally(Mutex<BTreeMap<Event, Entry>>);

#[derive(Debug)]
struct Entry {
    logged: Instant,
    /// Number of events since then, and the text of the newest.
    more: u64,
    text: String,
}

impl Tally {
    /// Notes an event that `text` describes, and logs it if there was no line of its kind for a minute.
    pub(super) fn note(&self, event: Event, text: String) {
        self.line(event, text, Instant::now()).into_iter().for_each(|line| warn!("{line}"));
    }

    /// Logs the counts that are a minute old.
    pub(super) fn log_counts(&self) {
        self.counts(Instant::now()).into_iter().for_each(|line| warn!("{line}"));
    }

    fn line(&self, event: Event, text: String, now: Instant) -> Option<String> {
        let mut entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(entry) = entries.get_mut(&event) {
            entry.more += 1;
            entry.text = text;
            return None;
        }
        entries.insert(event, Entry { logged: now, more: 0, text: String::new() });
        Some(text)
    }

    fn counts(&self, now: Instant) -> Vec<String> {
        let mut lines = Vec::new();
        let mut entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        entries.retain(|_, Entry { logged, more, text }| {
            if now.saturating_duration_since(*logged) < INTERVAL {
                return true;
            }
            let times = std::mem::take(more);
            if times > 0 {
                lines.push(format!("{text} ({times} times more in the last minute)"));
                *logged = now;
            }
            times > 0
        });
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_has_one_line_a_minute_with_a_count() {
        let (tally, begun) = (Tally::default(), Instant::now());
        let mut lines = Vec::new();
        // Ten refusals a second for 90 s, and one other event.
        for tenth in 0..1800 {
            let now = begun + tenth * Duration::from_millis(100);
            if tenth < 900 {
                lines.extend(tally.line(Event::Refused, format!("full {tenth}"), now));
            }
            if tenth == 5 {
                lines.extend(tally.line(Event::Dropped, "garbage".into(), now));
            }
            lines.extend(tally.counts(now));
        }
        let expected = [
            "full 0",
            "garbage",
            "full 600 (600 times more in the last minute)",
            "full 899 (299 times more in the last minute)",
        ];
        assert_eq!(lines, expected);
    }
}
