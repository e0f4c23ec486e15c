//! Judges the joint angles: wrong frames, steps of a signal, angles that come too rarely or no more, and why a cut ended.

use flexid_core::spectrum::fft::MIN_SAMPLES;
use flexid_core::stream::{LEAP, STATIC, WITHIN_PART};
use flexid_pipeline::check::{Identifier, Survey};
use flexid_pipeline::config::Config;
use flexid_pipeline::intake::Feeding;
use flexid_pipeline::text::count;

use super::Severity::{Doubtful, Note};
use super::words::{enumerate, hz};
use super::{Finding, unless_all_is_lost};

pub(super) const ABOUT: &str = "joints";
/// Largest movement of a joint between two angles, rad (m): half of what it may move in a part of a record. Chosen: both halves of a part then have an
/// angle of their own, which shows whether the robot moves evenly.
const BETWEEN: f64 = 0.5 * WITHIN_PART;

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
    findings.extend(of_feeding(config, survey));
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
    let came = rate.map(|rate| format!("came at {} Hz and ", hz(rate))).unwrap_or_default();
    let verb = if survey.silent.len() == 1 { "has" } else { "have" };
    let finding =
        format!("{} {came}{verb} not come since {since_s:.1} s", enumerate(survey.silent.iter()));
    let mend = "let the controller send all joint angles until the end of each cut";
    Some(Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend))
}

/// Angles that are no measurement, and those that are wrong for a moment.
fn of_wrong(config: &Config, survey: &Survey, joint: usize, signal: &str) -> Vec<Finding> {
    let counts = &survey.counts;
    let (Some(angle), Some(none)) =
        (counts.stream.angles.get(joint), counts.implausible.no_measurement.get(joint))
    else {
        return Vec::new();
    };
    let came = survey.expected.iter().find(|one| one.signals.iter().any(|name| name == signal));
    let all = came.map_or(0, |one| one.traffic.frames);
    let finding = |(frames, value, what): (u64, f64, &str)| {
        let finding = format!(
            "{signal} reads {value:.4} {}, {what}, in {} (left out)",
            unit(config, joint),
            count(frames, "frame")
        );
        let mend = "see what the controller sends where an angle is not available";
        let severity = if frames == all { unless_all_is_lost(survey) } else { Note };
        Finding::new(severity, ABOUT, finding, mend)
    };
    [
        (none.frames, none.value, "the end of its signal"),
        (angle.wrong, angle.wrong_value, "away from its pose for a moment"),
    ]
    .into_iter()
    .filter(|(frames, ..)| *frames > 0)
    .map(finding)
    .collect()
}

/// Step of the angle of a joint, rad (m): that which the DBC file states, or the larger one that shows.
fn step(config: &Config, survey: &Survey, joint: usize) -> f64 {
    let shown = survey.counts.stream.angles.get(joint).map_or(0.0, |angle| angle.step);
    let stated = config.stream().angles.get(joint).map_or(0.0, |angle| angle.resolution);
    stated.max(shown)
}

/// A signal whose steps are larger than a pose may change.
fn of_steps(config: &Config, survey: &Survey, joint: usize, signal: &str) -> Option<Finding> {
    let step = step(config, survey, joint);
    (step > STATIC).then(|| {
        let finding = format!("{signal} steps by {step:.4} {}, which is taken for its resolution: each pose is as uncertain", unit(config, joint));
        let mend = "let the controller send more digits";
        Finding::new(Doubtful, ABOUT, finding, mend)
    })
}

