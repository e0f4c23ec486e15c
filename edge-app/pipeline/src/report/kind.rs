//! Imperfections in words: name, unit, and entry of `[accuracy]`.

use flexid_core::imperfection::{Imperfection, Place, Stated};
use flexid_wire::accuracy::Accuracy;
use flexid_wire::text::{Label, clipped};

use crate::model::{Kind, Model};
use crate::names::{DOF_NAMES, joint_name};

const AXES: [&str; 3] = ["x", "y", "z"];
const SPREADS: [&str; 6] = ["x", "y", "z", "xy", "xz", "yz"];

/// Returns whether a report names it. What a low-pass does beside its delay belongs to the delay.
pub(super) fn is_listed(imperfection: Imperfection) -> bool {
    imperfection.facts().stated != Stated::WithAnother
}

/// Returns the name of an imperfection, for example `force sensor turned about x`.
pub(super) fn name(imperfection: Imperfection, model: &Model) -> Label {
    let name = imperfection.facts().name;
    let joint = |own| ("{joint}", joint_name(model, own).to_string());
    let word = |mark, word: &str| (mark, word.to_owned());
    let words = match imperfection.place() {
        Place::Only => vec![],
        Place::Axis(axis) => vec![word("{axis}", AXES[axis])],
        Place::Pair(into, from) => vec![word("{axis}", AXES[into]), word("{from}", AXES[from])],
        Place::Joint(own) => vec![joint(own)],
        Place::InJoint(own, entry) if name.contains("{spread}") => {
            vec![word("{spread}", SPREADS[entry]), joint(own)]
        }
        Place::InJoint(own, axis) => vec![word("{axis}", AXES[axis]), joint(own)],
        Place::Dof(dof) => vec![word("{dof}", DOF_NAMES[dof])],
        Place::Record(record) => vec![("{record}", (record + 1).to_string())],
    };
    let written = |name: String, (mark, word): (&str, String)| name.replace(mark, &word);
    clipped(words.into_iter().fold(name.to_owned(), written))
}

/// Returns the unit of an imperfection.
pub(super) fn unit(imperfection: Imperfection, model: &Model) -> &'static str {
    let is_along = match imperfection.place() {
        Place::Joint(joint) => model.joints[joint].kind == Kind::Prismatic,
        Place::Dof(dof) => dof < 3,
        _ => false,
    };
    let [along, about] = imperfection.facts().units;
    if is_along { along } else { about }
}

/// The entry of `[accuracy]` that speaks of an imperfection.
pub(super) fn entry(imperfection: Imperfection) -> Accuracy {
    // A test asks for those of all.
    Accuracy::of_key(imperfection.entry().key).expect("an entry of each imperfection")
}

#[cfg(test)]
mod tests {
    use flexid_core::MAX_JOINTS;
    use flexid_core::chain::JointKind;
    use flexid_core::imperfection::possible;

    use super::*;

    /// Imperfection and entry agree if it is a factor.
    #[test]
    fn each_imperfection_has_an_entry() {
        let low_pass = [Imperfection::Dispersion, Imperfection::RollOff];
        let all = possible(&[JointKind::Revolute; MAX_JOINTS], 2).chain(low_pass);
        for imperfection in all {
            let entry = entry(imperfection);
            assert_eq!(entry.key(), imperfection.entry().key);
            assert_eq!(entry.is_factor(), imperfection.facts().is_factor, "{imperfection:?}");
        }
    }
}
