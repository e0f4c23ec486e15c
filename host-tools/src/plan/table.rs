//! The plan as a table for people.

use comfy_table::{CellAlignment, Table};

use super::{Plan, Prediction, Step};
use crate::plan::greedy::Criterion;
use crate::simulation::scenario::Feed;
use crate::table::STYLE;

/// One line an experiment, the state before the first ahead of them.
pub fn plan(plan: &Plan) -> String {
    let mut table = Table::new();
    table.load_style(STYLE);
    let header = ["step", "pose", "cut", "uncertainty", "median ±", "worst ±"];
    let verdicts = ["identified", "weak", "not observable"];
    table.set_header(header.into_iter().chain(verdicts));
    table.add_row(row("now".into(), String::new(), String::new(), &plan.now));
    for (number, Step { pose, spindle_rpm, feed, after }) in (1..).zip(&plan.steps) {
        let pose: Vec<String> = pose.iter().map(|angle| format!("{angle:.2}")).collect();
        let feed = match feed {
            Feed::X => "x",
            Feed::Y => "y",
            Feed::Z => "z",
        };
        let cut = format!("along {feed}, {} to {} rpm", spindle_rpm[0], spindle_rpm[1]);
        table.add_row(row(number.to_string(), format!("[{}]", pose.join(", ")), cut, after));
    }
    for column in table.column_iter_mut().skip(3) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let meaning = match plan.criterion {
        Criterion::D => "geometric mean over the axes of the confidence ellipsoid",
        Criterion::A => "root mean square over the parameters",
    };
    let worst = plan.steps.last().map_or(&plan.now, |last| &last.after);
    format!(
        "{table}\n pose in rad (m); uncertainty: {meaning}, bounds included; best of {} experiments each time\n \
         worst known at the end: {}\n",
        plan.candidates, worst.worst_parameter
    )
}

fn row(number: String, pose: String, cut: String, prediction: &Prediction) -> Vec<String> {
    let percent = |part: f64| match part {
        told if told < 10.0 => format!("{:.2} %", 100.0 * told),
        _ => "none".to_owned(),
    };
    let Prediction { uncertainty, median, worst, identified, weak, not_observable, .. } =
        prediction;
    let mut cells = vec![number, pose, cut];
    cells.extend([uncertainty, median, worst].map(|part| percent(*part)));
    cells.extend([identified, weak, not_observable].map(ToString::to_string));
    cells
}
