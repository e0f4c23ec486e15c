//! A history as a table for people.

use comfy_table::CellAlignment;
use flexid_pipeline::names::{DAMPING_UNITS, STIFFNESS_UNITS};
use flexid_prediction::history::Parameter;
use flexid_prediction::parameter::Quantity;
use flexid_wire::words::{InUnit, Percent};

use super::{Told, change};
use crate::compare::name;
use crate::compare::table::between;
use crate::window;

/// Explains the words of the table.
fn legend(told: &Told) -> String {
    let hz = told.history.reference_hz;
    format!(
        " since: of what has changed; of the others, change is that along a line through all findings, by chance\n \
         in a robot that stays the same, one such change in its whole life has a chance below {} (Holm's method in each of ever smaller looks)\n \
         with hysteresis these are the values at {hz:.1} Hz\n",
        Percent(told.level)
    )
}

fn since<'a>(told: &'a Told, own: &Parameter) -> &'a str {
    match own.course.steps.last() {
        Some(_) if own.course.is_drift => "line",
        Some(step) => told.when(step.since),
        None => "",
    }
}

/// The verdict in the first line, notes, and a line for each parameter, in a table of at most so many columns.
pub(crate) fn text(told: &Told, columns: usize) -> String {
    let header = ["parameter", "now", "change", "95 %", "since"];
    let mut table = window::table(columns, header);
    for own in &told.history.parameters {
        let Some((ratio, [_, now])) = change(own) else { continue };
        let units = match own.quantity {
            Quantity::Stiffness => STIFFNESS_UNITS,
            Quantity::Damping => DAMPING_UNITS,
        };
        table.add_row([
            name(&own.joint, own.dof, own.quantity),
            InUnit { value: now, unit: units[own.dof] }.to_string(),
            Percent(ratio.value - 1.0).to_string(),
            between(ratio.interval.map(|ratio| ratio - 1.0)),
            since(told, own).to_owned(),
        ]);
    }
    for column in table.column_iter_mut().skip(1).take(3) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let mut text = format!("{}\n", told.verdict);
    for note in &told.notes {
        text += &format!(" note: {note}\n");
    }
    format!("{text}\n{table}\n{}", legend(told))
}
