//! Judges configuration, DBC file and logs before the identification: what is right, what is wrong, and what to do.
//!
//! | module        | judges                                                        |
//! | ------------- | ------------------------------------------------------------- |
//! | `setup`       | the configuration and its DBC file                            |
//! | `identifiers` | identifiers and rates                                         |
//! | `clocks`      | clocks that the sensors have of their own                      |
//! | `counters`    | lost frames, and the counters of the sensors                  |
//! | `joints`      | joint angles that are wrong, coarse, or come no more          |
//! | `units`       | units of angles, acceleration and force                       |
//! | `sensors`     | axes that are swapped, stuck or clipped; spikes               |
//! | `rest`        | rest before each cut                                          |
//! | `excitation`  | where the force stands clear of its noise                     |
//! | `blows`       | blows of a hammer that are cut off, or come twice             |
//! | `statics`     | the signs of static tests                                     |
//! | `paths`       | paths along which the robot feeds, and how much of them counts |
//! | `receptances` | what modal tests hold, and what they lack                     |
//! | `records`     | number, poses and repetitions of the records                  |
//! | `shown`       | what the records show of the parameters                       |
//! | `source`      | logs that are no whole logs of `candump -L`                   |
//! | `table`       | the findings as a table for people, `json` for scripts        |
//!
//! [`flexid_pipeline::check`] surveys the content of frames, with the thresholds of the daemon. The thresholds here stand at the top of
//! their file, each with its source.

mod blows;
mod clocks;
mod counters;
mod excitation;
#[cfg(test)]
mod fixture;
mod identifiers;
mod joints;
pub(crate) mod json;
mod paths;
mod receptances;
mod records;
mod rest;
mod sensors;
mod setup;
mod shown;
mod source;
mod statics;
pub(crate) mod table;
mod units;
mod words;

pub(crate) use identifiers::of_other_angles;

use std::fmt;

use flexid_pipeline::check::Survey;
use flexid_pipeline::config::Config;
use flexid_pipeline::text::count;
use serde::Serialize;

/// How grave a finding is, the gravest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Severity {
    /// It prevents identification, or makes every number wrong.
    Wrong,
    /// It costs accuracy, or a part of the data.
    Doubtful,
    /// It is to be known.
    Note,
    /// It is right.
    Right,
}

/// A finding.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Finding {
    pub(crate) severity: Severity,
    /// Subject, for example `units`.
    pub(crate) about: &'static str,
    /// The finding in words.
    pub(crate) finding: String,
    /// Mend. Empty where nothing is to be done.
    pub(crate) mend: String,
}

/// In one line: what was found, and what to do.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { finding, mend, .. } = self;
        if mend.is_empty() { f.write_str(finding) } else { write!(f, "{finding} ({mend})") }
    }
}

impl Finding {
    fn new(
        severity: Severity,
        about: &'static str,
        finding: impl Into<String>,
        mend: impl Into<String>,
    ) -> Self {
        Self { severity, about, finding: finding.into(), mend: mend.into() }
    }

    fn right(about: &'static str, finding: impl Into<String>) -> Self {
        Self::new(Severity::Right, about, finding, "")
    }
}

/// Severity of a fault that costs a part of the records: nothing can be identified if no record is left.
fn unless_all_is_lost(survey: &Survey) -> Severity {
    if survey.usable().next().is_some() { Severity::Doubtful } else { Severity::Wrong }
}

/// Judges a cut that is simulated, the gravest first: its path, its excitation, and why it has no record that a fit would take, if it has none.
pub(crate) fn of_cut(config: &Config, survey: &Survey) -> Vec<Finding> {
    let mut findings = joints::judge(config, survey);
    findings.extend(excitation::judge(survey));
    findings.extend(paths::judge(config, survey));
    if survey.usable().next().is_none() {
        let is_explained = findings.iter().any(|finding| finding.severity == Severity::Wrong);
        findings.extend(records::judge(config, survey, is_explained));
    }
    findings.sort_by_key(|finding| finding.severity);
    findings
}

/// The paths of a survey in words; `None` without any.
pub(crate) fn path(survey: &Survey) -> Option<String> {
    let all: Vec<String> = paths::paths(survey).iter().map(paths::Path::text).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// The findings on a configuration and its logs.
pub(crate) struct Check<'a> {
    config: &'a Config,
    /// Contents of the logs. `None` without a log.
    survey: Option<&'a Survey>,
    /// Perfect accuracies first, since the intervals of all results depend on them; then the gravest first, and of equally grave ones the causes before what they bring about.
    pub(crate) findings: Vec<Finding>,
}

