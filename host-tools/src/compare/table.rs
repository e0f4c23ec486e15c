//! A comparison as a table for people.

use comfy_table::CellAlignment;
use flexid_prediction::comparison::Comparison;

use super::{Compared, name};
use crate::window;

/// Explains the words of verdict and table.
fn legend(&Comparison { freedoms, reference_hz, .. }: &Comparison) -> String {
    format!(
        " squared distance: of all parameters together, each change in its standard deviation, what goes together counted once (Mahalanobis); \
         about {freedoms} for two fits of an unchanged robot\n chance: how often two fits of an unchanged robot are as far apart or farther\n \
         with hysteresis before and after are the values at {reference_hz:.1} Hz\n \
         std: the change in its standard deviations; *: changed by itself (Holm)\n"
    )
}

/// A change in per cent to three digits, or two decimal places.
fn digits(percent: f64) -> String {
    if percent.abs() < 9.995 { format!("{percent:+.2}") } else { format!("{percent:+.1}") }
}

/// The verdict in the first line, notes, and a line for each parameter, in a table of at most so many columns.
pub(crate) fn text(compared: &Compared, columns: usize) -> String {
    let header = ["parameter", "before", "after", "change", "95 %", "std", ""];
    let mut table = window::table(columns, header);
    for own in &compared.comparison.parameters {
        let [before, after] = own.values;
        let [low, high] = own.ratio.interval.map(|ratio| 100.0 * (ratio - 1.0));
        table.add_row([
            name(own),
            format!("{before:.2e}"),
            format!("{after:.2e}"),
            format!("{} %", digits(100.0 * (own.ratio.value - 1.0))),
            format!("{} to {}", digits(low), digits(high)),
            format!("{:+.1}", own.deviations),
            if own.has_changed { "*" } else { "" }.to_owned(),
        ]);
    }
    for column in table.column_iter_mut().skip(1).take(5) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let mut text = format!("{}\n", compared.verdict);
    for note in &compared.notes {
        text += &format!(" note: {note}\n");
    }
    format!("{text}\n{table}\n{}", legend(&compared.comparison))
}
