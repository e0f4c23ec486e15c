//! The news of a daemon, on a screen, in lines, or as JSON.

use std::io::{IsTerminal as _, stdout};
use std::time::{Duration, Instant};

use ::console::{Term, truncate_str};
use anyhow::Result;
use flexid_wire::messages::{BusErrors, BusHealth, BusState, FromEdge, Phase, Progress, Status};
use flexid_wire::report::{Acceptance, JointReport, Report, Verdict};

use crate::news::News;
use crate::{page, table};
use flexid_edge::console::{draw, print, printable};
use flexid_edge::finding::Finding;
use flexid_edge::summary::{Summary, count};

/// The screen is drawn this often at most.
pub(crate) const REDRAW: Duration = Duration::from_millis(200);
/// Home, and clear to the end.
const CLEAR: &str = "\x1b[H\x1b[J";

/// The latest of each kind of message.
#[derive(Default)]
pub(crate) struct View {
    pub(crate) status: Option<Status>,
    pub(crate) progress: Option<Progress>,
    pub(crate) bus: Option<BusHealth>,
    pub(crate) finding: Option<Finding>,
    /// A report whose confidence is still to come.
    report: Option<Report>,
}

impl View {
    /// Takes a message; the finding that it completes.
    pub(crate) fn take(&mut self, message: FromEdge) -> Option<&Finding> {
        match message {
            FromEdge::Status(status) => self.status = Some(status),
            FromEdge::Progress(progress) => {
                let before = self.progress.replace(progress);
                if before.is_some_and(|before| progress.records < before.records) {
                    // The daemon begins anew: its config has changed.
                    (self.finding, self.report) = (None, None);
                }
            }
            FromEdge::BusHealth(bus) => self.bus = Some(bus),
            FromEdge::Report(report) => self.report = Some(report),
            FromEdge::Confidence(confidence) => {
                let report = self.report.take()?;
                return Some(self.finding.insert(Finding { report, confidence }));
            }
            FromEdge::Hello(_) | FromEdge::Refused(_) => {}
        }
        None
    }

    /// The report on all records that the daemon has, once the work on them has ended.
    pub(crate) fn settled(&self) -> Option<&Report> {
        let (progress, finding) = (self.progress.as_ref()?, self.finding.as_ref()?);
        let Finding { report, confidence } = finding;
        // Progress is told before the report that goes with it.
        let current = report.fit.records + confidence.left_out >= progress.records;
        (progress.phase == Phase::Settled && current).then_some(report)
    }

    /// Whether the work on at least so many records has ended with a parameter that the data tell, and noise
    /// explains what is left.
    pub(crate) fn identified(&self, records: u64) -> bool {
        let told = |joint: &JointReport| {
            let verdicts = joint.stiffness_verdict.iter().chain(&joint.damping_verdict);
            verdicts.into_iter().any(|verdict| *verdict == Verdict::Identified)
        };
        self.settled().is_some_and(|Report { joints, fit, .. }| {
            fit.records >= records
                && fit.acceptance == Acceptance::Consistent
                && joints.iter().any(told)
        })
    }

    /// What the daemon does, in one line; `None` before it has said anything.
    pub(crate) fn state(&self) -> Option<String> {
        let waiting = || self.status.as_ref().map(|status| status.state.to_string());
        let Some(Progress { phase, starts, records, .. }) = self.progress else { return waiting() };
        match phase {
            Phase::Waiting => waiting(),
            // Of static tests alone: what is waited for is a record.
            Phase::Settled if records == 0 => waiting(),
            Phase::Searching => Some(format!("searching with record {records}, start {starts}")),
            Phase::Refining => Some(format!("refining with record {records}, start {starts}")),
            Phase::Settled => Some(format!("settled, {}", count(records, "record"))),
        }
    }

    /// Why no frames can come.
    pub(crate) fn dead_bus(&self) -> Option<String> {
        let bus = self.bus.as_ref()?;
        let state = match bus.state {
            BusState::Up => return None,
            BusState::Down => "DOWN",
            BusState::Gone => "GONE",
            BusState::BusOff => "BUS-OFF",
        };
        let error = if bus.error.is_empty() { "" } else { ": " };
        Some(format!("{} {state}{error}{}", self.interface(), bus.error))
    }

    /// All of it in one line, the bus first if it is dead.
    pub(crate) fn summary(&self) -> String {
        let state = self.state().unwrap_or_else(|| "no news from the daemon".to_owned());
        match (self.bus_line(), self.dead_bus().is_some()) {
            (None, _) => state,
            (Some(bus), false) => format!("{state}; {bus}"),
            (Some(bus), true) => format!("{bus}; {state}"),
        }
    }

