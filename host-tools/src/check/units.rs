//! Judges the units of angles, acceleration and force.

use flexid_pipeline::check::{AtRest, Survey};
use flexid_pipeline::config::Config;
use flexid_wire::implausible::{BeyondLimits, GravityDenial, Implausible};
use flexid_wire::warning::Warning;

use super::Severity::{Doubtful, Note, Wrong};
use super::{Finding, joints, unless_all_is_lost};
use crate::urdf;

pub(super) const ABOUT: &str = "units";
const GIVE_UNIT: &str = "give the unit in [bus] dbc, or with the name of the column";
/// Largest force of a cut, N. The strongest robots carry 2300 kg (23 kN), so that none bears this force.
const LARGEST_CUT_N: f32 = 1e5;

/// Judges the units of a survey. What the limits of the joints are worth is judged with the model.
pub(super) fn judge(config: &Config, survey: &Survey) -> Vec<Finding> {
    let mut findings: Vec<Finding> = survey.implausible.iter().filter_map(of_readings).collect();
    findings.extend(of_angles(survey).filter(|_| urdf::limits_in_degrees(&config.model).is_none()));
    findings.extend(survey.at_rest.map(of_rest));
    findings.extend(of_force(survey));
    findings
}

/// Readings that point to a wrong unit.
fn of_readings(readings: &Implausible) -> Option<Finding> {
    Some(match readings {
        Implausible::BeyondLimits(joint) => beyond_limits(joint),
        Implausible::GravityDenied { reading, by, .. } => {
            let stated = match by {
                GravityDenial::NoGravity => "gravity_m_per_s2 is zero",
                GravityDenial::Inertial => "accelerometer is \"inertial\"",
            };
            let finding = format!(
                "the accelerometer reads {reading:.2} m/s² at rest, as gravity is, but {stated}"
            );
            Finding::new(Wrong, ABOUT, finding, "delete that line in the configuration")
        }
        Implausible::GravityInUnit { reading, unit } => {
            let finding = format!(
                "the accelerometer reads {reading:.2} m/s² at rest, and gravity is 9.81 m/s²: is it in {unit}?"
            );
            Finding::new(Wrong, ABOUT, finding, GIVE_UNIT)
        }
        // The sensors have findings of their own.
        Implausible::Stuck(_)
        | Implausible::Flat(_)
        | Implausible::Spikes(_)
        | Implausible::Clipped(_)
        | Implausible::Held(_) => return None,
    })
}

fn beyond_limits(joint: &BeyondLimits) -> Finding {
    let (unit, other) = if joint.slides { ("m", "mm") } else { ("rad", "degrees") };
    let limits = match joint.limits {
        [Some(lower), Some(upper)] => format!("{lower:.2} to {upper:.2} {unit}"),
        [Some(lower), None] => format!("{lower:.2} {unit} or more"),
        [None, Some(upper)] => format!("{upper:.2} {unit} or less"),
        [None, None] => "not stated".to_owned(),
    };
    let others = match joint.others {
        0 => String::new(),
        1 => ", and 1 other joint is beyond its own".to_owned(),
        others => format!(", and {others} other joints are beyond theirs"),
    };
    let finding = format!(
        "{} reads {:.3} {unit}, and the limits of {} are {limits}{others}",
        joint.signal, joint.value, joint.joint
    );
    if joint.in_other_unit {
        Finding::new(Wrong, ABOUT, format!("{finding}: is it in {other}?"), GIVE_UNIT)
    } else {
        let mend = format!(
            "check its unit ({other}?) and its zero, or correct the limits in [model] file"
        );
        Finding::new(Doubtful, ABOUT, finding, mend)
    }
}

fn of_angles(survey: &Survey) -> Option<Finding> {
    let is_beyond = |readings: &Implausible| matches!(readings, Implausible::BeyondLimits(_));
    let are_right = !survey.implausible.iter().any(is_beyond) && !joints::has_wrong(survey);
    let any = survey.usable().next().is_some() && are_right;
    any.then(|| Finding::right(ABOUT, "all joint angles are within the limits of the model"))
}

/// The reading of the accelerometer at rest, where it should read gravity.
fn of_rest(at_rest: AtRest) -> Finding {
    match at_rest {
        AtRest::Gravity => Finding::right(ABOUT, "the accelerometer reads gravity at rest"),
        AtRest::Nothing(reading) => Finding::new(
            Note,
            ABOUT,
            format!("the accelerometer reads {reading:.2} m/s² at rest, and gravity is 9.81 m/s²"),
            "right if the sensor removes its mean, as that of `flexid simulate` does; else check its unit and factor",
        ),
        AtRest::Other(reading) => Finding::new(
            Doubtful,
            ABOUT,
            format!("the accelerometer reads {reading:.2} m/s² at rest, and gravity is 9.81 m/s²"),
            "check factor and offset in [bus] dbc, and the zero of each axis",
        ),
    }
}

