//! Judges the paths along which the robot feeds: how long and how fast they are, and how much of them a fit can use.

use flexid_core::stream::WITHIN_PART;
use flexid_pipeline::check::{Examined, Station, Survey, Travel};
use flexid_pipeline::config::Config;
use flexid_pipeline::text::count;

use super::Severity::{Doubtful, Note};
use super::words::{enumerate, records};
use super::{Finding, unless_all_is_lost};

const ABOUT: &str = "path";
/// Largest movement of a joint in a record, rad (m), that is none: displays of robots have steps of up to 0.1°, and a robot that feeds no farther in a
/// record stands (`COARSEST` in `core/src/stream/sender.rs`).
const STANDS: f64 = 2e-3;
/// Most paths that have a finding. Chosen: as many as an enumeration names.
const NAMED: usize = 4;

/// A path: its records, in their order.
pub(super) struct Path<'a> {
    pub(super) number: u64,
    pub(super) records: Vec<&'a Travel>,
}

/// The paths of the records that a fit would take.
pub(super) fn paths(survey: &Survey) -> Vec<Path<'_>> {
    let travels: Vec<&Travel> =
        survey.usable().filter_map(|record| record.travel.as_ref()).collect();
    let paths = travels.chunk_by(|one, other| one.path == other.path);
    paths.map(|records| Path { number: records[0].path, records: records.to_vec() }).collect()
}

impl Path<'_> {
    /// The path in words: `200 mm at 10.0 mm/s, joints up to 0.016 rad/s`.
    pub(super) fn text(&self) -> String {
        let length_m: f64 = self.records.iter().map(|travel| travel.length_m()).sum();
        let rate = self.records.iter().map(|travel| travel.rate()).fold(0.0, f64::max);
        let mut feeds: Vec<f64> =
            self.records.iter().flat_map(|travel| travel.feeds_m_per_s()).collect();
        feeds.sort_by(f64::total_cmp);
        let feed = match feeds.get(feeds.len() / 2) {
            Some(median) => format!(" at {:.1} mm/s", 1e3 * median),
            None => String::new(),
        };
        format!("{:.0} mm{feed}, joints up to {rate:.3} rad/s (m/s)", 1e3 * length_m)
    }

    /// The first and the last place of the path.
    pub(super) fn ends(&self) -> Option<[&Station; 2]> {
        Some([self.records.first()?.parts.first()?, self.records.last()?.parts.last()?])
    }
}

/// Judges the paths of a survey.
pub(super) fn judge(config: &Config, survey: &Survey) -> Vec<Finding> {
    let mut findings = Vec::new();
    let all = paths(survey);
    let text = |path: &Path<'_>| format!("path {}: {}", path.number, path.text());
    findings.extend(all.iter().take(NAMED).map(|path| Finding::right(ABOUT, text(path))));
    if all.len() > NAMED {
        let further = count((all.len() - NAMED) as u64, "further path");
        findings.push(Finding::right(ABOUT, format!("{further} (see the table of the records)")));
    }
    findings.extend(of_use(survey));
    findings.extend(of_speed(survey));
    findings.extend(of_jitter(config, survey));
    findings
}

/// Records along a path that repeat no other.
fn travels(survey: &Survey) -> impl Iterator<Item = (&Examined, &Travel)> {
    let own = survey.records.iter().filter(|record| record.repeats.is_none());
    own.filter_map(|record| Some((record, record.travel.as_ref()?)))
}

/// The time along paths that a fit can use, and why it cannot use the rest. Doubtful below half. Chosen: more is lost than kept.
fn of_use(survey: &Survey) -> Option<Finding> {
    let seconds = |of: &dyn Fn(&Examined, &Travel) -> f64| -> f64 {
        travels(survey).map(|(record, travel)| of(record, travel)).sum()
    };
    let all_s = seconds(&|record, _| record.seconds);
    if all_s <= 0.0 {
        return None;
    }
    let is_usable = |record: &Examined| f64::from(u8::from(record.is_usable()));
    let used_s = seconds(&|record, travel| is_usable(record) * travel.even_s());
    let refused_s = seconds(&|record, _| (1.0 - is_usable(record)) * record.seconds);
    let uneven_s = all_s - used_s - refused_s;
    let reasons = [
        (uneven_s, "the robot starts, stops or turns"),
        (refused_s, "the records cannot be used (see records)"),
    ];
    let reasons = reasons.iter().filter(|(seconds, _)| *seconds > 0.05);
    let reasons = enumerate(reasons.map(|(seconds, why)| format!("in {seconds:.1} s {why}")));
    let finding = format!("{used_s:.1} of {all_s:.1} s along paths count");
    if reasons.is_empty() {
        return Some(Finding::right(ABOUT, finding));
    }
    let severity = if used_s < 0.5 * all_s { Doubtful } else { Note };
    let mend = "feed evenly, in long straight stretches";
    Some(Finding::new(severity, ABOUT, format!("{finding}: {reasons}"), mend))
}

