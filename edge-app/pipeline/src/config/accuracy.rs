//! Section `[accuracy]`: how far what the configuration states may be off.

use flexid_core::imperfection::{Accuracies, ENTRIES, Form};
use flexid_core::sought::Sought;
use flexid_core::stream::STATIC;

use super::sought::{CALIBRATED, Calibrated};
use super::stated::{AccuracySection, Assumed};
use crate::model::MassAccuracy;

/// How many times its typical value an accuracy may be without a warning. Chosen: errors of up to thirty times their typical accuracy
/// are the largest with which the intervals are proved (tests/README.md). A standard deviation of twenty times makes larger ones likely.
const LOOSE: f64 = 20.0;

/// Returns the keys of `[accuracy]` that are so loose that hardly anything is left of what the configuration states, and by how many
/// times they are larger than typical.
pub fn loose(accuracies: &Accuracies) -> impl Iterator<Item = (&'static str, f64)> + use<> {
    let (stated, typical) = (*accuracies, Accuracies::typical());
    ENTRIES
        .iter()
        .filter(|entry| !entry.may_be_loose)
        .map(move |entry| (entry.key, entry.of(&stated) / entry.of(&typical)))
        // A part of a calculation may lie just above the limit.
        .filter(|(_, times)| *times > LOOSE * (1.0 + 1e-9))
}

/// Returns the accuracies, those that the section does not state as assumed, or as the model states them for its `masses`. What
/// is `sought` has a prior there, and none here. `band_hz` is the band that is fitted, and `angle_step` the largest step of a
/// joint's signal, rad (m).
pub(super) fn accuracies(
    section: &AccuracySection,
    sought: &Sought,
    masses: Option<&MassAccuracy>,
    band_hz: [f64; 2],
    angle_step: f64,
) -> Result<Accuracies, String> {
    let mut accuracies = assumed(section.assume, masses);
    let filters = [Form::Resonance, Form::Corner];
    for entry in ENTRIES.iter().filter(|entry| !filters.contains(&entry.form)) {
        let (key, most, unit) = (entry.key, entry.most, entry.unit);
        let is_sought = sought.imperfections().iter().any(|(own, _)| own.entry().key == key);
        let also = CALIBRATED.iter().find(|own| is_sought && own.accuracy == key);
        let target = (entry.own)(&mut accuracies);
        match (section.stated.get(key), also) {
            (Some(_), Some(Calibrated { key: other, .. })) => {
                return Err(format!(
                    "[accuracy] {key} and [calibration] {other} state the same: leave one out"
                ));
            }
            (Some(&stated), None) if (0.0..=most).contains(&stated) => *target = entry.si(stated),
            (Some(stated), None) => {
                return Err(format!(
                    "[accuracy] {key} is {stated}: must be 0 to {most} ({unit}), one standard deviation"
                ));
            }
            (None, Some(_)) => *target = 0.0,
            (None, None) => {}
        }
    }
    let states_angle = section.stated.contains_key("joint_angle_rad");
    if !states_angle && section.assume == Assumed::Typical && angle_step > STATIC {
        // An angle lies anywhere in the step that is read.
        accuracies.joint_angle = accuracies.joint_angle.hypot(angle_step / 12_f64.sqrt());
    }
    // A filter beyond these limits is no small change of the band. A reading is then wrong by a ninth, or turned by a third of a radian.
    let limits = [[3.0 * band_hz[1], 1e6], [0.0, band_hz[0] / 3.0]];
    for (form, [least, most]) in filters.into_iter().zip(limits) {
        for entry in ENTRIES.iter().filter(|entry| entry.form == form) {
            let Some(stated) = section.stated.get(entry.key) else { continue };
            if !(least..=most).contains(stated) {
                let [least, most] = [least, most].map(|hz: f64| (1e3 * hz).round() / 1e3);
                return Err(format!(
                    "[accuracy] {} is {stated}: must be {least} to {most} ({}), well outside band_hz: narrow that, or correct the filter",
                    entry.key, entry.unit
                ));
            }
            *(entry.own)(&mut accuracies) = entry.si(*stated);
        }
    }
    Ok(accuracies)
}

