//! The plan as a table for people.

use comfy_table::CellAlignment;
use flexid_simulation::scenario::Feed;
use flexid_wire::words::Percent;

use super::{Plan, Prediction, Step};
use crate::plan::greedy::Criterion;
use crate::window;

/// The plan as text: a line for the state before the first experiment, and a line for each experiment. Tables have at most so many columns.
pub fn plan(plan: &Plan, columns: usize) -> String {
    let mut poses = window::table(columns, ["step", "pose, rad (m)", "tool x, y, z, m"]);
    let header = ["step", "cut", "uncertainty", "median", "worst", "verdicts"];
    let mut table = window::table(columns, header);
    table.add_row(row("now".into(), String::new(), &plan.now));
    for (number, Step { pose, tool_m, spindle_rpm, feed, after }) in (1..).zip(&plan.steps) {
        let places = |numbers: &[f64]| {
            let all: Vec<String> = numbers.iter().map(|one| format!("{one:.2}")).collect();
            all.join(", ")
        };
        poses.add_row([number.to_string(), format!("[{}]", places(pose)), places(tool_m)]);
        let feed = match feed {
            Feed::X => "x",
            Feed::Y => "y",
            Feed::Z => "z",
            Feed::Path => "path",
        };
        let cut = format!("{feed}, {} to {} rpm", spindle_rpm[0], spindle_rpm[1]);
        table.add_row(row(number.to_string(), cut, after));
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let meaning = match plan.criterion {
        Criterion::D => "geometric mean over the axes of the confidence ellipsoid",
        Criterion::A => "root mean square over the parameters",
    };
    let Plan { peak_tangential_n, candidates, given_up, .. } = plan;
    let given_up = match given_up {
        0 => String::new(),
        some => format!("; {some} given up, which make the robot give way"),
    };
    let end = plan.steps.last().map_or(&plan.now, |last| &last.after);
    format!(
        "{poses}\n\n{table}\n\
         \x20pose: joints, base first, within their limits: see for yourself that it is clear; tool: along the axes of the base\n\
         \x20cut: axis of the TCP that the tool is fed along, spindle speed from start to end, at most \
         {peak_tangential_n} N on a tooth\n\
         \x20uncertainty: {meaning}, with the bounds as prior information\n\
         \x20median, worst: relative standard deviation of a parameter, from experiments alone\n\
         \x20verdicts: how many parameters `flexid identify` will call identified / weak / not observable\n\
         \x20predicted for the robot that the plan starts from, if `flexid identify` finds the right minimum\n\
         \x20each step is the best of {candidates} experiments beside all above it{given_up}\n\
         \x20worst in the end: {}, {}\n",
        end.worst_parameter,
        percent(end.worst)
    )
}

fn row(number: String, cut: String, prediction: &Prediction) -> Vec<String> {
    let Prediction { uncertainty, median, worst, identified, weak, not_observable, .. } =
        prediction;
    let mut cells = vec![number, cut];
    cells.extend([uncertainty, median, worst].map(|part| percent(*part)));
    cells.push(format!("{identified} / {weak} / {not_observable}"));
    cells
}

/// A standard deviation in per cent.
fn percent(part: f64) -> String {
    match part {
        ..10.0 => Percent(part).to_string(),
        far if far.is_finite() => "over 1000 %".to_owned(),
        _ => "undetermined".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_neither_none_of_much_nor_zero_of_little() {
        let cases = [1e-7, 0.000_234, 0.0124, 9.9].map(percent);
        assert_eq!(cases, ["<0.01 %", "0.02 %", "1.2 %", "990 %"]);
        let cases = [10.0, 1e9, f64::INFINITY, f64::NAN].map(percent);
        assert_eq!(cases, ["over 1000 %", "over 1000 %", "undetermined", "undetermined"]);
    }
}
