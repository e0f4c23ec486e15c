//! Judges the identifiers that came, their lengths and their rates.

use flexid_pipeline::check::{Identifier, Survey};
use flexid_pipeline::config::Config;
use flexid_pipeline::signals::{Clocks, OtherAngle};
use flexid_pipeline::text::count;
use flexid_wire::misfits::{FrameId, Misfit, MisfitKind};
use flexid_wire::rate::RateUsed;

use super::Severity::{Doubtful, Note, Wrong};
use super::words::enumerate;
use super::{Finding, source, unless_all_is_lost};

const ABOUT: &str = "identifiers";
/// Subject of findings on rates.
pub(super) const RATE: &str = "rate";
/// Relative difference from the configured rate from which on a mean rate is wrong. The stream uses no rate that is farther off
/// (`StreamHealth::wrong_rate`). It measures smaller differences by its clock model, and [`Survey::rate`] has them.
const RATE_OFF: f64 = 0.1;

/// Judges the identifiers of a survey.
pub(super) fn judge(config: &Config, survey: &Survey) -> Vec<Finding> {
    let mut findings = of_presence(survey);
    findings.extend(of_form(survey));
    findings.extend(of_rates(config, survey));
    findings.extend(of_other_angles(config, &survey.expected, &survey.unexpected));
    let others: u64 = survey.unexpected.iter().map(|other| other.traffic.frames).sum();
    if others > 0 {
        let identifiers = match survey.unexpected.len() as u64 {
            1 => "1 other identifier".to_owned(),
            some => format!("{some} other identifiers"),
        };
        let mend = "right if other devices share the bus";
        let finding = format!("{identifiers} in {}", count(others, "frame"));
        findings.push(Finding::new(Note, ABOUT, finding, mend));
    }
    if survey.counts.bus_errors > 0 {
        let errors = count(survey.counts.bus_errors, "error");
        let mend = "check bit rate, wires and termination";
        findings.push(Finding::new(Doubtful, "bus", format!("the bus reported {errors}"), mend));
    }
    findings
}

/// Name of an identifier: `0x101 (Fx, Fy, Fz)`. Columns have their own names.
pub(super) fn name(Identifier { id, signals, .. }: &Identifier) -> String {
    let signals = signals.join(", ");
    id.map_or_else(|| signals.clone(), |id| format!("{id} ({signals})"))
}

/// The identifier in words, or that it is none.
pub(super) fn id(Identifier { id, .. }: &Identifier) -> String {
    id.map_or_else(|| "column".to_owned(), |id| id.to_string())
}

/// Identifiers that did not come on the bus of the log: those on another bus, and those on none.
fn of_presence(survey: &Survey) -> Vec<Finding> {
    let is_missing = |identifier: &&Identifier| identifier.traffic.frames == 0;
    let missing: Vec<_> = survey.expected.iter().filter(is_missing).collect();
    let are_columns = survey.expected.iter().all(|identifier| identifier.id.is_none());
    if missing.is_empty() {
        let all = survey.expected.len();
        let finding = match are_columns {
            true => "all columns are in the table".to_owned(),
            false => format!("all {all} expected identifiers are in the log"),
        };
        return vec![Finding::right(ABOUT, finding)];
    }
    if are_columns {
        let finding = format!("{} without a number", enumerate(missing.into_iter().map(name)));
        return vec![Finding::new(Wrong, ABOUT, finding, "export these columns, too")];
    }
    let elsewhere = |identifier: &Identifier| {
        let mut all = survey.elsewhere.iter();
        all.find(|(id, _)| Some(*id) == identifier.id)
            .map(|(_, bus)| format!("{} is on {bus} in this log", name(identifier)))
    };
    let moved: Vec<String> = missing.iter().filter_map(|missing| elsewhere(missing)).collect();
    let absent: Vec<String> = missing
        .iter()
        .filter(|missing| elsewhere(missing).is_none())
        .map(|identifier| name(identifier))
        .collect();
    let mut findings = Vec::new();
    if !absent.is_empty() {
        let verb = if absent.len() == 1 { "is" } else { "are" };
        let came = survey
            .unexpected
            .iter()
            .map(|other| format!("{} ({})", id(other), other.traffic.frames));
        let instead = match enumerate(came) {
            none if none.is_empty() => String::new(),
            came => format!("; unknown identifiers with their frames: {came}"),
        };
        let mend = format!("switch the sender on, or correct the identifier in [bus] dbc{instead}");
        let finding = format!("{} {verb} not in the log", enumerate(absent));
        findings.push(Finding::new(Wrong, ABOUT, finding, mend));
    }
    if !moved.is_empty() {
        let mend = "all sensors and joints must share a bus: connect them to one, or let a gateway pass the frames on";
        findings.push(Finding::new(Wrong, ABOUT, enumerate(moved), mend));
    }
    findings
}

