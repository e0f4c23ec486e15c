//! A map in words.

use flexid_prediction::PositiveEstimate;

use super::{Cell, Map, UNCERTAIN};
use crate::numbers::with_interval;

/// Least and largest value with their poses, and how much of the map is uncertain, or below the base.
pub(crate) fn text(map: &Map) -> String {
    let (name, unit, scale) = map.quantity.shown();
    let valued = || map.cells.iter().filter_map(|cell| Some((cell, cell.value?)));
    let determined = || valued().filter(|(_, own)| own.determined);
    let by_value = |(_, a): &(&Cell, PositiveEstimate), (_, b): &(&Cell, PositiveEstimate)| {
        a.value.total_cmp(&b.value)
    };
    let mut text = format!(
        "{name}, {unit}, over {} and {}, {} poses\n",
        map.over.names[0],
        map.over.names[1],
        map.cells.len()
    );
    for (word, found) in
        [("least", determined().min_by(by_value)), ("largest", determined().max_by(by_value))]
    {
        let Some((cell, own)) = found else { continue };
        let pose: Vec<String> = cell.pose.iter().map(|angle| format!("{angle:.3}")).collect();
        let [x, y, z] = cell.tool;
        text += &format!(
            " {word:8} {} in pose [{}], tool at {x:.2}, {y:.2}, {z:.2} m\n",
            with_interval(scale * own.value, own.interval.map(|end| scale * end)),
            pose.join(", ")
        );
    }
    let uncertain = map.cells.iter().filter(|cell| cell.is_uncertain).count();
    text += &format!(
        " uncertain: {uncertain} of {} poses have an interval of more than ±{:.0} %\n",
        map.cells.len(),
        100.0 * UNCERTAIN
    );
    let open = valued().count() - determined().count();
    if open > 0 {
        text += &format!(
            " not determined: in {open} of {} poses an interval reaches from a seventh to seven times the value, or farther\n",
            map.cells.len()
        );
    }
    let without = map.cells.len() - valued().count();
    if without > 0 {
        text += &format!(
            " no value: in {without} of {} poses the robot has no stiffness, or no mode up to twice the band\n",
            map.cells.len()
        );
    }
    let below = map.cells.iter().filter(|cell| cell.tool[2] < 0.0).count();
    if below > 0 {
        text += &format!(
            " note: in {below} of {} poses the tool is below the base (z < 0): a robot on a floor does not reach them\n",
            map.cells.len()
        );
    }
    text
}
