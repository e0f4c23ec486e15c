//! The collector: messages of the plant's broker into PostgreSQL. The broker keeps what is not acknowledged, and a message is acknowledged
//! once the database has it.
//!
//! A broker may lose what it has acknowledged. So robots tell how many findings they have sent, and are asked for those that are missing:
//! at once, and again and again, since a request may be lost as well.

mod config;
mod database;

use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use flexid_pipeline::stop::Stop;
use rumqttc::mqttbytes::v5::Publish;

use crate::faults::Faults;
use crate::link::{Link, Quality, Signal};
use crate::place::Place;
pub use config::Config;
use database::Database;
pub use database::{DatabaseError, migrate};

/// Longest time until a signal of the system is seen.
const LOOK: Duration = Duration::from_millis(250);
/// Interval after which a database that failed is tried again.
const AGAIN: Duration = Duration::from_secs(5);
/// Interval after which a robot is asked again for findings: at first, and at most. Each time doubles it.
const ASK: [Duration; 2] = [Duration::from_secs(10), Duration::from_secs(3600)];
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
    /// Robots of which findings may be missing, by site and name: when to look, and how long to wait then.
    doubtful: BTreeMap<(String, String), (Instant, Duration)>,
    looks_at_all: bool,
}

impl<'a> Collector<'a> {
    /// Makes a collector; `say` writes a line of its log.
    pub fn new(config: &'a Config, say: &'a dyn Fn(&str)) -> Self {
        let (sender, events) = channel();
        // A collector that has ended listens no more.
        let tell = move |signal| _ = sender.send(signal);
        let link = Link::new(&config.broker, "flexid-collect", None, tell).keep_session(LARGEST);
        Self {
            config,
            faults: Faults::new(say),
            link,
            events,
            database: None,
            try_database: Instant::now(),
            todo: VecDeque::new(),
            doubtful: BTreeMap::new(),
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
            if let ["flexid", "v1", site, robot, _] = topic.split('/').collect::<Vec<_>>()[..] {
                let robot = (site.to_owned(), robot.to_owned());
                self.doubtful.entry(robot).or_insert((Instant::now(), ASK[0]));
            }
            if let Some(message) = self.todo.pop_front() {
                // Without a connection the message comes again.
                self.link.acknowledge(&message);
            }
        }
        if self.link.is_up() {
            self.ask(&mut database)?;
        }
        self.database = Some(database);
        Ok(())
    }

    /// Asks robots for the findings that are missing, where it is time.
    fn ask(&mut self, database: &mut Database) -> Result<(), DatabaseError> {
        let now = Instant::now();
        if self.looks_at_all {
            self.doubtful.extend(database.doubtful()?.into_iter().map(|own| (own, (now, ASK[0]))));
            self.looks_at_all = false;
        }
        for ((site, robot), (next, pause)) in &mut self.doubtful {
            let Ok(place) = Place::new(site, robot) else { continue };
            if *next > now {
                continue;
            }
            let missing = database.missing(site, robot)?;
            if missing.is_empty() {
                self.faults.end(&format!("{place}: "));
                continue;
            }
            for run in missing.chunk_by(|one, next| one + 1 == *next) {
                let ([first, ..], [.., last]) = (run, run) else { continue };
                let one = first.to_string();
                let request = if first == last { one } else { format!("{first}-{last}") };
                if self.link.send(&place.topic("resend"), &*request, Quality::Once) {
                    let line = format!("{place}: findings {request} are missing, and asked for");
                    self.faults.begin(line);
                }
            }
            (*next, *pause) = (now + *pause, (2 * *pause).min(ASK[1]));
        }
        self.doubtful.retain(|_, (next, _)| *next > now);
        Ok(())
    }
}
