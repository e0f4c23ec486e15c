//! The stream of server-sent events: each part when it has changed, and a beat when nothing has.

use std::array;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::response::sse::Event;
use futures_util::Stream;
use futures_util::stream::unfold;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until, timeout};

use super::PACE;
use super::parts::{NAMES, Parts};
use super::slots::Slot;

/// Longest time between two events. The page takes four times this as the end of the connection.
const BEAT: Duration = Duration::from_secs(1);

/// The events that one client has got, and its next one.
struct Reader {
    page: watch::Receiver<Parts>,
    sent: [Option<Arc<str>>; NAMES.len()],
    next: VecDeque<Event>,
    due: Instant,
    _slot: Slot,
}

/// Events for one client: the version of the page, every part, and from then on what changes. A client that reads slowly misses
/// what lies between.
pub(super) fn events(
    page: watch::Receiver<Parts>,
    version: &str,
    slot: Slot,
) -> impl Stream<Item = Result<Event, Infallible>> + use<> {
    let mut reader = Reader {
        page,
        sent: array::from_fn(|_| None),
        next: VecDeque::from([event("version", version)]),
        due: Instant::now(),
        _slot: slot,
    };
    reader.page.mark_changed();
    unfold(reader, Reader::step)
}

/// An event. Browsers leave out an event without data, and so does axum with data that are empty: a space stands for them.
fn event(name: &str, data: &str) -> Event {
    Event::default().event(name).data(if data.is_empty() { " " } else { data })
}

impl Reader {
    /// The next event; `None` when no page will follow.
    async fn step(mut self) -> Option<(Result<Event, Infallible>, Self)> {
        loop {
            if let Some(event) = self.next.pop_front() {
                return Some((Ok(event), self));
            }
            sleep_until(self.due).await;
            match timeout(BEAT, self.page.changed()).await {
                Ok(Ok(())) => self.take(),
                Ok(Err(_)) => return None,
                Err(_) => self.next.push_back(event("beat", "")),
            }
            self.due = Instant::now() + PACE;
        }
    }

    /// Puts the parts that have changed on the list.
    fn take(&mut self) {
        let parts = self.page.borrow_and_update();
        for ((name, part), sent) in NAMES.iter().zip(&*parts).zip(&mut self.sent) {
            if sent.as_ref() != Some(part) {
                self.next.push_back(event(name, part));
                *sent = Some(Arc::clone(part));
            }
        }
    }
}
