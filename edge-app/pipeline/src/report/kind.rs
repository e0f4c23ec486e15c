//! Imperfections in a report: unit, and entry of `[accuracy]`.

use flexid_core::imperfection::{Imperfection, Place, Stated};
use flexid_wire::accuracy::Accuracy;

use crate::model::{Kind, Model};

/// Returns whether a report names it. What a low-pass does beside its delay belongs to the delay.
pub(super) fn is_listed(imperfection: Imperfection) -> bool {
    imperfection.facts().stated != Stated::WithAnother
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