/// Typical or perfect accuracies; those of the links' bodies are the model's, where it states them: a guess stays one beside perfect sensors.
fn assumed(own: Assumed, masses: Option<&MassAccuracy>) -> Accuracies {
    let others = match own {
        Assumed::Typical => Accuracies::typical(),
        Assumed::Perfect => Accuracies::default(),
    };
    match masses {
        Some(&MassAccuracy { link_mass, link_inertia, centre_of_mass_m }) => Accuracies {
            mass: link_mass,
            inertia: link_inertia,
            centre_of_mass: centre_of_mass_m,
            ..others
        },
        None => others,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the configuration states goes before the model, and what it seeks before both. What the model guesses is not perfect.
    #[test]
    fn a_model_states_how_far_its_masses_may_be_off() {
        let masses = MassAccuracy { link_mass: 0.3, link_inertia: 0.4, centre_of_mass_m: 0.06 };
        let of = |section: &AccuracySection, sought: &Sought| {
            let all = accuracies(section, sought, Some(&masses), [2.0, 200.0], 0.0).unwrap();
            [all.mass, all.inertia, all.centre_of_mass, all.tool_centre_point]
        };
        let (mut section, mut sought) = (AccuracySection::default(), Sought::new(3).unwrap());
        let tool = Accuracies::typical().tool_centre_point;
        assert_eq!(of(&section, &sought), [0.3, 0.4, 0.06, tool]);
        section.stated.insert("link_inertia", 0.1);
        sought.seek("link_mass", 0.2).unwrap();
        assert_eq!(of(&section, &sought), [0.0, 0.1, 0.06, tool]);
        section.assume = Assumed::Perfect;
        assert_eq!(of(&section, &sought), [0.0, 0.1, 0.06, 0.0]);
    }

    #[test]
    fn each_accuracy_has_a_key() {
        assert_eq!(ENTRIES.len(), size_of::<Accuracies>() / size_of::<f64>());
        let has_key = |own: &&str| ENTRIES.iter().any(|entry| entry.key == *own);
        assert!(CALIBRATED.iter().map(|own| &own.accuracy).all(has_key));
        let mut accuracies = Accuracies::default();
        for entry in ENTRIES {
            assert_eq!(entry.of(&accuracies), 0.0, "{} is that of another", entry.key);
            *(entry.own)(&mut accuracies) = 1.0;
        }
    }

    #[test]
    fn a_pose_is_as_uncertain_as_the_steps_of_its_angles() {
        let joint_angle = |section: &AccuracySection, step| {
            accuracies(section, &Sought::new(3).unwrap(), None, [2.0, 200.0], step)
                .unwrap()
                .joint_angle
        };
        let mut section = AccuracySection::default();
        let typical = Accuracies::typical().joint_angle;
        assert_eq!(joint_angle(&section, 1e-5), typical);
        let degree = joint_angle(&section, 1_f64.to_radians());
        assert!((degree / 5.136e-3 - 1.0).abs() < 1e-3, "{degree}");
        section.stated.insert("joint_angle_rad", 2e-3);
        assert_eq!(joint_angle(&section, 1_f64.to_radians()), 2e-3);
    }

    #[test]
    fn a_hose_of_any_stiffness_is_loose() {
        let typical = Accuracies::typical();
        assert_eq!(loose(&typical).count(), 0);
        let accuracies = Accuracies { hose: 21e3, hose_damping: 400.0, ..typical };
        let all: Vec<_> = loose(&accuracies).collect();
        assert!(matches!(all[..], [("hose_n_per_m", times)] if (times - 21.0).abs() < 1e-9));
    }
}