    /// The bus in one line: what it delivers, and what does not become of it.
    pub(crate) fn bus_line(&self) -> Option<String> {
        let bus = self.bus.as_ref()?;
        let dead = self.dead_bus();
        let head = dead.clone().unwrap_or_else(|| format!("{} up", self.interface()));
        let mut line = format!(
            "{head}; {:.0} frames/s, {} taken, {} lost, {} dropped by the kernel",
            bus.frames_per_second, bus.frames, bus.frames_lost, bus.kernel_dropped
        );
        let rare = [
            (bus.frames_wrong_length, "of a wrong length"),
            (bus.frames_unknown, "of no known signal"),
            (bus.frames_not_data, "not data"),
            (bus.frames_clipped, "clipped"),
            (bus.repeated, "repeated"),
            (bus.refused, "refused"),
            (bus.bridged, "bridged"),
            (bus.samples_discarded, "discarded"),
        ];
        for (number, what) in rare.iter().filter(|(number, _)| *number > 0) {
            line += &format!(", {number} {what}");
        }
        if bus.restarts > 0 {
            line += &format!(", {}", count(bus.restarts, "counter restart"));
        }
        if bus.wrong_rate > 0 {
            let records = count(bus.wrong_rate, "record");
            line += &format!(", {records} at {:.1} Hz", bus.measured_rate_hz);
        }
        for (number, what) in errors(&bus.errors).filter(|(number, _)| *number > 0) {
            line += &format!(", {number} {what}");
        }
        if dead.is_none() && !bus.error.is_empty() {
            line += &format!("; {}", bus.error);
        }
        Some(line)
    }

    fn interface(&self) -> &str {
        self.status.as_ref().map_or("bus", |status| status.interface.as_str())
    }
}

/// What the bus has reported, the gravest first.
fn errors(errors: &BusErrors) -> impl Iterator<Item = (u64, &'static str)> {
    [
        (errors.bus_off, "times bus-off"),
        (errors.restarted, "controller restarts"),
        (errors.controller_passive, "times error-passive"),
        (errors.controller_warning, "error warnings"),
        (errors.controller_overflow, "controller overflows"),
        (errors.protocol, "protocol errors"),
        (errors.no_acknowledgement, "without acknowledgement"),
        (errors.transceiver, "transceiver errors"),
        (errors.lost_arbitration, "lost arbitrations"),
        (errors.transmit_timeout, "transmit timeouts"),
    ]
    .into_iter()
}

/// Where the news go: JSON lines, lines for people, or a screen that is drawn anew.
pub(crate) enum Screen {
    Json(Box<News>),
    Lines { last: String },
    Live { drawn: Option<Instant> },
}

impl Screen {
    /// JSON lines if asked for, a live screen on a terminal, else lines.
    pub(crate) fn new(json: bool) -> Self {
        if json {
            Self::Json(Box::new(News::new()))
        } else if stdout().is_terminal() {
            Self::Live { drawn: None }
        } else {
            Self::Lines { last: String::new() }
        }
    }

    /// What is printed for each finding.
    pub(crate) fn hear(&mut self, finding: &Finding) -> Result<()> {
        match self {
            Self::Json(news) => {
                news.end();
                Ok(print(&(serde_json::to_string(finding)? + "\n"))?)
            }
            Self::Lines { .. } => Ok(print(&Summary(&finding.report).to_string())?),
            Self::Live { .. } => Ok(()),
        }
    }

    /// Shows what has changed.
    pub(crate) fn draw(&mut self, view: &View) -> Result<()> {
        match self {
            Self::Json(news) => Ok(print(&news.lines(view)?)?),
            Self::Lines { last } => {
                let news: Vec<_> = view.dead_bus().into_iter().chain(view.state()).collect();
                let news = news.join("; ");
                if news == *last {
                    return Ok(());
                }
                last.clone_from(&news);
                Ok(print(&(news + "\n"))?)
            }
            Self::Live { drawn } => {
                if drawn.is_some_and(|drawn| drawn.elapsed() < REDRAW) {
                    return Ok(());
                }
                // The first time all, then line by line: that flickers less.
                let mut text = String::from(if drawn.is_none() { CLEAR } else { "\x1b[H" });
                *drawn = Some(Instant::now());
                // What does not fit would scroll the screen; the end has it all.
                let (rows, columns) = Term::stdout().size();
                for line in page::lines(view, rows.into(), columns.into()) {
                    let line = printable(&line);
                    let line = truncate_str(&line, columns.into(), "…");
                    text += &format!("{line}\x1b[K\n");
                }
                Ok(draw(&(text + "\x1b[J"))?)
            }
        }
    }

    /// What stays when the command ends.
    pub(crate) fn end(&mut self, view: &View) -> Result<()> {
        match self {
            Self::Json(_) => Ok(()),
            Self::Lines { .. } => {
                let table = view.finding.as_ref().map(|finding| table::finding(finding, None));
                let bus = view.bus_line().map(|line| line + "\n");
                Ok(print(&(table.unwrap_or_default() + &bus.unwrap_or_default()))?)
            }
            Self::Live { .. } => {
                let (_, columns) = Term::stdout().size();
                let page = page::full(view, columns.into()).join("\n");
                Ok(draw(&(CLEAR.to_owned() + &printable(&page) + "\n"))?)
            }
        }
    }

    /// Leaves an empty screen for something else.
    pub(crate) fn clear(self) -> Result<()> {
        match self {
            Self::Live { drawn: Some(_) } => Ok(draw(CLEAR)?),
            _ => Ok(()),
        }
    }
}
