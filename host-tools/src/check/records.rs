//! Judges the records: their number, their poses, and what they repeat.

use flexid_pipeline::MAX_PER_POSE;
use flexid_pipeline::check::{Examined, Survey};
use flexid_pipeline::config::Config;
use flexid_pipeline::text::count;
use flexid_wire::state::State;
use flexid_wire::unused::RecordFault;

use super::Severity::{Doubtful, Note, Wrong};
use super::words::{enumerate, records};
use super::{Finding, unless_all_is_lost};

const ABOUT: &str = "records";

/// Judges the records of a survey. `is_explained` says whether a finding names the reason why there are none.
pub(super) fn judge(config: &Config, survey: &Survey, is_explained: bool) -> Vec<Finding> {
    let mut findings = Vec::new();
    if survey.records.is_empty() {
        findings.push(none(survey, is_explained));
    }
    findings.extend(repeated(survey));
    findings.extend(refused(survey));
    findings.extend(of_rate(survey));
    findings.extend(of_places(survey));
    let most = (1..=survey.records.len() as u64)
        .map(|pose| survey.usable().filter(|record| record.pose_number == Some(pose)).count());
    if most.max().unwrap_or_default() > MAX_PER_POSE {
        let finding = format!(
            "more than {MAX_PER_POSE} records at one pose: the newest {MAX_PER_POSE} are kept"
        );
        findings.push(Finding::new(Note, ABOUT, finding, "mill elsewhere instead"));
    }
    let full_s = config.record_samples as f64 / config.rate_hz;
    // A path ends where it does.
    let is_short = |record: &&Examined| record.travel.is_none() && record.seconds < 0.75 * full_s;
    let short: Vec<u64> = survey.usable().filter(is_short).map(|record| record.number).collect();
    if !short.is_empty() {
        let finding = format!("{}: shorter than {full_s:.1} s", records(&short));
        let mend = "cut for a record's length or more at each pose";
        findings.push(Finding::new(Note, ABOUT, finding, mend));
    }
    findings
}

fn none(survey: &Survey, is_explained: bool) -> Finding {
    let mend = match &survey.state {
        _ if is_explained => "correct what is wrong above, then look again",
        State::AwaitingRecord { .. } => {
            "rest for a second, then cut for a record's length while the robot stands or feeds evenly"
        }
        State::AngleStopped { .. } => {
            "let the controller send all joint angles until the end of the cut"
        }
        _ => "see the state at the end of the finding",
    };
    // Other findings name the obstacle.
    let finding = match &survey.state {
        State::AwaitingRecord { seconds, .. } => {
            format!(
                "no record: no cut of {seconds:.1} s, or of an eighth of it, standing or at an even feed"
            )
        }
        _ if is_explained => "no record".to_owned(),
        state => format!("no record: {state}"),
    };
    Finding::new(Wrong, ABOUT, finding, mend)
}

fn repeated(survey: &Survey) -> Option<Finding> {
    let pairs = survey.records.iter().filter_map(|record| Some((record.number, record.repeats?)));
    let (again, originals): (Vec<u64>, Vec<u64>) = pairs.unzip();
    if again.is_empty() {
        return None;
    }
    let repeat = if again.len() == 1 { "repeats" } else { "repeat" };
    let finding = format!("{} {repeat} {}: left out", records(&again), records(&originals));
    Some(Finding::new(Doubtful, ABOUT, finding, "name each log once"))
}

fn refused(survey: &Survey) -> Option<Finding> {
    let faults = survey.records.iter();
    let faults =
        faults.filter_map(|record| Some((record.number, record.excitation.as_ref().err()?)));
    let (numbers, faults): (Vec<u64>, Vec<_>) = faults.unzip();
    let often = |fault: &&&RecordFault| faults.iter().filter(|other| *other == *fault).count();
    // The first of those that are as frequent.
    let main = faults.iter().rev().max_by_key(often)?;
    let alike = often(&main);
    let because = match numbers.len() - alike {
        0 => "since".to_owned(),
        _ => format!("{alike} of them since"),
    };
    let finding = format!("{} cannot be used, {because} {main}", records(&numbers));
    let mend = "correct that, or record them again";
    Some(Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend))
}

/// Records of a rate that is not known: a fit to them is wrong by an unknown factor.
fn of_rate(survey: &Survey) -> Option<Finding> {
    let doubtful: Vec<u64> = survey
        .usable()
        .filter(|record| record.has_doubtful_rate)
        .map(|record| record.number)
        .collect();
    (!doubtful.is_empty()).then(|| {
        let finding = format!("the rate of {} is not known", records(&doubtful));
        Finding::new(Wrong, ABOUT, finding, "correct the rate, or leave these records out")
    })
}

