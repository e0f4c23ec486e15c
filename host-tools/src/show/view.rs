//! The latest messages of a daemon.

use std::time::Duration;

use flexid_pipeline::text::count;
use flexid_wire::finding::Finding;
use flexid_wire::messages::{BusErrors, BusHealth, BusState, FromEdge, Phase, Progress, Status};
use flexid_wire::report::{Acceptance, JointReport, Report, Verdict};
use flexid_wire::spectra::Spectra;

/// Shortest time between two drawings of the screen.
pub(crate) const REDRAW: Duration = Duration::from_millis(200);

/// The latest of each kind of message.
#[derive(Default)]
pub(crate) struct View {
    pub(crate) status: Option<Status>,
    pub(crate) progress: Option<Progress>,
    pub(crate) bus: Option<BusHealth>,
    pub(crate) finding: Option<Finding>,
    /// Spectra of the newest record that the finding rests on.
    pub(crate) spectra: Option<Spectra>,
}

impl View {
    /// Takes a message. Returns whether it is a finding.
    pub(crate) fn take(&mut self, message: FromEdge) -> bool {
        let is_finding = matches!(message, FromEdge::Finding(_));
        match message {
            FromEdge::Status(status) => self.status = Some(status),
            FromEdge::Progress(progress) => {
                let before = self.progress.replace(progress);
                if before.is_some_and(|before| progress.records < before.records) {
                    // The daemon has started anew, because its config has changed.
                    (self.finding, self.spectra) = (None, None);
                }
            }
            FromEdge::BusHealth(bus) => self.bus = Some(bus),
            FromEdge::Finding(finding) => self.finding = Some(finding),
            FromEdge::Spectra(spectra) => self.spectra = Some(spectra),
            FromEdge::Hello(_) | FromEdge::Refused(_) => {}
        }
        is_finding
    }

    /// The report on all records that the daemon has, once the work on them has ended.
    pub(crate) fn settled(&self) -> Option<&Report> {
        let (progress, finding) = (self.progress.as_ref()?, self.finding.as_ref()?);
        let Finding { report, confidence, .. } = finding;
        // The daemon sends the progress before the report that belongs to it.
        let current = report.fit.records + confidence.left_out >= progress.records;
        (progress.phase == Phase::Settled && current).then_some(report)
    }

    /// Returns whether the work on at least `records` records has ended with an identified parameter, and noise explains the
    /// residuals.
    pub(crate) fn identified(&self, records: u64) -> bool {
        self.settled().is_some_and(|Report { joints, fit, .. }| {
            fit.records >= records
                && fit.acceptance == Acceptance::Consistent
                && joints.iter().any(has_identified)
        })
    }

    /// State of the daemon, in one line; `None` before its first message.
    pub(crate) fn state(&self) -> Option<String> {
        let waiting = || self.status.as_ref().map(|status| status.state.to_string());
        let Some(Progress { phase, starts, records, .. }) = self.progress else { return waiting() };
        match phase {
            Phase::Waiting => waiting(),
            // The daemon has settled on static tests alone, and waits for a record.
            Phase::Settled if records == 0 => waiting(),
            Phase::Searching => {
                let records = count(records, "record");
                Some(format!("searching for a robot that explains {records} (attempt {starts})"))
            }
            Phase::Refining => {
                Some(format!("refining the fit to {} (attempt {starts})", count(records, "record")))
            }
            Phase::Settled => Some(format!("search ended, {}", count(records, "record"))),
        }
    }

    /// Reason why no frames can arrive, if there is one.
    pub(crate) fn dead_bus(&self) -> Option<String> {
        let bus = self.bus.as_ref()?;
        let state = match bus.state {
            BusState::Up => return None,
            BusState::Down => "DOWN",
            BusState::Gone => "GONE",
            BusState::BusOff => "BUS-OFF",
        };
        let fault = bus.fault.as_ref().map_or_else(String::new, |fault| format!(": {fault}"));
        Some(format!("{} {state}{fault}", self.interface()))
    }

    /// State and bus in one line, the bus first if it is dead.
    pub(crate) fn summary(&self) -> String {
        let state = self.state().unwrap_or_else(|| "no news from the daemon".to_owned());
        match (self.bus_line(), self.dead_bus().is_some()) {
            (None, _) => state,
            (Some(bus), false) => format!("{state}; {bus}"),
            (Some(bus), true) => format!("{bus}; {state}"),
        }
    }

    /// The bus in one line: the frames that it delivers, the frames that are lost or not used, and its errors.
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
        if let (None, Some(fault)) = (dead, &bus.fault) {
            line += &format!("; {fault}");
        }
        Some(line)
    }

    fn interface(&self) -> &str {
        self.status.as_ref().map_or("bus", |status| status.interface.as_str())
    }
}

/// Errors that the bus has reported, the gravest first.
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

/// Returns whether the data determine a parameter of the joint.
pub(crate) fn has_identified(joint: &JointReport) -> bool {
    let mut verdicts = joint.stiffness_verdict.iter().chain(&joint.damping_verdict);
    verdicts.any(|verdict| *verdict == Verdict::Identified)
}
