//! Judges the logs as files: lines that are no frames, stamps that are no times, other buses, logs that break off.

use flexid_pipeline::check::Survey;
use flexid_pipeline::text::count;
use flexid_wire::trouble::Trouble;

use super::Finding;
use super::Severity::{Doubtful, Note, Wrong};

const ABOUT: &str = "log";
/// Subject of findings on the lines of a log. A log that breaks off has an error of its own.
pub(super) const LINES: &str = "lines";
/// A log is not what it seems if more than one in so many of its lines cannot be read. A line that the logger tore is one of many
/// thousands.
const UNREADABLE: u64 = 100;

/// Judges the logs of a survey.
pub(super) fn judge(survey: &Survey) -> Vec<Finding> {
    survey.troubles.iter().map(of).collect()
}

/// Returns whether the stamps of a log tell no time, so that no rate can be judged by them.
pub(super) fn is_without_time(survey: &Survey) -> bool {
    let is_of_all =
        |trouble: &Trouble| matches!(trouble, Trouble::Stamps { fault, .. } if fault.is_of_all());
    survey.troubles.iter().any(is_of_all)
}

fn of(trouble: &Trouble) -> Finding {
    let about = match trouble {
        Trouble::Garbage { .. } | Trouble::Stamps { .. } | Trouble::Dropped { .. } => LINES,
        _ => ABOUT,
    };
    let finding =
        |severity, finding: String, mend: &str| Finding::new(severity, about, finding, mend);
    match trouble {
        Trouble::Garbage { file, line, fault, lines, of } => {
            let severity = if lines * UNREADABLE > *of { Wrong } else { Doubtful };
            let lines = count(*lines, "line");
            let text = format!(
                "{file}:{line}: {lines} of {of} not of candump -L, from this one on ({fault})"
            );
            finding(severity, text, "record with `candump -L`, and change nothing in the log")
        }
        Trouble::Stamps { file, fault, frames } => {
            let severity = if fault.is_of_all() { Wrong } else { Note };
            finding(severity, format!("{file}: {}", fault.of(*frames)), fault.mend())
        }
        Trouble::Dropped { file, frames } => {
            let frames = count(*frames, "frame");
            let text = format!("{file}: the kernel dropped {frames} while this was recorded");
            finding(Doubtful, text, "record with `candump -r 8388608 -L`")
        }
        Trouble::OtherBuses { file, bus, frames } => {
            let text =
                format!("{file}: frames of {bus} are taken, {frames} of other buses are not");
            finding(Note, text, "right if [bus] interface names the bus of the sensors")
        }
        Trouble::RecordingBroken(error) | Trouble::Unreadable(error) => {
            finding(Wrong, error.to_string(), "")
        }
        Trouble::Bus(_) | Trouble::BusBroken(_) => finding(Doubtful, trouble.to_string(), ""),
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::text::clipped;
    use flexid_wire::trouble::LineFault;

    use super::*;
    use crate::check::fixture::good;

    #[test]
    fn lines_that_are_no_frames_are_doubtful_and_many_are_wrong() {
        let mut survey = good();
        assert_eq!(judge(&survey), []);
        for (lines, severity) in [(1, Doubtful), (10, Doubtful), (11, Wrong)] {
            let (file, fault) = (clipped("a.log"), LineFault::Frame);
            survey.troubles = vec![Trouble::Garbage { file, line: 3, fault, lines, of: 1000 }];
            let [only] = &judge(&survey)[..] else { panic!("one finding") };
            assert_eq!(only.severity, severity, "{lines}");
        }
        assert_eq!(
            judge(&survey)[0].finding,
            "a.log:3: 11 lines of 1000 not of candump -L, from this one on (Invalid CAN frame)"
        );
    }

    #[test]
    fn a_log_that_breaks_off_is_wrong_and_other_buses_are_a_note() {
        let mut survey = good();
        survey.troubles = vec![
            Trouble::RecordingBroken(clipped("a.log.gz:9: cannot be read")),
            Trouble::OtherBuses { file: clipped("b.log"), bus: clipped("can0"), frames: 2 },
        ];
        let severities: Vec<_> = judge(&survey).iter().map(|finding| finding.severity).collect();
        assert_eq!(severities, [Wrong, Note]);
    }
}
