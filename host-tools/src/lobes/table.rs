//! The lobes as a table for people.

use comfy_table::{CellAlignment, Table};
use flexid_pipeline::text::count;
use flexid_prediction::PositiveEstimate;
use flexid_prediction::lobes::Limit;
use flexid_prediction::modes::Mode;

use super::{Diagram, Speed};
use crate::numbers::with_interval;
use crate::predict::table::OPEN;
use crate::show::table::STYLE;

/// Speeds in the table, at most.
const ROWS: usize = 13;

/// The depths that are stable at all of these speeds, at the best, and at any, a line for some speeds, and the title.
pub(crate) fn text(diagram: &Diagram, title: &str) -> String {
    let [lower, upper] = diagram.band_hz;
    let Some(least) = diagram.least_depth_m else {
        return format!("no depth chatters between {lower:.1} and {upper:.1} Hz\n");
    };
    let limits: Vec<(&Speed, PositiveEstimate)> =
        diagram.speeds.iter().filter_map(|own| Some((own, own.limit?.depth_m))).collect();
    let worst = limits.iter().min_by(|(_, a), (_, b)| a.value.total_cmp(&b.value));
    // What lies beyond the band that was fitted may chatter earlier.
    let within = limits.iter().filter(|(speed, _)| !speed.is_beyond);
    let deepest = within.max_by(|(_, a), (_, b)| a.interval[0].total_cmp(&b.interval[0]));
    let mut text = String::new();
    let of_band = format!("deepest by the modes up to {:.1} Hz:", diagram.fitted_to_hz.min(upper));
    for (word, prefix, found) in
        [("stable at these speeds:", "depths below ", worst), (of_band.as_str(), "", deepest)]
    {
        if let Some((speed, depth)) = found {
            let mark = if speed.is_beyond { " *" } else { "" };
            text += &format!("{word} {}, at {:.0} rpm{mark}\n", depth_mm(prefix, depth), speed.rpm);
        }
    }
    let free = diagram.speeds.len() - limits.len();
    if free > 0 {
        text += &format!("no depth chatters at {free} of {} speeds\n", diagram.speeds.len());
    }
    text += &format!("stable at any speed: {}\n", depth_mm("depths below ", &least));
    let mut table = Table::new();
    table.load_style(STYLE);
    table.set_header(["rpm", "depth, mm (95 %)", "chatter, Hz (95 %)", "lobe"]);
    let step = diagram.speeds.len().div_ceil(ROWS);
    for Speed { rpm, limit, is_beyond } in diagram.speeds.iter().step_by(step) {
        let cells = match limit {
            None => ["any".to_owned(), String::new(), String::new()],
            Some(Limit { depth_m, chatter_hz, lobe }) => {
                [shown(depth_m, 1e3), shown(chatter_hz, 1.0), lobe.to_string()]
            }
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
    let title: String = title.lines().map(|line| format!(" {line}\n")).collect();
    format!(
        "{text}\n{table}\n{title}{beyond} chatter between {lower:.1} and {upper:.1} Hz: modes of spindle and tool lie above {fitted:.1} Hz, where the \
         band that was fitted ends, and may limit the depth further\n"
    )
}

/// A line about modes whose damping says nothing: their lobes may lie anywhere, and the interval of another lobe does not show it.
pub(crate) fn open_damping(modes: &[Mode]) -> Option<String> {
    let open = modes.iter().filter(|mode| !mode.damping_ratio.determined);
    let first = open.clone().next()?.frequency_hz.value;
    let modes = count(open.count() as u64, "mode");
    Some(format!(
        "the damping of {modes} is not determined, the lowest of {first:.1} Hz: cuts may chatter at smaller depths than these"
    ))
}

/// A depth behind the words `prefix`, which stand only before a number.
fn depth_mm(prefix: &str, depth: &PositiveEstimate) -> String {
    match depth.determined {
        true => format!("{prefix}{} mm", shown(depth, 1e3)),
        false => OPEN.to_owned(),
    }
}

/// A number, `scale` times, with its interval, unless it says nothing.
fn shown(own: &PositiveEstimate, scale: f64) -> String {
    match own.determined {
        true => with_interval(scale * own.value, own.interval.map(|end| scale * end)),
        false => OPEN.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_says_nothing_has_no_number() {
        let of = |std| depth_mm("below ", &PositiveEstimate::new(1.25e-3, std));
        assert_eq!(of(0.02), "below 1.250 (1.202 to 1.300) mm");
        assert_eq!(of(1.1), "not determined");
    }

    #[test]
    fn modes_of_open_damping_are_named() {
        let mode = |hz, std| Mode {
            frequency_hz: PositiveEstimate::new(hz, 0.01),
            damping_ratio: PositiveEstimate::new(0.02, std),
            energy: Vec::new(),
            tool: [[0.0; 2]; 6],
        };
        assert_eq!(open_damping(&[mode(12.0, 0.1), mode(20.0, 0.9)]), None);
        let line = open_damping(&[mode(12.0, 0.1), mode(20.0, 1.1), mode(31.0, 3.6)]).unwrap();
        assert!(
            line.starts_with("the damping of 2 modes is not determined, the lowest of 20.0 Hz: "),
            "{line}"
        );
    }
}
