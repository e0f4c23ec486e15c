//! What the publisher hears of the daemon.

use std::sync::mpsc::Sender;

use crate::envelope::Origin;
use crate::link::Signal;

/// News of the daemon.
#[derive(Clone, Debug)]
pub enum News {
    /// The daemon answers, or the reason why it does not.
    Daemon(Result<(), String>),
    /// A finding has settled.
    Found(Found),
    /// State of the daemon and its bus: a JSON object with entries.
    Health(String),
    /// A line for the log.
    Line(String),
}

/// A finding that has settled.
#[derive(Clone, Debug)]
pub struct Found {
    /// The result, a JSON object, as `flexid watch --json` writes it.
    pub body: String,
    /// Time since the newest record, s. `None` if that came to an earlier daemon.
    pub record_age_s: Option<f64>,
    /// Configuration, model and program behind it.
    pub origin: Origin,
}

/// What happens to the publisher.
pub(crate) enum Event {
    News(News),
    Link(Signal),
}

/// Way for news into the publisher.
#[derive(Clone, Debug)]
pub struct Inlet(pub(crate) Sender<Event>);

impl Inlet {
    /// Tells the publisher. Returns whether it still listens.
    pub fn tell(&self, news: News) -> bool {
        self.0.send(Event::News(news)).is_ok()
    }
}
