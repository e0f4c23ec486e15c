//! A robot of one's own: `flexid new`, and what follows it before anything is on the bus.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::setup::{flexid, json, stderr};

/// A folder with the published robots, and with one that mills: the ABB's flange carries a spindle.
fn robots() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/urdf");
    crate::common::copy(&tests, folder.path());
    let reference = tests.join("../../scenario/mill3.urdf");
    fs::copy(reference, folder.path().join("mill3.urdf")).unwrap();
    let spindle = r#"
      <link name="spindle"><inertial><origin xyz="0 0 0.15"/><mass value="40"/>
        <inertia ixx="0.5" iyy="0.5" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="flange_to_spindle" type="fixed"><parent link="tool0"/><child link="spindle"/></joint>
      <link name="tip"/>
      <joint name="spindle_to_tip" type="fixed"><parent link="spindle"/><child link="tip"/><origin xyz="0.15 0 0.35"/></joint>
    </robot>"#;
    let abb = fs::read_to_string(tests.join("abb_irb6640_185_280.urdf")).unwrap();
    fs::write(folder.path().join("mills.urdf"), abb.replace("</robot>", spindle)).unwrap();
    folder
}

#[test]
fn published_robots_are_simulated_and_checked_at_once() {
    let folder = robots();
    let folder = folder.path();
    for (arguments, joints, says) in [
        ("mill3.urdf --tcp tcp", 3, "1494.0 kg"),
        ("universal_ur10e.urdf --tcp tool0", 6, "28.7 kg"),
        ("kuka_iiwa14.urdf --tcp iiwa_link_ee", 7, "17.5 kg"),
        // A sixth is the base's.
        ("abb_irb6640_185_280.urdf --tcp tool0 --mass 1310", 6, "1091.7 kg"),
    ] {
        let output = flexid(folder, &format!("new {arguments} --out {joints}"));
        let said = String::from_utf8(output.stdout.clone()).unwrap();
        assert!(output.status.success(), "{arguments}: {}", stderr(&output));
        assert!(said.contains(&format!("{joints} joints and ")), "{said}");
        assert!(said.contains(says), "{said}");
        let config = format!("--config {joints}/edge.toml");
        let plant = format!("--plant {joints}/plant.toml");
        let simulated =
            flexid(folder, &format!("simulate {config} {plant} --experiments 1 --candump o.log"));
        assert!(simulated.status.success(), "{arguments}: {}", stderr(&simulated));
        let checked = flexid(folder, &format!("check {config} o.log"));
        let checked_says = String::from_utf8(checked.stdout.clone()).unwrap();
        assert!(checked.status.success(), "{arguments}: {checked_says}{}", stderr(&checked));
        assert!(checked_says.contains("1 record in 1 pose"), "{checked_says}");
        // Nothing that `new` states itself is doubted.
        assert!(!checked_says.contains("[accuracy]"), "{arguments}: {checked_says}");
        fs::remove_dir_all(folder.join(joints.to_string())).unwrap();
    }
}

/// The stiffnesses of all drives of a robot without masses in its file, from three cuts, and what follows from them: by the lines that
/// `new` prints.
#[test]
fn the_drives_of_a_robot_without_masses_are_identified() {
    let folder = robots();
    let folder = folder.path();
    let output = flexid(folder, "new mills.urdf --tcp tip --mass 1358 --out r");
    let warned = stderr(&output);
    assert!(
        warned.contains("link 'link_6' has no mass of its own, and gets none of --mass"),
        "{warned}"
    );
    let said = String::from_utf8(output.stdout).unwrap();
    let next = said.split("next: ").nth(1).unwrap().lines();
    let next: Vec<&str> = next.map_while(|line| line.trim().strip_prefix("flexid ")).collect();
    assert_eq!(next.len(), 8, "{said}");
    for arguments in next {
        let output = flexid(folder, arguments);
        assert!(output.status.success(), "{arguments}: {}", stderr(&output));
    }
    for file in ["report.html", "map.svg", "lobes.svg", "offsets.csv"] {
        assert!(folder.join(file).exists(), "{file}");
    }
    let (found, truth) = (json(folder, "found.json"), json(folder, "truth.json"));
    assert_eq!(found["fit"]["acceptance"], "consistent");
    // Axes of the ABB: z, y, y, x, y, x.
    let drives = [5, 4, 4, 3, 4, 3];
    for (joint, drive) in drives.into_iter().enumerate() {
        let name = found["joints"][joint]["name"].as_str().unwrap();
        assert_eq!(found["joints"][joint]["stiffness_verdict"][drive], "identified", "{name}");
        let interval = &found["confidence"]["joints"][joint]["stiffness_interval"][drive];
        let [lower, upper] = [0, 1].map(|end| interval[end].as_f64().unwrap());
        let truth: &Value = &truth["truth"][name]["stiffness"][drive];
        assert!((lower..=upper).contains(&truth.as_f64().unwrap()), "{name}: {interval} {truth}");
    }
}

#[test]
fn mistakes_have_their_mend_and_write_nothing() {
    let folder = robots();
    let folder = folder.path();
    fs::create_dir(folder.join("full")).unwrap();
    fs::write(folder.join("full/edge.toml"), "mine").unwrap();
    for (arguments, says) in [
        (
            "mill3.urdf --out d",
            "mill3.urdf: --tcp is missing: name the link at the tool's tip: the chains end in tcp",
        ),
        ("mill3.urdf --tcp tip --out d", "mill3.urdf: --tcp tip: no such link; the file has "),
        ("mill3.urdf --tcp tcp --out full", "full: has files already: name a new folder, or empty"),
        (
            "mill3.urdf --tcp tcp --out mill3.urdf",
            "mill3.urdf: cannot be made: a file is in its place",
        ),
        ("mill3.urdf --tcp tcp --mass 900 --out d", "leave --mass out"),
        ("mills.urdf --tcp tip --out d", "or add --mass KG, the robot's mass by its data sheet"),
        ("mills.urdf --tcp tip --mass 40 --out d", "nothing is left for the others"),
        ("none.urdf --tcp tip --out d", "none.urdf: "),
    ] {
        let output = flexid(folder, &format!("new {arguments}"));
        let error = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {error}");
        assert!(error.contains(says) && error.lines().count() == 1, "{arguments}: {error}");
        assert!(!folder.join("d").exists(), "{arguments}");
    }
    assert_eq!(fs::read_to_string(folder.join("full/edge.toml")).unwrap(), "mine");
    fs::create_dir(folder.join("empty")).unwrap();
    let output = flexid(folder, "new mill3.urdf --tcp tcp --out empty");
    assert!(output.status.success(), "{}", stderr(&output));
    // The next lines go into a shell.
    let output = flexid(folder, "new mill3.urdf --tcp tcp --out it's");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains(r"flexid check --config 'it'\''s/edge.toml' cut.log"), "{said}");
}
