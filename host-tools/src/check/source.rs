//! Judges the logs as files: lines that are no frames, other buses, logs that break off.

use flexid_pipeline::check::Survey;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::text::count;
use flexid_wire::trouble::Trouble;

use super::Finding;
use super::Severity::{Doubtful, Note, Wrong};

const ABOUT: &str = "log";
const COPY: &str = "copy or record it again";

/// Judges the logs of a survey. `cut_off` are those whose last line is not whole.
pub(super) fn judge(survey: &Survey, cut_off: &[BadInput]) -> Vec<Finding> {
    let cut = cut_off.iter().map(|log| {
        let line = log.line.map(|line| format!(":{line}")).unwrap_or_default();
        Finding::new(
            Wrong,
            ABOUT,
            format!("{}{line}: the last line is cut off", log.file.display()),
            COPY,
        )
    });
    cut.chain(survey.troubles.iter().filter_map(|trouble| of(trouble, cut_off))).collect()
}

fn of(trouble: &Trouble, cut_off: &[BadInput]) -> Option<Finding> {
    let finding =
        |severity, finding: String, mend: &str| Some(Finding::new(severity, ABOUT, finding, mend));
    match trouble {
        Trouble::Garbage { file, line, fault, lines } => {
            let is_last = |log: &BadInput| {
                log.file.display().to_string() == file.as_str()
                    && log.line.is_some_and(|last| last as u64 == *line)
            };
            if cut_off.iter().any(is_last) {
                return None;
            }
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
    use std::path::Path;

    use flexid_wire::text::clipped;
    use flexid_wire::trouble::LineFault;

    use super::*;
    use crate::check::fixture::good;

    #[test]
    fn a_line_that_is_cut_off_is_named_once() {
        let mut survey = good();
        assert_eq!(judge(&survey, &[]), []);
        let garbage = |line| Trouble::Garbage {
            file: clipped("a.log"),
            line,
            fault: LineFault::Frame,
            lines: 1,
        };
        let cut = BadInput { line: Some(7), ..BadInput::new(Path::new("a.log"), "") };
        survey.troubles = vec![garbage(7)];
        let [only] = &judge(&survey, std::slice::from_ref(&cut))[..] else { panic!("one finding") };
        assert_eq!(
            (only.severity, only.finding.as_str()),
            (Wrong, "a.log:7: the last line is cut off")
        );
        survey.troubles = vec![garbage(3)];
        assert_eq!(judge(&survey, &[cut]).len(), 2);
        let [only] = &judge(&survey, &[])[..] else { panic!("one finding") };
        assert_eq!(
            only.finding,
            "a.log:3: 1 line not of candump -L, from this one on (Invalid CAN frame)"
        );
    }

    #[test]
    fn a_log_that_breaks_off_is_wrong_and_other_buses_are_a_note() {
        let mut survey = good();
        survey.troubles = vec![
            Trouble::RecordingBroken(clipped("a.log.gz:9: cannot be read")),
            Trouble::OtherBuses { file: clipped("b.log"), bus: clipped("can0"), frames: 2 },
        ];
        let severities: Vec<_> =
            judge(&survey, &[]).iter().map(|finding| finding.severity).collect();
        assert_eq!(severities, [Wrong, Note]);
    }
}
