//! The live page, laid out for the window: everything if there is room, else all parameters in short and the gravest warnings.

use console::measure_text_width;
use flexid_pipeline::report::Summary;
use flexid_pipeline::text::count;
use flexid_wire::finding::Finding;
use flexid_wire::messages::{Phase, Progress, Status};
use textwrap::wrap;

use super::{compact, table};
use crate::show::view::View;

/// The lines for a window of `rows` and `columns`. The cursor needs the last row.
pub(crate) fn lines(view: &View, rows: usize, columns: usize) -> Vec<String> {
    let rows = rows.saturating_sub(1);
    let full = full(view, columns);
    let too_wide = |line: &String| measure_text_width(line) > columns;
    if full.len() <= rows && !full.iter().any(too_wide) {
        return full;
    }
    let Some(finding) = &view.finding else { return fitting(full, rows) };
    let model = view.status.as_ref().map_or("robot", |status| status.model.as_str());
    let mut lines = bus(view, columns);
    lines.extend(wrapped(&format!("{model}: {}", work(view)), columns));
    lines.extend(fit(finding, columns));
    lines.extend(compact::parameters(finding, columns));
    lines.extend(warnings(finding, rows.saturating_sub(lines.len()), columns));
    fitting(lines, rows)
}

/// The full page.
pub(crate) fn full(view: &View, columns: usize) -> Vec<String> {
    let mut lines = bus(view, columns);
    if let Some(Status { model, joints, uptime_s, .. }) = &view.status {
        let joints = count((*joints).into(), "joint");
        lines.push(format!("{model} ({joints}), up {uptime_s:.0} s"));
    }
    lines.extend(wrapped(&work(view), columns));
    // The important lines stand above those that may not fit.
    if let Some(finding) = &view.finding {
        let summary = Summary(&finding.report).to_string();
        lines.extend(summary.lines().flat_map(|line| wrapped(line, columns)));
        lines.push(String::new());
        let parameters = table::parameters(finding, None);
        lines.extend(parameters.lines().map(str::to_owned));
    }
    lines
}

/// The lines on the bus. They stand first, so that a dead bus is seen.
fn bus(view: &View, columns: usize) -> Vec<String> {
    view.bus_line().iter().flat_map(|line| wrapped(line, columns)).collect()
}

/// State of the daemon, its progress, and the share of the next record that is recorded.
fn work(view: &View) -> String {
    let at_work =
        |progress: &Progress| matches!(progress.phase, Phase::Searching | Phase::Refining);
    let percent = view.progress.filter(at_work).map(|progress| 100.0 * progress.fraction);
    let mut work: Vec<String> = view.state().into_iter().collect();
    if let (Some(state), Some(percent)) = (work.first_mut(), percent) {
        *state += &format!(" ({percent:.0} %)");
    }
    let recorded = view.status.as_ref().map_or(0.0, |status| status.record_fraction);
    if recorded > 0.0 {
        work.push(format!("recording {:.0} %", 100.0 * recorded));
    }
    work.join("; ")
}

/// A short summary of the fit.
fn fit(finding: &Finding, columns: usize) -> Vec<String> {
    let summary = Summary(&finding.report).to_string();
    let mut lines = summary.lines();
    // Frames and costs are left out.
    let fit = lines.next().and_then(|line| line.split(';').next()).unwrap_or_default();
    let fit = format!("{fit}; {}", count(finding.report.fit.records, "record"));
    [fit.as_str(), lines.next().unwrap_or_default()]
        .into_iter()
        .flat_map(|line| wrapped(line, columns))
        .collect()
}