/// Even parts in which a joint moves farther than a part should. Doubtful where this holds for half of them. Chosen: as of the time that counts.
fn of_speed(survey: &Survey) -> Option<Finding> {
    let parts = || {
        let usable = travels(survey).filter(|(record, _)| record.is_usable());
        usable.flat_map(|(_, travel)| travel.even().map(move |part| (part.moves, travel.part_s)))
    };
    let all_s: f64 = parts().map(|(_, part_s)| part_s).sum();
    let fast = || parts().filter(|(moves, _)| *moves > WITHIN_PART * (1.0 + 1e-6));
    let fast_s: f64 = fast().map(|(_, part_s)| part_s).sum();
    let farthest = fast().map(|(moves, _)| moves).reduce(f64::max)?;
    let fastest = fast().map(|(moves, part_s)| moves / part_s).fold(0.0, f64::max);
    let finding = format!(
        "in {fast_s:.1} of {all_s:.1} s a joint moves by more than {WITHIN_PART} rad (m) in a part of its record, up to {farthest:.3}: modes change within it"
    );
    let mend = format!(
        "feed {:.1} times as slowly: joints below {:.3} rad/s (m/s)",
        farthest / WITHIN_PART,
        fastest * WITHIN_PART / farthest
    );
    let severity = if fast_s < 0.5 * all_s { Note } else { Doubtful };
    Some(Finding::new(severity, ABOUT, finding, mend))
}

/// Records of a robot that stands, and of which a joint seems to move.
fn of_jitter(config: &Config, survey: &Survey) -> Option<Finding> {
    let range = |travel: &Travel, joint: usize| {
        let angles = travel.parts.iter().map(|part| part.pose[joint]);
        let ends = angles.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], angle| {
            [low.min(angle), high.max(angle)]
        });
        ends[1] - ends[0]
    };
    let joints = config.signals.joints.len();
    let moves = |travel: &Travel| travel.parts.iter().map(|part| part.moves).fold(0.0, f64::max);
    let stands =
        |travel: &Travel| (0..joints).all(|joint| range(travel, joint) + moves(travel) <= STANDS);
    let standing: Vec<(&Examined, &Travel)> =
        travels(survey).filter(|(_, travel)| stands(travel)).collect();
    let (_, worst) = standing.iter().max_by(|(_, a), (_, b)| moves(a).total_cmp(&moves(b)))?;
    let joint = (0..joints).max_by(|&a, &b| range(worst, a).total_cmp(&range(worst, b)))?;
    let numbers: Vec<u64> = standing.iter().map(|(record, _)| record.number).collect();
    let finding = format!(
        "{}: the robot stands, but angles, most of all {}, jitter by {:.4} rad (m): taken for a feed",
        records(&numbers),
        config.signals.joints[joint],
        moves(worst)
    );
    let mend =
        "let the controller send steadier angles, or round them to the steps of their resolution";
    Some(Finding::new(unless_all_is_lost(survey), super::joints::ABOUT, finding, mend))
}

#[cfg(test)]
mod tests {
    use flexid_wire::unused::RecordFault;

    use super::*;
    use crate::check::Severity::Right;
    use crate::check::fixture::{config, feeding, good};

    fn said(survey: &Survey) -> Vec<(super::super::Severity, String)> {
        let all = judge(&config(), survey).into_iter();
        all.map(|finding| (finding.severity, finding.finding)).collect()
    }

    #[test]
    fn a_path_has_its_length_its_feed_and_what_counts_of_it() {
        assert_eq!(said(&good()), []);
        let mut survey = feeding();
        let of_path = "path 1: 123 mm at 10.0 mm/s, joints up to 0.010 rad/s (m/s)";
        assert_eq!(
            said(&survey),
            [(Right, of_path.into()), (Right, "12.3 of 12.3 s along paths count".into())]
        );
        for part in &mut survey.records[0].travel.as_mut().unwrap().parts[..5] {
            part.is_even = false;
        }
        survey.records[2].excitation = Err(RecordFault::NoForce);
        let counts = "5.6 of 12.3 s along paths count: in 2.6 s the robot starts, stops or turns and \
                      in 4.1 s the records cannot be used (see records)";
        assert_eq!(said(&survey)[1], (Doubtful, counts.into()));
    }

    #[test]
    fn a_feed_that_is_too_fast_is_named_with_one_that_is_not() {
        let mut survey = feeding();
        let parts =
            survey.records.iter_mut().flat_map(|own| &mut own.travel.as_mut().unwrap().parts);
        parts.for_each(|part| part.moves = 0.02);
        let finding = judge(&config(), &survey).pop().unwrap();
        assert_eq!(finding.severity, Doubtful);
        assert!(finding.finding.starts_with("in 12.3 of 12.3 s a joint moves by more than 0.01"));
        assert_eq!(finding.mend, "feed 2.0 times as slowly: joints below 0.020 rad/s (m/s)");
    }

    #[test]
    fn a_robot_that_stands_and_seems_to_move_is_named() {
        let mut survey = feeding();
        for part in &mut survey.records[1].travel.as_mut().unwrap().parts {
            (part.pose, part.moves) = (vec![0.2, -0.4, 0.9], 8e-4);
        }
        survey.records[1].travel.as_mut().unwrap().parts[1].pose[1] += 4e-4;
        let finding = judge(&config(), &survey).pop().unwrap();
        let expected = "record 2: the robot stands, but angles, most of all q2, jitter by 0.0008 rad (m): taken for a feed";
        assert_eq!((finding.severity, finding.finding.as_str()), (Doubtful, expected));
    }
}
