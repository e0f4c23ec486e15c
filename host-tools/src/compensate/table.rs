//! What a compensation does, for people.

use super::Compensated;
use crate::predict::table::along_axes;

/// The place that is deflected most, what is left there, and the largest offsets of all places.
pub(crate) fn text(path: &[Compensated]) -> String {
    let most =
        |of: &dyn Fn(&Compensated) -> f64| path.iter().max_by(|a, b| of(a).total_cmp(&of(b)));
    let deflected = |own: &Compensated| own.compensation.deflection.distance();
    // The largest value within the interval of what is left: its most likely value is nearly zero.
    let left = |own: &Compensated| {
        let ends = own.compensation.left.translation.iter().flat_map(|own| own.interval);
        ends.map(f64::abs).fold(0.0, f64::max)
    };
    let mut text = format!("{} places\n", path.len());
    if let Some(own) = most(&deflected) {
        let deflection = &own.compensation.deflection;
        text += &format!(
            " most deflected, line {}, µm:{}\n",
            own.line,
            along_axes(&deflection.translation, 1e6)
        );
        text += &format!("  rotation, µrad:{}\n", along_axes(&deflection.rotation, 1e6));
    }
    if let Some(own) = most(&left) {
        let left = &own.compensation.left;
        text += &format!(
            " most left by the offsets, line {}, µm:{}\n",
            own.line,
            along_axes(&left.translation, 1e6)
        );
        text += &format!("  rotation, µrad:{}\n", along_axes(&left.rotation, 1e6));
    }
    let joints = path.first().map_or(0, |own| own.pose.len());
    text += " largest offsets, mrad (mm), to be added to the commanded angles:";
    for joint in 0..joints {
        let offsets = path.iter().map(|own| own.compensation.offsets[joint]);
        if let Some(own) = offsets.max_by(|a, b| a.value.abs().total_cmp(&b.value.abs())) {
            let [low, high] = own.interval.map(|end| 1e3 * end);
            let comma = if joint > 0 { "," } else { "" };
            text +=
                &format!("{comma} q{} {:.4} ({low:.4} to {high:.4})", joint + 1, 1e3 * own.value);
        }
    }
    text.push('\n');
    let singular: Vec<usize> =
        path.iter().filter(|own| own.compensation.is_singular).map(|own| own.line).collect();
    if let Some(first) = singular.first() {
        text += &format!(
            " near a singularity: {} places, the first in line {first}: there the offsets are held small, and more is left\n",
            singular.len()
        );
    }
    text
}