/// The gravest warnings that fit, and the number of the others.
fn warnings(finding: &Finding, rows: usize, columns: usize) -> Vec<String> {
    let warnings = &finding.report.warnings;
    let mut lines = Vec::new();
    for (index, warning) in warnings.iter().enumerate() {
        let warning = wrapped(&format!("warning: {warning}"), columns);
        let left = warnings.len() - index;
        // Unless the warning is the last, the line that counts the others must fit as well.
        let room = rows.saturating_sub(lines.len() + usize::from(left > 1));
        if warning.len() > room && !(lines.is_empty() && room > 0) {
            lines.push(format!(
                "... {} more: make the window higher",
                count(left as u64, "warning")
            ));
            break;
        }
        let cut = warning.len() > room;
        lines.extend(warning.into_iter().take(room));
        if let Some(last) = lines.last_mut().filter(|_| cut) {
            *last = console::truncate_str(&format!("{last} …"), columns, "…").into_owned();
        }
    }
    lines
}

fn wrapped(line: &str, columns: usize) -> Vec<String> {
    wrap(line, columns.max(1)).into_iter().map(|line| line.into_owned()).collect()
}

/// The first of `lines` that fit into `rows`, and the number of the others.
fn fitting(mut lines: Vec<String>, rows: usize) -> Vec<String> {
    if lines.len() > rows {
        let shown = rows.saturating_sub(1);
        let more = format!("... {} lines more: make the window higher", lines.len() - shown);
        lines.truncate(shown);
        lines.push(more);
    }
    lines
}

#[cfg(test)]
pub(crate) mod tests {
    use flexid_wire::confidence::{Confidence, Correlations, JointIntervals};
    use flexid_wire::messages::{BusErrors, BusHealth, BusState, FromEdge};
    use flexid_wire::report::{Acceptance, Fit, FoundBy, JointReport, Report, Verdict};
    use flexid_wire::residuals::{Meaning, Objection, Residuals};
    use flexid_wire::state::State;
    use flexid_wire::text::clipped;
    use flexid_wire::warning::Warning;

    use super::*;

    /// A finding with all parameters identified, to 1.7 and 9.8 %.
    pub(crate) fn finding(joints: usize) -> Finding {
        let joint = |index: usize| JointReport {
            name: clipped(format_args!("joint_{}", index + 1)),
            stiffness: [6e7; 6],
            stiffness_std: [Some(5e5); 6],
            stiffness_verdict: [Verdict::Identified; 6],
            damping: [2e4; 6],
            damping_std: [Some(1e3); 6],
            damping_verdict: [Verdict::Weak; 6],
        };
        let intervals = |index: usize| JointIntervals {
            name: clipped(format_args!("joint_{}", index + 1)),
            stiffness_interval: [Some([5.9e7, 6.1e7]); 6],
            damping_interval: [Some([1.8e4, 2.2e4]); 6],
        };
        let fit = Fit {
            records: 3,
            frames: 49_152,
            frames_lost: 0,
            ssp: 1e-3,
            ssp_max: 2e-2,
            consistency: 1.0,
            search_evaluations: 2000,
            refine_iterations: 12,
            starts: 1,
            bridged: 0,
            seconds: 1.2,
            acceptance: Acceptance::Consistent,
            found_by: FoundBy::Descent,
            random_searches: 0,
            branches: 1,
        };
        Finding {
            report: Report {
                joints: (0..joints).map(joint).collect(),
                fit,
                warnings: Default::default(),
            },
            confidence: Confidence {
                joints: (0..joints).map(intervals).collect(),
                nuisances: Default::default(),
                correlations: Correlations {
                    unknowns: Default::default(),
                    percent: Default::default(),
                },
                explanations: Default::default(),
                weak_directions: Default::default(),
                residuals: Residuals {
                    consistency: 1.0,
                    whiteness: 0.0,
                    size_objects: false,
                    whiteness_objects: false,
                    meaning: Meaning::Noise,
                },
                left_over: Default::default(),
                held_out: Default::default(),
                retired: 0,
                left_out: 0,
            },
        }
    }

