//! Predictions as tables for people.

use std::path::Path;

use comfy_table::CellAlignment;
use flexid_edge::console::complain;
use flexid_prediction::document::{Found, is_far};
use flexid_prediction::modes::Mode;
use flexid_prediction::{Estimate, PositiveEstimate};
use flexid_wire::report::{Acceptance, Fit};
use flexid_wire::words::{ThreeDigits, Within};

use super::Prediction;
use crate::numbers::places;
use crate::window;

/// Names of the degrees of freedom of a joint.
pub(crate) const DOF: [&str; 6] = ["tx", "ty", "tz", "rx", "ry", "rz"];
/// Springs named beside a mode, at most. Chosen: two stand in a line of 80 columns.
const SPRINGS: usize = 2;
/// Least part of a mode's strain energy of a spring that is named.
const LEAST: f64 = 0.1;

/// All predictions as text, in tables of at most so many columns.
///
/// The modes go up to `highest_hz`.
pub(crate) fn predictions(
    found: &Found,
    predictions: &[Prediction],
    highest_hz: f64,
    columns: usize,
) -> String {
    let doubt = doubt(&found.fit).map(|line| format!("{line}\n")).unwrap_or_default();
    let parts = predictions.iter().map(|own| one(found, own, columns));
    let [_, upper_hz] = found.robot.band_hz();
    let hint = if highest_hz == upper_hz && found.fit.records > 0 {
        format!(
            " modes up to the end of the band, {upper_hz} Hz: --highest HZ lists others, which no record shows\n"
        )
    } else {
        String::new()
    };
    format!("{doubt}{}\n{hint}{AXES}\n", parts.collect::<Vec<_>>().join("\n"))
}

/// The verdict on a fit, for files.
pub(crate) fn verdict(fit: &Fit) -> &'static str {
    match fit.acceptance {
        Acceptance::Consistent => "consistent: noise explains the residuals of the fit",
        Acceptance::ModelSuspect => "MODEL SUSPECT: the fit leaves more than noise",
        Acceptance::Unsettled => "NOT SETTLED: the fit may have missed the right minimum",
    }
}

/// Why predictions from a fit may be off by more than their intervals say, if they may.
pub(crate) fn doubt(fit: &Fit) -> Option<&'static str> {
    match fit.acceptance {
        Acceptance::Consistent => None,
        _ if is_far(fit) => Some(
            "χ²/dof IS ABOVE 10: the fit is far from the records, and neither these numbers nor their intervals hold: check masses, TCP, axes and units",
        ),
        Acceptance::ModelSuspect => Some(
            "MODEL SUSPECT: the fit leaves more than noise, and what is predicted may be off by more than the intervals say",
        ),
        Acceptance::Unsettled => Some(
            "NOT SETTLED: the fit may have missed the right minimum, and the intervals do not allow for that",
        ),
    }
}

/// Why nothing that needs a damping can be said of a fit to static tests alone, if the fit is one.
pub(crate) fn lacks_damping(fit: &Fit) -> Option<&'static str> {
    (fit.records == 0).then_some(
        "rests on static tests alone, which show no damping: identify the log of a cut with them",
    )
}

/// Says the same on stderr, of a result `file` whose reader does not see the text.
pub(crate) fn warn_of(file: &Path, fit: &Fit) {
    if let Some(doubt) = doubt(fit) {
        complain(&format!("warning: {}: {doubt}", file.display()));
    }
}

/// Stands in place of a number that says nothing.
pub(crate) const OPEN: &str = "not determined";

/// Explains x, y and z.
pub(crate) const AXES: &str = " x, y, z: axes of the tool centre point (TCP)";

