//! The board on which the daemon puts its latest messages, and from which every client reads at its own pace.
//!
//! The board has one place for each kind of message. A slow client misses the values in between and gets the latest. No thread
//! waits for a client.

use std::mem::discriminant;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use flexid_wire::messages::FromEdge;

/// The latest message of every kind.
#[derive(Debug, Default)]
pub struct Board {
    latest: Mutex<Latest>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Latest {
    /// One message of each kind, oldest first, numbered from 1.
    messages: Vec<(u64, Arc<FromEdge>)>,
    count: u64,
    closed: bool,
}

impl Board {
    /// Makes an empty board.
    pub fn new() -> Self {
        Self::default()
    }

    /// Puts up a message in place of the one of its kind.
    pub fn publish(&self, message: FromEdge) {
        self.publish_together([message]);
    }

    /// Puts up messages that belong together. A client that gets one of them gets the others right after it.
    pub fn publish_together<const N: usize>(&self, messages: [FromEdge; N]) {
        let mut latest = self.lock();
        for message in messages.map(Arc::new) {
            latest.messages.retain(|(_, old)| discriminant(&**old) != discriminant(&*message));
            latest.count += 1;
            let number = latest.count;
            latest.messages.push((number, message));
        }
        self.changed.notify_all();
    }

    /// Removes the report and its confidence, since they belong to another robot or another measurement.
    pub fn withdraw_finding(&self) {
        let finding =
            |message: &FromEdge| matches!(message, FromEdge::Report(_) | FromEdge::Confidence(_));
        self.lock().messages.retain(|(_, message)| !finding(message));
    }

    /// Closes the board. No message will follow.
    pub fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// Waits, at most `timeout`, for messages that were put up since `seen` (0 at first). Returns them, oldest first, and moves
    /// `seen` on. Returns `None` when the board is closed and all messages are seen.
    pub fn news(&self, seen: &mut u64, timeout: Duration) -> Option<Vec<Arc<FromEdge>>> {
        let (latest, _) = self
            .changed
            .wait_timeout_while(self.lock(), timeout, |latest| {
                latest.count == *seen && !latest.closed
            })
            .unwrap_or_else(PoisonError::into_inner);
        if latest.count == *seen && latest.closed {
            return None;
        }
        let news = latest.messages.iter().filter(|(number, _)| number > seen);
        let news = news.map(|(_, message)| Arc::clone(message)).collect();
        *seen = latest.count;
        Some(news)
    }

    fn lock(&self) -> MutexGuard<'_, Latest> {
        // The messages are whole even after a panic.
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::messages::{Phase, Progress, Refusal};
    use flexid_wire::text::clipped;

    use super::*;

    fn progress(records: u64) -> FromEdge {
        FromEdge::Progress(Progress {
            phase: Phase::Searching,
            fraction: 0.0,
            starts: 0,
            search_evaluations: 0,
            refine_iterations: 0,
            search_loss: 1.0,
            records,
        })
    }

    #[test]
    fn the_latest_of_each_kind_is_kept() {
        let board = Board::new();
        let other = FromEdge::Refused(Refusal { reason: clipped("full") });
        let mut seen = 0;
        assert_eq!(board.news(&mut seen, Duration::ZERO), Some(vec![]));
        for message in [progress(1), other.clone(), progress(2), progress(3)] {
            board.publish(message);
        }
        let news = board.news(&mut seen, Duration::ZERO).unwrap();
        assert_eq!(news, [Arc::new(other), Arc::new(progress(3))]);
        assert_eq!(board.news(&mut seen, Duration::ZERO), Some(vec![]));
        board.publish(progress(4));
        board.close();
        assert_eq!(board.news(&mut seen, Duration::ZERO), Some(vec![Arc::new(progress(4))]));
        assert_eq!(board.news(&mut seen, Duration::from_secs(60)), None);
    }

    /// A client that looks at any moment gets the two messages of one pair, in their order.
    #[test]
    fn what_belongs_together_comes_together() {
        let board = Board::new();
        let other = |records| {
            let reason = clipped(format_args!("{records}"));
            FromEdge::Refused(Refusal { reason })
        };
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for records in 0..2000 {
                    board.publish_together([progress(records), other(records)]);
                }
                board.close();
            });
            let mut seen = 0;
            let mut pairs = 0;
            while let Some(news) = board.news(&mut seen, Duration::from_secs(60)) {
                let FromEdge::Progress(first) = *news[0] else { panic!("{news:?}") };
                assert_eq!((news.len(), &*news[1]), (2, &other(first.records)));
                pairs += 1;
            }
            assert!(pairs > 0);
        });
    }
}
