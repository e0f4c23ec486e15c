//! Judges the joint angles: wrong frames, steps of a signal, angles that come no more, and why a cut ended.

use flexid_core::stream::STATIC;
use flexid_pipeline::check::{Identifier, Survey};
use flexid_pipeline::config::Config;
use flexid_pipeline::text::count;

use super::Severity::{Doubtful, Note};
use super::words::enumerate;
use super::{Finding, unless_all_is_lost};

pub(super) const ABOUT: &str = "joints";

/// Judges the joint angles of a survey.
pub(super) fn judge(config: &Config, survey: &Survey) -> Vec<Finding> {
    let silent = of_silence(survey);
    let mut findings: Vec<Finding> = silent.iter().cloned().collect();
    let without = survey.counts.stream.without_pose;
    if without > 0 {
        let mend = "let the controller send all joint angles until the end of each cut";
        let finding = format!("{} without joint angles: no records of them", count(without, "cut"));
        findings.push(Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend));
    }
    for (joint, signal) in config.signals.joints.iter().enumerate() {
        findings.extend(of_wrong(config, survey, joint, signal));
        findings.extend(of_steps(config, survey, joint, signal));
    }
    findings.extend(of_ends(config, survey));
    findings
}

/// Returns whether readings of joints were left out, since they are wrong.
pub(super) fn has_wrong(survey: &Survey) -> bool {
    let counts = &survey.counts;
    counts.stream.angles.iter().any(|angle| angle.wrong > 0)
        || counts.implausible.no_measurement.iter().any(|none| none.frames > 0)
}

/// Unit of the readings of a joint.
fn unit(config: &Config, joint: usize) -> &'static str {
    let turns = config.stream().angles.get(joint).is_none_or(|angle| angle.turns);
    if turns { "rad" } else { "m" }
}

/// Joints whose angles came in a cycle, and not to the end.
fn of_silence(survey: &Survey) -> Option<Finding> {
    let is_silent = |identifier: &&Identifier| {
        identifier.signals.iter().any(|signal| survey.silent.contains(signal))
    };
    let silent: Vec<&Identifier> = survey.expected.iter().filter(is_silent).collect();
    let newest_s = |one: &Identifier| one.traffic.newest_s - survey.began_s;
    let since_s = silent.iter().map(|one| newest_s(one)).reduce(f64::min)?;
    let rate = silent.iter().find_map(|one| one.traffic.rate_hz());
    let came = rate.map(|rate| format!("came at {rate:.0} Hz and ")).unwrap_or_default();
    let verb = if survey.silent.len() == 1 { "has" } else { "have" };
    let finding =
        format!("{} {came}{verb} not come since {since_s:.1} s", enumerate(survey.silent.iter()));
    let mend = "let the controller send all joint angles until the end of each cut";
    Some(Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend))
}

/// Angles that are wrong for a moment, and those that are no measurement.
fn of_wrong(config: &Config, survey: &Survey, joint: usize, signal: &str) -> Option<Finding> {
    let angle = survey.counts.stream.angles.get(joint)?;
    let none = survey.counts.implausible.no_measurement.get(joint)?;
    let came = survey.expected.iter().find(|one| one.signals.iter().any(|name| name == signal));
    let all = came.map_or(0, |one| one.traffic.frames);
    let (frames, value, what) = match (none.frames, angle.wrong) {
        (0, 0) => return None,
        (0, wrong) => (wrong, angle.wrong_value, "away from its pose for a moment"),
        (frames, _) => (frames, none.value, "the end of its signal"),
    };
    let finding = format!(
        "{signal} reads {value:.4} {}, {what}, in {} (left out)",
        unit(config, joint),
        count(frames, "frame")
    );
    let mend = "see what the controller sends where an angle is not available";
    let severity = if frames == all { unless_all_is_lost(survey) } else { Note };
    Some(Finding::new(severity, ABOUT, finding, mend))
}

/// A signal whose steps are larger than a pose may change.
fn of_steps(config: &Config, survey: &Survey, joint: usize, signal: &str) -> Option<Finding> {
    let shown = survey.counts.stream.angles.get(joint)?.step;
    let stated = config.stream().angles.get(joint)?.resolution;
    let step = stated.max(shown);
    (step > STATIC).then(|| {
        let finding = format!("{signal} steps by {step:.4} {}, which is taken for its resolution: each pose is as uncertain", unit(config, joint));
        let mend = "let the controller send more digits";
        Finding::new(Doubtful, ABOUT, finding, mend)
    })
}

/// Joints that ended cuts before the length of a record, where there are fewer records than cuts.
fn of_ends(config: &Config, survey: &Survey) -> Option<Finding> {
    let full_s = config.record_samples as f64 / config.rate_hz;
    let is_full = |seconds: f64| seconds > 0.75 * full_s;
    if !survey.records.is_empty() && survey.usable().all(|record| is_full(record.seconds)) {
        return None;
    }
    let angles = survey.counts.stream.angles.iter();
    let moved = config
        .signals
        .joints
        .iter()
        .zip(angles)
        .enumerate()
        .filter(|(_, (_, angle))| angle.ended > 0);
    let moved: Vec<String> = moved
        .map(|(joint, (signal, angle))| {
            let times =
                if angle.ended == 1 { "once".to_owned() } else { format!("{} times", angle.ended) };
            format!(
                "{signal} moved by {:.4} {} or more {times}",
                angle.ended_by,
                unit(config, joint)
            )
        })
        .collect();
    (!moved.is_empty()).then(|| {
        let finding =
            format!("{} while something was cut: {STATIC} ends a record", enumerate(moved));
        let mend = "hold the joints while you cut, or let the controller send steadier angles";
        Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend)
    })
}
