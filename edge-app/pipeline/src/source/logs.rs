//! Recordings, one after the other.

use std::io;
use std::time::Duration;

use flexid_wire::text::clipped;
use flexid_wire::trouble::Trouble;

use super::{Arrival, Elsewhere, Flow, FrameSource, SourceHealth};

/// Several recordings, which are read one after the other. Each is opened when its turn comes. One that cannot be read to its end
/// does not keep the next from being read.
pub struct Logs<I, S> {
    waiting: I,
    open: Option<S>,
    /// Troubles of the logs that have been read.
    troubles: Vec<Trouble>,
    /// Frames of other buses in them.
    elsewhere: Vec<Elsewhere>,
    /// Error of the first log that could not be read to its end.
    broken: Option<io::Error>,
}

impl<I: Iterator<Item = io::Result<S>>, S> Logs<I, S> {
    /// Makes a source of recordings in the order in which they were made. Each step of the iterator opens one.
    pub fn new(logs: impl IntoIterator<IntoIter = I>) -> Self {
        Self {
            waiting: logs.into_iter(),
            open: None,
            troubles: Vec::new(),
            elsewhere: Vec::new(),
            broken: None,
        }
    }
}

impl<I, S> Logs<I, S> {
    /// Notes an error. The first error comes after the last log, further ones are among the troubles.
    fn note(&mut self, error: io::Error) {
        match self.broken {
            None => self.broken = Some(error),
            Some(_) => self.troubles.push(Trouble::Unreadable(clipped(error))),
        }
    }
}

impl<I, S> FrameSource for Logs<I, S>
where
    I: Iterator<Item = io::Result<S>> + Send,
    S: FrameSource,
{
    /// Reads from the present log. An error comes after the last log.
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        if self.open.is_none() {
            match self.waiting.next() {
                Some(Ok(log)) => self.open = Some(log),
                Some(Err(error)) => self.note(error),
                None => return self.broken.take().map_or(Ok(Flow::Ended), Err),
            }
        }
        let Some(log) = &mut self.open else { return Ok(Flow::Open) };
        let flow = log.read(batch, timeout);
        if matches!(flow, Ok(Flow::Open)) {
            return Ok(Flow::Open);
        }
        let health = log.health();
        self.troubles.extend(health.troubles);
        self.elsewhere.extend(health.elsewhere);
        self.open = None;
        if let Err(error) = flow {
            self.note(error);
        }
        Ok(Flow::Open)
    }

    fn health(&self) -> SourceHealth {
        let (troubles, elsewhere) = (self.troubles.clone(), self.elsewhere.clone());
        SourceHealth { troubles, elsewhere, ..SourceHealth::default() }
    }
}