/// Three estimates along the axes, times `scale`, with their intervals: in per cent, or its ends where it holds zero. Three digits count, of
/// what may be zero those of the largest number or half interval.
pub(crate) fn along_axes(estimates: &[Estimate; 3], scale: f64) -> String {
    let determined = || estimates.iter().filter(|own| own.determined);
    // What is zero by calculation is known no better than its interval.
    let size = |own: &Estimate| {
        let [low, high] = own.interval;
        scale * own.value.abs().max((high - low) / 2.0)
    };
    let Some(largest) = determined().map(size).reduce(f64::max) else {
        return format!(" {OPEN}");
    };
    let places = places(largest, 3);
    let least = 0.5 * 0.1_f64.powi(places as i32);
    let each = estimates.iter().zip(["x", "y", "z"]).map(|(own, axis)| {
        if !own.determined {
            return format!(" {axis} {OPEN}");
        }
        let [low, high] = own.interval;
        if low > 0.0 || high < 0.0 {
            let ends = [low.abs().min(high.abs()), low.abs().max(high.abs())];
            let within = Within { value: own.value.abs(), interval: ends };
            return format!(" {axis} {} ({within})", ThreeDigits(scale * own.value));
        }
        // What rounds to zero has no sign.
        let scaled = |own: f64| if (scale * own).abs() < least { 0.0 } else { scale * own };
        let [low, high] = own.interval.map(scaled);
        format!(" {axis} {:.places$} ({low:.places$} to {high:.places$})", scaled(own.value))
    });
    each.collect::<Vec<_>>().join(",")
}

fn one(found: &Found, prediction: &Prediction, columns: usize) -> String {
    let pose: Vec<String> = prediction.pose.iter().map(|angle| format!("{angle:.4}")).collect();
    let mut text = format!("pose [{}]\n", pose.join(", "));
    let [lower_hz, upper_hz] = found.robot.band_hz();
    // Static tests show no damping, and have no band.
    let is_static = found.fit.records == 0;
    let dampings: &[&str] = if is_static { &[] } else { &["damping", "95 %"] };
    let header = ["mode", "Hz", "95 %"].iter().chain(dampings).chain(&["springs"]);
    let mut table = window::table(columns, header);
    let is_above = |mode: &Mode| !is_static && mode.frequency_hz.value > upper_hz;
    for (number, mode) in (1..).zip(&prediction.modes) {
        let above = if is_above(mode) { " *" } else { "" };
        let open = if mode.frequency_hz.is_observable() { "" } else { " ?" };
        let [frequency, frequencies] = cells(&mode.frequency_hz, 1.0, "");
        let mut row = vec![format!("{number}{above}{open}"), frequency, frequencies];
        if !is_static {
            row.extend(cells(&mode.damping_ratio, 100.0, " %"));
        }
        row.push(springs(found, &mode.energy));
        table.add_row(row);
    }
    for column in table.column_iter_mut().take(3 + dampings.len()) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    text += &format!("{table}\n");
    if is_static {
        text += " modes by the masses of the model: static tests show none, and no damping\n";
    }
    if prediction.modes.iter().any(is_above) {
        text += &format!(
            " * above the band that was fitted, {lower_hz} to {upper_hz} Hz: no record shows it, the model extrapolates\n"
        );
    }
    if !prediction.modes.iter().all(|mode| mode.frequency_hz.is_observable()) {
        text += " ? its springs are not determined: it may lie anywhere\n";
    }
    text += &format!(" stiffness at the tool, N/µm:{}\n", stiffnesses(prediction));
    if let Some(deflection) = &prediction.deflection {
        for (what, own) in
            [("deflection, µm", &deflection.translation), ("rotation, µrad", &deflection.rotation)]
        {
            text += &format!(" {what}:{}\n", along_axes(own, 1e6));
        }
    }
    text
}

/// The stiffness along each axis, N/µm, one loaded at a time: the inverse of the compliance there.
fn stiffnesses(prediction: &Prediction) -> String {
    let along = |(axis, name): (usize, &str)| {
        let own: Estimate = prediction.compliance[axis][axis];
        if !own.determined {
            return format!(" {name} {OPEN}");
        }
        let [least, most] = own.interval.map(|compliance| 1e-6 / compliance);
        let value = 1e-6 / own.value;
        // A compliance whose interval reaches zero has no largest stiffness.
        let interval = if least > 0.0 {
            Within { value, interval: [most, least] }.to_string()
        } else {
            format!("above {}", ThreeDigits(most))
        };
        format!(" {name} {} ({interval})", ThreeDigits(value))
    };
    ["x", "y", "z"].into_iter().enumerate().map(along).collect::<Vec<_>>().join(",")
}

