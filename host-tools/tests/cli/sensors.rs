//! Gravity and sensors as the configuration has them, in the simulation and in the fit.

use std::fs::{self, File};
use std::path::Path;
use std::process::Command;

use crate::setup::{FLEXID, besides, edit, flexid, folder, identified, json, stderr, stdout};

/// Gravity, and an accelerometer that turns with the tool.
fn as_on_earth(config: &Path) {
    edit(config, "[0.0, 0.0, 0.0]", "[0.0, 0.0, -9.80665]");
    edit(config, "\"inertial\"", "\"strapdown\"");
}

/// The simulated robot sags and the simulated accelerometer turns with the tool, as the fit assumes.
#[test]
fn what_gravity_does_to_the_simulated_robot_is_what_the_fit_expects() {
    let folder = folder();
    as_on_earth(&folder.path().join("edge.toml"));
    let (_, report) = identified(folder.path(), "--truth drawn:1", || ());
    let consistency = report["fit"]["consistency"].as_f64().unwrap();
    assert!((0.9..1.1).contains(&consistency), "chi^2/dof is {consistency}");
}

/// The simulated sensors sit where the configuration says, and the fit allows for it; without that it does not hold.
#[test]
fn sensors_that_sit_elsewhere_are_allowed_for() {
    let folder = folder();
    let edge = folder.path().join("edge.toml");
    as_on_earth(&edge);
    let section = "\n[mounting]\naccelerometer_xyz_m = [0.08, -0.05, 0.22]\n\
                   accelerometer_rpy_rad = [0.4, -0.3, 1.2]\nforce_rpy_rad = [-0.2, 0.5, -0.7]\n\
                   tool_mass_kg = 2.0\ntool_centre_m = [0.01, 0.02, 0.12]\n";
    let config = fs::read_to_string(&edge).unwrap();
    fs::write(&edge, format!("{config}{section}")).unwrap();
    let (_, report) = identified(folder.path(), "--truth-json t.json", || ());
    assert_eq!(report["confidence"]["residuals"]["size_objects"], false);
    let consistency = report["fit"]["consistency"].as_f64().unwrap();
    assert!((0.9..1.1).contains(&consistency), "chi^2/dof is {consistency}");
    let truth = json(folder.path(), "t.json");
    for joint in report["joints"].as_array().unwrap() {
        let truth = &truth["truth"][joint["name"].as_str().unwrap()];
        for kind in ["stiffness", "damping"] {
            for dof in 0..6 {
                let [value, std, truth] =
                    [&joint[kind], &joint[format!("{kind}_std")], &truth[kind]]
                        .map(|list| list[dof].as_f64().unwrap());
                assert!((value - truth).abs() < 4.5 * std, "{kind} {dof} of {joint}");
            }
        }
    }
    let ignorant = || fs::write(&edge, &config).unwrap();
    let (_, report) = identified(folder.path(), "", ignorant);
    assert_eq!(report["confidence"]["residuals"]["size_objects"], true);
}

/// A force sensor that is turned by 180 degrees about z, and an accuracy that is very loose. The search runs all the same.
#[test]
fn what_the_readings_show_by_themselves_is_said_before_the_search() {
    let folder = folder();
    let path = folder.path();
    stdout(path, "simulate --config edge.toml --experiments 1 --candump o.log");
    let said = || {
        let output = flexid(path, "identify --config edge.toml o.log");
        assert!(output.status.success(), "{}", stderr(&output));
        besides(&output)
    };
    assert_eq!(said(), "");
    edit(&path.join("mill3.dbc"), "Fx : 0|16@1- (0.1,", "Fx : 0|16@1- (-0.1,");
    edit(&path.join("mill3.dbc"), "Fy : 16|16@1- (0.1,", "Fy : 16|16@1- (-0.1,");
    edit(
        &path.join("edge.toml"),
        "assume = \"perfect\"",
        "assume = \"perfect\"\nelastic_centre_m = 0.3",
    );
    let warnings = said();
    let [first, second] = &warnings.lines().collect::<Vec<_>>()[..] else { panic!("{warnings}") };
    assert!(first.starts_with("warning: the robot gives off energy ("), "{first}");
    assert!(first.ends_with("or turn the axes in [mounting])"), "{first}");
    assert!(
        second
            .starts_with("warning: [accuracy] elastic_centre_m is 30 times as large as is typical"),
        "{second}"
    );
}

/// Standard input can be read only once: what the configuration shows comes after the fit, and not without one.
#[test]
fn a_wrong_log_on_standard_input_has_its_error_alone() {
    let folder = folder();
    let path = folder.path();
    edit(
        &path.join("edge.toml"),
        "assume = \"perfect\"",
        "assume = \"perfect\"\nelastic_centre_m = 0.3",
    );
    fs::write(path.join("o.log"), "(1767000000.000060) vcan0 101#03000000FEFFFE0E\n").unwrap();
    let output = Command::new(FLEXID)
        .args("identify --config edge.toml -".split(' '))
        .current_dir(path)
        .stdin(File::open(path.join("o.log")).unwrap())
        .output()
        .unwrap();
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.starts_with("flexid: -: no record") && said.lines().count() == 1, "{said}");
}
