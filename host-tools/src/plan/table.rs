//! The plan as a table for people.

use comfy_table::CellAlignment;
use flexid_core::verdict::Verdict;
use flexid_pipeline::text::count;
use flexid_simulation::scenario::Feed;
use flexid_wire::words::Percent;

use super::prediction::verdict;
use super::{Expected, OwnStep, Plan, Prediction, Step};
use crate::plan::greedy::Criterion;
use crate::window;

/// The plan as text: a line for the state before the first experiment, and a line for each experiment. Cuts of the user have a table more. Tables have
/// at most so many columns.
pub fn plan(plan: &Plan, columns: usize) -> String {
    let places = |numbers: &[f64]| {
        let all: Vec<String> = numbers.iter().map(|one| format!("{one:.2}")).collect();
        all.join(", ")
    };
    let mut poses = window::table(columns, ["step", "pose, rad (m)", "tool x, y, z, m"]);
    let header = ["step", "cut", "uncertainty", "median", "worst", "verdicts"];
    let mut table = window::table(columns, header);
    table.add_row(row("now".into(), String::new(), &plan.now));
    for (number, own) in (1..).zip(&plan.own) {
        let OwnStep { pose, tool_m, path, spindle_rpm, feed, records, seconds, after, .. } = own;
        let number = format!("own {number}");
        let path = path.as_ref().map(|path| format!(", then {path}")).unwrap_or_default();
        poses.add_row([number.clone(), format!("[{}]{path}", places(pose)), places(tool_m)]);
        let records = count(*records as u64, "record");
        let cut = format!("{}; {records}, {seconds:.1} s", cut(*feed, spindle_rpm));
        table.add_row(row(number, cut, after));
    }
    for (number, Step { pose, tool_m, spindle_rpm, feed, after }) in (1..).zip(&plan.steps) {
        poses.add_row([number.to_string(), format!("[{}]", places(pose)), places(tool_m)]);
        table.add_row(row(number.to_string(), cut(*feed, spindle_rpm), after));
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
    let (parameters, own) = match plan.own.is_empty() {
        true => (String::new(), String::new()),
        false => (
            format!("\n\n{}", parameters(plan, columns)),
            format!(
                "\x20own: {}, simulated; steps 1 to {} stand in place of them\n",
                count(plan.own.len() as u64, "cut"),
                plan.steps.len()
            ),
        ),
    };
    format!(
        "{poses}\n\n{table}{parameters}\n{own}\
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

/// What each parameter will be known to after the cuts of the user, and after the steps.
fn parameters(plan: &Plan, columns: usize) -> String {
    let mut table = window::table(columns, ["parameter", "own", "", "steps", ""]);
    for Expected { name, own, steps, .. } in &plan.parameters {
        let own = own.unwrap_or(f64::INFINITY);
        let word = |deviation| match verdict(deviation) {
            Verdict::Identified => "identified".to_owned(),
            Verdict::Weak => "weak".to_owned(),
            Verdict::NotObservable => "not observable".to_owned(),
        };
        table.add_row([name.clone(), percent(own), word(own), percent(*steps), word(*steps)]);
    }
    for column in [1, 3] {
        let column = table.column_mut(column);
        column.into_iter().for_each(|own| own.set_cell_alignment(CellAlignment::Right));
    }
    table.to_string()
}

/// A cut in words.
fn cut(feed: Feed, spindle_rpm: &[f64; 2]) -> String {
    let feed = match feed {
        Feed::X => "x",
        Feed::Y => "y",
        Feed::Z => "z",
        Feed::Path => "path",
    };
    format!("{feed}, {} to {} rpm", spindle_rpm[0], spindle_rpm[1])
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