/// Force by itself, and against the acceleration.
fn of_force(survey: &Survey) -> Option<Finding> {
    let in_unit = |readings: &Implausible| matches!(readings, Implausible::GravityInUnit { .. });
    let largest = survey.counts.implausible.largest_force;
    match &survey.scale {
        // The unit of the acceleration is known, and explains it.
        Some(_) if survey.implausible.iter().any(in_unit) => None,
        Some(Warning::Disproportion { ratio, suspect }) => {
            let finding = format!(
                "the acceleration is {ratio:.1e} times what the force makes of the model's masses: {suspect}"
            );
            let mend = format!("{GIVE_UNIT}, or correct masses or [bounds]");
            Some(Finding::new(Wrong, ABOUT, finding, mend))
        }
        Some(other) => Some(Finding::new(Wrong, ABOUT, other.to_string(), "")),
        None if survey.faint_force_n.is_some() => {
            let finding = format!("no force is above {largest:.2} N: is it in kN?");
            Some(Finding::new(
                unless_all_is_lost(survey),
                ABOUT,
                finding,
                format!("{GIVE_UNIT}, or cut"),
            ))
        }
        None if largest > LARGEST_CUT_N => {
            let finding = format!("the force reaches {largest:.0} N: is it in mN?");
            Some(Finding::new(unless_all_is_lost(survey), ABOUT, finding, GIVE_UNIT))
        }
        None if survey.usable().next().is_some() => {
            let finding = format!(
                "force (up to {largest:.0} N) and acceleration go with the masses of the model"
            );
            Some(Finding::right(ABOUT, finding))
        }
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::implausible::AccelerationUnit;
    use flexid_wire::text::clipped;
    use flexid_wire::warning::WrongUnit;

    use super::*;
    use crate::check::Severity::Right;
    use crate::check::fixture::{config, empty, good};

    fn gravest(survey: &Survey) -> Finding {
        judge(&config(), survey).into_iter().min_by_key(|finding| finding.severity).unwrap()
    }

    fn beyond(in_other_unit: bool) -> Implausible {
        Implausible::BeyondLimits(BeyondLimits {
            signal: clipped("q2"),
            joint: clipped("joint_2"),
            slides: false,
            value: -63.025,
            limits: [Some(-2.1), Some(2.1)],
            in_other_unit,
            others: 1,
        })
    }

    #[test]
    fn degrees_are_wrong_and_a_narrow_limit_is_doubtful() {
        let mut survey = good();
        assert!(judge(&config(), &survey).iter().all(|finding| finding.severity == Right));
        survey.implausible = vec![beyond(true)];
        assert_eq!(gravest(&survey).severity, Wrong);
        assert_eq!(
            gravest(&survey).finding,
            "q2 reads -63.025 rad, and the limits of joint_2 are -2.10 to 2.10 rad, \
             and 1 other joint is beyond its own: is it in degrees?"
        );
        survey.implausible = vec![beyond(false)];
        assert_eq!(gravest(&survey).severity, Doubtful);
    }

    #[test]
    fn an_acceleration_in_g_is_named_once() {
        let mut survey = good();
        survey.scale =
            Some(Warning::Disproportion { ratio: 0.1, suspect: WrongUnit::AccelerationInG });
        assert_eq!(gravest(&survey).severity, Wrong);
        assert!(gravest(&survey).finding.ends_with("is the acceleration in g?"));
        survey.implausible =
            vec![Implausible::GravityInUnit { reading: 1.0, unit: AccelerationUnit::G }];
        let wrong =
            judge(&config(), &survey).into_iter().filter(|finding| finding.severity == Wrong);
        assert_eq!(wrong.count(), 1);
    }

    #[test]
    fn gravity_is_looked_for_at_rest() {
        let mut survey = good();
        for (at_rest, severity) in
            [(AtRest::Gravity, Right), (AtRest::Nothing(0.1), Note), (AtRest::Other(5.0), Doubtful)]
        {
            survey.at_rest = Some(at_rest);
            assert_eq!(gravest(&survey).severity, severity);
        }
    }

    #[test]
    fn a_force_in_another_unit_is_asked_for() {
        let mut survey = empty();
        assert_eq!(judge(&config(), &survey), []);
        survey.faint_force_n = Some(0.4);
        survey.counts.implausible.largest_force = 0.4;
        assert_eq!(gravest(&survey).finding, "no force is above 0.40 N: is it in kN?");
        survey.faint_force_n = None;
        survey.counts.implausible.largest_force = 4e5;
        assert_eq!(gravest(&survey).finding, "the force reaches 400000 N: is it in mN?");
        assert_eq!(gravest(&survey).severity, Wrong);
    }
}
