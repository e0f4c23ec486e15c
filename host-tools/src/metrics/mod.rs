//! The numbers of a daemon in the text format of Prometheus. node_exporter takes them from a file in its folder, so that the daemon
//! needs no port.
//!
//! It is the text format and not OpenMetrics, whose counters node_exporter would take for numbers without a type.

mod families;

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Result;
use flexid_console::output::{self, Output};
use flexid_pipeline::input::BadInput;
use flexid_wire::messages::{BusErrors, BusHealth, BusState, Status};
use flexid_wire::report::{Acceptance, Report};

use crate::show::table::DOF_NAMES;
use crate::show::view::View;
use families::Families;

/// Shortest interval between two versions of the file: that at which Prometheus asks in the example of its manual. Flash memory wears out.
const INTERVAL: Duration = Duration::from_secs(15);

/// A file for node_exporter, if there is to be one.
#[derive(Debug)]
pub(crate) struct Metrics<'a> {
    file: Option<&'a Path>,
    written: Option<Instant>,
}

impl<'a> Metrics<'a> {
    /// Checks that `file` can be written.
    pub(crate) fn new(file: Option<&'a Path>) -> Result<Self, BadInput> {
        output::is_not_stdout(file)?;
        file.map(Output::create).transpose()?;
        Ok(Self { file, written: None })
    }

    /// Writes what the view shows, if the daemon has told its state and the last version is old enough.
    pub(crate) fn update(&mut self, view: &View) -> Result<()> {
        if self.written.is_some_and(|written| written.elapsed() < INTERVAL) {
            return Ok(());
        }
        self.write(view)
    }

    /// Writes what the view shows, if the daemon has told its state.
    pub(crate) fn write(&mut self, view: &View) -> Result<()> {
        let (Some(status), Some(bus)) = (&view.status, &view.bus) else { return Ok(()) };
        self.written = Some(Instant::now());
        let report = view.finding.as_ref().map(|finding| &finding.report);
        self.replace(|| text(status, bus, report))
    }

    /// Writes that there is no daemon.
    pub(crate) fn write_lost(&self) -> Result<()> {
        self.replace(|| up(false).text())
    }

    fn replace(&self, text: impl FnOnce() -> String) -> Result<()> {
        self.file.map_or(Ok(()), |file| Output::create(file)?.finish(&text()))
    }
}

fn up(is_up: bool) -> Families {
    let mut families = Families::default();
    families.gauge("up", "1 if flexid-edge answers.", f64::from(u8::from(is_up)));
    families
}

fn text(status: &Status, bus: &BusHealth, report: Option<&Report>) -> String {
    let mut families = up(true);
    of_status(&mut families, status);
    of_bus(&mut families, bus);
    families.counters(
        "bus_errors_total",
        "Error frames of the bus.",
        "class",
        classes(&bus.errors),
    );
    if let Some(report) = report {
        of_report(&mut families, report);
    }
    families.text()
}

fn of_status(families: &mut Families, status: &Status) {
    let Status { uptime_s, model, interface, state, newest_record_s, .. } = status;
    let names = [("model", model.as_str()), ("interface", interface.as_str())];
    families.gauges("info", "1 for the robot and the interface.", [(&names[..], 1.0)]);
    families.gauge("uptime_seconds", "Time since the start of flexid-edge.", *uptime_s);
    let well = f64::from(u8::from(state.is_in_order()));
    families.gauge("in_order", "1 if nothing keeps frames from becoming records.", well);
    if let Some(newest_s) = newest_record_s {
        let help = "Time since the newest record.";
        families.gauge("newest_record_age_seconds", help, uptime_s - newest_s);
    }
}

fn of_bus(families: &mut Families, bus: &BusHealth) {
    let is_up = f64::from(u8::from(bus.state == BusState::Up));
    families.gauge("link_up", "1 if the CAN interface is up.", is_up);
    families.gauge("frames_per_second", "Rate of frames of all kinds.", bus.frames_per_second);
    for (name, help, number) in [
        ("frames_total", "Force and acceleration frames taken.", bus.frames),
        ("frames_lost_total", "Frames missing by their counters.", bus.frames_lost),
        ("samples_bridged_total", "Missing samples that were bridged.", bus.bridged),
        ("sensor_restarts_total", "Counters that disagreed with the time.", bus.restarts),
        ("frames_repeated_total", "Frames whose counter had been seen.", bus.repeated),
        ("frames_wrong_length_total", "Frames of a wrong length.", bus.frames_wrong_length),
        ("frames_unknown_total", "Frames of no known signal.", bus.frames_unknown),
        ("frames_not_data_total", "Remote requests, and CAN FD frames.", bus.frames_not_data),
        ("frames_clipped_total", "Frames at the limit of a signal.", bus.frames_clipped),
        ("kernel_dropped_total", "Frames that the kernel dropped.", bus.kernel_dropped),
        ("samples_discarded_total", "Samples in no record.", bus.samples_discarded),
        ("readings_refused_total", "Readings that were rejected.", bus.refused),
        ("records_wrong_rate_total", "Records of a wrong rate.", bus.wrong_rate),
        ("records_doubtful_rate_total", "Records of a doubtful rate.", bus.doubtful_rate),
    ] {
        families.counter(name, help, number);
    }
}

fn classes(errors: &BusErrors) -> [(&'static str, u64); 10] {
    [
        ("bus_off", errors.bus_off),
        ("restarted", errors.restarted),
        ("controller_passive", errors.controller_passive),
        ("controller_warning", errors.controller_warning),
        ("controller_overflow", errors.controller_overflow),
        ("protocol", errors.protocol),
        ("no_acknowledgement", errors.no_acknowledgement),
        ("transceiver", errors.transceiver),
        ("lost_arbitration", errors.lost_arbitration),
        ("transmit_timeout", errors.transmit_timeout),
    ]
}

fn of_report(families: &mut Families, Report { joints, fit, .. }: &Report) {
    families.gauge("records", "Records that the numbers rest on.", fit.records as f64);
    families.gauge("consistency", "Chi square per degree of freedom.", fit.consistency);
    let verdicts = [
        ("consistent", Acceptance::Consistent),
        ("model_suspect", Acceptance::ModelSuspect),
        ("unsettled", Acceptance::Unsettled),
    ];
    let verdicts = verdicts.map(|(name, own)| ([("acceptance", name)], own == fit.acceptance));
    let verdicts = verdicts.each_ref().map(|(label, is)| (&label[..], f64::from(u8::from(*is))));
    families.gauges("acceptance", "1 for the verdict on the fit.", verdicts);
    // What the cuts do not show has no standard deviation, and no number here.
    let mut known = Vec::new();
    for joint in joints {
        let kinds = [
            ("stiffness", &joint.stiffness, &joint.stiffness_std),
            ("damping", &joint.damping, &joint.damping_std),
        ];
        for (kind, values, deviations) in kinds {
            for ((axis, value), deviation) in DOF_NAMES.iter().zip(values).zip(deviations) {
                let labels = [("joint", joint.name.as_str()), ("axis", *axis), ("kind", kind)];
                known.extend(deviation.map(|deviation| (labels, *value, deviation)));
            }
        }
    }
    let unit = "N/m, Nm/rad, Ns/m or Nms/rad.";
    let values = known.iter().map(|(labels, value, _)| (&labels[..], *value));
    families.gauges("estimate", &format!("Identified parameter, {unit}"), values);
    let deviations = known.iter().map(|(labels, _, deviation)| (&labels[..], *deviation));
    families.gauges("estimate_std", &format!("Its standard deviation, {unit}"), deviations);
}
