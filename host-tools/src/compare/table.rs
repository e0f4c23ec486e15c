//! A comparison as a table for people.

use comfy_table::CellAlignment;
use flexid_pipeline::names::{DAMPING_UNITS, STIFFNESS_UNITS};
use flexid_prediction::comparison::Comparison;
use flexid_prediction::parameter::Quantity;
use flexid_wire::words::{Percent, ThreeDigits, prefixed};

use super::{Compared, name};
use crate::window;

/// Explains the words of verdict and table.
fn legend(&Comparison { freedoms, reference_hz, .. }: &Comparison) -> String {
    format!(
        " squared distance: of all parameters together, each change in its standard deviation, what goes together counted once (Mahalanobis); \
         about {freedoms} for two fits of an unchanged robot\n chance: how often two fits of an unchanged robot are as far apart or farther\n \
         with hysteresis these are the values at {reference_hz:.1} Hz\n \
         std: the change in its standard deviations; *: changed by itself (Holm)\n"
    )
}

/// Both values with the prefix that suits the larger, which stands beside the second.
fn both([before, after]: [f64; 2], unit: &str) -> [String; 2] {
    let (scale, prefix) = prefixed(before.abs().max(after.abs()));
    let [before, after] = [before, after].map(|own| ThreeDigits(own / scale));
    [before.to_string(), format!("{after} {prefix}{unit}")]
}

/// A number of standard deviations: tenths where they count.
fn deviations(number: f64) -> String {
    let places = usize::from(number.abs() < 9.95);
    format!("{number:.places$}")
}

/// Both ends of a change, relative, in per cent: `-5.3 to 5.2`.
pub(crate) fn between(ends: [f64; 2]) -> String {
    let [low, high] = ends.map(|own| Percent(own).to_string().replace(" %", ""));
    format!("{low} to {high}")
}

/// The verdict in the first line, notes, and a line for each parameter, in a table of at most so many columns.
pub(crate) fn text(compared: &Compared, columns: usize) -> String {
    let header = ["parameter", "from", "to", "change", "95 %", "std"];
    let mut table = window::table(columns, header);
    for own in &compared.comparison.parameters {
        let [before, after] = own.values;
        let units = match own.quantity {
            Quantity::Stiffness => STIFFNESS_UNITS,
            Quantity::Damping => DAMPING_UNITS,
        };
        let [before, after] = both([before, after], units[own.dof]);
        table.add_row([
            name(&own.joint, own.dof, own.quantity),
            before,
            after,
            Percent(own.ratio.value - 1.0).to_string(),
            between(own.ratio.interval.map(|ratio| ratio - 1.0)),
            format!("{} {}", deviations(own.deviations), if own.has_changed { '*' } else { ' ' }),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_share_a_prefix() {
        assert_eq!(both([9.5e5, 1.2e6], "N/m"), ["0.950", "1.20 MN/m"]);
    }

    #[test]
    fn tenths_of_few_deviations_count() {
        assert_eq!([-0.13, 9.96, -443.21].map(deviations), ["-0.1", "10", "-443"]);
    }

    #[test]
    fn a_change_has_the_digits_of_a_part() {
        assert_eq!(between([-0.0526, 0.0522]), "-5.3 to 5.2");
        assert_eq!(between([-0.1678, -0.137]), "-17 to -14");
    }
}
