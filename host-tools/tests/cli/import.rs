//! `flexid model import` of robots whose files lack masses, or that have no URDF.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use crate::setup::{flexid, refused, stderr};

const BOX: &str = "
<link name=\"{}\"><collision><geometry><box size=\"0.3 0.3 0.9\"/></geometry></collision></link>";

/// Denavit-Hartenberg tables of the iiwa, and an arm of boxes.
fn robots() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dh");
    crate::common::copy(&tests, folder.path());
    let links: String = ["base", "arm", "hand"].map(|name| BOX.replace("{}", name)).concat();
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"0 0 0.9\"/>\
             <axis xyz=\"0 1 0\"/><limit lower=\"-2\" upper=\"2\"/></joint>\n"
        )
    };
    let tip = "<link name=\"tip\"/><joint name=\"mount\" type=\"fixed\"><parent link=\"hand\"/><child link=\"tip\"/><origin xyz=\"0.1 0 0.9\"/></joint>";
    let joints = joint("a1", "base", "arm") + &joint("a2", "arm", "hand");
    fs::write(
        folder.path().join("boxes.urdf"),
        format!("<robot name=\"boxes\">{links}{joints}{tip}</robot>"),
    )
    .unwrap();
    folder
}

#[test]
fn guessed_masses_say_where_they_come_from_and_how_far_they_may_be_off() {
    let folder = robots();
    let folder = folder.path();
    let import = "model import boxes.urdf --tcp tip --total-mass 400 --payload 15 -o m.toml";
    let output = flexid(folder, import);
    assert!(output.status.success(), "{}", stderr(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    let guessed = "masses are guessed, to 30 %, inertias beside them to 40 %, centres to 0.032 m: the model says so to identify";
    assert!(said.contains("2 joints") && said.contains(guessed), "{said}");
    let model = fs::read_to_string(folder.join("m.toml")).unwrap();
    for line in [
        "# - link 'arm': box, ",
        "# - 15 kg (--payload) on the last link",
        "\n[accuracy]\nlink_mass = 0.3\nlink_inertia = 0.4\n",
    ] {
        assert!(model.contains(line), "{line:?} is not in\n{model}");
    }
}

/// A payload beside masses of the file guesses nothing about these.
#[test]
fn a_payload_alone_leaves_the_masses_of_the_file_as_they_are() {
    let folder = robots();
    let folder = folder.path();
    let output =
        flexid(folder, "model import iiwa14-standard.csv --dh standard --payload 10 -o m.toml");
    assert!(output.status.success(), "{}", stderr(&output));
    let model = fs::read_to_string(folder.join("m.toml")).unwrap();
    let head = "# Beside the masses of the file:\n# - 10 kg (--payload) on the last link: a ";
    assert!(model.starts_with(head) && !model.contains("[accuracy]"), "{model}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("27.5 kg of moving mass") && !said.contains("guessed"), "{said}");
}

#[test]
fn a_table_of_denavit_hartenberg_parameters_is_a_robot() {
    let folder = robots();
    let folder = folder.path();
    for convention in ["standard", "modified"] {
        let output = flexid(
            folder,
            &format!("model import iiwa14-{convention}.csv --dh {convention} -o m.toml"),
        );
        assert!(output.status.success(), "{}", stderr(&output));
        let said = String::from_utf8(output.stdout).unwrap();
        let place = "tool at 'tcp' at x 0.000, y 0.000, z 1.306 m with all joints at 0\n";
        assert!(said.contains(&format!("7 joints and 17.5 kg of moving mass, {place}")), "{said}");
    }
}

#[test]
fn mistakes_have_their_mend() {
    let folder = robots();
    let folder = folder.path();
    fs::write(folder.join("bad.csv"), "theta,d,a,alpha\n0,0,0,0\n0,0,0,-90\n").unwrap();
    for (arguments, says) in [
        (
            "iiwa14-standard.csv -o m.toml",
            "iiwa14-standard.csv: is a table and no URDF: add --dh standard or --dh modified",
        ),
        ("iiwa14-standard.csv --dh standard", "-o MODEL.toml is missing"),
        ("iiwa14-standard.csv --dh standard --tcp hand -o m.toml", "--tcp hand: no such link"),
        (
            "bad.csv --dh standard -o m.toml",
            "bad.csv:3: row of joint_2: alpha is -90 rad: in deg? Head the column alpha [deg]",
        ),
        ("boxes.urdf --dh standard -o m.toml", "boxes.urdf: is a URDF: leave --dh out"),
        (
            "boxes.urdf --tcp tip -o m.toml",
            "or add --total-mass KG, the robot's mass by its data sheet",
        ),
        ("boxes.urdf --tcp tip --total-mass -4 -o m.toml", "--total-mass"),
        ("boxes.urdf --tcp tip --total-mass 0 -o m.toml", "--total-mass 0: must be positive"),
    ] {
        let message = refused(folder, &format!("model import {arguments}"));
        assert!(message.contains(says), "{arguments}: {message}");
        assert!(!folder.join("m.toml").exists(), "{arguments}");
    }
}
