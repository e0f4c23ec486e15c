//! All parameters in few lines: stiffnesses above dampings, a column for each joint.

use console::{measure_text_width, truncate_str};
use flexid_wire::confidence::{Interval, JointIntervals};
use flexid_wire::finding::Finding;
use flexid_wire::report::{JointReport, Verdict};
use flexid_wire::words::Percent;

use crate::show::headline::tone;
use crate::show::line::Line;
use crate::show::table::DOF_NAMES;

/// Meaning of the marks, and the units.
const LEGEND: &str = "95 % intervals; ~ weak, ? not observable, = fixed; N/m Nm/rad, Ns/m Nms/rad";
/// Meaning of the marks where there is no room for intervals.
const NO_INTERVALS: &str = "~ weak, ? not observable, = fixed; a wider window has the intervals";

/// Names of the blocks, and what stands for them where there is no room.
const BLOCKS: [[&str; 2]; 2] = [["stiffness", "stiff"], ["damping", "damp"]];

/// The form in which a parameter is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// Value to four digits, interval.
    Long,
    /// Value to two digits, interval.
    Short,
    /// Value to two digits.
    Value,
}

type Joint<'a> = (&'a JointReport, &'a JointIntervals);

/// Two blocks of six lines with their headers, and a line with the legend or with what `columns` have no room for.
pub(crate) fn parameters(finding: &Finding, columns: usize) -> Vec<Line> {
    let joints: Vec<_> = finding.report.joints.iter().zip(&finding.confidence.joints).collect();
    let beside_dof = columns.saturating_sub(DOF_NAMES[0].len());
    let room = |joints: usize| beside_dof / joints.max(1);
    let fits = |form: &Form| widest(&joints, *form) <= room(joints.len());
    let (form, shown) = match [Form::Long, Form::Short, Form::Value].into_iter().find(fits) {
        Some(form) => (form, joints.len()),
        None => (Form::Value, beside_dof / widest(&joints, Form::Value)),
    };
    let (joints, hidden) = joints.split_at(shown);
    // A column is as wide as names and numbers need, and no wider than the room.
    // The header of the first begins above the directions.
    let block = 1 + BLOCKS[0][1].len() - DOF_NAMES[0].len();
    let names = joints.iter().map(|(joint, _)| block + measure_text_width(&joint.name));
    let width = names.chain([widest(joints, form)]).max().unwrap_or(1).min(room(shown));
    let cells: Vec<_> = joints.iter().map(|joint| cells(joint, form)).collect();
    let mut lines = Vec::new();
    for (block, what) in BLOCKS.into_iter().enumerate() {
        lines.push(header(what, joints, width).into());
        for (dof, name) in DOF_NAMES.iter().enumerate() {
            let mut line = Line::from(*name);
            for ((report, _), joint) in joints.iter().zip(&cells) {
                let verdicts = [&report.stiffness_verdict, &report.damping_verdict];
                line.push(tone(verdicts[block][dof]), format!("{:>width$}", joint[block][dof]));
            }
            lines.push(line);
        }
    }
    let note = match hidden {
        [] if form == Form::Value => NO_INTERVALS.to_owned(),
        [] => LEGEND.to_owned(),
        [(first, _), ..] => format!("from {} on hidden: widen the window", first.name),
    };
    lines.push(truncate_str(&note, columns, "…").into());
    lines
}

/// Width of the widest number of a form, with a column before it.
fn widest(joints: &[Joint], form: Form) -> usize {
    let cells = joints.iter().flat_map(|joint| cells(joint, form).concat());
    1 + cells.map(|cell| measure_text_width(&cell)).max().unwrap_or_default()
}

/// Stiffnesses and dampings, each with the mark of its verdict.
fn cells((joint, intervals): &Joint, form: Form) -> [[String; 6]; 2] {
    let cells = |values: &[f64; 6], intervals: &[Option<Interval>; 6], verdicts: &[Verdict; 6]| {
        std::array::from_fn(|dof| cell(values[dof], intervals[dof], form) + mark(verdicts[dof]))
    };
    [
        cells(&joint.stiffness, &intervals.stiffness_interval, &joint.stiffness_verdict),
        cells(&joint.damping, &intervals.damping_interval, &joint.damping_verdict),
    ]
}

