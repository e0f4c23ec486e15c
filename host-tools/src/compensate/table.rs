//! A compensation in words.

use flexid_pipeline::text::count;

use super::Compensated;
use crate::numbers::with_interval;
use crate::predict::table::{AXES, OPEN, along_axes};

/// The largest offset of a joint, mrad (mm), of those that are determined.
fn largest(path: &[Compensated], joint: usize) -> String {
    let offsets = path.iter().map(|own| own.compensation.offsets[joint]);
    let determined = offsets.filter(|own| own.determined);
    match determined.max_by(|a, b| a.value.abs().total_cmp(&b.value.abs())) {
        None => OPEN.to_owned(),
        Some(own) => with_interval(1e3 * own.value, own.interval.map(|end| 1e3 * end)),
    }
}

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
    let mut text = format!("{}\n", count(path.len() as u64, "place"));
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
    text += &format!("{AXES}\n");
    let joints = path.first().map_or(0, |own| own.pose.len());
    text += " largest offsets, mrad (mm), to be added to the commanded angles:";
    for joint in 0..joints {
        let comma = if joint > 0 { "," } else { "" };
        text += &format!("{comma} q{} {}", joint + 1, largest(path, joint));
    }
    text.push('\n');
    let open = |own: &&Compensated| own.compensation.offsets.iter().any(|own| !own.determined);
    let open: Vec<usize> = path.iter().filter(open).map(|own| own.line).collect();
    if let Some(first) = open.first() {
        text += &format!(
            " not determined: offsets in {} of {} places, the first in line {first}: their standard deviations are larger than all offsets \
             there together; do not use them\n",
            open.len(),
            path.len()
        );
    }
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

#[cfg(test)]
mod tests {
    use flexid_prediction::Estimate;
    use flexid_prediction::compensation::Compensation;
    use flexid_prediction::statics::Deflection;

    use super::*;

    fn place(line: usize, offsets: [Estimate; 2]) -> Compensated {
        let none = Deflection {
            translation: [Estimate::new(0.0, 0.0); 3],
            rotation: [Estimate::new(0.0, 0.0); 3],
        };
        let compensation = Compensation {
            deflection: none,
            along_base: none,
            offsets: offsets.to_vec(),
            left: none,
            is_singular: false,
        };
        Compensated { line, pose: vec![0.0; 2], wrench: [0.0; 6], compensation }
    }

    #[test]
    fn offsets_that_are_not_determined_are_no_largest_ones() {
        let (known, unknown) = (Estimate::new(1e-3, 1e-5), Estimate::new(2e-3, 3e-3));
        let all = text(&[place(2, [known, unknown]), place(3, [unknown, unknown])]);
        assert!(all.contains(": q1 1.000 (0.980 to 1.020), q2 not determined\n"), "{all}");
        assert!(
            all.contains(" not determined: offsets in 2 of 2 places, the first in line 2: "),
            "{all}"
        );
        let known = text(&[place(2, [known, known])]);
        assert!(!known.contains("not determined"), "{known}");
    }
}
