//! Section `[accuracy]`: how far what the configuration states may be off.

use std::f64::consts::TAU;

use flexid_core::imperfection::Accuracies;
use flexid_core::stream::STATIC;

use super::sections::{AccuracySection, Assumed, CalibrationSection};
use crate::model::MassAccuracy;

/// How many times its typical value an accuracy may be without a warning. Chosen: errors of up to thirty times their typical accuracy
/// are the largest with which the intervals are proved (tests/README.md). A standard deviation of twenty times makes larger ones likely.
const LOOSE: f64 = 20.0;

/// An accuracy of one value that the section may state.
struct Accuracy {
    key: &'static str,
    stated: fn(&AccuracySection) -> Option<f64>,
    own: fn(&mut Accuracies) -> &mut f64,
    /// Largest value that may be stated. Beyond it what is off must be corrected itself.
    most: f64,
    /// SI unit over that of the section.
    scale: f64,
    unit: &'static str,
    /// True if a value of more than [`LOOSE`] times the typical one deserves a warning. Structure, ground, clocks, and growth with load may
    /// be so much worse on a real robot. Others are refused before they are so loose.
    is_warned_of: bool,
}

/// A row of [`ACCURACIES`].
macro_rules! accuracy {
    ($key:ident, $($own:ident).+, $most:expr, $unit:expr, $is_warned_of:expr) => {
        Accuracy {
            key: stringify!($key),
            stated: |section| section.$key,
            own: |accuracies| &mut accuracies.$($own).+,
            most: $most,
            scale: 1.0,
            unit: $unit,
            is_warned_of: $is_warned_of,
        }
    };
}

/// A key of `[accuracy]`, that of `[calibration]`, and what the latter states.
type AlsoSought = (&'static str, &'static str, fn(&CalibrationSection) -> Option<f64>);

/// Accuracies that a key of `[calibration]` states as well: what that seeks has a prior there, and none here.
const ALSO_SOUGHT: [AlsoSought; 5] = [
    ("delay_s", "delay_s", |section| section.delay_s),
    ("force_gain", "force_gain", |section| section.force_gain),
    ("acceleration_gain", "acceleration_gain", |section| section.acceleration_gain),
    ("accelerometer_angle_rad", "misalignment_rad", |section| section.misalignment_rad),
    ("link_mass", "link_mass", |section| section.link_mass),
];

const PART: &str = "0.01 is 1 %";
/// All but those of the filters of sensors, which are stated by their frequencies.
#[rustfmt::skip]
const ACCURACIES: [Accuracy; 28] = [
    accuracy!(delay_s, delay, 1e-3, "in s", true),
    accuracy!(delay_drift, delay_drift, 1e-3, "1e-6 is 1 ppm", false),
    accuracy!(force_gain, force.gain, 0.5, PART, true),
    accuracy!(force_crosstalk, force.crosstalk, 0.5, PART, true),
    accuracy!(force_angle_rad, force.angle, 0.5, "in rad", true),
    accuracy!(acceleration_gain, accelerometer.gain, 0.5, PART, true),
    accuracy!(acceleration_crosstalk, accelerometer.crosstalk, 0.5, PART, true),
    accuracy!(accelerometer_angle_rad, accelerometer.angle, 0.5, "in rad", true),
    accuracy!(accelerometer_place_m, accelerometer_place, 0.5, "in m", true),
    accuracy!(tool_angle_rad, tool_angle, 0.5, "in rad", true),
    accuracy!(tcp_m, tool_centre_point, 0.5, "in m", true),
    accuracy!(link_mass, mass, 0.5, PART, true),
    accuracy!(centre_of_mass_m, centre_of_mass, 0.5, "in m", true),
    accuracy!(joint_angle_rad, joint_angle, 0.5, "in rad", true),
    accuracy!(elastic_centre_m, elastic_centre, 0.5, "in m", true),
    accuracy!(link_inertia, inertia, 1.0, PART, false),
    accuracy!(hysteresis, hysteresis, 1.0, PART, false),
    accuracy!(drive_growth, servo, 1.0, PART, false),
    Accuracy { scale: 1e-3, ..accuracy!(drive_growth_per_knm, load, 0.5, PART, false) },
    accuracy!(delay_of_record_s, record_delay, 1e-3, "in s", true),
    accuracy!(stiffness_of_record, record_stiffness, 0.2, PART, true),
    accuracy!(structure_m_per_n, structure_translation, 1e-6, "in m/N: 1e-10 is 1e10 N/m", false),
    accuracy!(structure_rad_per_nm, structure_rotation, 1e-5, "in rad/Nm: 1e-10 is 1e10 Nm/rad", false),
    accuracy!(ground_m_per_n, ground_translation, 1e-6, "in m/N: 1e-9 is 1e9 N/m", false),
    accuracy!(ground_rad_per_nm, ground_rotation, 1e-5, "in rad/Nm: 1e-9 is 1e9 Nm/rad", false),
    accuracy!(base_mass, base_mass, 1.0, PART, false),
    accuracy!(hose_n_per_m, hose, 1e6, "in N/m", true),
    accuracy!(hose_ns_per_m, hose_damping, 1e5, "in Ns/m", true),
];

/// Returns the keys of `[accuracy]` that are so loose that hardly anything is left of what the configuration states, and by how many
/// times they are larger than typical. Filters (`*_resonance_hz`, `*_high_pass_hz`) may be so much worse on a real robot.
pub fn loose(accuracies: &Accuracies) -> impl Iterator<Item = (&'static str, f64)> + use<> {
    let (mut stated, mut typical) = (*accuracies, Accuracies::typical());
    ACCURACIES
        .iter()
        .filter(|accuracy| accuracy.is_warned_of)
        .map(move |Accuracy { key, own, .. }| (*key, *own(&mut stated) / *own(&mut typical)))
        // A part of a calculation may lie just above the limit.
        .filter(|(_, times)| *times > LOOSE * (1.0 + 1e-9))
}