/// A number, `scale` times with its unit, and its interval: `-` where the records do not determine it, and no number where it says nothing.
fn cells(own: &PositiveEstimate, scale: f64, unit: &str) -> [String; 2] {
    let value = || format!("{}{unit}", ThreeDigits(scale * own.value));
    let interval = || Within { value: own.value, interval: own.interval }.to_string();
    match (own.is_observable(), own.determined) {
        (true, _) => [value(), interval()],
        (false, true) => [value(), "-".into()],
        (false, false) => ["-".into(), OPEN.into()],
    }
}

/// The springs with most of the strain energy of a mode.
fn springs(found: &Found, energy: &[[f64; 6]]) -> String {
    let mut all: Vec<(f64, String)> = Vec::new();
    for (joint, parts) in found.joints.iter().zip(energy) {
        for (part, dof) in parts.iter().zip(DOF) {
            all.push((*part, format!("{} {dof}", joint.name)));
        }
    }
    all.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let named = all.iter().take(SPRINGS).take_while(|(part, _)| *part >= LEAST);
    let named: Vec<String> =
        named.map(|(part, name)| format!("{name} {:.0} %", 100.0 * part)).collect();
    named.join(", ")
}

#[cfg(test)]
mod tests {
    use flexid_wire::report::FoundBy;

    use super::*;

    #[test]
    fn what_no_record_determines_has_no_interval() {
        let shown = |value, std, scale| cells(&PositiveEstimate::new(value, std), scale, "");
        assert_eq!(shown(12.3041, 0.01, 1.0), ["12.3", "±2.0 %"]);
        assert_eq!(shown(0.02, 0.31, 100.0), ["2.00", "-"]);
        assert_eq!(shown(0.02, 1.1, 100.0), ["-", "not determined"]);
        assert_eq!(shown(-0.02, 0.01, 100.0), ["-", "not determined"]);
        assert_eq!(shown(12.3041, f64::NAN, 1.0), ["-", "not determined"]);
    }

    #[test]
    fn a_fit_far_from_the_records_is_worth_nothing() {
        let said = |acceptance, consistency| {
            let fit = Fit {
                records: 3,
                frames: 0,
                frames_lost: 0,
                ssp: 0.01,
                ssp_max: 0.01,
                consistency,
                search_evaluations: 0,
                refine_iterations: 0,
                starts: 1,
                bridged: 0,
                seconds: 0.0,
                acceptance,
                found_by: FoundBy::Descent,
                random_searches: 0,
                branches: 0,
            };
            doubt(&fit).unwrap_or("")
        };
        assert_eq!(said(Acceptance::Consistent, 1.0), "");
        assert!(said(Acceptance::Unsettled, 9.0).starts_with("NOT SETTLED: "));
        assert!(said(Acceptance::ModelSuspect, 9.0).starts_with("MODEL SUSPECT: "));
        assert!(said(Acceptance::Unsettled, 11.0).starts_with("χ²/dof IS ABOVE 10: "));
    }

    /// A component near zero is known where its error is small beside the vector.
    #[test]
    fn a_vector_is_shown_where_its_error_is_below_its_length() {
        let of = |stds: [f64; 3]| {
            let [x, y, z] = stds;
            let all = [Estimate::new(0.0, x), Estimate::new(-4e-6, y), Estimate::new(3e-6, z)];
            along_axes(&Estimate::beside_length(all), 1e6)
        };
        let known = " x 0.00 (-1.96 to 1.96), y -4.00 (±49 %), z 3.00 (-6.60 to 12.60)";
        assert_eq!(of([1e-6, 1e-6, 4.9e-6]), known);
        assert!(of([1e-6, 1e-6, 5.1e-6]).ends_with(", z not determined"));
        assert_eq!(of([6e-6, 6e-6, f64::INFINITY]), " not determined");
        // Nothing but rounding is left of what is taken back.
        let left = Estimate { determined: true, ..Estimate::new(1e-17, 4e-7) };
        let interval = "0.000 (-0.784 to 0.784)";
        let expected = format!(" x {interval}, y {interval}, z {interval}");
        assert_eq!(along_axes(&[left; 3], 1e6), expected);
    }
}
