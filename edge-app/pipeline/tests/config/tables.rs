//! Configs for tables: neither bus nor counters, and a rate only where the table has none.

use std::fs;

use flexid_pipeline::config::Config;
use flexid_pipeline::source::Shown;

use super::{EDGE, MODEL};

const BUS: &str = "[bus]\ninterface = \"vcan0\"\ndbc = \"mill3.dbc\"                   # where the signals lie in the frames\n";
const JOINTS: &str = "joints = [\"q1\", \"q2\", \"q3\"]";
const POSES: &str = "[recording]\nposes = \"poses.csv\"";
const SHOWN: Shown =
    Shown { rate_hz: Some(1000.0), steps: [0.1, 0.2, 0.0, 0.01, 0.0, 0.02], own_clocks: false };

/// The text of the reference scenario without bus and counters.
fn text() -> String {
    let lines = EDGE.replace(BUS, "");
    assert_ne!(lines, EDGE);
    lines
        .lines()
        .filter(|line| !line.contains("_counter"))
        .map(|line| format!("{line}\n"))
        .collect()
}

/// Loads this text for recordings; the error without the folder's name.
fn recorded(text: &str) -> Result<Config, String> {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("edge.toml", text);
    write("mill3-model.toml", MODEL);
    write("poses.csv", "file,q1 [deg],q2,q3\ncut.csv,90,-0.5,1\n");
    write("blows.csv", "file,q1,q2,q3,force\ncut.csv,0,-0.5,1,-z\n");
    Config::load_recorded(&folder.path().join("edge.toml"))
        .map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn a_table_needs_neither_bus_nor_counters_nor_rate() {
    let config = recorded(&text()).unwrap();
    assert!(config.interface.is_empty() && config.signals.is_of_columns() && config.knows_rate);
    assert_eq!(config.layout().unwrap().axes, ["Fx", "Fy", "Fz", "ax", "ay", "az"]);
    assert_eq!(config.layout().unwrap().joints.len(), 3);
    let config = config.of_tables(&SHOWN).unwrap();
    assert_eq!((config.rate_hz, config.record_samples), (2000.0, 8192));
    assert_eq!(
        (config.signals.force_resolution, config.signals.acceleration_resolution),
        (0.2, 0.02)
    );

    let config = recorded(&text().replace("rate_hz = 2000.0", "").replace(JOINTS, POSES)).unwrap();
    assert!(!config.knows_rate && config.layout().unwrap().joints.is_empty());
    assert_eq!(config.signals.joints, ["q1", "q2", "q3"]);
    let poses = config.poses.as_ref().unwrap().of("day/cut.csv".as_ref());
    assert_eq!(poses[0].pose, [90_f64.to_radians(), -0.5, 1.0]);
    let config = config.of_tables(&SHOWN).unwrap();
    assert_eq!((config.rate_hz, config.record_samples, config.knows_rate), (1000.0, 4096, true));
    assert!(config.stream().force_resolution > 0.0);
}

#[test]
fn what_a_table_needs_is_named() {
    let of_rate = |rate_hz: Option<f64>| {
        let config = recorded(&text().replace("rate_hz = 2000.0", "")).unwrap();
        let error = config.of_tables(&Shown { rate_hz, ..SHOWN }).unwrap_err().to_string();
        error.split_once("edge.toml: ").unwrap().1.to_owned()
    };
    assert_eq!(
        of_rate(None),
        "[measurement] rate_hz is missing, and no column of the table tells it: state it, or give the time of each row in a column \"time [s]\""
    );
    assert_eq!(
        of_rate(Some(300.0)),
        "[measurement] band_hz ends at 200 Hz: must stay below 150 Hz, half of rate_hz"
    );
    for (from, to, expected) in [
        (
            JOINTS,
            "",
            "edge.toml: [signals] joints is missing: name the column of the angle of each driven joint, base first, or a file of poses in [recording] poses",
        ),
        (
            JOINTS,
            "joints = [\"q1\"]",
            "edge.toml: [signals] joints names 1 signal, but mill3-model.toml has 3 driven joints",
        ),
        (
            "[measurement]",
            "[recording]\nposes = \"poses.csv\"\n[measurement]",
            "edge.toml: [signals] joints and [recording] poses state the same angles: leave one out",
        ),
        (
            JOINTS,
            "[recording]\nposes = \"p.csv\"",
            "edge.toml: [recording] poses: p.csv cannot be read: it does not exist",
        ),
    ] {
        let error = recorded(&text().replace(from, to)).unwrap_err();
        assert!(error.starts_with(expected), "{error}");
    }
}

const FORCE: &str = "force = [\"Fx\", \"Fy\", \"Fz\"]";
const BLOWS: &str = "[recording]\nposes = \"blows.csv\"";

#[test]
fn a_hammer_has_one_channel() {
    let along_z = text().replace(FORCE, "force = [\"\", \"\", \"Hammer\"]");
    let signals = recorded(&along_z).unwrap().signals;
    let measured: Vec<bool> = (0..6).map(|axis| signals.is_measured(axis)).collect();
    assert_eq!(measured, [false, false, true, true, true, true]);
    assert!(signals.has_part_of_force() && signals.is_of_columns() && !signals.is_single(0));
    let any = text().replace(FORCE, "force = \"Hammer\"").replace(JOINTS, BLOWS);
    let config = recorded(&any).unwrap();
    assert!(config.signals.is_single(0) && !config.signals.is_single(1));
    let cuts = config.poses.as_ref().unwrap().of("cut.csv".as_ref());
    assert_eq!(cuts[0].directions[0].map(|own| (own.axis, own.sign)), Some((2, -1.0)));
    // Those of all axes are what they were before there was a choice.
    assert!(!recorded(&text()).unwrap().signals.has_part_of_force());
    for (force, joints, expected) in [
        (
            "force = [\"\", \"\", \"\"]",
            JOINTS,
            "[signals] force names nothing: name an axis that is measured",
        ),
        (
            "force = \"Hammer\"",
            POSES,
            "[signals] force is the channel \"Hammer\" alone: name the file in [recording] poses whose column force",
        ),
        (
            FORCE,
            BLOWS,
            "[recording] poses has a column force, and [signals] force names axes: leave one out",
        ),
        (
            "force_axes = \"base\"\nforce = [\"\", \"\", \"Hammer\"]",
            JOINTS,
            "[signals] force_axes is \"base\", and force has fewer than three axes: leave one out",
        ),
    ] {
        let error = recorded(&text().replace(FORCE, force).replace(JOINTS, joints)).unwrap_err();
        assert!(error.starts_with(&format!("edge.toml: {expected}")), "{error}");
    }
    let error = recorded(&text().replace(FORCE, "force = 3")).unwrap_err();
    assert!(error.contains("the names of three signals"), "{error}");
    let tool = along_z.replace("[search]", "[mounting]\ntool_mass_kg = 2.0\n\n[search]");
    let error = recorded(&tool).unwrap_err();
    assert!(
        error.starts_with("edge.toml: [mounting] tool_mass_kg lies beyond a dynamometer"),
        "{error}"
    );
    let error = super::load("edge.toml", FORCE, "force = [\"\", \"\", \"Fz\"]").unwrap_err();
    assert!(
        error.starts_with("edge.toml: [signals] force must name three signals of [bus] dbc"),
        "{error}"
    );
}

#[test]
fn a_bag_needs_topics_alone() {
    let topics = |joints: &str| {
        let topics =
            format!("[topics]\nwrench = \"/ft\"\nacceleration = \"/imu\"\n{joints}\n[measurement]");
        let own = text();
        let (before, rest) = own.split_once("[signals]").unwrap();
        let after = rest.split_once("[measurement]").unwrap().1;
        recorded(&[before, &topics, after].concat())
    };
    let config = topics("joints = \"/joint_states\"").unwrap();
    assert!(config.signals.is_of_columns());
    assert_eq!(config.signals.axes[3], "/imu x");
    let layout = config.layout().unwrap();
    assert_eq!(layout.joints[2], ("joint_3".to_owned(), false));
    assert_eq!(layout.topics.unwrap().wrench, "/ft");
    let poses = topics(POSES).unwrap();
    assert!(poses.layout().unwrap().joints.is_empty());
    assert_eq!(
        topics("").unwrap_err(),
        "edge.toml: [topics] joints is missing: name the topic of the joints, or a file of poses in [recording] poses"
    );
    let both = format!("joints = \"/joint_states\"\n{POSES}");
    let error = topics(&both).unwrap_err();
    assert!(
        error.starts_with("edge.toml: [topics] joints and [recording] poses state the same angles"),
        "{error}"
    );
    let error = recorded(&text().replace("force = [\"Fx\", \"Fy\", \"Fz\"]", "")).unwrap_err();
    assert_eq!(error, "edge.toml: [signals] force names nothing: name an axis that is measured");
}

#[test]
fn a_bus_needs_all_of_it() {
    for (from, to, expected) in [
        (
            BUS,
            "",
            "edge.toml: [bus] is missing: add what host-tools/scenario/edge.toml has there; a file for tables (CSV, LVM) has no [bus], ",
        ),
        (
            "force_counter = \"ForceCounter\"",
            "clocks = \"common\"",
            "edge.toml: [signals] clocks is \"common\", and force_counter is missing: name the signal that counts the samples of both, or ",
        ),
        (
            JOINTS,
            "",
            "edge.toml: [signals] joints is missing: name the signal of the angle of each driven joint, base first",
        ),
        (
            JOINTS,
            "joints = [\"q1\", \"q2\", \"q3\"]\nforce_axes = \"base\"",
            "edge.toml: [signals] force_axes is \"base\": frames of [bus] have the force along",
        ),
        ("rate_hz = 2000.0\n", "", "edge.toml: [measurement] key `rate_hz` (in Hz) is missing"),
    ] {
        let error = super::load("edge.toml", from, to).unwrap_err();
        assert!(error.starts_with(expected), "{error}");
    }
}