fn cell(value: f64, interval: Option<Interval>, form: Form) -> String {
    match (form, interval) {
        (Form::Long, Some(interval)) => format!("{value:.3e} ±{}", percent(value, interval)),
        (Form::Long, None) => format!("{value:.3e}"),
        (Form::Short, Some(interval)) => format!("{value:.1e}±{}", percent(value, interval)),
        (Form::Short, None) | (Form::Value, _) => format!("{value:.1e}"),
    }
}

/// The header of a block: its name, and the joints' names above their columns. Both are short where there is no room.
fn header([what, short]: [&str; 2], joints: &[Joint], width: usize) -> String {
    let mut header = String::new();
    for (index, (joint, _)) in joints.iter().enumerate() {
        let (what, width) =
            if index == 0 { (what, width + DOF_NAMES[0].len()) } else { ("", width) };
        let beside_name = width.saturating_sub(1 + measure_text_width(&joint.name));
        let what = if index == 0 && what.len() > beside_name { short } else { what };
        let name = truncate_str(&joint.name, width.saturating_sub(1 + what.len()), "…");
        let gap = width.saturating_sub(measure_text_width(&name) + what.len());
        header += &format!("{what}{:gap$}{name}", "");
    }
    header
}

fn mark(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Identified => " ",
        Verdict::Weak => "~",
        Verdict::NotObservable => "?",
        Verdict::Fixed => "=",
    }
}

/// Half the width of an interval in per cent of the value, without blanks.
fn percent(value: f64, [lower, upper]: Interval) -> String {
    Percent(0.5 * (upper - lower) / value).to_string().replace(' ', "").replace("<0.", "<.")
}

#[cfg(test)]
mod tests {
    use flexid_wire::text::clipped;

    use super::*;
    use crate::show::page::tests::finding;

    fn fits(finding: &Finding, columns: usize) -> Vec<String> {
        let lines: Vec<_> = parameters(finding, columns).iter().map(Line::text).collect();
        assert_eq!(lines.len(), 15, "{lines:#?}");
        for line in &lines {
            assert!(measure_text_width(line) <= columns, "{line:?} is wider than {columns}");
        }
        lines
    }

    #[test]
    fn three_joints_have_all_in_eighty_columns() {
        let mut finding = finding(3);
        finding.report.joints[1].damping_verdict[5] = Verdict::NotObservable;
        finding.confidence.joints[1].damping_interval[5] = None;
        let lines = fits(&finding, 80);
        let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&lines[0]), ["stiffness", "joint_1", "joint_2", "joint_3"]);
        assert_eq!(words(&lines[1])[..3], ["tx", "6.000e7", "±1.7%"]);
        assert_eq!(words(&lines[13])[3..5], ["2.000e4?", "2.000e4"], "{}", lines[13]);
        assert_eq!(lines[14], LEGEND);
    }

    #[test]
    fn six_joints_have_all_in_eighty_columns_and_seven_their_values() {
        let lines = fits(&finding(6), 80);
        assert_eq!(lines[1].matches("6.0e7±1.7%").count(), 6, "{}", lines[1]);
        assert!(lines[0].starts_with("stiff") && lines[7].starts_with("damp"), "{lines:#?}");
        assert!(lines[0].contains(" joint_1") && lines[7].contains(" joint_6"), "{}", lines[7]);
        let lines = fits(&finding(7), 72);
        assert_eq!(lines[1].matches("6.0e7").count(), 7);
        assert!(lines[14].ends_with("a wider window has the intervals"), "{}", lines[14]);
    }

    #[test]
    fn names_are_whole_above_numbers_without_intervals() {
        for joints in 3..=6 {
            let mut finding = finding(joints);
            for own in &mut finding.confidence.joints {
                (own.stiffness_interval, own.damping_interval) = ([None; 6], [None; 6]);
            }
            let lines = fits(&finding, 80);
            let words = |line: &str| line.split_whitespace().count();
            assert!(!lines[0].contains('…') && words(&lines[0]) == joints + 1, "{}", lines[0]);
            assert!(!lines[7].contains('…') && words(&lines[7]) == joints + 1, "{}", lines[7]);
        }
    }

    #[test]
    fn what_has_no_room_is_named() {
        let lines = fits(&finding(6), 40);
        assert_eq!(lines[14], "from joint_6 on hidden: widen the window");
        for columns in 20..200 {
            let mut finding = finding(5);
            finding.report.joints[0].name = clipped("a_joint_whose_name_is_too_long_x");
            fits(&finding, columns);
        }
    }
}