/// Returns the accuracies, those that the section does not state as assumed, or as the model states them for its `masses`. What
/// `calibration` seeks has a prior there, and none here. `band_hz` is the band that is fitted, and `angle_step` the largest step of a
/// joint's signal, rad (m).
pub(super) fn accuracies(
    section: &AccuracySection,
    calibration: &CalibrationSection,
    masses: Option<&MassAccuracy>,
    band_hz: [f64; 2],
    angle_step: f64,
) -> Result<Accuracies, String> {
    let mut accuracies = assumed(section.assume, masses);
    for Accuracy { key, stated, own, most, scale, unit, .. } in &ACCURACIES {
        let sought = ALSO_SOUGHT.iter().find(|(also, ..)| also == key);
        let sought = sought.filter(|(.., sought)| sought(calibration).is_some());
        let target = own(&mut accuracies);
        match (stated(section), sought) {
            (Some(_), Some((_, other, _))) => {
                return Err(format!(
                    "[accuracy] {key} and [calibration] {other} state the same: leave one out"
                ));
            }
            (Some(stated), None) if (0.0..=*most).contains(&stated) => *target = scale * stated,
            (Some(stated), None) => {
                return Err(format!(
                    "[accuracy] {key} is {stated}: must be 0 to {most} ({unit}), one standard deviation"
                ));
            }
            (None, Some(_)) => *target = 0.0,
            (None, None) => {}
        }
    }
    let is_assumed = section.joint_angle_rad.is_none() && section.assume == Assumed::Typical;
    if is_assumed && angle_step > STATIC {
        // An angle lies anywhere in the step that is read.
        accuracies.joint_angle = accuracies.joint_angle.hypot(angle_step / 12_f64.sqrt());
    }
    let Accuracies { force, accelerometer, .. } = &mut accuracies;
    // A filter beyond these limits is no small change of the band. A reading is then wrong by a ninth, or turned by a third of a radian.
    let resonances = [3.0 * band_hz[1], 1e6];
    let corners = [0.0, band_hz[0] / 3.0];
    let squared_period: fn(f64) -> f64 = |omega| 1.0 / (omega * omega);
    let itself: fn(f64) -> f64 = |omega| omega;
    for (key, stated, target, [least, most], of_omega) in [
        (
            "force_resonance_hz",
            section.force_resonance_hz,
            &mut force.resonance,
            resonances,
            squared_period,
        ),
        (
            "accelerometer_resonance_hz",
            section.accelerometer_resonance_hz,
            &mut accelerometer.resonance,
            resonances,
            squared_period,
        ),
        ("force_high_pass_hz", section.force_high_pass_hz, &mut force.high_pass, corners, itself),
        (
            "accelerometer_high_pass_hz",
            section.accelerometer_high_pass_hz,
            &mut accelerometer.high_pass,
            corners,
            itself,
        ),
    ] {
        let Some(stated) = stated else { continue };
        if !(least..=most).contains(&stated) {
            let [least, most] = [least, most].map(|hz: f64| (1e3 * hz).round() / 1e3);
            return Err(format!(
                "[accuracy] {key} is {stated}: must be {least} to {most} (in Hz), well outside band_hz: narrow that, or correct the filter"
            ));
        }
        *target = of_omega(TAU * stated);
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
        let of = |section: &AccuracySection, calibration: &CalibrationSection| {
            let all = accuracies(section, calibration, Some(&masses), [2.0, 200.0], 0.0).unwrap();
            [all.mass, all.inertia, all.centre_of_mass, all.tool_centre_point]
        };
        let (mut section, mut calibration) = Default::default();
        let tool = Accuracies::typical().tool_centre_point;
        assert_eq!(of(&section, &calibration), [0.3, 0.4, 0.06, tool]);
        section.link_inertia = Some(0.1);
        calibration.link_mass = Some(0.2);
        assert_eq!(of(&section, &calibration), [0.0, 0.1, 0.06, tool]);
        section.assume = Assumed::Perfect;
        assert_eq!(of(&section, &calibration), [0.0, 0.1, 0.06, 0.0]);
    }

    #[test]
    fn each_accuracy_has_a_key() {
        const FILTERS: usize = 4;
        let all = size_of::<Accuracies>() / size_of::<f64>();
        assert_eq!(ACCURACIES.len() + FILTERS, all);
        let has_key = |own: &&str| ACCURACIES.iter().any(|accuracy| accuracy.key == *own);
        assert!(ALSO_SOUGHT.iter().map(|(key, ..)| key).all(has_key));
        let mut accuracies = Accuracies::default();
        for Accuracy { key, own, .. } in &ACCURACIES {
            assert_eq!(*own(&mut accuracies), 0.0, "{key} is that of another");
            *own(&mut accuracies) = 1.0;
        }
    }

    #[test]
    fn a_pose_is_as_uncertain_as_the_steps_of_its_angles() {
        let joint_angle = |section: &AccuracySection, step| {
            accuracies(section, &CalibrationSection::default(), None, [2.0, 200.0], step)
                .unwrap()
                .joint_angle
        };
        let mut section = AccuracySection::default();
        let typical = Accuracies::typical().joint_angle;
        assert_eq!(joint_angle(&section, 1e-5), typical);
        let degree = joint_angle(&section, 1_f64.to_radians());
        assert!((degree / 5.136e-3 - 1.0).abs() < 1e-3, "{degree}");
        section.joint_angle_rad = Some(2e-3);
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