/// Frames of another length or kind than in the DBC file.
fn of_form(survey: &Survey) -> Option<Finding> {
    let Misfit { id, kind, frames, others_fit } = survey.counts.misfit?;
    let (what, mend) = match kind {
        MisfitKind::Length { got, expected } => (
            format!("{id} has {got} bytes, and {expected} in [bus] dbc"),
            "correct the DBC file or the sender",
        ),
        // Other devices may send them, too.
        MisfitKind::Remote if others_fit => return None,
        MisfitKind::Remote => {
            (format!("{id} has remote requests only"), "see whether the sensor answers")
        }
        // They are counted with those that are lost.
        MisfitKind::Incomplete => return None,
    };
    let severity = if others_fit { unless_all_is_lost(survey) } else { Wrong };
    Some(Finding::new(severity, ABOUT, format!("{what}: {}", count(frames, "frame")), mend))
}

fn of_rates(config: &Config, survey: &Survey) -> Vec<Finding> {
    if source::is_without_time(survey) {
        return Vec::new();
    }
    let configured_hz = config.rate_hz;
    if let Some((rate, used)) = &survey.rate {
        let (measured_hz, expected_hz) = (f64::from(rate.measured_hz), rate.rate_hz);
        let (severity, use_of_it) = match used {
            RateUsed::Measured => (Doubtful, "the records have the measured rate".to_owned()),
            RateUsed::Configured => (
                Doubtful,
                "a sender was held up, and the records have the configured rate".to_owned(),
            ),
            RateUsed::TooFast => {
                (unless_all_is_lost(survey), "such records are refused".to_owned())
            }
            RateUsed::Uncertain { std_hz } => {
                (Wrong, format!("± {std_hz:.2} Hz is too uncertain to be used"))
            }
        };
        let finding = format!(
            "samples come at {measured_hz:.2} Hz, and rate_hz is {expected_hz}: {use_of_it}"
        );
        let mend = "set [measurement] rate_hz, or the sensors, to the right rate";
        return vec![Finding::new(severity, RATE, finding, mend)];
    }
    let sampled = survey.expected.iter().filter(|identifier| identifier.is_sampled);
    let rates: Vec<(&Identifier, f64)> = sampled
        .filter_map(|identifier| Some((identifier, identifier.traffic.rate_hz()?)))
        .collect();
    let is_off = |rate: f64| (rate / configured_hz - 1.0).abs() > RATE_OFF;
    // Of sensors with clocks of their own the slower one has the configured rate.
    let has_own = matches!(config.signals.clocks, Clocks::Own(_));
    let slowest_hz = rates.iter().map(|(_, rate)| *rate).fold(f64::INFINITY, f64::min);
    let is_faster = |rate: f64| has_own && rate > (1.0 + RATE_OFF) * slowest_hz;
    let off = rates.iter().filter(|(_, rate)| is_off(*rate) && !is_faster(*rate));
    let mut findings: Vec<Finding> = off
        .map(|(identifier, rate)| {
            let finding = format!(
                "{} comes at {rate:.0} Hz, and rate_hz is {configured_hz}",
                name(identifier)
            );
            let mend = "set [measurement] rate_hz, or the sensor, to the right rate";
            Finding::new(unless_all_is_lost(survey), RATE, finding, mend)
        })
        .collect();
    if findings.is_empty() && !rates.is_empty() {
        let mut texts: Vec<String> = rates.iter().map(|(_, rate)| format!("{rate:.1}")).collect();
        texts.dedup();
        let rates = enumerate(texts);
        let finding =
            format!("force and acceleration come at {rates} Hz, and rate_hz is {configured_hz}");
        findings.push(Finding::right(RATE, finding));
    }
    findings
}

