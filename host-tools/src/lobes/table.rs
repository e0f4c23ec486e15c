//! The lobes as a table for people.

use comfy_table::{CellAlignment, Table};
use flexid_prediction::lobes::Limit;

use super::{Diagram, Speed};
use crate::numbers::with_interval;
use crate::show::table::STYLE;

/// Speeds in the table, at most.
const ROWS: usize = 13;

/// The depth that is stable at all speeds, the speed of the deepest cut, and a line for some speeds.
pub(crate) fn text(diagram: &Diagram) -> String {
    let [lower, upper] = diagram.band_hz;
    let Some(least) = diagram.least_depth_m else {
        return format!("no depth chatters between {lower:.1} and {upper:.1} Hz\n");
    };
    let millimetres = |own: flexid_prediction::PositiveEstimate| {
        with_interval(1e3 * own.value, own.interval.map(|end| 1e3 * end))
    };
    let mut text = format!("stable at all speeds: depths below {} mm\n", millimetres(least));
    let deepest = diagram.speeds.iter().filter_map(|Speed { rpm, limit }| Some((rpm, (*limit)?)));
    let deepest =
        deepest.max_by(|(_, a), (_, b)| a.depth_m.interval[0].total_cmp(&b.depth_m.interval[0]));
    if let Some((rpm, limit)) = deepest {
        text += &format!("deepest for sure: {} mm at {rpm:.0} rpm\n", millimetres(limit.depth_m));
    }
    let mut table = Table::new();
    table.load_style(STYLE);
    table.set_header(["rpm", "depth, mm (95 %)", "chatter, Hz (95 %)", "lobe"]);
    let step = diagram.speeds.len().div_ceil(ROWS);
    for Speed { rpm, limit } in diagram.speeds.iter().step_by(step) {
        let cells = match limit {
            None => ["any".to_owned(), String::new(), String::new()],
            Some(Limit { depth_m, chatter_hz, lobe }) => [
                millimetres(*depth_m),
                with_interval(chatter_hz.value, chatter_hz.interval),
                lobe.to_string(),
            ],
        };
        let [depth, chatter, lobe] = cells;
        table.add_row([format!("{rpm:.0}"), depth, chatter, lobe]);
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    format!(
        "{text}\n{table}\n chatter between {lower:.1} and {upper:.1} Hz: modes of spindle and tool are above the band that was fitted, \
         and not among these\n"
    )
}
