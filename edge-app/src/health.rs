//! The health of a running daemon, as a plugin of Nagios and its kin says it: a line and an exit status.

use std::fmt;
use std::time::{Duration, Instant};

use flexid_pipeline::config::Listen;
use flexid_wire::messages::{BusHealth, BusState, FromEdge, Phase, Progress, Status};
use flexid_wire::report::{Acceptance, Fit};

use crate::client::{Client, ClientError};

/// Longest time until the daemon tells anew how the bus is: ten times its own interval.
const PATIENCE: Duration = Duration::from_secs(5);

/// How well the daemon is. The number is the exit status of a plugin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Nobody needs to act.
    Ok = 0,
    /// Somebody should act: what the journal files as a warning, or a fit that cannot be believed.
    Warning = 1,
    /// The daemon does not run, or its bus is dead.
    Critical = 2,
    /// The daemon cannot be asked.
    Unknown = 3,
}

/// Health of a daemon. Its text is the line of a plugin, with the numbers behind a bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Health {
    /// How well the daemon is.
    pub level: Level,
    says: Vec<String>,
    numbers: Vec<String>,
}

impl Health {
    /// Asks the daemon at `address`. With `max_age_s`, a newest record that is so many seconds old is a warning.
    pub fn of(address: &Listen, max_age_s: Option<u64>) -> Self {
        match News::of(address) {
            Ok(news) => news.health(max_age_s),
            Err(error) => Self::without_news(&error),
        }
    }

    /// Makes the health of a daemon that cannot be asked, and why.
    pub fn unknown(why: impl fmt::Display) -> Self {
        Self { level: Level::Unknown, says: vec![why.to_string()], numbers: Vec::new() }
    }

    fn without_news(error: &ClientError) -> Self {
        use ClientError::{HungUp, Nobody, NotAllowed, Protocol, Refused, Silent, Stranger};
        let level = match error {
            Nobody { .. } | Silent(_) | HungUp(_) => Level::Critical,
            NotAllowed { .. } | Refused { .. } | Protocol { .. } | Stranger(_) => Level::Unknown,
        };
        Self { level, ..Self::unknown(error) }
    }

    fn say(&mut self, level: Level, text: impl fmt::Display) {
        self.level = self.level.max(level);
        self.says.push(text.to_string());
    }
}

impl fmt::Display for Health {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let level = match self.level {
            Level::Ok => "OK",
            Level::Warning => "WARNING",
            Level::Critical => "CRITICAL",
            Level::Unknown => "UNKNOWN",
        };
        // A bar would end the text.
        let says = self.says.join(", ").replace('\n', " ").replace('|', "/");
        write!(f, "FLEXID {level} - {says}")?;
        if !self.numbers.is_empty() {
            write!(f, " | {}", self.numbers.join(" "))?;
        }
        writeln!(f)
    }
}

/// The news of a daemon.
#[derive(Clone, Debug)]
struct News {
    status: Status,
    bus: BusHealth,
    progress: Option<Progress>,
    fit: Option<Fit>,
}

impl News {
    /// Asks for the news, and waits until the reader has told how the bus is once more: it works.
    fn of(address: &Listen) -> Result<Self, ClientError> {
        let silent = || ClientError::Silent(address.clone());
        let mut client = Client::connect(address, None)?;
        let end = Instant::now() + PATIENCE;
        let (mut status, mut progress, mut fit, mut told) = (None, None, None, 0);
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match client.next(left)?.ok_or_else(silent)? {
                FromEdge::Status(own) => status = Some(own),
                FromEdge::Progress(own) => progress = Some(own),
                FromEdge::Finding(own) => fit = Some(own.report.fit),
                FromEdge::BusHealth(bus) => {
                    told += 1;
                    // The first may be old. The status comes before each.
                    if let (2.., Some(status)) = (told, status.take()) {
                        return Ok(Self { status, bus, progress, fit });
                    }
                }
                FromEdge::Hello(_) | FromEdge::Refused(_) | FromEdge::Spectra(_) => {}
            }
        }
    }

    fn health(&self, max_age_s: Option<u64>) -> Health {
        let mut health = Health { level: Level::Ok, says: Vec::new(), numbers: Vec::new() };
        self.judge_bus(&mut health);
        self.judge_records(&mut health, max_age_s);
        self.judge_fit(&mut health);
        health
    }

    fn judge_bus(&self, health: &mut Health) {
        let Self { status: Status { interface, state, .. }, bus, .. } = self;
        let link = match bus.state {
            BusState::Up => "up",
            BusState::Down => "down",
            BusState::Gone => "gone",
            BusState::BusOff => "bus-off",
        };
        let is_up = bus.state == BusState::Up;
        health.say(if is_up { Level::Ok } else { Level::Critical }, format!("{interface} {link}"));
        let rate = bus.frames_per_second;
        let fell_silent = is_up && rate == 0.0 && bus.frames > 0;
        let level = if fell_silent { Level::Warning } else { Level::Ok };
        health.say(level, format!("{rate:.0} frames/s"));
        if !state.is_in_order() {
            health.say(Level::Warning, state);
        }
        health.numbers.extend([
            format!("frames_per_second={rate:.0};;;0"),
            format!("frames_lost={}c", bus.frames_lost),
            format!("kernel_dropped={}c", bus.kernel_dropped),
        ]);
    }

    fn judge_records(&self, health: &mut Health, max_age_s: Option<u64>) {
        let Status { uptime_s, newest_record_s, .. } = self.status;
        let age_s = uptime_s - newest_record_s.unwrap_or_default();
        let is_old = max_age_s.is_some_and(|most| age_s > most as f64);
        let text = match newest_record_s {
            Some(_) => format!("newest record {age_s:.0} s ago"),
            None => format!("no record since the start {age_s:.0} s ago"),
        };
        health.say(if is_old { Level::Warning } else { Level::Ok }, text);
        let limit = max_age_s.map(|most| most.to_string()).unwrap_or_default();
        // U is a number that is not known.
        health.numbers.push(match newest_record_s {
            Some(_) => format!("record_age={age_s:.0}s;{limit};;0"),
            None => format!("record_age=U;{limit};;0"),
        });
    }

    fn judge_fit(&self, health: &mut Health) {
        let works = self.progress.is_some_and(|progress| progress.phase != Phase::Settled);
        let (level, text) = match self.fit.map(|fit| fit.acceptance) {
            None => (Level::Ok, "nothing identified yet"),
            Some(Acceptance::Consistent) => (Level::Ok, "consistent"),
            Some(Acceptance::ModelSuspect) => (Level::Warning, "MODEL SUSPECT"),
            Some(Acceptance::Unsettled) if works => (Level::Ok, "not settled yet"),
            Some(Acceptance::Unsettled) => (Level::Warning, "not settled"),
        };
        health.say(level, text);
        let records = self.fit.map_or(0, |fit| fit.records);
        health.numbers.push(format!("records={records};;;0"));
    }
}
