//! The lobes as a table for people.

use comfy_table::CellAlignment;
use flexid_pipeline::text::count;
use flexid_prediction::PositiveEstimate;
use flexid_prediction::lobes::Limit;
use flexid_prediction::milling::Cutter;
use flexid_prediction::modes::Mode;

use super::{Diagram, Speed};
use crate::numbers::with_interval;
use crate::predict::table::OPEN;
use crate::window;

/// Speeds in the table, at most.
const ROWS: usize = 13;

/// The depths that are stable at all of these speeds, at the best, and at any of which the fit speaks, the speeds of which it does not, a line for
/// some speeds, in a table of at most so many columns, and the title. `cutter` is the one of the title.
pub(crate) fn text(diagram: &Diagram, title: &str, cutter: &Cutter, columns: usize) -> String {
    let [lower, upper] = diagram.band_hz;
    let limits: Vec<(&Speed, PositiveEstimate)> =
        diagram.stated().filter_map(|own| Some((own, own.limit?.depth_m))).collect();
    let worst = limits.iter().min_by(|(_, a), (_, b)| a.value.total_cmp(&b.value));
    let deepest = limits.iter().max_by(|(_, a), (_, b)| a.interval[0].total_cmp(&b.interval[0]));
    let mut text = String::new();
    let these = match [diagram.stated().next(), diagram.stated().last()] {
        [Some(first), Some(last)] if diagram.speeds.iter().any(|own| own.is_beyond) => {
            format!("stable from {:.0} to {:.0} rpm:", first.rpm, last.rpm)
        }
        _ => "stable at these speeds:".to_owned(),
    };
    let of_band = format!("deepest by the modes up to {upper:.1} Hz:");
    for (word, prefix, found) in [(these, "depths below ", worst), (of_band, "", deepest)] {
        if let Some((speed, depth)) = found {
            text += &format!("{word} {}, at {:.0} rpm\n", depth_mm(prefix, depth), speed.rpm);
        }
    }
    let stated = diagram.stated().count();
    let free = stated - limits.len();
    if free > 0 {
        text += &format!("no depth chatters at {free} of {stated} speeds\n");
    }
    let [slowest, fastest] = diagram.stated_rpm;
    text += &match &diagram.least_depth_m {
        Some(least) => format!(
            "stable at any speed from {slowest:.0} to {fastest:.0} rpm: {}\n",
            depth_mm("depths below ", least)
        ),
        None => format!("no depth chatters between {lower:.1} and {upper:.1} Hz\n"),
    };
    text += &unstated(diagram, cutter);
    let mut table =
        window::table(columns, ["rpm", "depth, mm (95 %)", "chatter, Hz (95 %)", "lobe"]);
    let step = diagram.speeds.len().div_ceil(ROWS);
    for Speed { rpm, limit, is_beyond } in diagram.speeds.iter().step_by(step) {
        let [depth, chatter, lobe] = match limit {
            None if *is_beyond => ["no statement".to_owned(), String::new(), String::new()],
            None => ["any".to_owned(), String::new(), String::new()],
            Some(Limit { depth_m, chatter_hz, lobe }) => {
                [shown(depth_m, 1e3), shown(chatter_hz, 1.0), lobe.to_string()]
            }
        };
        table.add_row([format!("{rpm:.0}"), depth, chatter, lobe]);
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let title: String = title.lines().map(|line| format!(" {line}\n")).collect();
    format!(
        "{text}\n{table}\n{title} chatter between {lower:.1} and {upper:.1} Hz: modes of spindle and tool lie above, and may limit the depth further\n"
    )
}

/// Lines about the speeds of which nothing is stated, and what would be needed to state something.
fn unstated(diagram: &Diagram, cutter: &Cutter) -> String {
    let [lower, upper] = diagram.band_hz;
    let [slowest, fastest] = diagram.stated_rpm;
    let mut text = String::new();
    if diagram.speeds.first().is_some_and(|own| own.is_beyond && own.rpm < slowest) {
        text += &format!(
            "no statement below {slowest:.0} rpm: there the teeth pass below {lower:.1} Hz, where the band that was fitted begins\n"
        );
    }
    if let Some(Speed { rpm, .. }) = diagram.speeds.last().filter(|own| own.rpm > fastest) {
        let passes_hz = rpm * f64::from(cutter.teeth) / 60.0;
        text += &format!(
            "no statement above {fastest:.0} rpm: there the teeth pass above {upper:.1} Hz, where the band that was fitted ends\n \
             for {rpm:.0} rpm fit cuts up to {passes_hz:.0} Hz ([measurement] band_hz), and test spindle and tool with a hammer\n"
        );
    }
    text
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
