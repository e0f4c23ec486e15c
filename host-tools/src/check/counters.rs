//! Judges the counters of force and acceleration: lost frames, restarts, counters that do not count.

use flexid_pipeline::check::{Identifier, Survey};
use flexid_pipeline::text::count;
use flexid_wire::state::Obstacle;
use flexid_wire::words::Percent;

use super::Severity::{Doubtful, Note};
use super::{Finding, source, unless_all_is_lost};

pub(super) const ABOUT: &str = "counters";
/// Share of lost frames from which on bridging them costs accuracy. At this share the error of bridging is 4 to 7 times the noise of
/// the force (measured on the reference scenario, with samples that were not lost).
const LOST: f64 = 0.005;

/// Returns the mend where frames are missing.
fn record(survey: &Survey) -> &'static str {
    // A table has no frames.
    if survey.expected.is_empty() {
        "look why the recorder left rows out"
    } else {
        "check the load of the bus, and record with `candump -r 8388608 -L`"
    }
}

/// Judges the counters of a survey.
pub(super) fn judge(survey: &Survey) -> Vec<Finding> {
    let stream = &survey.counts.stream;
    let mut findings: Vec<Finding> = of_obstacle(survey).into_iter().collect();
    let lost = stream.frames_lost.saturating_sub(stream.frames_unheard);
    let is_missing = |one: &Identifier| one.is_sampled && one.traffic.frames == 0;
    if survey.expected.iter().any(is_missing) {
        // The sensor that is missing has a finding of its own.
    } else if lost > 0 {
        let share = lost as f64 / (stream.frames + lost) as f64;
        let severity = if share > LOST { Doubtful } else { Note };
        let finding = format!(
            "{} of force and acceleration lost ({}), {} bridged",
            count(lost, "frame"),
            Percent(share),
            count(stream.bridged, "sample"),
        );
        findings.push(Finding::new(severity, ABOUT, finding, record(survey)));
    } else if stream.frames > 0 {
        let frames = stream.frames;
        findings.push(Finding::right(ABOUT, format!("no frame of {frames} lost")));
    }
    if survey.counts.left_out > 0 {
        let left_out = survey.counts.left_out;
        let share = left_out as f64 / (stream.frames + left_out) as f64;
        let severity = if share > LOST { Doubtful } else { Note };
        let finding = format!(
            "{} left out: another frame of their sample is missing",
            count(left_out, "frame")
        );
        findings.push(Finding::new(severity, ABOUT, finding, record(survey)));
    }
    let restarts = stream.restarts - stream.pauses;
    if source::is_without_time(survey) {
        return findings;
    }
    if stream.pauses > 0 {
        let finding = format!(
            "{} of more than 0.5 s, over which the counters go on without a gap",
            count(stream.pauses, "pause")
        );
        let mend = "right if the sensors paused; else the clock of the recording was set";
        findings.push(Finding::new(Note, ABOUT, finding, mend));
    }
    if stream.frames_unheard > 0 {
        let finding = format!(
            "{} of force and acceleration not recorded in silences of more than 0.5 s, over which the counters run on",
            count(stream.frames_unheard, "frame")
        );
        let mend = "right if the recording was paused; else see whether the bus was off";
        findings.push(Finding::new(Note, ABOUT, finding, mend));
    }
    if restarts > 0 {
        // Counters may begin anew with each recording.
        let is_often = stream.records > 0 && restarts > stream.records + stream.without_pose;
        let severity = if is_often { Doubtful } else { Note };
        let finding = format!("{} of the counters", count(restarts, "restart"));
        let mend = "right between recordings; else check supply and cables of the sensors";
        findings.push(Finding::new(severity, ABOUT, finding, mend));
    }
    if stream.repeated as f64 > LOST * stream.frames as f64 {
        let finding =
            format!("{} of force and acceleration came again", count(stream.repeated, "frame"));
        let mend = "see whether two senders or two listeners put the same frames into the log";
        findings.push(Finding::new(Doubtful, ABOUT, finding, mend));
    }
    findings
}

/// Returns whether as many frames of a sensor came again.
fn came_again(survey: &Survey, frames: u64) -> bool {
    survey.expected.iter().any(|one| one.is_sampled && one.traffic.again >= frames)
}

