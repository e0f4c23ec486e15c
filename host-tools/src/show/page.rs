//! The live pages. The first is laid out for the window: everything if there is room, else all parameters in short and the gravest
//! warnings.

use console::Style;
use flexid_pipeline::report::Summary;
use flexid_pipeline::text::count;
use flexid_wire::finding::Finding;
use flexid_wire::messages::{Phase, Progress, Status};
use flexid_wire::report::Verdict;
use textwrap::wrap;

use super::headline::{Headline, Tone, tone};
use super::line::Line;
use super::verdict::verdict as word;
use super::{answer, compact, confidence, table};
use crate::show::view::View;

/// The most important lines, in `rows` lines at most.
pub(crate) fn overview(view: &View, rows: usize, columns: usize) -> Vec<Line> {
    let full = full(view, columns);
    if full.len() <= rows && !full.iter().any(|line| line.width() > columns) {
        return full;
    }
    let Some(finding) = &view.finding else { return fitting(full, rows) };
    let model = view.status.as_ref().map_or("robot", |status| status.model.as_str());
    let dead = view.dead_bus().is_some();
    let mut head = if dead { bus(view, columns) } else { Vec::new() };
    head.extend(verdict(view, columns));
    let mut rest = wrapped(Tone::Neutral, &format!("{model}: {}", work(view)), columns);
    if !dead {
        rest.extend(bus(view, columns));
    }
    rest.extend(compact::parameters(finding, columns));
    let room = rows.saturating_sub(head.len() + rest.len());
    fitting([head, gravest(finding, room, columns), rest].concat(), rows)
}

/// Everything on one page.
pub(crate) fn full(view: &View, columns: usize) -> Vec<Line> {
    let mut lines = Vec::new();
    if view.dead_bus().is_some() {
        lines.extend(bus(view, columns));
    }
    lines.extend(answer(view, columns));
    lines.extend(view.finding.iter().flat_map(|finding| {
        let summary = Summary(&finding.report).to_string();
        let counts = summary.lines().take(2).enumerate();
        let tone = Headline::of(view).tone;
        let toned =
            |(index, line)| wrapped(if index == 0 { tone } else { Tone::Neutral }, line, columns);
        counts.flat_map(toned).collect::<Vec<_>>()
    }));
    lines.extend(warnings(view, columns));
    if let Some(Status { model, joints, uptime_s, .. }) = &view.status {
        let joints = count((*joints).into(), "joint");
        lines.push(format!("{model} ({joints}), up {uptime_s:.0} s").into());
    }
    lines.extend(wrapped(Tone::Neutral, &work(view), columns));
    if view.dead_bus().is_none() {
        lines.extend(bus(view, columns));
    }
    if view.finding.is_some() {
        lines.push(Line::default());
        lines.extend(parameters(view, columns));
        lines.push(Line::default());
        lines.extend(confidence(view, columns));
    }
    lines
}

/// All parameters, with intervals and verdicts.
pub(crate) fn parameters(view: &View, columns: usize) -> Vec<Line> {
    let numbers = view.finding.as_ref().map(|finding| table::numbers(finding, None, columns));
    match numbers {
        Some(numbers) => numbers.lines().map(with_verdicts).collect(),
        None => vec!["no parameters yet".into()],
    }
}

/// How far the numbers can be trusted.
pub(crate) fn confidence(view: &View, columns: usize) -> Vec<Line> {
    let Some(finding) = &view.finding else { return vec!["no fit yet".into()] };
    let size = Headline::of(view)
        .fit
        .map(|size| format!("{:indent$}{size}\n", "fit", indent = confidence::INDENT));
    let lines = size.unwrap_or_default() + &confidence::lines(finding);
    hanging(&lines, columns).map(Line::from).collect()
}

/// All warnings, the gravest first.
pub(crate) fn warnings(view: &View, columns: usize) -> Vec<Line> {
    let warnings = view.finding.iter().flat_map(|finding| &finding.report.warnings);
    let lines =
        warnings.map(|warning| wrapped(Tone::Caution, &format!("warning: {warning}"), columns));
    lines.collect::<Vec<_>>().concat()
}

