//! The publisher: findings of a daemon into the outbox, and from there to the broker, in their order.
//!
//! | topic, below `flexid/v1/SITE/ROBOT` | what                                                     | quality, retained |
//! | ----------------------------------- | -------------------------------------------------------- | ----------------- |
//! | `finding`                           | result with its envelope                                 | 1, retained       |
//! | `status`                            | publisher and daemon; the last will says `online: false` | 1, retained       |
//! | `health`                            | state of the daemon and of its bus, each minute          | 0                 |
//! | `resend`                            | request: a sequence, or the first and last, `17-20`      |                   |

mod config;
mod intake;
mod message;
mod news;
pub mod request;

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use flexid_pipeline::stop::Stop;

use crate::faults::Faults;
use crate::link::{Link, Quality, Signal};
use crate::outbox::{Outbox, OutboxError};
pub use config::Config;
use intake::Intake;
use news::Event;
pub use news::{Found, Inlet, News};

/// Longest time until a signal of the system is seen.
const LOOK: Duration = Duration::from_millis(250);
/// Interval between two messages of health.
const HEALTH: Duration = Duration::from_secs(60);
/// Longest time between two messages of status: they say how many findings there are, so that the last one is missed, too.
const STATUS: Duration = Duration::from_secs(600);
/// Interval after which a broker that refused is tried again.
const AGAIN: Duration = Duration::from_secs(5);
/// Longest time at the end in which the broker may take what is left.
const LEAVE: Duration = Duration::from_secs(2);

/// What the broker has not acknowledged yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flight {
    Status,
    Finding(u64),
    Again,
}

/// The publisher of a robot.
pub struct Publisher<'a> {
    config: &'a Config,
    tool: &'a str,
    faults: Faults<'a>,
    outbox: Outbox,
    boot: Option<String>,
    link: Link,
    events: Receiver<Event>,
    inlet: Inlet,
    daemon: Option<bool>,
    health: Option<String>,
    health_sent: Option<Instant>,
    status_due: Instant,
    flight: Option<Flight>,
    again: BTreeSet<u64>,
    try_broker: Instant,
}

impl<'a> Publisher<'a> {
    /// Opens the outbox. `tool` is name and version of the program, `say` writes a line of its log.
    ///
    /// # Errors
    /// The outbox cannot be used.
    pub fn new(
        config: &'a Config,
        tool: &'a str,
        say: &'a dyn Fn(&str),
    ) -> Result<Self, OutboxError> {
        let outbox = Outbox::open(&config.outbox)?;
        // The kernel draws it at each start of the box.
        let boot = fs::read_to_string("/proc/sys/kernel/random/boot_id").ok();
        let boot = boot.map(|own| own.trim().to_owned());
        let (sender, events) = channel();
        let will = message::status(false, false, tool, &outbox, boot.as_deref());
        let to_self = sender.clone();
        let link = Link::new(
            &config.broker,
            &format!("flexid-publish-{}", config.place.robot()),
            Some((config.place.topic("status"), will)),
            // A publisher that has ended listens no more.
            move |signal| _ = to_self.send(Event::Link(signal)),
        );
        Ok(Self {
            config,
            tool,
            faults: Faults::new(say),
            outbox,
            boot,
            link,
            events,
            inlet: Inlet(sender),
            daemon: None,
            health: None,
            health_sent: None,
            status_due: Instant::now(),
            flight: None,
            again: BTreeSet::new(),
            try_broker: Instant::now(),
        })
    }

    /// Returns the way for news of the daemon.
    pub fn inlet(&self) -> Inlet {
        self.inlet.clone()
    }

    /// Publishes until `stop` is requested. Whatever the broker has not taken then stays in the outbox.
    ///
    /// # Errors
    /// The system gives no thread for the connection.
    pub fn run(mut self, stop: &Stop) -> io::Result<()> {
        let (config, boot) = (self.config, self.boot.clone());
        let mut intake = Intake::new(&config.place, config.interval, boot.as_deref(), &self.outbox);
        while !stop.requested() {
            self.link.keep()?;
            self.hear(LOOK, Some(&mut intake));
            intake.store(&mut self.outbox, &mut self.faults);
            self.send_health();
            self.send();
        }
        intake.finish(&mut self.outbox, &mut self.faults);
        self.leave();
        Ok(())
    }

    /// Sends what is left and that the publisher ends, within [`LEAVE`].
    fn leave(&mut self) {
        let end = Instant::now() + LEAVE;
        let mut told = false;
        while self.link.is_up() && Instant::now() < end {
            self.send();
            if self.flight.is_none() {
                if told {
                    break;
                }
                let text = self.status(false);
                let topic = self.config.place.topic("status");
                told = self.link.send(&topic, text, Quality::Retained);
                self.flight = told.then_some(Flight::Status);
            }
            self.hear(LOOK, None);
        }
        self.link.leave();
        while self.link.is_up() && Instant::now() < end {
            self.hear(LOOK, None);
        }
    }

