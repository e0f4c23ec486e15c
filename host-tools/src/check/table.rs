//! The findings as tables for people: verdict, findings, identifiers, records.

use comfy_table::{CellAlignment, Table};
use flexid_pipeline::check::{Examined, Identifier, Survey};
use flexid_wire::words::Percent;

use super::excitation::{band, silent};
use super::identifiers::id;
use super::paths::paths;
use super::words::enumerate;
use super::{Check, Finding, Severity};
use crate::window;

/// Most identifiers without a signal that have a row.
const UNEXPECTED: usize = 8;

/// The verdict in the first line and in the last, and between them tables of at most so many columns.
pub(crate) fn text(check: &Check, columns: usize) -> String {
    let verdict = check.verdict();
    let mut text = format!("{verdict}\n\n{}\n", findings(&check.findings, columns));
    if let Some(survey) = check.survey {
        text += &format!("\n{}\n", identifiers(survey, check.config.rate_hz, columns));
        if !survey.records.is_empty() {
            text += &format!(
                "\n{}\n{}\
                 \x20start, length, rest before the cut: s; force: root mean square in the band, N\n\
                 \x20clear: share of the band's bins in which the force stands clear of its noise; below half: the bands where it does not\n",
                records(survey, columns),
                places(survey)
            );
        }
    }
    format!("{text}\n{verdict}\n")
}

fn findings(findings: &[Finding], columns: usize) -> Table {
    let mut table = window::table(columns, ["state", "about", "finding", "what to do"]);
    for Finding { severity, about, finding, mend } in findings {
        table.add_row([word(*severity), about, finding, mend]);
    }
    table
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Wrong => "wrong",
        Severity::Doubtful => "doubtful",
        Severity::Note => "note",
        Severity::Right => "right",
    }
}

fn identifiers(survey: &Survey, rate_hz: f64, columns: usize) -> Table {
    let mut table = window::table(columns, ["identifier", "signals", "frames", "Hz", "expected"]);
    let rate = |Identifier { traffic, .. }: &Identifier| match traffic.rate_hz() {
        Some(rate) => format!("{rate:.1}"),
        None => "-".to_owned(),
    };
    let frames = |identifier: &Identifier| identifier.traffic.frames.to_string();
    for expected in &survey.expected {
        let at = if expected.is_sampled { format!("{rate_hz:.1}") } else { "any".to_owned() };
        let signals = expected.signals.join(", ");
        table.add_row([id(expected), signals, frames(expected), rate(expected), at]);
    }
    for other in survey.unexpected.iter().take(UNEXPECTED) {
        let none = "none".to_owned();
        table.add_row([id(other), none, frames(other), rate(other), "no".to_owned()]);
    }
    if let more @ 1.. = survey.unexpected.len().saturating_sub(UNEXPECTED) {
        let rest = survey.unexpected.iter().skip(UNEXPECTED);
        let frames: u64 = rest.map(|other| other.traffic.frames).sum();
        let cells =
            [format!("{more} more"), "none".into(), frames.to_string(), "-".into(), "no".into()];
        table.add_row(cells);
    }
    align(&mut table, 2..5);
    table
}

/// The joint angles of each pose, and the ends of each path, a line each.
fn places(survey: &Survey) -> String {
    let angles = |pose: &[f64]| {
        let all: Vec<String> = pose.iter().map(|angle| format!("{angle:.3}")).collect();
        all.join(" ")
    };
    let mut lines = String::new();
    let mut last = 0;
    for record in &survey.records {
        if let Some(number) = record.pose_number.filter(|number| *number > last) {
            last = number;
            let pose = angles(&record.pose);
            lines += &format!(" pose {last}: joints at {pose} rad (m), base first\n");
        }
    }
    for path in paths(survey) {
        if let Some([from, to]) = path.ends() {
            let [from, to] = [from, to].map(|own| angles(&own.pose));
            let (number, text) = (path.number, path.text());
            lines += &format!(" path {number}: {text}; from {from} to {to} rad (m), base first\n");
        }
    }
    lines
}

fn records(survey: &Survey, columns: usize) -> Table {
    let header = ["record", "start", "length", "place", "rest", "force", "clear", "not clear"];
    let mut table = window::table(columns, header);
    let first_s = survey.records.first().map_or(0.0, |record| record.start_s);
    for record in &survey.records {
        table.add_row(row(record, first_s));
    }
    align(&mut table, 0..7);
    table
}

fn row(record: &Examined, first_s: f64) -> Vec<String> {
    let (force, clear, bands) = match &record.excitation {
        Ok(excitation) => {
            let bands = enumerate(silent(&excitation.octaves).iter().map(band));
            (
                format!("{:.1}", excitation.rms_force_n),
                Percent(excitation.share()).to_string(),
                bands,
            )
        }
        Err(_) => ("-".to_owned(), "refused".to_owned(), String::new()),
    };
    let note = match record.repeats {
        Some(original) => format!("repeats record {original}"),
        None => bands,
    };
    vec![
        record.number.to_string(),
        // Two logs may have been made on different days.
        format!("{:.1}", record.start_s - first_s),
        format!("{:.2}", record.seconds),
        match (&record.travel, record.pose_number) {
            (Some(travel), _) => format!("path {}", travel.path),
            (None, pose) => format!("pose {}", pose.unwrap_or_default()),
        },
        format!("{:.2}", record.quiet_s),
        force,
        clear,
        note,
    ]
}

fn align(table: &mut Table, columns: std::ops::Range<usize>) {
    for (place, column) in table.column_iter_mut().enumerate() {
        if columns.contains(&place) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::fixture::{config, empty, good, identifier};

    #[test]
    fn the_verdict_is_the_first_line_and_the_last_and_findings_are_ordered() {
        let config = config();
        let mut survey = good();
        let check = Check::new(&config, Some(&survey));
        assert!(check.is_ready());
        let text = text(&check, 80);
        let verdict = Some("ready to identify: 3 records in 3 poses");
        assert_eq!([text.lines().next(), text.lines().last()], [verdict; 2]);
        assert!(
            text.lines().all(|line| line.starts_with(' ') || line.chars().count() <= 80),
            "{text}"
        );

        survey.expected[4].traffic = Default::default();
        survey.records.pop();
        let check = Check::new(&config, Some(&survey));
        assert_eq!(check.verdict(), "not ready: 0x113 (q3) is not in the log");
        assert!(check.findings.is_sorted_by_key(|finding| finding.severity));
        assert!(!check.is_ready());
    }

    #[test]
    fn causes_stand_before_what_they_bring_about() {
        let config = config();
        let mut survey = empty();
        survey.expected = vec![identifier(0x101, &["Fx", "Fy", "Fz"], 0)];
        let check = Check::new(&config, Some(&survey));
        assert_eq!(check.verdict(), "not ready: 0x101 (Fx, Fy, Fz) is not in the log (and 1 more)");
        assert!(check.findings[1].finding.starts_with("no record"));
    }

    #[test]
    fn without_a_log_the_configuration_is_judged() {
        let config = config();
        let check = Check::new(&config, None);
        assert_eq!(check.verdict(), "ready to record: 3 joints and 5 identifiers");
        assert!(!text(&check, 80).contains("identifier  "), "{}", text(&check, 80));
    }

    #[test]
    fn of_many_unknown_identifiers_the_rest_is_counted() {
        let mut survey = good();
        survey.unexpected = (0..20).map(|id| identifier(0x200 + id, &[], 2)).collect();
        let text = identifiers(&survey, 2000.0, 80).to_string();
        assert!(text.contains("12 more") && text.contains("24"), "{text}");
    }
}
