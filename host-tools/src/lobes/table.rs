//! The lobes as a table for people.

use comfy_table::{CellAlignment, Table};
use flexid_prediction::PositiveEstimate;
use flexid_prediction::lobes::Limit;

use super::{Diagram, Speed};
use crate::numbers::with_interval;
use crate::show::table::STYLE;

/// Speeds in the table, at most.
const ROWS: usize = 13;

/// The depths that are stable at all of these speeds, at the best, and at any, and a line for some speeds.
pub(crate) fn text(diagram: &Diagram) -> String {
    let [lower, upper] = diagram.band_hz;
    let Some(least) = diagram.least_depth_m else {
        return format!("no depth chatters between {lower:.1} and {upper:.1} Hz\n");
    };
    let limits: Vec<(&Speed, PositiveEstimate)> =
        diagram.speeds.iter().filter_map(|own| Some((own, own.limit?.depth_m))).collect();
    let worst = limits.iter().min_by(|(_, a), (_, b)| a.value.total_cmp(&b.value));
    // What lies beyond the band that was fitted may chatter earlier.
    let shown = limits.iter().filter(|(speed, _)| !speed.is_beyond);
    let deepest = shown.max_by(|(_, a), (_, b)| a.interval[0].total_cmp(&b.interval[0]));
    let mut text = String::new();
    let of_band = format!("deepest by the modes up to {:.1} Hz:", diagram.fitted_to_hz.min(upper));
    for (word, found) in
        [("stable at these speeds: depths below", worst), (of_band.as_str(), deepest)]
    {
        if let Some((speed, depth)) = found {
            let mark = if speed.is_beyond { " *" } else { "" };
            text += &format!("{word} {} mm, at {:.0} rpm{mark}\n", millimetres(depth), speed.rpm);
        }
    }
    let free = diagram.speeds.len() - limits.len();
    if free > 0 {
        text += &format!("no depth chatters at {free} of {} speeds\n", diagram.speeds.len());
    }
    text += &format!("stable at any speed: depths below {} mm\n", millimetres(&least));
    let mut table = Table::new();
    table.load_style(STYLE);
    table.set_header(["rpm", "depth, mm (95 %)", "chatter, Hz (95 %)", "lobe"]);
    let step = diagram.speeds.len().div_ceil(ROWS);
    for Speed { rpm, limit, is_beyond } in diagram.speeds.iter().step_by(step) {
        let cells = match limit {
            None => ["any".to_owned(), String::new(), String::new()],
            Some(Limit { depth_m, chatter_hz, lobe }) => [
                millimetres(depth_m),
                with_interval(chatter_hz.value, chatter_hz.interval),
                lobe.to_string(),
            ],
        };
        let [depth, chatter, lobe] = cells;
        let mark = if *is_beyond { " *" } else { "" };
        table.add_row([format!("{rpm:.0}{mark}"), depth, chatter, lobe]);
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let fitted = diagram.fitted_to_hz;
    let beyond = if diagram.speeds.iter().any(|own| own.is_beyond) {
        format!(
            " * chatters above the band that was fitted, which ends at {fitted:.1} Hz: no record shows it, the model extrapolates\n"
        )
    } else {
        String::new()
    };
    format!(
        "{text}\n{table}\n{beyond} chatter between {lower:.1} and {upper:.1} Hz: modes of spindle and tool lie above {fitted:.1} Hz, where the \
         band that was fitted ends, and may limit the depth further\n"
    )
}

fn millimetres(depth: &PositiveEstimate) -> String {
    with_interval(1e3 * depth.value, depth.interval.map(|end| 1e3 * end))
}