/// Frames and errors of the bus.
pub(crate) fn bus(view: &View, columns: usize) -> Vec<Line> {
    let tone = if view.dead_bus().is_some() { Tone::Bad } else { Tone::Neutral };
    view.bus_line().iter().flat_map(|line| wrapped(tone, line, columns)).collect()
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

/// The answer, the verdict on the fit, and the numbers of the verdicts on the parameters.
fn verdict(view: &View, columns: usize) -> Vec<Line> {
    let headline = Headline::of(view);
    let mut lines = Vec::new();
    if let Some(answer) = &headline.answer {
        lines.extend(wrapped(Style::new().bold(), answer, columns));
    }
    lines.extend(wrapped(headline.tone, &headline.line(), columns));
    lines
}

/// The answer, or so far as it is known, in bold, with the drives and where it holds.
fn answer(view: &View, columns: usize) -> Vec<Line> {
    let answer = view.finding.as_ref().and_then(|finding| finding.answer.as_ref());
    let lines = answer.map(answer::lines).unwrap_or_default();
    hanging(&lines.join("\n"), columns).map(|own| Line::toned(Style::new().bold(), own)).collect()
}

/// Lines with a heading before each paragraph, wrapped below their words.
fn hanging(text: &str, columns: usize) -> std::vec::IntoIter<String> {
    let indent = " ".repeat(confidence::INDENT);
    let options = textwrap::Options::new(columns.max(2 * indent.len())).subsequent_indent(&indent);
    let wrapped = |line| wrap(line, &options).into_iter().map(String::from).collect::<Vec<_>>();
    text.lines().flat_map(wrapped).collect::<Vec<_>>().into_iter()
}

/// The gravest warnings that fit, and the number of the others.
fn gravest(finding: &Finding, rows: usize, columns: usize) -> Vec<Line> {
    let warnings = &finding.report.warnings;
    let mut lines = Vec::new();
    for (index, warning) in warnings.iter().enumerate() {
        let warning = wrapped(Tone::Caution, &format!("warning: {warning}"), columns);
        let left = warnings.len() - index;
        // Unless the warning is the last, the line that counts the others must fit as well.
        let room = rows.saturating_sub(lines.len() + usize::from(left > 1));
        if warning.len() > room && !(lines.is_empty() && room > 0) {
            let left = count(left as u64, "warning");
            lines.push(Line::toned(
                Tone::Caution,
                format!("... {left} more: make the window higher"),
            ));
            break;
        }
        let cut = warning.len() > room;
        lines.extend(warning.into_iter().take(room));
        if let Some(last) = lines.last_mut().filter(|_| cut) {
            let text = format!("{} …", last.text());
            *last = Line::toned(Tone::Caution, console::truncate_str(&text, columns, "…"));
        }
    }
    lines
}

/// A line of the table, with the verdicts in their colours. They stand to the right of joint and direction.
fn with_verdicts(line: &str) -> Line {
    let mut coloured = Line::default();
    let mut rest = line;
    // No verdict is part of another.
    let verdicts = [Verdict::Identified, Verdict::Weak, Verdict::NotObservable, Verdict::Fixed];
    let next = |text: &str| {
        let found = verdicts
            .into_iter()
            .filter_map(|own| Some((text.find(&format!(" {}", word(own)))?, own)));
        found.min_by_key(|(place, _)| *place)
    };
    while let Some((place, own)) = next(rest) {
        let (before, after) = rest.split_at(place + 1);
        let (verdict, after) = after.split_at(word(own).len());
        coloured.push(Tone::Neutral, before);
        coloured.push(tone(own), verdict);
        rest = after;
    }
    coloured.push(Tone::Neutral, rest);
    coloured
}

fn wrapped(style: impl Into<Style>, line: &str, columns: usize) -> Vec<Line> {
    let style = style.into();
    wrap(line, columns.max(1)).into_iter().map(|line| Line::toned(style.clone(), line)).collect()
}

/// The first of `lines` that fit into `rows`, and the number of the others.
fn fitting(mut lines: Vec<Line>, rows: usize) -> Vec<Line> {
    if lines.len() > rows {
        let shown = rows.saturating_sub(1);
        let more = format!("... {} lines more: make the window higher", lines.len() - shown);
        lines.truncate(shown);
        lines.push(more.into());
    }
    lines
}

#[cfg(test)]
pub(crate) mod tests {
    use flexid_wire::answer::{Answer, Drive, LowestMode, Number, ToolStiffness};
    use flexid_wire::confidence::{Confidence, Correlations, JointIntervals};
    use flexid_wire::messages::{BusErrors, BusHealth, BusState, FromEdge};
    use flexid_wire::report::{Acceptance, Fit, FoundBy, JointReport, Report};
    use flexid_wire::residuals::{Meaning, Objection, Residuals};
    use flexid_wire::spectra::{Band, Spectra};
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
                    structure: 0.0,
                    size_objects: false,
                    whiteness_objects: false,
                    structure_objects: false,
                    meaning: Meaning::Noise,
                },
                left_over: Default::default(),
                held_out: Default::default(),
                retired: 0,
                left_out: 0,
                robust_widening: None,
            },
            answer: Some(answer(joints)),
        }
    }

    /// An answer in which all is determined but the last drive, and intervals are wide enough to be shown.
    pub(crate) fn answer(joints: usize) -> Answer {
        let number = |value: f64| {
            let interval = Some([0.98 * value, 1.02 * value]);
            Some(Number { value, interval })
        };
        let tool = |stiffness, direction| ToolStiffness {
            stiffness: number(stiffness),
            direction: Some(direction),
        };
        let drive = |index: usize| Drive {
            joint: clipped(format_args!("joint_{}", index + 1)),
            dof: 5,
            stiffness: number(2.31e6).filter(|_| index + 1 < joints),
        };
        Answer {
            pose: [0.1, -0.45, 0.95].into_iter().collect(),
            record: Some(3),
            softest: tool(3.81e5, [0.71, 0.02, -0.7]),
            stiffest: tool(8.7e5, [0.0, 1.0, 0.03]),
            lowest_mode: LowestMode { frequency_hz: number(6.33), damping_ratio: number(0.011) },
            drives: (0..joints).map(drive).collect(),
        }
    }

    /// A view of a daemon that refines with a third record while the fourth is recorded.
    pub(crate) fn view(joints: usize, warnings: &[Warning]) -> View {
        let mut view = View::default();
        view.take(FromEdge::Status(Status {
            uptime_s: 93.0,
            model: clipped("mill3"),
            joints: joints as u8,
            interface: clipped("vcan0"),
            state: State::Measuring { implausible: None },
            record_fraction: 0.62,
            newest_record_s: Some(80.0),
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
        view.spectra = Some(spectra());
        view
    }

    /// A resonance of a third of an octave at 20 Hz along z, measured ten times as large as modelled along x.
    pub(crate) fn spectra() -> Spectra {
        let band = |index: usize| {
            let frequency_hz = 2.0 * 100_f32.powf(index as f32 / 59.0);
            let resonance = 1.0 / (1.0 + (8.0 * (frequency_hz / 20.0).log2()).powi(2));
            Band {
                frequency_hz,
                measured: [0.1, 0.01, 0.01 + resonance],
                modelled: [0.01, 0.01, 0.01 + resonance],
                noise: [1e-3; 3],
            }
        };
        Spectra {
            record: 3,
            pose: [0.0, -0.45, 0.95].into_iter().collect(),
            band_hz: [2.0, 200.0],
            bands: (0..60).map(band).collect(),
        }
    }

    const SHORT: Warning = Warning::BusErrors { errors: 2 };
    const LAST: Warning = Warning::ImposedParameters;
    /// Ends with `units of the signals`.
    const LONG: Warning =
        Warning::Objection(Objection::WrongMinimum { consistency: 84.0, structure: Some(0.18) });

    fn shown(joints: usize, warnings: &[Warning], rows: usize, columns: usize) -> Vec<String> {
        let lines = overview(&view(joints, warnings), rows, columns);
        assert!(lines.len() <= rows, "{} lines in {rows} rows: {lines:#?}", lines.len());
        for line in &lines {
            assert!(line.width() <= columns, "{line:?}");
        }
        lines.iter().map(Line::text).collect()
    }

    #[test]
    fn eighty_by_twenty_four_shows_every_parameter_and_the_first_warning() {
        for joints in [2, 3, 6] {
            let lines = shown(joints, &[SHORT, LONG, LAST], 22, 80);
            let page = lines.join("\n");
            let (_, table) = page.split_once("\ntx ").unwrap();
            assert_eq!(table.matches("6.0").count(), 6 * joints, "{page}");
            assert_eq!(table.matches("±").count(), 12 * joints, "{page}");
            for part in [
                "vcan0 up; 4030 frames/s",
                "mill3: ",
                "refining the fit to 3 records",
                "(40 %); recording 62 %",
                "tool 0.381 (±2.0 %) to 0.870 N/µm (±2.0 %), lowest mode 6.33 Hz",
                "\nconsistent, 3 records: ",
                "parameters identified",
                "warning: the bus reported 2 errors",
            ] {
                assert!(page.contains(part), "{part:?} is not in\n{page}");
            }
            // The second warning needs three lines, and the line that counts the rest needs one.
            assert!(page.contains("\n... 2 warnings more: make the window higher\n"), "{page}");
        }
        // A long warning is cut, and whole with a line more.
        for (rows, end) in [(22, "axes and …"), (23, "units of the signals")] {
            let lines = shown(3, &[LONG], rows, 80);
            assert!(lines.join(" ").contains(end), "{lines:#?}");
        }
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
        assert!(page.starts_with("tool         softest 0.381 N/µm"), "{page}");
        assert!(page.contains("\ndrives       joint_1 2.31 MNm/rad"), "{page}");
    }

    #[test]
    fn what_does_not_fit_is_counted() {
        let lines = |rows| {
            let lines = fitting(["1", "2", "3", "4"].map(Line::from).into(), rows);
            lines.iter().map(Line::text).collect::<Vec<_>>()
        };
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
