//! Judges the logs as files: lines that are no frames, other buses, logs that break off.

use flexid_pipeline::check::Survey;
use flexid_pipeline::text::count;
use flexid_wire::trouble::Trouble;

use super::Finding;
use super::Severity::{Doubtful, Note, Wrong};

const ABOUT: &str = "log";
const COPY: &str = "copy or record it again";

/// Judges the logs of a survey.
pub(super) fn judge(survey: &Survey) -> Vec<Finding> {
    survey.troubles.iter().map(of).collect()
}

fn of(trouble: &Trouble) -> Finding {
    let finding =
        |severity, finding: String, mend: &str| Finding::new(severity, ABOUT, finding, mend);
    match trouble {
        Trouble::Garbage { file, line, fault, lines } => {
            let lines = count(*lines, "line");
            let text =
                format!("{file}:{line}: {lines} not of candump -L, from this one on ({fault})");
            finding(Doubtful, text, "record with `candump -L`, and change nothing in the log")
        }
        Trouble::OtherBuses { file, bus, frames } => {
            let text =
                format!("{file}: frames of {bus} are taken, {frames} of other buses are not");
            finding(Note, text, "right if [bus] interface names the bus of the sensors")
        }
        Trouble::RecordingBroken(error) | Trouble::Unreadable(error) => {
            finding(Wrong, error.to_string(), COPY)
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
    fn lines_that_are_no_frames_are_doubtful() {
        let mut survey = good();
        assert_eq!(judge(&survey), []);
        survey.troubles = vec![Trouble::Garbage {
            file: clipped("a.log"),
            line: 3,
            fault: LineFault::Frame,
            lines: 1,
        }];
        let [only] = &judge(&survey)[..] else { panic!("one finding") };
        assert_eq!(
            (only.severity, only.finding.as_str()),
            (Doubtful, "a.log:3: 1 line not of candump -L, from this one on (Invalid CAN frame)")
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
