//! The news of a daemon, on a screen, in lines, or as JSON.

use std::io::{IsTerminal as _, Write as _, stdout};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use flexid_wire::messages::{BusHealth, BusState, FromEdge, Phase, Progress, Status};
use flexid_wire::report::{Acceptance, Report};

use crate::table;

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
    pub(crate) report: Option<Report>,
}

impl View {
    pub(crate) fn take(&mut self, message: FromEdge) {
        match message {
            FromEdge::Status(status) => self.status = Some(status),
            FromEdge::Progress(progress) => self.progress = Some(progress),
            FromEdge::BusHealth(bus) => self.bus = Some(bus),
            FromEdge::Report(report) => self.report = Some(report),
            FromEdge::Hello(_) | FromEdge::Refused(_) => {}
        }
    }

    /// The report on all records that the daemon has, once the work on them has ended.
    pub(crate) fn settled(&self) -> Option<&Report> {
        let (progress, report) = (self.progress.as_ref()?, self.report.as_ref()?);
        // Progress is told before the report that goes with it.
        let current = report.fit.records >= progress.records;
        (progress.phase == Phase::Settled && current).then_some(report)
    }

    /// Whether the work has ended, and noise explains what is left.
    pub(crate) fn identified(&self) -> bool {
        let consistent = |report: &Report| report.fit.acceptance == Acceptance::Consistent;
        self.settled().is_some_and(consistent)
    }

    /// What the daemon does, in one line.
    pub(crate) fn state(&self) -> String {
        let waiting = || match &self.status {
            Some(status) => status.state.to_string(),
            None => "no news from the daemon".to_owned(),
        };
        let Some(Progress { phase, starts, records, .. }) = self.progress else { return waiting() };
        match phase {
            Phase::Waiting => waiting(),
            Phase::Searching => format!("searching with record {records}, start {starts}"),
            Phase::Refining => format!("refining with record {records}, start {starts}"),
            Phase::Settled => format!("settled, {records} records"),
        }
    }

    /// The bus in one line.
    pub(crate) fn bus_line(&self) -> Option<String> {
        let bus = self.bus.as_ref()?;
        let state = match bus.state {
            BusState::Up => "up",
            BusState::Down => "DOWN",
            BusState::Gone => "GONE",
        };
        let interface = self.status.as_ref().map_or("bus", |status| status.interface.as_str());
        let mut line = format!(
            "{interface} {state}: {:.0} frames/s, {} taken, {} lost, {} dropped by the kernel",
            bus.frames_per_second, bus.frames, bus.frames_lost, bus.kernel_dropped
        );
        if !bus.error.is_empty() {
            line += &format!("; {}", bus.error);
        }
        Some(line)
    }
}

/// Where the news go: JSON lines, lines for people, or a screen that is drawn anew.
pub(crate) enum Screen {
    Json,
    Lines { last: String },
    Live { drawn: Option<Instant> },
}

impl Screen {
    /// JSON lines if asked for, a live screen on a terminal, else lines.
    pub(crate) fn new(json: bool) -> Self {
        if json {
            Self::Json
        } else if stdout().is_terminal() {
            Self::Live { drawn: None }
        } else {
            Self::Lines { last: String::new() }
        }
    }

    /// What is printed for each message.
    pub(crate) fn hear(&mut self, message: &FromEdge) -> Result<()> {
        if let (FromEdge::Report(report), Self::Json) = (message, &self) {
            return print(&(serde_json::to_string(report)? + "\n"));
        }
        match (message, &self) {
            (FromEdge::Report(report), Self::Lines { .. }) => print(&(table::fit(report) + "\n")),
            _ => Ok(()),
        }
    }

    /// Shows what has changed.
    pub(crate) fn draw(&mut self, view: &View) -> Result<()> {
        match self {
            Self::Json => Ok(()),
            Self::Lines { last } => {
                let state = view.state();
                if state == *last {
                    return Ok(());
                }
                last.clone_from(&state);
                print(&(state + "\n"))
            }
            Self::Live { drawn } => {
                if drawn.is_some_and(|drawn| drawn.elapsed() < REDRAW) {
                    return Ok(());
                }
                // The first time all, then line by line: that flickers less.
                let mut text = String::from(if drawn.is_none() { CLEAR } else { "\x1b[H" });
                *drawn = Some(Instant::now());
                for line in page(view).lines() {
                    text += &format!("{line}\x1b[K\n");
                }
                print(&(text + "\x1b[J"))
            }
        }
    }

    /// What stays when the command ends.
    pub(crate) fn end(&mut self, view: &View) -> Result<()> {
        match self {
            Self::Json => Ok(()),
            Self::Lines { .. } => match &view.report {
                Some(report) => print(&table::report(report, None)),
                None => Ok(()),
            },
            Self::Live { drawn } => {
                *drawn = None;
                self.draw(view)
            }
        }
    }

    /// Leaves an empty screen for something else.
    pub(crate) fn clear(self) -> Result<()> {
        match self {
            Self::Live { drawn: Some(_) } => print(CLEAR),
            _ => Ok(()),
        }
    }
}

fn page(view: &View) -> String {
    let mut page = String::new();
    if let Some(status) = &view.status {
        page +=
            &format!("{} ({} joints), up {:.0} s\n", status.model, status.joints, status.uptime_s);
    }
    if let Some(line) = view.bus_line() {
        page += &(line + "\n");
    }
    let percent = view.progress.map_or(0.0, |progress| 100.0 * progress.fraction);
    page += &format!("{} ({percent:.0} %)\n", view.state());
    if let Some(report) = &view.report {
        page += &table::report(report, None);
    }
    page
}

fn print(text: &str) -> Result<()> {
    let mut out = stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).context("stdout")
}
