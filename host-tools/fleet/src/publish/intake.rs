//! Findings on their way to the disk.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

use super::news::Found;
use crate::envelope::{Envelope, Known, Times};
use crate::faults::Faults;
use crate::moment::{Moment, is_synchronised};
use crate::outbox::Outbox;
use crate::place::Place;

/// Interval after which a disk that was full is tried again.
const AGAIN: Duration = Duration::from_secs(5);
/// Most findings that wait for room on the disk, 3 MB.
const HELD: usize = 100;

/// A finding that is not on the disk yet.
struct Pending {
    found: Found,
    times: Times,
    known: Known,
}

/// Takes findings, at most one in an interval, and keeps them in an outbox.
pub(crate) struct Intake<'a> {
    place: &'a Place,
    interval: Duration,
    boot: Option<&'a str>,
    /// The newest finding on the disk.
    newest: Option<Known>,
    taken: Option<Instant>,
    /// The newest finding of this interval.
    waiting: Option<Pending>,
    /// Findings that wait for room on the disk, oldest first.
    held: VecDeque<Pending>,
    try_disk: Instant,
}

impl<'a> Intake<'a> {
    /// Makes an intake of a robot, in this boot of the box, that goes on behind the newest finding of an outbox.
    pub(crate) fn new(
        place: &'a Place,
        interval: Duration,
        boot: Option<&'a str>,
        outbox: &Outbox,
    ) -> Self {
        let newest = outbox.newest().and_then(|newest| outbox.read(newest).ok().flatten());
        let newest = newest.and_then(|text| Known::of(&text));
        let (held, try_disk) = (VecDeque::new(), Instant::now());
        Self { place, interval, boot, newest, taken: None, waiting: None, held, try_disk }
    }

    /// Takes a finding, unless it is the estimate that was taken last.
    pub(crate) fn take(&mut self, found: Found) {
        let Some(known) = Known::of(&found.body) else { return };
        let last = self.waiting.as_ref().or(self.held.back()).map(|pending| &pending.known);
        if last.or(self.newest.as_ref()).is_some_and(|last| last.is_estimate_of(&known)) {
            return;
        }
        let found_at = Moment::now();
        let begun = found.record_age_s.and_then(|age_s| found_at.ago(age_s));
        let times = Times { begun, found_at, synchronised: is_synchronised() };
        self.waiting = Some(Pending { found, times, known });
    }

    /// Keeps in `outbox` what is due, and what a full disk had refused.
    pub(crate) fn store(&mut self, outbox: &mut Outbox, faults: &mut Faults) {
        let is_due = self.taken.is_none_or(|taken| taken.elapsed() >= self.interval);
        if let Some(pending) = self.waiting.take_if(|_| is_due) {
            self.taken = Some(Instant::now());
            self.hold(pending, outbox, faults);
        }
        if !self.held.is_empty() && Instant::now() >= self.try_disk {
            self.write(outbox, faults);
        }
    }

    /// Keeps in `outbox` what there is, at the end.
    pub(crate) fn finish(mut self, outbox: &mut Outbox, faults: &mut Faults) {
        if let Some(pending) = self.waiting.take() {
            self.hold(pending, outbox, faults);
        }
        self.write(outbox, faults);
        for Pending { times, .. } in &self.held {
            let folder = outbox.folder().display();
            faults.say(&format!(
                "{folder}: the finding of {} is not kept: the daemon sends its newest again",
                times.found_at
            ));
        }
    }

    fn hold(&mut self, pending: Pending, outbox: &Outbox, faults: &Faults) {
        if self.held.len() == HELD
            && let Some(oldest) = self.held.pop_front()
        {
            let (folder, found_at) = (outbox.folder().display(), oldest.times.found_at);
            faults.say(&format!(
                "{folder}: the finding of {found_at} is dropped for newer ones, which wait for room, too"
            ));
        }
        self.held.push_back(pending);
    }

    fn write(&mut self, outbox: &mut Outbox, faults: &mut Faults) {
        while let Some(Pending { found, times, .. }) = self.held.front() {
            let envelope = Envelope::new(self.place, &found.origin, *times);
            let text =
                envelope.numbered(outbox.name(), self.boot, outbox.next()).around(&found.body);
            let folder = outbox.folder().display().to_string();
            match outbox.put(times.found_at, &text) {
                Ok(thinned) => {
                    self.newest = self.held.pop_front().map(|pending| pending.known);
                    faults.end(&folder);
                    if let Some(thinned) = thinned.filter(|thinned| !thinned.was_sent) {
                        faults.say(&format!(
                            "{folder}: is full: finding {} makes room, and was never sent: mend the way to the broker",
                            thinned.sequence
                        ));
                    }
                }
                Err(error) if is_full(&error) && outbox.make_room().is_some() => {}
                Err(error) => {
                    faults.begin(format!(
                        "{folder}: cannot be written: {error}: make room; findings wait in memory"
                    ));
                    self.try_disk = Instant::now() + AGAIN;
                    return;
                }
            }
        }
    }
}

fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use crate::envelope::Origin;

    #[test]
    fn a_full_outbox_names_what_makes_room_and_keeps_the_newest() {
        let folder = tempfile::tempdir().unwrap();
        let mut outbox = Outbox::open(folder.path()).unwrap();
        outbox.limit(2);
        let place = Place::new("hall", "r1").unwrap();
        let mut intake = Intake::new(&place, Duration::ZERO, None, &outbox);
        let lines = RefCell::new(Vec::new());
        let say = |line: &str| lines.borrow_mut().push(line.to_owned());
        let mut faults = Faults::new(&say);
        for number in 1..=4 {
            let body = format!("{{\"joints\":[{number}]}}");
            intake.take(Found { body, record_age_s: None, origin: Origin::default() });
            intake.store(&mut outbox, &mut faults);
        }
        assert_eq!((outbox.waiting(), outbox.newest()), (2, Some(4)));
        let says = |line: &String| line.ends_with("was never sent: mend the way to the broker");
        assert!(lines.borrow().len() == 2 && lines.borrow().iter().all(says), "{lines:?}");
    }
}