/// Joint angles that the configuration does not name: the log is of a robot of more joints. `expected` are the identifiers of the
/// configuration, `unexpected` the others that came.
pub(crate) fn of_other_angles(
    config: &Config,
    expected: &[Identifier],
    unexpected: &[Identifier],
) -> Option<Finding> {
    let came = |other: &&OtherAngle| {
        let mut all = expected.iter().chain(unexpected);
        all.any(|own| own.id == Some(other.id) && own.traffic.frames > 0)
    };
    let named: Vec<&OtherAngle> = config.signals.other_angles.iter().filter(came).collect();
    let finding = if named.is_empty() {
        let others = beyond_the_joints(expected, unexpected);
        (!others.is_empty()).then(|| {
            let others = enumerate(others.into_iter().map(id));
            format!("next to the identifiers of the joint angles, and at their rate, [bus] dbc lacks {others}")
        })?
    } else {
        let verb = if named.len() == 1 { "is" } else { "are" };
        let named = enumerate(named.iter().map(|other| &other.name));
        format!("{named} {verb} in the log, and [signals] joints does not name {named}")
    };
    let mend = "name the log of this robot; for one of more joints import all of them, and name their angles";
    let joints = config.signals.joints.len();
    let finding = format!("{finding}: is the log of a robot of more than {joints} joints?");
    Some(Finding::new(Doubtful, ABOUT, finding, mend))
}

/// Identifiers without a signal that go on where those of the joint angles end, at the same rate.
fn beyond_the_joints<'a>(
    expected: &[Identifier],
    unexpected: &'a [Identifier],
) -> Vec<&'a Identifier> {
    let joints = expected.iter().filter(|own| !own.is_sampled);
    let Some(last) = joints.max_by_key(|own| own.id) else { return Vec::new() };
    let (Some(last_id), Some(rate_hz)) = (last.id, last.traffic.rate_hz()) else {
        return Vec::new();
    };
    let has_rate = |id: FrameId| {
        let own = unexpected.iter().find(|own| own.id == Some(id))?;
        let is_equal = (own.traffic.rate_hz()? / rate_hz - 1.0).abs() <= RATE_OFF;
        is_equal.then_some(own)
    };
    (1..).map_while(|step| has_rate(after(last_id, step))).collect()
}

