//! A report as a table for people.

use comfy_table::{CellAlignment, LineStyle, Table, TableStyle};
use flexid_core::parameters::Bushing;
use flexid_edge::summary::Summary;
use flexid_wire::report::{Report, Verdict};

/// Degrees of freedom in the order of all vectors of six.
pub(crate) const DOF_NAMES: [&str; 6] = ["tx", "ty", "tz", "rx", "ry", "rz"];

/// A line below the header, and no other.
const STYLE: TableStyle =
    TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// The estimate in a report, base first.
pub fn bushings(report: &Report) -> Vec<Bushing> {
    let bushing = |joint: &flexid_wire::report::JointReport| Bushing {
        stiffness: joint.stiffness,
        damping: joint.damping,
    };
    report.joints.iter().map(bushing).collect()
}

/// All parameters, how the fit went, and the warnings; with `truth` (base first) also the true values and
/// how far the estimates are from them.
pub fn report(report: &Report, truth: Option<&[Bushing]>) -> String {
    let mut table = Table::new();
    table.load_style(STYLE);
    let mut header = vec!["joint", "DOF"];
    for name in ["stiffness", "damping"] {
        header.extend([name, "±", "verdict"]);
        if truth.is_some() {
            header.extend(["true", "off by"]);
        }
    }
    table.set_header(header);
    for (index, joint) in report.joints.iter().enumerate() {
        let truth = truth.and_then(|truth| truth.get(index));
        for (dof, name) in DOF_NAMES.iter().enumerate() {
            let joint_name = if dof == 0 { joint.name.as_str() } else { "" };
            let mut row = vec![joint_name.to_owned(), (*name).to_owned()];
            let (value, deviation) = (joint.stiffness[dof], joint.stiffness_std[dof]);
            let true_value = truth.map(|truth| truth.stiffness[dof]);
            row.extend(cells(value, deviation, joint.stiffness_verdict[dof], true_value));
            let (value, deviation) = (joint.damping[dof], joint.damping_std[dof]);
            let true_value = truth.map(|truth| truth.damping[dof]);
            row.extend(cells(value, deviation, joint.damping_verdict[dof], true_value));
            table.add_row(row);
        }
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    format!(
        "{table}\n N/m and Ns/m along the axes of the joint frame, Nm/rad and Nms/rad about them\n\n{}",
        Summary(report)
    )
}

/// Value, standard deviation in per cent, verdict, and where there is one the truth and the error in per cent.
fn cells(value: f64, deviation: Option<f64>, verdict: Verdict, truth: Option<f64>) -> Vec<String> {
    let percent = |part: f64| format!("{:.2} %", 100.0 * part);
    let verdict = match verdict {
        Verdict::Identified => "identified",
        Verdict::Weak => "weak",
        Verdict::NotObservable => "not observable",
    };
    let mut cells = vec![
        format!("{value:.4e}"),
        deviation.map_or_else(|| "-".to_owned(), |deviation| percent(deviation / value)),
        verdict.to_owned(),
    ];
    if let Some(truth) = truth {
        cells.extend([format!("{truth:.4e}"), percent(value / truth - 1.0)]);
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_tells_value_deviation_verdict_and_truth() {
        let cells = cells(2.02e6, Some(1.01e4), Verdict::Weak, Some(2.0e6));
        assert_eq!(cells, ["2.0200e6", "0.50 %", "weak", "2.0000e6", "1.00 %"]);
        let cells = super::cells(3.0e6, None, Verdict::NotObservable, None);
        assert_eq!(cells, ["3.0000e6", "-", "not observable"]);
    }
}
