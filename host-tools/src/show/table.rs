//! The finding as a table for people.

use std::ops::Range;

use comfy_table::CellAlignment;
use flexid_core::imperfection::REFERENCE_HZ;
use flexid_core::parameters::Bushing;
pub(crate) use flexid_pipeline::names::DOF_NAMES;
use flexid_pipeline::names::{DAMPING_UNITS, STIFFNESS_UNITS};
use flexid_pipeline::report::{StaticReport, Summary};
use flexid_wire::confidence::{Confidence, Interval};
use flexid_wire::finding::Finding;
use flexid_wire::report::{Acceptance, Report, Verdict};
use flexid_wire::words::{Percent, Within, prefixed};

use super::verdict::verdict;
use crate::numbers::places;
use crate::show::{answer, confidence, statics};
use crate::window;

/// Explains the SSP in the summary of a fit.
const SSP: &str = "SSP, the surface similarity parameter, is 0 where model and measurement agree, and 2 where they are opposite; \
                   the first is the median of all directions of all records";

/// The estimate in a report, base first.
pub(crate) fn bushings(report: &Report) -> Vec<Bushing> {
    let bushing = |joint: &flexid_wire::report::JointReport| Bushing {
        stiffness: joint.stiffness,
        damping: joint.damping,
    };
    report.joints.iter().map(bushing).collect()
}

/// All parameters, their confidence, the static tests, the answer, the summary of the fit, and the warnings. With `truth` (base first) the table
/// also has the true values and the errors of the estimates, where the truth is known.
pub(crate) fn finding(
    finding: &Finding,
    statics: Option<&StaticReport>,
    truth: Option<&[Option<Bushing>]>,
) -> String {
    let tests = statics.map(statics::lines).unwrap_or_default();
    let ssp = match finding.report.fit.records {
        0 => String::new(),
        _ => format!("\n {SSP}\n"),
    };
    let answer = finding.answer.as_ref().map(|own| answer::lines(own).join("\n") + "\n");
    format!(
        "{}{tests}{ssp}\n{}{}",
        parameters(finding, truth),
        answer.unwrap_or_default(),
        Summary(&finding.report)
    )
}

/// All parameters and their confidence, without the summary of the fit and the warnings.
pub(crate) fn parameters(finding: &Finding, truth: Option<&[Option<Bushing>]>) -> String {
    format!("{}\n{}", numbers(finding, truth, window::columns()), confidence::lines(finding))
}

/// All parameters with intervals and verdicts, and a note on the intervals: dampings beside the stiffnesses, or below where `columns`
/// have no room. Without records there are no dampings.
pub(crate) fn numbers(
    finding: &Finding,
    truth: Option<&[Option<Bushing>]>,
    columns: usize,
) -> String {
    let has_dampings = finding.report.fit.records > 0;
    let beside = grid(finding, truth, 0..1 + usize::from(has_dampings), usize::MAX);
    let is_wide = beside.lines().any(|line| console::measure_text_width(line) > columns);
    let tables = match has_dampings && is_wide {
        true => [0..1, 1..2].map(|kind| grid(finding, truth, kind, columns)).join("\n\n"),
        false => beside,
    };
    let at = match has_dampings {
        true => format!("\n with hysteresis these are the values at {REFERENCE_HZ} Hz"),
        false => String::new(),
    };
    let kinds = 1 + usize::from(has_dampings);
    let mut verdicts = finding.report.joints.iter().flat_map(|joint| {
        [joint.stiffness_verdict, joint.damping_verdict].into_iter().take(kinds).flatten()
    });
    let open = match verdicts.any(|own| own == Verdict::NotObservable) {
        true => "\n in brackets: no result, but where the search has ended",
        false => "",
    };
    format!(
        "{tables}\n tx ty tz along, rx ry rz about the axes of the joint frame{at}{open}\n{}",
        caveat(&finding.report, &finding.confidence)
    )
}

