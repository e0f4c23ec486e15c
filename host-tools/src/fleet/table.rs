//! A fleet as tables for people.

use comfy_table::{CellAlignment, Table};
use flexid_pipeline::names::{DAMPING_UNITS, STIFFNESS_UNITS};
use flexid_prediction::fleet::{OTHERS, Parameter};
use flexid_prediction::parameter::Quantity;
use flexid_wire::words::{InUnit, Percent};

use super::{Outside, Told};
use crate::compare::name;
use crate::compare::table::between;
use crate::window;

/// Explains the words of the tables.
fn legend(told: &Told) -> String {
    let hz = told.fleet.reference_hz;
    format!(
        " mean, spread: of the robots that are not outside, the spread with its 95 % interval; next: as far from the mean a further robot lies with 95 %\n \
         in a fleet without a robot outside, one is called so with a chance below {} (Holm's method over robots and parameters)\n \
         with hysteresis these are the values at {hz:.1} Hz\n",
        Percent(told.level)
    )
}

fn in_unit(own: &Parameter, value: f64) -> String {
    let units = match own.quantity {
        Quantity::Stiffness => STIFFNESS_UNITS,
        Quantity::Damping => DAMPING_UNITS,
    };
    InUnit { value, unit: units[own.dof] }.to_string()
}

/// The verdict in the first line, notes, what is outside, and a line for each parameter, in tables of at most so many columns.
pub(crate) fn text(told: &Told, columns: usize) -> String {
    let mut text = format!("{}\n", told.verdict);
    for note in &told.notes {
        text += &format!(" note: {note}\n");
    }
    let outside = told.outside();
    if !outside.is_empty() {
        text += &format!("\n{}\n", of_outside(&outside, columns));
    }
    format!("{text}\n{}\n{}", of_population(told, columns), legend(told))
}

fn of_outside(outside: &[Outside<'_>], columns: usize) -> Table {
    let mut table = window::table(columns, ["robot", "outside in", "value", "off", "95 %"]);
    for own in outside {
        let (parameter, ratio) = (own.parameter, own.judged.ratio);
        table.add_row([
            own.robot.to_owned(),
            name(&parameter.joint, parameter.dof, parameter.quantity),
            in_unit(parameter, own.value),
            Percent(ratio.value - 1.0).to_string(),
            between(ratio.interval.map(|ratio| ratio - 1.0)),
        ]);
    }
    right(&mut table, 2);
    table
}

fn of_population(told: &Told, columns: usize) -> Table {
    let header = ["parameter", "robots", "mean", "spread", "95 %", "next ±"];
    let mut table = window::table(columns, header);
    for own in &told.fleet.parameters {
        let name = name(&own.joint, own.dof, own.quantity);
        let Some(found) = own.shown.population else {
            let robots = own.shown.members.len().to_string();
            table.add_row([name, robots, format!("needs {}", OTHERS + 1)]);
            continue;
        };
        table.add_row([
            name,
            found.robots.to_string(),
            in_unit(own, found.mean.value),
            Percent(found.spread).to_string(),
            between(found.spread_interval),
            Percent(found.next[1] / found.mean.value - 1.0).to_string(),
        ]);
    }
    right(&mut table, 1);
    table
}

/// Aligns all columns from this one on to the right.
fn right(table: &mut Table, first: usize) {
    for column in table.column_iter_mut().skip(first) {
        column.set_cell_alignment(CellAlignment::Right);
    }
}
