//! The collector: messages of the plant's broker into PostgreSQL. The broker keeps what is not acknowledged, and a message is acknowledged
//! once the database has it.

mod config;
mod database;

use std::collections::{BTreeSet, VecDeque};
use std::io;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use flexid_pipeline::stop::Stop;
use rumqttc::mqttbytes::v5::Publish;
use rumqttc::{AckMode, BrokerSessionResumePolicy};

use crate::faults::Faults;
use crate::link::{Link, Quality, Signal};
use crate::place::Place;
pub use config::Config;
use database::{Database, Gap};
pub use database::{DatabaseError, migrate};

/// Longest time until a signal of the system is seen.
const LOOK: Duration = Duration::from_millis(250);
/// Interval after which a database that failed is tried again.
const AGAIN: Duration = Duration::from_secs(5);
/// Largest message, bytes. The broker keeps larger ones from this client.
const LARGEST: u32 = 1 << 20;

/// The collector of a plant.
pub struct Collector<'a> {
    config: &'a Config,
    faults: Faults<'a>,
    link: Link,
    events: Receiver<Signal>,
    database: Option<Database>,
    try_database: Instant,
    /// Messages that are not acknowledged, oldest first.
    todo: VecDeque<Publish>,
    /// Robots whose findings may have gaps, by site and name.
    doubtful: BTreeSet<(String, String)>,
    /// Missing findings that were asked for.
    asked: BTreeSet<Gap>,
    looks_at_all: bool,
}

impl<'a> Collector<'a> {
    /// Makes a collector; `say` writes a line of its log.
    pub fn new(config: &'a Config, say: &'a dyn Fn(&str)) -> Self {
        let (sender, events) = channel();
        // A collector that has ended listens no more.
        let tell = move |signal| _ = sender.send(signal);
        let mut link = Link::new(&config.broker, "flexid-collect", None, tell);
        link.options()
            .set_clean_start(false)
            // The broker keeps the session, and the messages for it, for ever.
            .set_session_expiry_interval(Some(u32::MAX))
            .set_broker_session_resume_policy(BrokerSessionResumePolicy::AllowBrokerOnly)
            .set_ack_mode(AckMode::Manual)
            .set_max_packet_size(Some(LARGEST));
        Self {
            config,
            faults: Faults::new(say),
            link,
            events,
            database: None,
            try_database: Instant::now(),
            todo: VecDeque::new(),
            doubtful: BTreeSet::new(),
            asked: BTreeSet::new(),
            looks_at_all: true,
        }
    }

    /// Collects until `stop` is requested.
    ///
    /// # Errors
    /// The system gives no thread for the connection.
    pub fn run(mut self, stop: &Stop) -> io::Result<()> {
        while !stop.requested() {
            self.link.keep()?;
            if let Ok(signal) = self.events.recv_timeout(LOOK) {
                self.take(signal);
                while let Ok(signal) = self.events.try_recv() {
                    self.take(signal);
                }
            }
            if Instant::now() >= self.try_database
                && let Err(error) = self.store()
            {
                (self.database, self.try_database) = (None, Instant::now() + AGAIN);
                self.faults.begin(format!("database: {error}; messages wait at the broker"));
            }
        }
        self.link.leave();
        while self.link.is_up()
            && let Ok(signal) = self.events.recv_timeout(LOOK)
        {
            self.take(signal);
        }
        Ok(())
    }

    fn take(&mut self, signal: Signal) {
        self.link.hear(&signal);
        match signal {
            Signal::Up => {
                for topic in ["finding", "status"] {
                    self.link.subscribe(&format!("flexid/v1/+/+/{topic}"));
                }
                self.faults.end("mqtt ");
                self.faults.say(&format!("mqtt {}: connected", self.config.broker.address));
            }
            Signal::Down(reason) => {
                // The broker sends again what it has no acknowledgement of.
                self.todo.clear();
                self.faults.begin(reason);
            }
            Signal::Message(message) => self.todo.push_back(message),
            Signal::Acknowledged(Ok(())) => {}
            Signal::Acknowledged(Err(reason)) => {
                self.faults.begin(format!("flexid/v1/+/+/resend: {reason}"));
            }
        }
    }

    /// Keeps the messages in the database, and asks for findings that are missing.
    fn store(&mut self) -> Result<(), DatabaseError> {
        let mut database = match self.database.take() {
            Some(database) => database,
            None => {
                let database = Database::connect(&self.config.database)?;
                self.faults.end("database: ");
                self.faults.say("database: connected");
                database
            }
        };
        while let Some(message) = self.todo.front() {
            let topic = String::from_utf8_lossy(&message.topic).into_owned();
            database.keep(&topic, &message.payload)?;
            for warning in database.warnings() {
                self.faults.say(&warning);
            }
            self.doubt(&topic);
            if let Some(message) = self.todo.pop_front() {
                // Without a connection the message comes again.
                self.link.acknowledge(&message);
            }
        }
        if self.link.is_up() && (self.looks_at_all || !self.doubtful.is_empty()) {
            self.ask(&mut database)?;
        }
        self.database = Some(database);
        Ok(())
    }

    /// Takes note that a robot may have a gap. After a status, it has come back, and is asked again.
    fn doubt(&mut self, topic: &str) {
        let levels: Vec<&str> = topic.split('/').collect();
        if let ["flexid", "v1", site, robot, what] = levels[..] {
            if what == "status" {
                self.asked.retain(|gap| (&*gap.site, &*gap.robot) != (site, robot));
            }
            self.doubtful.insert((site.to_owned(), robot.to_owned()));
        }
    }

    /// Asks robots for the findings that are missing, each once until it comes back.
    fn ask(&mut self, database: &mut Database) -> Result<(), DatabaseError> {
        let gaps = match std::mem::take(&mut self.looks_at_all) {
            true => database.gaps(None)?,
            false => {
                let robots = self.doubtful.iter();
                let gaps = robots.map(|(site, robot)| database.gaps(Some((site, robot))));
                gaps.collect::<Result<Vec<_>, _>>()?.concat()
            }
        };
        self.doubtful.clear();
        let mut missing: Vec<Gap> =
            gaps.into_iter().filter(|gap| !self.asked.contains(gap)).collect();
        missing.sort();
        let follows =
            |one: &Gap, next: &Gap| *next == Gap { missing: one.missing + 1, ..one.clone() };
        for run in missing.chunk_by(follows) {
            let ([first, ..], [.., last]) = (run, run) else { continue };
            let Ok(place) = Place::new(&first.site, &first.robot) else { continue };
            let request = format!("{}-{}", first.missing, last.missing);
            if self.link.send(&place.topic("resend"), &*request, Quality::Once) {
                self.faults.say(&format!("{place}: findings {request} are missing, and asked for"));
                self.asked.extend(run.iter().cloned());
            } else {
                self.looks_at_all = true;
            }
        }
        Ok(())
    }
}
