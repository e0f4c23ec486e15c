//! Section `[accuracy]`: how far what the configuration states may be off.

use std::f64::consts::TAU;

use flexid_core::imperfection::Accuracies;

use super::sections::{AccuracySection, Assumed, CalibrationSection};

/// How many times its typical value an accuracy may be without a warning. Chosen: errors of up to thirty times their typical accuracy
/// are the largest with which the intervals are proved (tests/README.md). A standard deviation of twenty times makes larger ones likely.
const LOOSE: f64 = 20.0;

/// Returns the keys of `[accuracy]` that are so loose that hardly anything is left of what the configuration states, and by how many
/// times they are larger than typical.
///
/// Left out is what may be so much worse on a real robot: filters (`*_resonance_hz`, `*_high_pass_hz`), structure and ground
/// (`structure_*`, `ground_*`), and the growth with load (`drive_growth_per_knm`). Left out is also what is refused before it is so
/// loose: `link_inertia`, `hysteresis`, `drive_growth` and `base_mass`.
pub fn loose(accuracies: &Accuracies) -> impl Iterator<Item = (&'static str, f64)> + use<> {
    let typical = Accuracies::typical();
    // Each is named, so that a new one is not forgotten.
    let Accuracies {
        force,
        accelerometer,
        delay,
        tool_angle,
        tool_centre_point,
        accelerometer_place,
        mass,
        centre_of_mass,
        joint_angle,
        elastic_centre,
        inertia: _,
        hysteresis: _,
        servo: _,
        load: _,
        record_delay,
        record_stiffness,
        structure_translation: _,
        structure_rotation: _,
        ground_translation: _,
        ground_rotation: _,
        base_mass: _,
        hose,
        hose_damping,
    } = accuracies;
    let all = [
        ("delay_s", delay / typical.delay),
        ("force_gain", force.gain / typical.force.gain),
        ("force_crosstalk", force.crosstalk / typical.force.crosstalk),
        ("force_angle_rad", force.angle / typical.force.angle),
        ("acceleration_gain", accelerometer.gain / typical.accelerometer.gain),
        ("acceleration_crosstalk", accelerometer.crosstalk / typical.accelerometer.crosstalk),
        ("accelerometer_angle_rad", accelerometer.angle / typical.accelerometer.angle),
        ("accelerometer_place_m", accelerometer_place / typical.accelerometer_place),
        ("tool_angle_rad", tool_angle / typical.tool_angle),
        ("tcp_m", tool_centre_point / typical.tool_centre_point),
        ("link_mass", mass / typical.mass),
        ("centre_of_mass_m", centre_of_mass / typical.centre_of_mass),
        ("joint_angle_rad", joint_angle / typical.joint_angle),
        ("elastic_centre_m", elastic_centre / typical.elastic_centre),
        ("delay_of_record_s", record_delay / typical.record_delay),
        ("stiffness_of_record", record_stiffness / typical.record_stiffness),
        ("hose_n_per_m", hose / typical.hose),
        ("hose_ns_per_m", hose_damping / typical.hose_damping),
    ];
    // A part of a calculation may lie just above the limit.
    all.into_iter().filter(|(_, times)| *times > LOOSE * (1.0 + 1e-9))
}

