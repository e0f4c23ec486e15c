//! An identification in one line of a table, for many recordings: a header, and the line of one run, whether it gave a result or an error.

use std::path::PathBuf;

use anyhow::{Error, Result};
use flexid_console::exit;
use flexid_console::output::Output;
use flexid_edge::console::complain;
use flexid_pipeline::config::Config;
use flexid_pipeline::names::DOF_NAMES;
use flexid_wire::report::{Acceptance, JointReport, Report, Verdict};

/// The columns before those of the parameters.
const COLUMNS: [&str; 9] = [
    "recording",
    "exit_status",
    "reason",
    "acceptance",
    "chi2_per_dof",
    "records",
    "identified",
    "weak",
    "not_observable",
];

/// The summary of a run, which is written when it ends.
#[derive(Debug)]
pub(crate) struct Summary {
    output: Output,
    recordings: String,
    /// Joints of the model, base first.
    joints: Vec<String>,
    /// Result, if there is one.
    report: Option<Report>,
}

impl Summary {
    /// The summary of a run over these recordings, without a result so far.
    pub(crate) fn new(output: Output, config: &Config, recordings: &[PathBuf]) -> Self {
        let names: Vec<_> = recordings.iter().map(|file| file.to_string_lossy()).collect();
        let joints = config.model.joints.iter().map(|joint| joint.name.clone()).collect();
        Self { output, recordings: names.join(" "), joints, report: None }
    }

    /// Takes note of the result.
    pub(crate) fn note(&mut self, report: &Report) {
        self.report = Some(report.clone());
    }

    /// Writes the file, whole or not at all, as the run has ended.
    ///
    /// # Errors
    /// That of the run; or the file cannot be written.
    pub(crate) fn finish(self, end: Result<()>) -> Result<()> {
        let written = csv(&self, end.as_ref().err()).and_then(|text| self.output.finish(&text));
        match (end, written) {
            (Ok(()), written) => written,
            (Err(error), written) => {
                if let Err(lost) = written {
                    complain(&format!("warning: {lost:#}"));
                }
                Err(error)
            }
        }
    }
}

/// The table: a header, and a line. A parameter that is not observable has neither value nor standard deviation.
fn csv(summary: &Summary, error: Option<&Error>) -> Result<String> {
    let kinds = ["stiffness", "damping"];
    let Summary { recordings, joints, report, .. } = summary;
    let mut header: Vec<String> = COLUMNS.map(str::to_owned).to_vec();
    for joint in joints {
        for kind in kinds {
            for dof in DOF_NAMES {
                let name = format!("{joint} {dof} {kind}");
                header.extend([name.clone(), name + " std"]);
            }
        }
    }
    let columns = header.len();
    let status = error.map_or(0, exit::status);
    let reason = error.filter(|_| status > 0).map(|error| format!("{error:#}"));
    let mut line = vec![recordings.clone(), status.to_string(), reason.unwrap_or_default()];
    if let Some(Report { joints, fit, .. }) = report {
        let verdicts = || {
            let of = |own: &JointReport| [own.stiffness_verdict, own.damping_verdict];
            joints.iter().flat_map(of).flatten()
        };
        let number = |own: Verdict| verdicts().filter(|verdict| *verdict == own).count();
        let acceptance = match fit.acceptance {
            Acceptance::Consistent => "consistent",
            Acceptance::ModelSuspect => "model_suspect",
            Acceptance::Unsettled => "unsettled",
        };
        line.extend([acceptance.to_owned(), fit.consistency.to_string(), fit.records.to_string()]);
        line.extend(
            [Verdict::Identified, Verdict::Weak, Verdict::NotObservable]
                .map(|own| number(own).to_string()),
        );
        for own in joints {
            for (values, deviations, verdicts) in [
                (own.stiffness, own.stiffness_std, own.stiffness_verdict),
                (own.damping, own.damping_std, own.damping_verdict),
            ] {
                for ((value, deviation), verdict) in values.iter().zip(deviations).zip(verdicts) {
                    let value = (verdict != Verdict::NotObservable).then(|| value.to_string());
                    line.extend(
                        [value, deviation.map(|own| own.to_string())]
                            .map(Option::unwrap_or_default),
                    );
                }
            }
        }
    }
    line.resize(columns, String::new());
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&header)?;
    writer.write_record(&line)?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}
