//! The latest message of each kind, which the daemon publishes and every client reads at its own pace.
//!
//! A message replaces the one of its kind. A slow client misses the messages in between and gets the latest. No thread waits
//! for a client.

use std::mem::discriminant;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use flexid_wire::messages::FromEdge;

/// The latest message of every kind.
#[derive(Debug, Default)]
pub struct Latest {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// One message of each kind, oldest first, numbered from 1.
    messages: Vec<(u64, Arc<FromEdge>)>,
    count: u64,
    closed: bool,
}

impl Latest {
    /// Makes one without messages.
    pub fn new() -> Self {
        Self::default()
    }

    /// Publishes a message in place of the one of its kind.
    pub fn publish(&self, message: FromEdge) {
        let message = Arc::new(message);
        let mut latest = self.lock();
        latest.messages.retain(|(_, old)| discriminant(&**old) != discriminant(&*message));
        latest.count += 1;
        let number = latest.count;
        latest.messages.push((number, message));
        self.changed.notify_all();
    }

    /// Removes the finding and its spectra, since they belong to another robot or another measurement.
    pub fn withdraw_finding(&self) {
        let found =
            |message: &FromEdge| matches!(message, FromEdge::Finding(_) | FromEdge::Spectra(_));
        self.lock().messages.retain(|(_, message)| !found(message));
    }

    /// Says that no message will follow.
    pub fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// Waits, at most `timeout`, for messages that were published since `seen` (0 at first). Returns them, oldest first, and moves
    /// `seen` on. Returns `None` when all messages are seen and none will follow.
    pub fn news(&self, seen: &mut u64, timeout: Duration) -> Option<Vec<Arc<FromEdge>>> {
        let (state, _) = self
            .changed
            .wait_timeout_while(self.lock(), timeout, |state| state.count == *seen && !state.closed)
            .unwrap_or_else(PoisonError::into_inner);
        if state.count == *seen && state.closed {
            return None;
        }
        let news = state.messages.iter().filter(|(number, _)| number > seen);
        let news = news.map(|(_, message)| Arc::clone(message)).collect();
        *seen = state.count;
        Some(news)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // The messages are whole even after a panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
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
        let latest = Latest::new();
        let other = FromEdge::Refused(Refusal { reason: clipped("full") });
        let mut seen = 0;
        assert_eq!(latest.news(&mut seen, Duration::ZERO), Some(vec![]));
        for message in [progress(1), other.clone(), progress(2), progress(3)] {
            latest.publish(message);
        }
        let news = latest.news(&mut seen, Duration::ZERO).unwrap();
        assert_eq!(news, [Arc::new(other), Arc::new(progress(3))]);
        assert_eq!(latest.news(&mut seen, Duration::ZERO), Some(vec![]));
        latest.publish(progress(4));
        latest.close();
        assert_eq!(latest.news(&mut seen, Duration::ZERO), Some(vec![Arc::new(progress(4))]));
        assert_eq!(latest.news(&mut seen, Duration::from_secs(60)), None);
    }
}