/// Returns the accuracies, those that the section does not state as assumed. What `calibration` seeks has a prior there, and none
/// here. `band_hz` is the band that is fitted.
pub(super) fn accuracies(
    section: &AccuracySection,
    calibration: &CalibrationSection,
    band_hz: [f64; 2],
) -> Result<Accuracies, String> {
    let mut accuracies = match section.assume {
        Assumed::Typical => Accuracies::typical(),
        Assumed::Perfect => Accuracies::default(),
    };
    let Accuracies {
        force,
        accelerometer,
        delay,
        tool_angle,
        tool_centre_point,
        accelerometer_place,
        mass,
        centre_of_mass,
        joint_angle,
        elastic_centre,
        inertia,
        hysteresis,
        servo,
        load,
        record_delay,
        record_stiffness,
        structure_translation,
        structure_rotation,
        ground_translation,
        ground_rotation,
        base_mass,
        hose,
        hose_damping,
    } = &mut accuracies;
    let part = "0.01 is 1 %";
    let mut load_per_knm = 0.0;
    // Beyond these limits the stated value itself must be corrected.
    for (key, stated, target, most, unit) in [
        ("delay_s", section.delay_s, &mut *delay, 1e-3, "in s"),
        ("force_gain", section.force_gain, &mut force.gain, 0.5, part),
        ("force_crosstalk", section.force_crosstalk, &mut force.crosstalk, 0.5, part),
        ("force_angle_rad", section.force_angle_rad, &mut force.angle, 0.5, "in rad"),
        ("acceleration_gain", section.acceleration_gain, &mut accelerometer.gain, 0.5, part),
        (
            "acceleration_crosstalk",
            section.acceleration_crosstalk,
            &mut accelerometer.crosstalk,
            0.5,
            part,
        ),
        (
            "accelerometer_angle_rad",
            section.accelerometer_angle_rad,
            &mut accelerometer.angle,
            0.5,
            "in rad",
        ),
        ("accelerometer_place_m", section.accelerometer_place_m, accelerometer_place, 0.5, "in m"),
        ("tool_angle_rad", section.tool_angle_rad, tool_angle, 0.5, "in rad"),
        ("tcp_m", section.tcp_m, tool_centre_point, 0.5, "in m"),
        ("link_mass", section.link_mass, &mut *mass, 0.5, part),
        ("centre_of_mass_m", section.centre_of_mass_m, centre_of_mass, 0.5, "in m"),
        ("joint_angle_rad", section.joint_angle_rad, joint_angle, 0.5, "in rad"),
        ("elastic_centre_m", section.elastic_centre_m, elastic_centre, 0.5, "in m"),
        ("link_inertia", section.link_inertia, inertia, 0.5, part),
        ("hysteresis", section.hysteresis, hysteresis, 1.0, part),
        ("drive_growth", section.drive_growth, servo, 1.0, part),
        ("drive_growth_per_knm", section.drive_growth_per_knm, &mut load_per_knm, 0.5, part),
        ("delay_of_record_s", section.delay_of_record_s, record_delay, 1e-3, "in s"),
        (
            "structure_m_per_n",
            section.structure_m_per_n,
            structure_translation,
            1e-6,
            "in m/N: 1e-10 is 1e10 N/m",
        ),
        (
            "structure_rad_per_nm",
            section.structure_rad_per_nm,
            structure_rotation,
            1e-5,
            "in rad/Nm: 1e-10 is 1e10 Nm/rad",
        ),
        (
            "ground_m_per_n",
            section.ground_m_per_n,
            ground_translation,
            1e-6,
            "in m/N: 1e-9 is 1e9 N/m",
        ),
        (
            "ground_rad_per_nm",
            section.ground_rad_per_nm,
            ground_rotation,
            1e-5,
            "in rad/Nm: 1e-9 is 1e9 Nm/rad",
        ),
        ("base_mass", section.base_mass, base_mass, 1.0, part),
        ("hose_n_per_m", section.hose_n_per_m, hose, 1e6, "in N/m"),
        ("hose_ns_per_m", section.hose_ns_per_m, hose_damping, 1e5, "in Ns/m"),
        ("stiffness_of_record", section.stiffness_of_record, record_stiffness, 0.2, part),
    ] {
        let Some(stated) = stated else { continue };
        if !(0.0..=most).contains(&stated) {
            return Err(format!(
                "[accuracy] {key} is {stated}: must be 0 to {most} ({unit}), one standard deviation"
            ));
        }
        *target = stated;
    }
    if section.drive_growth_per_knm.is_some() {
        *load = load_per_knm / 1e3;
    }
    for (key, stated, other, sought, target) in [
        ("delay_s", section.delay_s, "delay_s", calibration.delay_s, delay),
        ("force_gain", section.force_gain, "force_gain", calibration.force_gain, &mut force.gain),
        (
            "acceleration_gain",
            section.acceleration_gain,
            "acceleration_gain",
            calibration.acceleration_gain,
            &mut accelerometer.gain,
        ),
        (
            "accelerometer_angle_rad",
            section.accelerometer_angle_rad,
            "misalignment_rad",
            calibration.misalignment_rad,
            &mut accelerometer.angle,
        ),
        ("link_mass", section.link_mass, "link_mass", calibration.link_mass, mass),
    ] {
        match (stated, sought) {
            (Some(_), Some(_)) => {
                return Err(format!(
                    "[accuracy] {key} and [calibration] {other} state the same: leave one out"
                ));
            }
            (None, Some(_)) => *target = 0.0,
            _ => {}
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hose_of_any_stiffness_is_loose() {
        let typical = Accuracies::typical();
        assert_eq!(loose(&typical).count(), 0);
        let accuracies = Accuracies { hose: 21e3, hose_damping: 400.0, ..typical };
        let all: Vec<_> = loose(&accuracies).collect();
        assert!(matches!(all[..], [("hose_n_per_m", times)] if (times - 21.0).abs() < 1e-9));
    }
}