    /// A view of a daemon that refines with a third record while the fourth is recorded.
    fn view(joints: usize, warnings: &[Warning]) -> View {
        let mut view = View::default();
        view.take(FromEdge::Status(Status {
            uptime_s: 93.0,
            model: clipped("mill3"),
            joints: joints as u8,
            interface: clipped("vcan0"),
            state: State::Measuring { implausible: None },
            record_fraction: 0.62,
        }));
        view.take(FromEdge::Progress(Progress {
            phase: Phase::Refining,
            fraction: 0.4,
            starts: 1,
            search_evaluations: 2000,
            refine_iterations: 5,
            search_loss: 0.1,
            records: 3,
        }));
        view.take(FromEdge::BusHealth(BusHealth {
            state: BusState::Up,
            frames: 123_456,
            frames_lost: 12,
            bridged: 0,
            restarts: 0,
            repeated: 0,
            frames_wrong_length: 0,
            frames_unknown: 0,
            frames_not_data: 0,
            frames_clipped: 0,
            kernel_dropped: 0,
            receive_buffer_bytes: 0,
            samples_discarded: 0,
            refused: 0,
            wrong_rate: 0,
            measured_rate_hz: 0.0,
            frames_per_second: 4030.0,
            fault: None,
            errors: BusErrors::default(),
            doubtful_rate: 0,
            measured_rate_std_hz: 0.0,
        }));
        let mut finding = finding(joints);
        finding.report.warnings = warnings.iter().cloned().collect();
        view.finding = Some(finding);
        view
    }

    const SHORT: Warning = Warning::BusErrors { errors: 2 };
    const LAST: Warning = Warning::ImposedParameters;
    /// Ends with `units of the signals`.
    const LONG: Warning =
        Warning::Objection(Objection::WrongMinimum { consistency: 84.0, whiteness: 12.0 });

    fn shown(joints: usize, warnings: &[Warning], rows: usize, columns: usize) -> Vec<String> {
        let lines = lines(&view(joints, warnings), rows, columns);
        assert!(lines.len() < rows, "{} lines in {rows} rows: {lines:#?}", lines.len());
        for line in &lines {
            assert!(measure_text_width(line) <= columns, "{line:?}");
        }
        lines
    }

    #[test]
    fn eighty_by_twenty_four_shows_every_parameter_and_the_first_warning_whole() {
        for joints in [2, 3, 6] {
            let lines = shown(joints, &[SHORT, LONG, LAST], 24, 80);
            let page = lines.join("\n");
            assert_eq!(page.matches("6.0").count(), 6 * joints, "{page}");
            assert_eq!(page.matches("±").count(), 12 * joints, "{page}");
            for part in [
                "vcan0 up; 4030 frames/s",
                "mill3: ",
                "refining with record 3",
                "(40 %); recording 62 %",
                "consistent: χ²/dof 1.000, SSP 1.0e-3 (worst 2.0e-2); 3 records",
                "parameters identified",
                "warning: the bus reported 2 errors",
            ] {
                assert!(page.contains(part), "{part:?} is not in\n{page}");
            }
            // The second warning needs three lines, and the line that counts the rest needs one.
            assert_eq!(lines.last().unwrap(), "... 2 warnings more: make the window higher");
        }
        let lines = shown(3, &[LONG], 24, 80);
        assert!(lines.join(" ").contains("units of the signals"), "{lines:#?}");
    }

    #[test]
    fn a_large_window_shows_all() {
        let lines = shown(3, &[LONG, LAST], 60, 130);
        let page = lines.join("\n");
        assert!(
            page.contains("warning: what [parameters] fixes")
                && page.contains("residuals    noise"),
            "{page}"
        );
        assert!(page.contains("12 refinement steps"), "{page}");
    }

    #[test]
    fn what_does_not_fit_is_counted() {
        let lines = |rows| fitting(["1", "2", "3", "4"].map(str::to_owned).into(), rows);
        assert_eq!(lines(4), ["1", "2", "3", "4"]);
        assert_eq!(lines(3), ["1", "2", "... 2 lines more: make the window higher"]);
        assert_eq!(lines(0), ["... 4 lines more: make the window higher"]);
        for rows in 3..30 {
            for columns in [50, 60, 80, 100] {
                shown(3, &[LONG, LONG], rows, columns);
            }
        }
    }
}