/// Angles that come in steps that hide where a joint is between them, and those that come too rarely for the feed.
fn of_feeding(config: &Config, survey: &Survey) -> Vec<Finding> {
    let all = config.signals.joints.iter().zip(&survey.counts.feeding).enumerate();
    let all =
        || all.clone().filter_map(|(joint, (name, own))| Some((joint, name, own, own.step()?)));
    let are_held = |own: &Feeding| own.repeats() >= 1.0;
    let severity = unless_all_is_lost(survey);
    let mut findings = Vec::new();
    let held = || all().filter(|(_, _, own, step)| are_held(own) && *step > STATIC);
    if let Some((joint, _, own, step)) = held().max_by(|a, b| a.3.total_cmp(&b.3)) {
        let finding = format!(
            "{} in steps while the robot feeds, of {step:.4} {}, each held for {:.2} s: the poses of the path are as uncertain",
            comes(held().map(|(_, name, ..)| name)),
            unit(config, joint),
            own.every_s()
        );
        let mend = format!(
            "let the controller send more digits, for steps of {STATIC} {} or less, and each angle when it is new",
            unit(config, joint)
        );
        findings.push(Finding::new(severity, ABOUT, finding, mend));
    }
    // A straight line is off by an eighth of the second difference, which falls with the square of the time between two angles.
    let rarely =
        |own: &Feeding, step: f64| (step / BETWEEN).max((own.bend() / 8.0 / STATIC).sqrt());
    let rare = || all().filter(|(_, _, own, step)| !are_held(own) && rarely(own, *step) > 1.0);
    let needed_hz = |own: &Feeding, step: f64| rarely(own, step) / own.every_s();
    let worst = rare().max_by(|a, b| needed_hz(a.2, a.3).total_cmp(&needed_hz(b.2, b.3)));
    if let Some((joint, _, own, step)) = worst {
        let unit = unit(config, joint);
        let finding = format!(
            "{} too rarely for the feed, {} times a second: by {step:.4} {unit} from one angle to the next, in steps that differ by {:.4} {unit}",
            comes(rare().map(|(_, name, ..)| name)),
            hz(1.0 / own.every_s()),
            own.bend()
        );
        let often = needed_hz(own, step).ceil();
        let mend = format!("let the controller send each angle {often:.0} times a second or more");
        findings.push(Finding::new(severity, ABOUT, finding, mend));
    }
    findings
}

/// `q1 comes`, or `q1 and q2 come`.
fn comes<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<&String> = names.collect();
    let verb = if names.len() == 1 { "comes" } else { "come" };
    format!("{} {verb}", enumerate(names))
}

/// Joints that ended cuts before the length of a record since they moved faster than a feed, where there are fewer records than cuts.
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
            let unit = unit(config, joint);
            format!("{signal} moved by {:.4} {unit} or more {times}", angle.ended_by)
        })
        .collect();
    (!moved.is_empty()).then(|| {
        let finding = format!("{}, faster than a feed, while something was cut", enumerate(moved));
        let mend = format!(
            "feed by no more than {LEAP} rad (m) in {MIN_SAMPLES} samples, and let the controller send the angles {:.0} times a second or more",
            (config.rate_hz / MIN_SAMPLES as f64 * LEAP / BETWEEN).ceil()
        );
        Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::fixture::{config, good, identifier};

    fn said(config: &Config, survey: &Survey) -> String {
        judge(config, survey).iter().map(|own| format!("{}\n", own.finding)).collect()
    }

    /// The end of the signal, and a leap: both stand there.
    #[test]
    fn readings_that_are_none_and_wrong_ones_are_two_findings() {
        let (config, mut survey) = (config(), good());
        let none = &mut survey.counts.implausible.no_measurement[1];
        (none.frames, none.value) = (5, 2147.0);
        let angle = &mut survey.counts.stream.angles[1];
        (angle.wrong, angle.wrong_value) = (2, 0.3);
        let said = said(&config, &survey);
        assert!(
            said.contains("q2 reads 2147.0000 rad, the end of its signal, in 5 frames"),
            "{said}"
        );
        assert!(said.contains("q2 reads 0.3000 rad, away from its pose for a moment, in 2 frames"));
    }

    #[test]
    fn joints_that_end_records_are_named() {
        let (config, mut survey) = (config(), good());
        survey.records.clear();
        for (joint, times) in [(0, 1), (1, 3)] {
            let angle = &mut survey.counts.stream.angles[joint];
            (angle.ended, angle.ended_by) = (times, 0.045);
        }
        let said = said(&config, &survey);
        let expected = "q1 moved by 0.0450 rad or more once and q2 moved by 0.0450 rad or more 3 times, \
                        faster than a feed, while something was cut";
        assert!(said.contains(expected), "{said}");
    }

    #[test]
    fn a_slow_sender_has_its_rate() {
        let (config, mut survey) = (config(), good());
        survey.expected[4] = identifier(0x113, &["q3"], 3);
        survey.expected[4].traffic.seconds = 8.0;
        survey.silent = vec!["q3".into()];
        let said = said(&config, &survey);
        assert!(said.contains("q3 came at 0.25 Hz and has not come since"), "{said}");
    }
}
