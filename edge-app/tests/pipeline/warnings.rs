//! The gravest warning comes first.

use flexid_pipeline::config::Config;
use flexid_pipeline::run_offline;
use flexid_pipeline::source::Arrival;
use flexid_wire::report::Acceptance;

use super::frames::{POSES, Replay, frames, robot};
use super::{config, config_with, lines};

/// Outcome of these frames: the acceptance, the warnings, and how the intake stands at their end.
fn found(config: &Config, frames: Vec<Arrival>) -> (Acceptance, Vec<String>, String) {
    let mut source = Replay { frames: frames.into_iter(), breaks: false };
    let outcome = run_offline(config, &mut source, |_| {}, |_| {}).unwrap();
    let report = outcome.finding.expect("a finding").report;
    (report.fit.acceptance, lines(&report), outcome.state.to_string())
}

#[test]
fn wrong_units_are_named_before_all_else() {
    let config = config();
    let found = |frames| found(&config, frames);
    let at = |pose: &[f64; 3]| robot(&config, pose);
    let (_, right, state) = found(frames(&config, &POSES, at));
    assert!(!right.iter().any(|warning| warning.contains('?')), "{right:?}");
    assert_eq!(state, "measuring");

    let (_, in_g, _) = found(frames(&config, &POSES, |pose| {
        let mut tool = at(pose);
        Box::new(move |force| tool(force).map(|value| value / 9.806_65))
    }));
    let first = &in_g[0];
    assert!(first.contains("is the acceleration in g?"), "{first}");

    let degrees = POSES.map(|pose| pose.map(f64::to_degrees));
    let (_, in_degrees, state) =
        found(frames(&config, &degrees, |pose| at(&pose.map(f64::to_radians))));
    let first = &in_degrees[0];
    assert!(first.starts_with("q3 reads 108.8620, beyond joint_3's limits, "), "{first}");
    assert!(first.contains("in degrees? give its unit in [bus] dbc"), "{first}");
    assert_eq!(state, format!("measuring; {first}"));
}

/// Bounds that leave out the robot make a right model look wrong.
#[test]
fn bounds_that_leave_out_the_robot_are_named_before_the_model() {
    let right = config();
    let wrong =
        config_with("rotation_nm_per_rad = [1.0e6, 1.0e8]", "rotation_nm_per_rad = [5.0e7, 1.0e8]");
    let (acceptance, warnings, _) =
        found(&wrong, frames(&right, &POSES, |pose| robot(&right, pose)));
    assert_ne!(acceptance, Acceptance::Consistent);
    let place = |words: &str| {
        let at = warnings.iter().position(|warning| warning.contains(words));
        at.unwrap_or_else(|| panic!("{words} is not in {warnings:?}"))
    };
    let bounds = place("on an end of [bounds]: ");
    assert!(warnings[bounds].ends_with("before anything else, run again without [bounds]"));
    assert!(bounds < place("masses"), "{warnings:?}");
}