/// The obstacle that keeps most frames from becoming records.
fn of_obstacle(survey: &Survey) -> Option<Finding> {
    let (finding, mend) = match survey.obstacle.as_ref()? {
        // A frame that comes again, bit by bit, has a finding of its own.
        Obstacle::CounterStandsStill { frames, .. } if came_again(survey, *frames) => return None,
        Obstacle::CounterStandsStill { sensor, frames } => (
            format!("[signals] {sensor}_counter stands still in {}", count(*frames, "frame")),
            "name the signal that counts the samples",
        ),
        Obstacle::CountersApart { jumps } => (
            format!(
                "the counters of force and acceleration do not go together: {}",
                count(*jumps, "jump")
            ),
            "both must be equal at the same instant: start the sensors together, or write clocks = \"own\" in [signals]",
        ),
        Obstacle::NotFinite { readings } => (
            format!("{} not finite", count(*readings, "reading")),
            "correct types and factors in [bus] dbc, or see in the sensor's manual what it sends so for",
        ),
        // The identifiers, their rates and the signals at a limit have findings of their own. The state without a record says the last.
        Obstacle::Misfit(_)
        | Obstacle::WrongRate(_)
        | Obstacle::Clipped { .. }
        | Obstacle::CountersJump { .. } => return None,
    };
    Some(Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend))
}

#[cfg(test)]
mod tests {
    use flexid_wire::state::Sensor;

    use super::*;
    use crate::check::Severity::{Right, Wrong};
    use crate::check::fixture::{empty, good};

    #[test]
    fn lost_frames_are_doubtful_from_half_a_per_cent_on() {
        let mut survey = good();
        survey.counts.stream.frames = 10_000;
        for (lost, severity) in [(0, Right), (10, Note), (100, Doubtful)] {
            survey.counts.stream.frames_lost = lost;
            assert_eq!(judge(&survey)[0].severity, severity, "{lost}");
        }
        assert!(
            judge(&survey)[0]
                .finding
                .starts_with("100 frames of force and acceleration lost (1.0 %)")
        );
    }

    #[test]
    fn frames_of_samples_that_are_not_whole_are_named() {
        let mut survey = good();
        survey.counts.stream.frames = 10_000;
        for (left_out, severity) in [(10, Note), (100, Doubtful)] {
            survey.counts.left_out = left_out;
            let finding = &judge(&survey)[1];
            let expected = "frames left out: another frame of their sample is missing";
            assert_eq!(finding.finding, format!("{left_out} {expected}"));
            assert_eq!(finding.severity, severity);
        }
    }

    #[test]
    fn a_recording_that_was_paused_has_lost_nothing() {
        let mut survey = good();
        survey.counts.stream.frames = 10_000;
        (survey.counts.stream.frames_lost, survey.counts.stream.frames_unheard) = (4002, 4000);
        let findings = judge(&survey);
        assert!(
            findings[0].finding.starts_with("2 frames of force and acceleration lost (0.02 %)")
        );
        assert_eq!((findings[0].severity, findings[1].severity), (Note, Note));
        assert!(
            findings[1].finding.starts_with("4000 frames of force and acceleration not recorded")
        );
    }

    #[test]
    fn restarts_are_right_between_recordings() {
        let mut survey = good();
        let records = survey.counts.stream.records;
        for (restarts, severity) in [(records - 1, Note), (records + 1, Doubtful)] {
            survey.counts.stream.restarts = restarts;
            assert_eq!(judge(&survey).last().unwrap().severity, severity);
        }
    }

    #[test]
    fn a_counter_that_stands_still_is_named() {
        let mut survey = empty();
        let still = Obstacle::CounterStandsStill { sensor: Sensor::Force, frames: 8000 };
        survey.obstacle = Some(still);
        let finding = &judge(&survey)[0];
        assert_eq!(finding.severity, Wrong);
        assert_eq!(finding.finding, "[signals] force_counter stands still in 8000 frames");
        survey.obstacle = Some(Obstacle::NotFinite { readings: 2 });
        assert_eq!(judge(&survey)[0].finding, "2 readings not finite");
    }
}