/// The identifier so many places after another. The highest have none.
fn after(id: FrameId, step: u16) -> FrameId {
    match id {
        FrameId::Standard(id) => FrameId::Standard(id.saturating_add(step)),
        FrameId::Extended(id) => FrameId::Extended(id.saturating_add(step.into())),
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::rate::WrongRate;
    use flexid_wire::text::clipped;

    use super::*;
    use crate::check::Severity;
    use crate::check::fixture::{config, empty, good, identifier, other_angle};

    fn gravest(survey: &Survey) -> Finding {
        judge(&config(), survey).into_iter().min_by_key(|finding| finding.severity).unwrap()
    }

    #[test]
    fn missing_identifiers_are_named_with_what_came_instead() {
        let mut survey = good();
        assert_eq!(gravest(&survey).severity, Severity::Right);
        survey.expected[4].traffic = Default::default();
        survey.unexpected = vec![identifier(0x7F3, &[], 41)];
        let missing = gravest(&survey);
        assert_eq!(missing.severity, Wrong);
        assert_eq!(missing.finding, "0x113 (q3) is not in the log");
        assert!(missing.mend.ends_with("0x7F3 (41)"), "{}", missing.mend);
    }

    /// A sensor on another bus does not hide a joint that is nowhere.
    #[test]
    fn what_is_on_another_bus_and_what_is_missing_are_two_findings() {
        let mut survey = good();
        survey.expected[1].traffic = Default::default();
        survey.expected[4].traffic = Default::default();
        survey.elsewhere = vec![(FrameId::Standard(0x102), "can1".into())];
        let findings = judge(&config(), &survey);
        let wrong = findings.iter().filter(|own| own.severity == Wrong).map(|own| &*own.finding);
        let expected =
            ["0x113 (q3) is not in the log", "0x102 (ax, ay, az) is on can1 in this log"];
        assert_eq!(wrong.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn frames_of_a_wrong_length_prevent_identification_if_no_other_fits() {
        let mut survey = good();
        for (others_fit, severity) in [(true, Doubtful), (false, Wrong)] {
            let (id, kind) = (FrameId::Standard(0x101), MisfitKind::Length { got: 7, expected: 8 });
            survey.counts.misfit = Some(Misfit { id, kind, frames: 9, others_fit });
            let finding = gravest(&survey);
            assert_eq!(finding.severity, severity);
            assert_eq!(finding.finding, "0x101 has 7 bytes, and 8 in [bus] dbc: 9 frames");
        }
    }

    #[test]
    fn joint_angles_without_a_name_are_doubtful() {
        let (mut survey, mut config) = (good(), config());
        let said = |config: &Config, survey: &Survey| {
            let finding = of_other_angles(config, &survey.expected, &survey.unexpected);
            finding.map(|own| own.finding).unwrap_or_default()
        };
        config.signals.other_angles = [("q4", 0x114), ("q5", 0x115)].map(other_angle).into();
        assert_eq!(said(&config, &survey), "");
        // In a message of their own, and in that of another joint.
        config.signals.other_angles.push(other_angle(("q6", 0x113)));
        survey.unexpected = vec![identifier(0x114, &[], 41)];
        let named = "q4 and q6 are in the log, and [signals] joints does not name q4 and q6: \
            is the log of a robot of more than 3 joints?";
        assert_eq!(said(&config, &survey), named);

        config.signals.other_angles.clear();
        let last = survey.expected[4].traffic;
        survey.unexpected = [0x116, 0x114, 0x115].map(|id| identifier(id, &[], 41)).into();
        survey.unexpected.iter_mut().for_each(|own| own.traffic = last);
        assert!(said(&config, &survey).contains(" lacks 0x114, 0x115 and 0x116: is the log"));
        survey.unexpected[1].traffic.seconds *= 1.2;
        assert_eq!(said(&config, &survey), "");
    }

    #[test]
    fn a_rate_that_is_off_is_doubtful_while_there_are_records() {
        let mut survey = good();
        let mut config = config();
        let rate = |config: &Config, survey: &Survey| of_rates(config, survey)[0].clone();
        assert_eq!(rate(&config, &survey).severity, Severity::Right);
        config.rate_hz = 1500.0;
        assert_eq!(rate(&config, &survey).severity, Doubtful);
        survey.records.clear();
        let wrong = rate(&config, &survey);
        assert_eq!(wrong.severity, Wrong);
        assert_eq!(wrong.finding, "0x101 (Fx, Fy, Fz) comes at 2000 Hz, and rate_hz is 1500");
        let known = WrongRate { file: clipped("edge.toml"), rate_hz: 2000.0, measured_hz: 1996.5 };
        survey.rate = Some((known, RateUsed::Uncertain { std_hz: 1.0 }));
        assert_eq!(rate(&config, &survey).severity, Wrong);
        assert!(of_rates(&config, &empty()).is_empty());
    }

    #[test]
    fn a_faster_sensor_with_a_clock_of_its_own_has_a_right_rate() {
        let (mut survey, mut config) = (good(), config());
        survey.expected[1].traffic.seconds *= 0.2;
        assert_eq!(of_rates(&config, &survey)[0].severity, Doubtful);
        config.signals.clocks = Clocks::Own([None; 2]);
        let right = of_rates(&config, &survey)[0].clone();
        assert_eq!(right.severity, Severity::Right);
        assert!(right.finding.contains("at 2000.0 and 10000.0 Hz"), "{}", right.finding);
        survey.expected[0].traffic.seconds *= 2.0;
        assert_eq!(of_rates(&config, &survey)[0].severity, Doubtful);
    }
}