/// The records that a fit would take, in words: `3 records in 2 poses and along 1 path`.
pub(super) fn text(survey: &Survey) -> String {
    let number = survey.usable().count() as u64;
    let places = [("in", survey.poses(), "pose"), ("along", survey.paths(), "path")];
    let places = places.iter().filter(|(_, number, _)| *number > 0);
    let places = places.map(|(how, number, what)| format!("{how} {}", count(*number as u64, what)));
    format!("{} {}", count(number, "record"), enumerate(places)).trim_end().to_owned()
}

fn of_places(survey: &Survey) -> Option<Finding> {
    survey.usable().next()?;
    let shared = shared_poses(survey);
    let same = if shared.is_empty() {
        String::new()
    } else {
        format!("; at one pose: {}", enumerate(shared))
    };
    Some(Finding::right(ABOUT, text(survey) + &same))
}

/// The records of each pose that several have.
fn shared_poses(survey: &Survey) -> Vec<String> {
    let of_pose = |pose| -> Vec<u64> {
        let all = survey.usable().filter(|record| record.pose_number == Some(pose));
        all.map(|record| record.number).collect()
    };
    let poses = (1..=survey.records.len() as u64).map(of_pose);
    poses.filter(|numbers| numbers.len() > 1).map(|numbers| records(&numbers)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::Severity::Right;
    use crate::check::fixture::{config, empty, feeding, good, record};

    fn gravest(survey: &Survey) -> Finding {
        let all = judge(&config(), survey, false).into_iter();
        all.min_by_key(|finding| finding.severity).unwrap()
    }

    #[test]
    fn three_records_in_three_poses_are_right() {
        let mut survey = good();
        assert_eq!(gravest(&survey), Finding::right(ABOUT, "3 records in 3 poses"));
        survey.records.push(Examined { pose_number: Some(1), ..record(4) });
        assert_eq!(gravest(&survey).finding, "4 records in 3 poses; at one pose: records 1 and 4");
        let mut paths = feeding();
        assert_eq!(gravest(&paths).finding, "3 records along 1 path");
        (paths.records[0].travel, paths.records[0].pose_number) = (None, Some(1));
        assert_eq!(gravest(&paths).finding, "3 records in 1 pose and along 1 path");
    }

    #[test]
    fn without_a_record_nothing_can_be_identified() {
        let mut survey = empty();
        assert_eq!(gravest(&survey).severity, Wrong);
        assert!(gravest(&survey).mend.starts_with("rest for a second"));
        survey.state = State::NoForce;
        assert_eq!(gravest(&survey).finding, "no record: waiting for force frames: none seen");
        let [only] = &judge(&config(), &survey, true)[..] else { panic!("one finding") };
        assert_eq!(only.finding, "no record");
    }

    #[test]
    fn records_that_come_again_are_left_out() {
        let mut survey = good();
        survey.records.extend((4..=6).map(|n| Examined {
            repeats: Some(n - 3),
            pose_number: Some(n - 3),
            ..record(n)
        }));
        let finding = gravest(&survey);
        assert_eq!(finding.severity, Doubtful);
        assert_eq!(finding.finding, "records 4, 5 and 6 repeat records 1, 2 and 3: left out");
        let right = judge(&config(), &survey, false).into_iter().find(|one| one.severity == Right);
        assert_eq!(right.unwrap().finding, "3 records in 3 poses");
    }

    #[test]
    fn refused_records_are_named_with_their_most_frequent_fault() {
        let mut survey = good();
        survey.records[2].excitation = Err(RecordFault::NoForce);
        let all = judge(&config(), &survey, false);
        assert!(all[0].finding.starts_with("record 3 cannot be used, since its force"));
        assert_eq!(all[0].severity, Doubtful);
        survey.records[0].excitation = Err(RecordFault::Uneven);
        survey.records[1].excitation = Err(RecordFault::Uneven);
        let most =
            "records 1, 2 and 3 cannot be used, 2 of them since the robot starts, stops or turns";
        assert!(gravest(&survey).finding.starts_with(most), "{}", gravest(&survey).finding);
        survey.records.iter_mut().for_each(|record| record.excitation = Err(RecordFault::NoForce));
        assert_eq!(gravest(&survey).severity, Wrong);
    }

    #[test]
    fn a_rate_that_is_not_known_and_short_records_are_named() {
        let mut survey = good();
        survey.records[0].seconds = 1.024;
        let short = judge(&config(), &survey, false);
        assert!(
            short
                .iter()
                .any(|one| one.severity == Note && one.finding == "record 1: shorter than 4.1 s")
        );
        survey.records[1].has_doubtful_rate = true;
        assert_eq!(gravest(&survey).finding, "the rate of record 2 is not known");
    }

    #[test]
    fn of_many_records_at_a_pose_the_newest_are_kept() {
        let mut survey = good();
        survey
            .records
            .extend((4..=8).map(|number| Examined { pose_number: Some(1), ..record(number) }));
        let all = judge(&config(), &survey, false);
        assert!(all.iter().any(|one| one.severity == Note && one.finding.contains("newest 5")));
    }
}