/// The table of stiffnesses (kind 0), dampings (kind 1), or both.
fn grid(
    Finding { report, confidence, .. }: &Finding,
    truth: Option<&[Option<Bushing>]>,
    kinds: Range<usize>,
    columns: usize,
) -> String {
    let mut header = vec!["joint", "DOF"];
    for name in &["stiffness", "damping"][kinds.clone()] {
        header.extend([*name, "95 %", "verdict"]);
        if truth.is_some() {
            header.extend(["true", "off by"]);
        }
    }
    let mut table = window::table(columns, header);
    for (index, (joint, intervals)) in report.joints.iter().zip(&confidence.joints).enumerate() {
        let truth = truth.map(|truth| truth.get(index).copied().flatten());
        for (dof, name) in DOF_NAMES.iter().enumerate() {
            let joint_name = if dof == 0 { joint.name.as_str() } else { "" };
            let mut row = vec![joint_name.to_owned(), (*name).to_owned()];
            let stiffness = cells(
                joint.stiffness[dof],
                STIFFNESS_UNITS[dof],
                intervals.stiffness_interval[dof],
                joint.stiffness_verdict[dof],
                truth.map(|truth| truth.map(|truth| truth.stiffness[dof])),
            );
            let damping = cells(
                joint.damping[dof],
                DAMPING_UNITS[dof],
                intervals.damping_interval[dof],
                joint.damping_verdict[dof],
                truth.map(|truth| truth.map(|truth| truth.damping[dof])),
            );
            row.extend([stiffness, damping][kinds.clone()].concat());
            table.add_row(row);
        }
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}

/// The note on intervals that are wider than the noise makes them, or on missing intervals of measured parameters.
fn caveat(report: &Report, confidence: &Confidence) -> String {
    let times = report.fit.consistency.sqrt();
    let intervals = confidence
        .joints
        .iter()
        .flat_map(|joint| joint.stiffness_interval.iter().chain(&joint.damping_interval));
    let deviations =
        report.joints.iter().flat_map(|joint| joint.stiffness_std.iter().chain(&joint.damping_std));
    if intervals.flatten().next().is_some() {
        let larger = confidence.residuals.size_objects.then(|| {
            format!(
                " intervals are at least √(χ²/dof) = {times:.1} times as wide as the noise makes them\n"
            )
        });
        let robust = confidence.robust_widening.map(robust);
        larger.into_iter().chain(robust).collect()
    } else if deviations.flatten().next().is_none() {
        String::new()
    } else if report.fit.acceptance == Acceptance::Unsettled {
        " no intervals: another minimum may be the right one\n".to_owned()
    } else if confidence.residuals.size_objects {
        format!(
            " no intervals: residuals of {times:.1} times the noise have another cause, and it is not known how \
             far that moves the numbers\n"
        )
    } else {
        " no intervals: static tests contradict the fit\n".to_owned()
    }
}

/// The note on robust intervals, which are so many times as wide.
fn robust(times: f64) -> String {
    format!(
        " intervals are robust: no narrower than the numbers scatter between bands of the records; that makes them \
         {times:.1} times as wide as accuracies and √(χ²/dof) make them (root mean square)\n"
    )
}

/// Value, in brackets if it is no result, interval and verdict, and with a `truth` also the truth, in the unit of the value, and the error in
/// per cent, if it is known. Three digits count, or as many as show two of the interval.
fn cells(
    value: f64,
    unit: &str,
    interval: Option<Interval>,
    own: Verdict,
    truth: Option<Option<f64>>,
) -> Vec<String> {
    let (scale, prefix) = prefixed(value.abs());
    let three = places(value.abs() / scale, 3);
    let digits =
        interval.map_or(three, |[low, high]| three.max(places((high - low) / 2.0 / scale, 2)));
    let shown = format!("{:.digits$} {prefix}{unit}", value / scale);
    let mut cells = vec![
        if own == Verdict::NotObservable { format!("({shown})") } else { shown },
        interval.map_or_else(|| "-".to_owned(), |interval| Within { value, interval }.to_string()),
        verdict(own).to_owned(),
    ];
    match truth {
        Some(Some(truth)) => {
            cells.extend([
                format!("{:.*}", digits.max(places(truth.abs() / scale, 3)), truth / scale),
                Percent(value / truth - 1.0).to_string(),
            ]);
        }
        Some(None) => cells.extend(["-", "-"].map(str::to_owned)),
        None => {}
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::show::page::tests::finding;

    #[test]
    fn a_row_has_value_interval_verdict_and_truth() {
        let row = cells(2.02e6, "N/m", Some([2.0e6, 2.04e6]), Verdict::Weak, Some(Some(2.0e6)));
        assert_eq!(row, ["2.020 MN/m", "±1.0 %", "weak", "2.000", "1.0 %"]);
        let row = cells(1.0e10, "N/m", None, Verdict::NotObservable, Some(Some(2.0e6)));
        assert_eq!(row[3..], ["0.00200", "499900 %"]);
        let row = cells(3.0e8, "N/m", Some([2.9e8, 3.2e8]), Verdict::Weak, None);
        assert_eq!(row, ["300 MN/m", "-3.3 to +6.7 %", "weak"]);
        let row = cells(3.0e6, "Nm/rad", None, Verdict::NotObservable, None);
        assert_eq!(row, ["(3.00 MNm/rad)", "-", "not observable"]);
        let row = cells(3.0e6, "Nm/rad", None, Verdict::NotObservable, Some(None));
        assert_eq!(row, ["(3.00 MNm/rad)", "-", "not observable", "-", "-"]);
    }

    #[test]
    fn what_makes_intervals_wider_is_noted() {
        let mut finding = finding(1);
        let said = |finding: &Finding| caveat(&finding.report, &finding.confidence);
        assert_eq!(said(&finding), "");
        finding.confidence.robust_widening = Some(1.34);
        let robust = said(&finding);
        assert!(
            robust.starts_with(" intervals are robust: ") && robust.contains(" 1.3 times as wide")
        );
        finding.report.fit.consistency = 4.0;
        finding.confidence.residuals.size_objects = true;
        let both = said(&finding);
        assert!(
            both.starts_with(" intervals are at least √(χ²/dof) = 2.0 times")
                && both.ends_with(&robust),
            "{both}"
        );
        // Without intervals there are none that are robust.
        for joint in &mut finding.confidence.joints {
            joint.stiffness_interval = [None; 6];
            joint.damping_interval = [None; 6];
        }
        assert!(!said(&finding).contains("robust"));
    }
}