    /// Takes the events of the next `time`, and all that have come after the first of them.
    fn hear(&mut self, time: Duration, mut intake: Option<&mut Intake>) {
        let mut event = self.events.recv_timeout(time);
        loop {
            match event {
                Ok(Event::Link(signal)) => self.take_signal(signal),
                Ok(Event::News(News::Found(found))) => {
                    if let Some(intake) = intake.as_deref_mut() {
                        intake.take(found);
                    }
                }
                Ok(Event::News(News::Daemon(answer))) => self.take_answer(answer),
                Ok(Event::News(News::Health(body))) => self.health = Some(body),
                Ok(Event::News(News::Line(line))) => self.faults.say(&line),
                // The publisher itself holds a sender.
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return,
            }
            event = self.events.recv_timeout(Duration::ZERO);
        }
    }

    fn take_answer(&mut self, answer: Result<(), String>) {
        let is_there = answer.is_ok();
        if self.daemon.replace(is_there) != Some(is_there) {
            self.status_due = Instant::now();
            self.faults.say(&match answer {
                Ok(()) => format!("{}: the daemon answers", self.config.daemon),
                Err(reason) => format!("{reason}; goes on trying"),
            });
        }
        if !is_there {
            self.health = None;
        }
    }

    fn take_signal(&mut self, signal: Signal) {
        self.link.hear(&signal);
        let place = &self.config.place;
        match signal {
            Signal::Up => {
                let now = Instant::now();
                (self.flight, self.status_due, self.try_broker) = (None, now, now);
                self.link.subscribe(&place.topic("resend"));
                self.faults.end("mqtt ");
                let (address, waiting) = (self.config.broker.address, self.outbox.waiting());
                self.faults
                    .say(&format!("mqtt {address}: connected, findings that wait: {waiting}"));
            }
            Signal::Down(reason) => {
                self.flight = None;
                self.faults.begin(format!("{reason}; findings wait in the outbox"));
            }
            Signal::Acknowledged(Ok(())) => {
                if let Some(Flight::Finding(sequence)) = self.flight.take() {
                    self.outbox.acknowledge(sequence);
                    self.faults.end(&place.topic(""));
                }
            }
            Signal::Acknowledged(Err(reason)) => {
                let is_status = self.flight.take() == Some(Flight::Status);
                let topic = place.topic(if is_status { "status" } else { "finding" });
                self.faults.begin(format!("{topic}: {reason}"));
                self.try_broker = Instant::now() + AGAIN;
            }
            Signal::Message(message) => match request::parse(&message.payload) {
                Ok(range) => self.again.extend(self.outbox.within(range)),
                Err(error) => self.faults.say(&format!("{}: {error}", place.topic("resend"))),
            },
        }
    }

    /// Sends the next message, once the broker has acknowledged the one before: so they arrive in their order.
    fn send(&mut self) {
        if !self.link.is_up() || self.flight.is_some() || Instant::now() < self.try_broker {
            return;
        }
        if Instant::now() >= self.status_due {
            let (topic, text) = (self.config.place.topic("status"), self.status(true));
            if self.link.send(&topic, text, Quality::Retained) {
                (self.flight, self.status_due) = (Some(Flight::Status), Instant::now() + STATUS);
            }
            return;
        }
        while let Some(sequence) = self.again.pop_first() {
            if let Some(text) = self.text(sequence) {
                return self.fly(text, Quality::Once, Flight::Again);
            }
        }
        while let Some(sequence) = self.outbox.unsent() {
            match self.text(sequence) {
                Some(text) => return self.fly(text, Quality::Retained, Flight::Finding(sequence)),
                None => self.outbox.acknowledge(sequence),
            }
        }
    }

    fn fly(&mut self, text: String, quality: Quality, flight: Flight) {
        let topic = self.config.place.topic("finding");
        self.flight = self.link.send(&topic, text, quality).then_some(flight);
    }

    fn text(&mut self, sequence: u64) -> Option<String> {
        let text = message::finding(&self.outbox, sequence);
        text.unwrap_or_else(|line| {
            self.faults.begin(line);
            None
        })
    }

    fn send_health(&mut self) {
        if !self.link.is_up() || self.health_sent.is_some_and(|sent| sent.elapsed() < HEALTH) {
            return;
        }
        let (daemon, waiting) = (self.daemon == Some(true), self.outbox.waiting());
        let text = message::health(daemon, waiting, self.health.as_deref());
        if self.link.send(&self.config.place.topic("health"), text, Quality::Maybe) {
            self.health_sent = Some(Instant::now());
        }
    }

    fn status(&self, online: bool) -> String {
        let daemon = self.daemon == Some(true);
        message::status(online, daemon, self.tool, &self.outbox, self.boot.as_deref())
    }
}
