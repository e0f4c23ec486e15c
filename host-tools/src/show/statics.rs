//! The static tests in a fit, in lines for people.

use flexid_pipeline::report::{StaticReport, StaticTestReport};
use flexid_pipeline::text::count;

use super::confidence::INDENT;

/// Largest number of tests shown.
const MOST: usize = 5;

/// Their noise, and the tests that are farthest from what all others predict.
pub(crate) fn lines(report: &StaticReport) -> String {
    let StaticReport { tests, .. } = report;
    let mut farthest: Vec<&StaticTestReport> =
        tests.iter().filter(|test| test.deviations.is_some()).collect();
    farthest.sort_by(|a, b| b.deviations.unwrap_or(0.0).total_cmp(&a.deviations.unwrap_or(0.0)));
    let mut lines = vec![format!("{}{}", count(tests.len() as u64, "test"), noise(report))];
    if !farthest.is_empty() {
        lines.push("farthest from what all others predict, in standard deviations:".to_owned());
    }
    lines.extend(farthest.iter().take(MOST).map(|test| line(test)));
    let mut text = String::new();
    for (number, line) in lines.iter().enumerate() {
        let about = if number == 0 { "static" } else { "" };
        text += &format!("{about:INDENT$}{line}\n");
    }
    text
}

/// Estimated deviation, m, beyond which a gauge is not the cause: dial gauges of 10 mm err by up to 25 µm (DIN 878), laser trackers by
/// up to 40 µm at 5 m (10 µm and 5 µm/m, data sheets).
const OF_NO_GAUGE: f64 = 5e-5;

/// The standard deviation of the displacements that state none, and where it is from.
fn noise(report: &StaticReport) -> String {
    let Some(deviation) = report.deviation_m else { return String::new() };
    let micrometres = 1e6 * deviation;
    // Three digits: of fifty readings the second is unsure.
    let digits = (2.0 - micrometres.log10().floor()).clamp(0.0, 3.0) as usize;
    if report.deviation_is_estimated {
        let cause = if deviation > OF_NO_GAUGE {
            ". No gauge has that: the model may lack a compliance, as with drive_only, and the stiffnesses make up for it"
        } else {
            ""
        };
        format!(
            "; standard deviation {micrometres:.digits$} µm where none is stated, by the residuals: a χ²/dof near 1 says nothing of these{cause}"
        )
    } else {
        format!(
            "; standard deviation {micrometres:.0} µm assumed where none is stated: too few residuals to tell it"
        )
    }
}

fn line(test: &StaticTestReport) -> String {
    let axes = |values: &[Option<f64>; 3]| {
        let cells =
            values.map(|value| value.map_or("-".to_owned(), |value| format!("{value:+.1}")));
        cells.join(" ")
    };
    let StaticTestReport { line, residual, left_out, deviations, chance } = test;
    let chance = match chance.unwrap_or(1.0) {
        chance if chance < 0.01 => format!("{chance:.0e}"),
        chance => format!("{chance:.2}"),
    };
    format!(
        "line {line}: {:.1}, by chance {chance}; x y z {}, in the fit {}",
        deviations.unwrap_or(0.0),
        axes(left_out),
        axes(residual)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn test(line: usize, deviations: Option<f64>) -> StaticTestReport {
        StaticTestReport {
            line,
            residual: [Some(1.25), None, Some(-0.5)],
            left_out: [Some(6.0), None, Some(-2.0)],
            deviations,
            chance: deviations.map(|_| 0.25),
        }
    }

    #[test]
    fn the_farthest_come_first() {
        let mut report = StaticReport {
            deviation_m: None,
            deviation_is_estimated: false,
            tests: (2..9).map(|line| test(line, Some(line as f64))).collect(),
        };
        let text = lines(&report);
        assert!(text.starts_with("static       7 tests\n"), "{text}");
        let first = "line 8: 8.0, by chance 0.25; x y z +6.0 - -2.0, in the fit +1.2 - -0.5";
        assert_eq!(text.lines().nth(2).unwrap().trim(), first);
        assert_eq!(text.lines().count(), 7);
        report.tests = vec![test(2, None)];
        (report.deviation_m, report.deviation_is_estimated) = (Some(1e-5), false);
        let assumed = "1 test; standard deviation 10 µm assumed where none is stated: too few residuals to tell it";
        assert_eq!(lines(&report).trim(), format!("static       {assumed}"));
        (report.deviation_m, report.deviation_is_estimated) = (Some(4.5678e-6), true);
        let text = lines(&report);
        assert!(
            text.contains("deviation 4.57 µm where none is stated, by the residuals"),
            "{text}"
        );
        assert!(!text.contains("No gauge"));
        report.deviation_m = Some(1.17e-4);
        assert!(lines(&report).contains("117 µm where none is stated"));
        assert!(lines(&report).contains("No gauge has that: the model may lack a compliance"));
    }
}
