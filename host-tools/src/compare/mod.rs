//! Two fits of a robot, one beside the other, in words.

pub(crate) mod table;

use std::path::Path;

use flexid_pipeline::model::Model;
use flexid_pipeline::text::count;
use flexid_prediction::PositiveEstimate;
use flexid_prediction::comparison::{Change, Comparison};
use flexid_prediction::document::Found;
use flexid_prediction::parameter::Quantity;
use flexid_wire::words::Percent;
use serde::Serialize;

use crate::predict::table as prediction;

/// Changes, and keys of the model file, named in the verdict, at most.
const NAMED: usize = 3;
/// Keys of the model file that state how the joints lie. Other keys may differ between two models of one robot.
const KINEMATICS: [&str; 3] = ["origin_xyz_m", "origin_rpy_rad", "axis"];

/// A comparison in words and numbers.
#[derive(Debug, Serialize)]
pub(crate) struct Compared {
    /// The verdict, a line.
    pub(crate) verdict: String,
    /// Doubts about the fits, to be known before the numbers are believed, a line each.
    pub(crate) notes: Vec<String>,
    /// The numbers.
    #[serde(flatten)]
    pub(crate) comparison: Comparison,
}

impl Compared {
    /// Puts the fits before and after into words, each with its file.
    pub(crate) fn new(fits: [(&Path, &Found); 2], comparison: Comparison) -> Self {
        let [before, after] = fits.map(|(_, found)| found.robot.model());
        let models = models(&differing(before, after)).unwrap_or_default();
        let verdict = models + &verdict(&comparison);
        Self { verdict, notes: notes(fits), comparison }
    }
}

/// Name of a parameter.
pub(crate) fn name(joint: &str, dof: usize, quantity: Quantity) -> String {
    let quantity = match quantity {
        Quantity::Stiffness => "stiffness",
        Quantity::Damping => "damping",
    };
    format!("{joint} {} {quantity}", prediction::DOF[dof])
}

/// Says that the robots, or the models of the robot, differ: the beginning of the verdict. `None` for models without a difference.
fn models(differing: &[String]) -> Option<String> {
    if differing.is_empty() {
        return None;
    }
    let what = match differing.iter().any(|key| is_of_kinematics(key)) {
        true => "different robots",
        false => "different models of a robot",
    };
    let named: Vec<&str> = differing.iter().take(NAMED).map(String::as_str).collect();
    let more = match differing.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Some(format!(
        "{what}, by {}{more} of the model files; their joints have the same names, and the parameters ",
        named.join(", ")
    ))
}

fn verdict(comparison: &Comparison) -> String {
    let Comparison { distance_squared, quantile, chance, parameters, all, .. } = comparison;
    let below = if distance_squared <= quantile { "below" } else { "above" };
    let whole = format!(
        "squared distance {distance_squared:.1}, {below} {quantile:.1} (chance {})",
        Percent(*chance)
    );
    if comparison.agree {
        return format!("agree: {} of {all} parameters compared, {whole}", parameters.len());
    }
    let mut changed: Vec<&Change> = parameters.iter().filter(|own| own.has_changed).collect();
    changed.sort_by(|a, b| b.deviations.abs().total_cmp(&a.deviations.abs()));
    if changed.is_empty() {
        return format!("differ: all parameters together, and none by itself: {whole}");
    }
    let named: Vec<String> = changed
        .iter()
        .take(NAMED)
        .map(|own| in_words(&name(&own.joint, own.dof, own.quantity), &own.ratio))
        .collect();
    let more = match changed.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    format!("differ: {}{more}", named.join("; "))
}

/// A change of what has this name, in words.
pub(crate) fn in_words(name: &str, ratio: &PositiveEstimate) -> String {
    let (is_less, by) = by(ratio);
    format!("{name} {} by {by}", if is_less { "fell" } else { "rose" })
}

/// Whether a ratio is below 1, and by how much it differs: `12.0 % (10.1 to 13.9)`.
pub(crate) fn by(ratio: &PositiveEstimate) -> (bool, String) {
    let [low, high] = ratio.interval.map(|ratio| 100.0 * (ratio - 1.0));
    let by = 100.0 * (ratio.value - 1.0);
    if by < 0.0 {
        (true, format!("{:.1} % ({:.1} to {:.1})", -by, -high, -low))
    } else {
        (false, format!("{by:.1} % ({low:.1} to {high:.1})"))
    }
}

fn notes(fits: [(&Path, &Found); 2]) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(repetition(fits.map(|(_, found)| found)));
    for (file, found) in fits {
        if let Some(doubt) = prediction::doubt(&found.fit) {
            notes.push(format!("{}: {doubt}", file.display()));
        }
    }
    let [before, after] = fits.map(|(_, found)| found.robot.found());
    let differing = differing(&before.model, &after.model);
    if !differing.is_empty() {
        notes.push(format!(
            "the models differ in {}: what differs in a model shows in the parameters",
            differing.join(", ")
        ));
    }
    if before.band_hz != after.band_hz {
        notes.push(format!("the bands differ, {:?} and {:?} Hz", before.band_hz, after.band_hz));
    }
    if before.gravity_m_per_s2 != after.gravity_m_per_s2 {
        notes.push("the directions of gravity differ".into());
    }
    notes
}

/// Says what agreement of two results of the same records is worth. `None` for results of different logs.
fn repetition([before, after]: [&Found; 2]) -> Option<String> {
    let shared = after.logs.iter().filter(|log| before.logs.contains(log)).count();
    let what = if shared == 0 {
        let [own, other] = [before, after].map(|found| (&found.joints, &found.fit));
        // Without a log, as of static tests, the numbers alone show it.
        (own == other).then(|| "both are the same result".to_owned())?
    } else if shared == before.logs.len().max(after.logs.len()) {
        "both are of the same logs".to_owned()
    } else {
        format!("both are of {}, among others", count(shared as u64, "common log"))
    };
    Some(format!("{what}: agreement proves nothing: compare results of separate cuts"))
}

/// Returns whether a key of the model file states how the joints lie.
pub(crate) fn is_of_kinematics(key: &str) -> bool {
    KINEMATICS.iter().any(|own| key.ends_with(own))
}

/// Keys of the model file that differ. Limits are no part of what is fitted.
pub(crate) fn differing(before: &Model, after: &Model) -> Vec<String> {
    let mut keys = Vec::new();
    for (own, other) in before.joints.iter().zip(&after.joints) {
        let same = [
            ("origin_xyz_m", own.origin_xyz_m == other.origin_xyz_m),
            ("origin_rpy_rad", own.origin_rpy_rad == other.origin_rpy_rad),
            ("axis", own.axis == other.axis),
            ("mass_kg", own.mass_kg == other.mass_kg),
            ("centre_of_mass_m", own.centre_of_mass_m == other.centre_of_mass_m),
            ("inertia_kg_m2", own.inertia_kg_m2 == other.inertia_kg_m2),
        ];
        let own = same.iter().filter(|(_, same)| !same);
        keys.extend(own.map(|(key, _)| format!("{} {key}", other.name)));
    }
    let (own, other) = (&before.tcp, &after.tcp);
    if (own.xyz_m, own.rpy_rad) != (other.xyz_m, other.rpy_rad) {
        keys.push("tcp".into());
    }
    keys
}