impl<'a> Check<'a> {
    /// Judges a configuration, and what its logs hold.
    pub(crate) fn new(config: &'a Config, survey: Option<&'a Survey>) -> Self {
        let mut findings = Vec::new();
        if let Some(survey) = survey {
            findings.extend(source::judge(survey));
            findings.extend(identifiers::judge(config, survey));
            findings.extend(clocks::judge(survey));
            findings.extend(counters::judge(survey));
            findings.extend(units::judge(config, survey));
            findings.extend(joints::judge(config, survey));
            findings.extend(sensors::judge(survey));
            findings.extend(rest::judge(survey));
            findings.extend(excitation::judge(survey));
            findings.extend(blows::judge(survey));
            let is_explained = findings.iter().any(|finding| finding.severity == Severity::Wrong);
            findings.extend(records::judge(config, survey, is_explained));
            findings.extend(paths::judge(config, survey));
            findings.extend(shown::judge(config, survey));
        }
        findings.extend(setup::judge(config));
        findings.extend(statics::judge(config));
        findings.extend(receptances::judge(config));
        findings.sort_by_key(|finding| finding.severity);
        findings.splice(0..0, setup::of_perfect_accuracies(config));
        Self { config, survey, findings }
    }

    /// Returns whether nothing prevents identification, or a recording if there is no log.
    pub(crate) fn is_ready(&self) -> bool {
        self.of(Severity::Wrong) == 0
    }

    /// Returns the verdict in one line.
    pub(crate) fn verdict(&self) -> String {
        if let Some(first) = self.findings.iter().find(|first| first.severity == Severity::Wrong) {
            let more = match self.of(Severity::Wrong) - 1 {
                0 => String::new(),
                more => format!(" (and {more} more)"),
            };
            return format!("not ready: {}{more}", first.finding);
        }
        let doubts = match self.of(Severity::Doubtful) {
            0 => String::new(),
            doubts => format!("; {}", count(doubts, "doubt")),
        };
        let ready = match self.survey {
            Some(survey) => {
                format!("ready to identify: {}", records::text(survey))
            }
            None if setup::has_signals(self.config) => {
                let joints = self.config.signals.joints.len() as u64;
                let joints = count(joints, "joint");
                match self.config.signals.identifiers().len() as u64 {
                    0 => format!("ready to read tables: {joints}"),
                    some => format!("ready to record: {joints} and {}", count(some, "identifier")),
                }
            }
            None if !self.config.receptances.is_empty() => {
                let own = receptances::counted(self.config);
                format!("ready to identify: {own}")
            }
            None => {
                let tests = self.config.statics.tests.len() as u64;
                format!("ready to identify: {}", count(tests, "static test"))
            }
        };
        ready + &doubts
    }

    /// The findings that are known before the fit, and are likely to spoil it. Nothing where the logs give no record, which has an error of its own.
    ///
    /// | findings | about |
    /// | -------- | ----- |
    /// | wrong    | configuration and model, static tests, readings, units, logs, lost frames, rates |
    /// | doubtful | configuration and model, readings, units |
    /// | notes    | friction under blows |
    pub(crate) fn at_once(&self) -> impl Iterator<Item = &Finding> {
        let has_record = self.survey.is_none_or(|survey| survey.usable().next().is_some());
        self.findings.iter().filter(move |finding| {
            let is_of_setup = setup::ABOUTS.contains(&finding.about);
            let is_of_readings =
                [sensors::ABOUT, units::ABOUT, joints::ABOUT].contains(&finding.about);
            let is_of_time =
                [source::LINES, counters::ABOUT, identifiers::RATE].contains(&finding.about);
            has_record
                && match finding.severity {
                    Severity::Wrong => {
                        is_of_setup
                            || finding.about == statics::ABOUT
                            || finding.about == receptances::ABOUT
                            || is_of_readings
                            || is_of_time
                    }
                    Severity::Doubtful => is_of_setup || is_of_readings,
                    Severity::Note => finding.about == blows::FRICTION,
                    Severity::Right => false,
                }
        })
    }

    fn of(&self, severity: Severity) -> u64 {
        self.findings.iter().filter(|finding| finding.severity == severity).count() as u64
    }
}
