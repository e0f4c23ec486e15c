//! Mistakes in `EDGE.toml` and in the files that it names: each gives one line with file, place and mend.

mod bounds;
mod clocks;
mod dbc;
mod history;
mod tables;

use std::fs;
use std::path::Path;

use flexid_core::imperfection::{Accuracies, Imperfection};
use flexid_core::mounting::Mounting;
use flexid_core::sought::Coordinate;
use flexid_pipeline::config::{Accelerometer, Config, Listen};
use nalgebra::Vector3;

const EDGE: &str = include_str!("../../../../host-tools/scenario/mill3-edge.toml");
/// The example for a real robot.
const EXAMPLE: &str = include_str!("../../../../host-tools/scenario/edge.toml");
const MODEL: &str = include_str!("../../../../host-tools/scenario/mill3-model.toml");
const DBC: &str = include_str!("../../../../host-tools/scenario/mill3.dbc");

/// Loads the scenario with `from` replaced by `to` in one of its files; the error without the folder's name.
fn load(file: &str, from: &str, to: &str) -> Result<Config, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("edge.toml", EDGE), ("mill3-model.toml", MODEL), ("mill3.dbc", DBC)] {
        let text = if name == file {
            assert!(text.contains(from), "{from:?} is not in {name}");
            text.replace(from, to)
        } else {
            text.to_string()
        };
        fs::write(folder.path().join(name), text).unwrap();
    }
    Config::load(&folder.path().join("edge.toml"))
        .map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn the_reference_scenario_is_read() {
    let config = load("edge.toml", "", "").unwrap();
    assert_eq!(config.model.name, "mill3");
    assert_eq!(config.gravity, [0.0; 3]);
    assert_eq!(config.bounds.joints[0].damping[5], [1.0e2, 5.0e4]);
    assert_eq!(config.accelerometer, Accelerometer::Inertial);
    assert_eq!(config.record_samples, 8192);
    assert_eq!(config.seed, 1);
    assert!(matches!(&config.listen[..], [Listen::Unix(path)] if path.ends_with("flexid.sock")));
    assert!(config.scenario.unwrap().ends_with("mill3.toml"));
}

#[test]
fn what_is_left_out_has_its_default() {
    let config = load("edge.toml", "gravity_m_per_s2 = [0.0, 0.0, 0.0]", "").unwrap();
    assert_eq!(config.gravity, [0.0, 0.0, -9.80665]);
    let config = load("edge.toml", "accelerometer = \"inertial\"", "").unwrap();
    assert_eq!(config.accelerometer, Accelerometer::Strapdown);
    let config = load("edge.toml", "[server]\nlisten = [\"unix:flexid.sock\"]", "").unwrap();
    assert!(matches!(&config.listen[..], [Listen::Unix(path)] if path.ends_with("flexid.sock")));
    for (rate, samples) in [("rate_hz = 1000.0", 4096), ("rate_hz = 500.0", 2048)] {
        assert_eq!(load("edge.toml", "rate_hz = 2000.0", rate).unwrap().record_samples, samples);
    }
    for (rate, samples) in [("rate_hz = 410.0", 2048), ("rate_hz = 50000.0", 32_768)] {
        assert_eq!(load("edge.toml", "rate_hz = 2000.0", rate).unwrap().record_samples, samples);
    }
}

#[test]
fn what_is_sought_can_be_chosen() {
    let sections = "[calibration]\ndelay_s = 1e-3\nlink_mass = 0.05\n\n[parameters]\n\
        fixed = { \"joint_1.stiffness.tx\" = 1e8 }\n\
        tied = [[\"joint_2.damping.rx\", \"joint_2.damping.ry\", \"joint_3.damping.rz\"]]\n\n[search]";
    let sought = load("edge.toml", "[search]", sections).unwrap().sought;
    // 36, less one that is fixed and two that follow a third; a delay and three masses.
    assert_eq!(sought.unknowns(), 36 - 1 - 2 + 1 + 3);
    assert_eq!(sought.unknown(Coordinate::Stiffness { joint: 0, dof: 0 }), None);
    let tied = |joint, dof| sought.unknown(Coordinate::Damping { joint, dof }).unwrap();
    assert_eq!((tied(1, 3), tied(1, 3)), (tied(1, 4), tied(2, 5)));
    let mass = |link| (Imperfection::Mass(link), 0.05);
    assert_eq!(sought.imperfections(), [(Imperfection::Delay, 1e-3), mass(0), mass(1), mass(2)]);
}

#[test]
fn sensors_may_sit_elsewhere() {
    assert_eq!(load("edge.toml", "", "").unwrap().mounting, Mounting::AT_TCP);
    let section = "[mounting]\naccelerometer_xyz_m = [0.1, -0.2, 0.3]\n\
        accelerometer_rpy_rad = [1.5707963267948966, 0.0, 1.5707963267948966]\n\
        tool_mass_kg = 2\ntool_centre_m = [0.0, 0.0, 0.05]\n\n[search]";
    let config = load("edge.toml", "[search]", section).unwrap();
    let mounting = config.measurement().mounting;
    assert_eq!(mounting.accelerometer, Vector3::new(0.1, -0.2, 0.3));
    // First a quarter about x takes y to z; then a quarter about the fixed z leaves it there, and takes x to y.
    let axes = mounting.accelerometer_axes;
    assert!((axes * Vector3::y() - Vector3::z()).norm() < 1e-12);
    assert!((axes * Vector3::x() - Vector3::y()).norm() < 1e-12);
    assert_eq!(mounting.force_axes, Mounting::AT_TCP.force_axes);
    assert_eq!((mounting.tool_mass, mounting.tool_centre), (2.0, Vector3::new(0.0, 0.0, 0.05)));
}

/// A user who copies the example for his robot has gravity and an accelerometer that turns with the tool.
#[test]
fn the_example_is_for_a_real_robot() {
    let config = load("edge.toml", EDGE, EXAMPLE).unwrap();
    assert_eq!(config.gravity, [0.0, 0.0, -9.80665]);
    assert_eq!(config.accelerometer, Accelerometer::Strapdown);
    assert_eq!(config.scenario, None);
    assert_eq!(config.accuracies, Accuracies::typical());
}

/// Every key that the example shows in a comment is a key, and has the value that is said to be the default.
#[test]
fn what_the_example_shows_in_comments_is_right() {
    let shown = |line: &str| {
        let line = line.strip_prefix("# ").unwrap_or(line);
        let is_key = line.split_once(" = ").is_some_and(|(key, _)| !key.contains([' ', ',']));
        (is_key || line.starts_with('[')).then(|| format!("{line}\n"))
    };
    let all: String = EXAMPLE.lines().filter_map(shown).collect();
    assert!(all.contains("\ntool_mass_kg") && all.contains("\n[calibration]\n"), "{all}");
    let all = all.replace("[static]\nfile = \"static.csv\"\n", "");
    let all = all.replace("[recording]\nposes = \"poses.csv\"\n", "");
    let (before, section) = all.split_once("[receptance]\n").expect("modal tests");
    let all = format!("{before}[{}", section.split_once("\n[").expect("a section behind them").1);
    let config = load("edge.toml", EDGE, &all).unwrap();
    assert_eq!(config.gravity, [0.0, 0.0, -9.80665]);
    assert_eq!(config.accelerometer, Accelerometer::Strapdown);
    assert_eq!(config.record_samples, 8192);
    let mounting = config.mounting;
    assert_eq!((mounting.tool_mass, mounting.accelerometer.z), (2.0, 0.12));
    assert_eq!(config.bounds.joints[1].stiffness[5], [3e5, 3e8]);
    assert_eq!(config.bounds.joints[2].damping[5], [1.0, 1e5]);
}

#[test]
fn mistakes_in_the_mounting_name_place_and_mend() {
    let table = [
        ("tool_mass_kg = -1.0", "[mounting] tool_mass_kg is -1: must be 0 or positive, and finite"),
        ("tool_mass_kg = nan", "[mounting] tool_mass_kg is NaN: must be 0 or positive, and finite"),
        (
            "tool_mass_kg = 500.0",
            "[mounting] tool_mass_kg is 500: the tool is a part of the link of \"joint_3\", must be at most its 451 kg",
        ),
        (
            "tool_centre_m = [0.0, 0.0, 0.1]",
            "[mounting] tool_centre_m needs a mass: give tool_mass_kg, too",
        ),
        (
            "accelerometer_xyz_m = [0.0, 120.0, 0.0]",
            "[mounting] accelerometer_xyz_m is [0.0, 120.0, 0.0]: must be in m, and within 10 m of the TCP",
        ),
        (
            "accelerometer_xyz_m = [0.0, nan, 0.0]",
            "[mounting] accelerometer_xyz_m is [0.0, NaN, 0.0]: must be in m, and within 10 m of the TCP",
        ),
        (
            "force_rpy_rad = [0.0, 0.0, inf]",
            "[mounting] force_rpy_rad is [0, 0, inf]: must be in rad, and within -2π to 2π",
        ),
        (
            "accelerometer_rpy_rad = [0.0, 0.0, 90.0]",
            "[mounting] accelerometer_rpy_rad is [0, 0, 90]: must be in rad, and within -2π to 2π",
        ),
    ];
    for (line, message) in table {
        let section = format!("[mounting]\n{line}\n\n[search]");
        let error = load("edge.toml", "[search]", &section).unwrap_err();
        assert_eq!(error, format!("edge.toml: {message}"));
    }
    let error = load("edge.toml", "[search]", "[mounting]\ntool_mass = 2\n\n[search]").unwrap_err();
    assert_eq!(
        error,
        "edge.toml:31: [mounting] tool_mass: unknown key `tool_mass`: did you mean `tool_mass_kg` (in kg)?"
    );
}

#[test]
fn mistakes_in_accuracies_name_place_and_mend() {
    let table = [
        ("tcp_m = 10.0", "[accuracy] tcp_m is 10: must be 0 to 0.5 (in m), one standard deviation"),
        (
            "joint_angle_rad = -0.1",
            "[accuracy] joint_angle_rad is -0.1: must be 0 to 0.5 (in rad), one standard deviation",
        ),
        (
            "link_mass = nan",
            "[accuracy] link_mass is NaN: must be 0 to 0.5 (0.01 is 1 %), one standard deviation",
        ),
        (
            "force_resonance_hz = 2.0",
            "[accuracy] force_resonance_hz is 2: must be 600 to 1000000 (in Hz), well outside band_hz: narrow that, or correct the filter",
        ),
        (
            "structure_m_per_n = 1e10",
            "[accuracy] structure_m_per_n is 10000000000: must be 0 to 0.000001 (in m/N: 1e-10 is 1e10 N/m), one standard deviation",
        ),
        (
            "hysteresis = 30.0",
            "[accuracy] hysteresis is 30: must be 0 to 1 (0.01 is 1 %), one standard deviation",
        ),
        (
            "delay_s = 1e-5\n[calibration]\ndelay_s = 1e-3",
            "[accuracy] delay_s and [calibration] delay_s state the same: leave one out",
        ),
    ];
    for (lines, message) in table {
        let error = load("edge.toml", "assume = \"perfect\"", lines).unwrap_err();
        assert_eq!(error, format!("edge.toml: {message}"));
    }
}

#[test]
fn accuracies_are_those_stated_or_assumed() {
    let accuracies =
        |lines: &str| load("edge.toml", "assume = \"perfect\"", lines).unwrap().accuracies;
    let typical = Accuracies::typical();
    assert_eq!(accuracies(""), typical);
    assert_eq!(accuracies("assume = \"typical\""), typical);
    assert_eq!(accuracies("assume = \"perfect\""), Accuracies::default());
    let own = accuracies("link_mass = 0.1\nforce_high_pass_hz = 0.0");
    assert_eq!((own.mass, own.force.high_pass, own.delay), (0.1, 0.0, typical.delay));
    let own =
        accuracies("drive_growth_per_knm = 0.5\nstructure_rad_per_nm = 0.0\nground_m_per_n = 2e-9");
    assert_eq!((own.load, own.structure_rotation, own.ground_translation), (5e-4, 0.0, 2e-9));
    // What is sought with a prior of its own has no second one.
    let sought = accuracies("[calibration]\ndelay_s = 1e-3");
    assert_eq!((sought.delay, sought.mass), (0.0, typical.mass));
    // What the file states itself is not assumed.
    let perfect = |lines| load("edge.toml", "assume = \"perfect\"", lines).unwrap().assumes_perfect;
    let lines = ["", "assume = \"perfect\"", "assume = \"perfect\"\ndelay_s = 1e-5"];
    assert_eq!(lines.map(perfect), [false, true, true]);
}

#[test]
fn mistakes_in_what_is_sought_name_place_and_mend() {
    let table = [
        (
            "[calibration]\nmisalignment_rad = 3.0",
            "[calibration] misalignment_rad is 3: must be above 0 and at most 0.5 (in rad)",
        ),
        (
            "[calibration]\nforce_gain = 5.0",
            "[calibration] force_gain is 5: must be above 0 and at most 1 (0.1 is 10 %)",
        ),
        (
            "[parameters]\nfixed = { joint_1.stiffness.tx = 6.0e7 }",
            ":31: [parameters] fixed: a name with points must stand in quotes, like \"a.b.c\" = 1",
        ),
        (
            "[calibration]\ndelay_s = 0.0",
            "[calibration] delay_s is 0: must be above 0 and at most 0.1 (in s)",
        ),
        (
            "[parameters]\nfixed = { \"joint_1.stiffness.tx\" = -1.0 }",
            "[parameters] fixed \"joint_1.stiffness.tx\" is -1e0: must lie between 1e-3 and 1e12",
        ),
        (
            "[parameters]\nfixed = { \"joint_1.stiffness.tx\" = 1e40 }",
            "[parameters] fixed \"joint_1.stiffness.tx\" is 1e40: must lie between 1e-3 and 1e12",
        ),
        (
            "[parameters]\ntied = [[\"joint_1.stiffness.tx\"]]",
            "[parameters] tied: \"joint_1.stiffness.tx\" is alone in its group: name two or more",
        ),
        (
            "[parameters]\ntied = [[]]",
            "[parameters] tied has a group without a name: name two or more",
        ),
        (
            "[parameters]\nfixed = { \"stiffness.tx\" = 1.0 }",
            "[parameters] fixed has \"stiffness.tx\": write it like \"joint_1.stiffness.tx\"",
        ),
        (
            "[parameters]\nfixed = { \"joint_9.stiffness.tx\" = 1.0 }",
            "[parameters] fixed has \"joint_9.stiffness.tx\": the model has no joint \"joint_9\", it has joint_1, joint_2, joint_3",
        ),
        (
            "[parameters]\nfixed = { \"joint_1.stiffness.tq\" = 1.0 }",
            "[parameters] fixed has \"joint_1.stiffness.tq\": \"tq\" is no degree of freedom: one of tx, ty, tz, rx, ry, rz",
        ),
        (
            "[parameters]\nfixed = { \"joint_1.mass.tx\" = 1.0 }",
            "[parameters] fixed has \"joint_1.mass.tx\": \"mass\" is neither \"stiffness\" nor \"damping\"",
        ),
        (
            "[parameters]\ntied = [[\"joint_1.stiffness.tx\", \"joint_1.stiffness.rx\"]]",
            "[parameters] tied: \"joint_1.stiffness.tx\" and \"joint_1.stiffness.rx\" are of different units: tie like to like",
        ),
        (
            "[parameters]\ntied = [[\"joint_1.stiffness.tx\", \"joint_1.stiffness.tx\"]]",
            "[parameters] tied: \"joint_1.stiffness.tx\" is there twice: fix or tie it once",
        ),
    ];
    for (section, message) in table {
        let error = load("edge.toml", "[search]", &format!("{section}\n\n[search]")).unwrap_err();
        let line = if message.starts_with(':') { "" } else { ": " };
        assert_eq!(error, format!("edge.toml{line}{message}"));
    }
}

/// Values over several lines, whose brackets look like sections.
#[test]
fn a_mistake_within_an_array_names_its_own_section() {
    let cases = [
        (
            "tied = [\n  [\n    \"joint_1.stiffness.tx\", 5\n  ],\n]",
            "edge.toml:33: [parameters] tied: invalid type: integer `5`, expected a string",
        ),
        (
            "tied = [\n[\"joint_1.stiffness.tx\", \"joint_1.stiffness.ty\"],\n5]",
            "edge.toml:33: [parameters] tied: invalid type: integer `5`, expected a sequence",
        ),
        (
            "tied = [\n[\"a = 1\"],\n]\nfixd = 1",
            "edge.toml:34: [parameters] fixd: unknown key `fixd`: did you mean `fixed`?",
        ),
    ];
    for (lines, message) in cases {
        let section = format!("[parameters]\n{lines}\n\n[search]");
        assert_eq!(load("edge.toml", "[search]", &section).unwrap_err(), message);
    }
}

#[test]
fn who_may_connect_is_said_in_octal() {
    let access = |line: &str| {
        let config = load("edge.toml", "[server]", &format!("[server]\n{line}"))?;
        Ok((config.socket_access.mode, config.socket_access.group))
    };
    assert_eq!(access(""), Ok((0o660, None)));
    let all = access("socket_mode = 0o666\nsocket_group = \"mill\"");
    assert_eq!(all, Ok((0o666, Some("mill".into()))));
    for (line, error) in [
        ("socket_mode = 660", "socket_mode is 0o1224: write three octal digits"),
        ("socket_mode = 0o060", "socket_mode is 0o60: write three octal digits"),
        ("socket_group = \"\"", "socket_group is no name of a group"),
    ] {
        let line_of_error: String = access(line).unwrap_err();
        assert!(line_of_error.contains(&format!("edge.toml: [server] {error}")), "{line_of_error}");
    }
    let config = load("edge.toml", "[server]", "[state]\nfile = \"a.state\"\n[server]").unwrap();
    assert!(config.state.unwrap().ends_with("a.state"));
}

#[test]
fn mistakes_in_the_config_name_place_and_mend() {
    let table = [
        // Keys and syntax.
        (
            "rate_hz = 2000.0",
            "rate_khz = 2.0",
            "edge.toml:26: [measurement] rate_khz: unknown key `rate_khz`: did you mean `rate_hz` (in Hz)?",
        ),
        (
            "band_hz",
            "band",
            "edge.toml:27: [measurement] band: unknown key `band`: did you mean `band_hz` (in Hz)?",
        ),
        (
            "stiffness_translation_n_per_m =",
            "stiffness_translation_n_per_mm =",
            "edge.toml:9: [bounds] stiffness_translation_n_per_mm: unknown key \
             `stiffness_translation_n_per_mm`: did you mean `stiffness_translation_n_per_m` (in N/m)?",
        ),
        (
            "[measurement]",
            "[measurements]",
            "edge.toml:25: [measurements] unknown key `measurements`: did you mean `measurement`?",
        ),
        (
            "assume = \"perfect\"",
            "accelerometer_gain = 0.1",
            "edge.toml:40: [accuracy] accelerometer_gain: unknown key `accelerometer_gain`: did you mean `acceleration_gain`?",
        ),
        (
            "seed = 1",
            "colour = 1",
            "edge.toml:31: [search] colour: unknown key `colour`: known are seed",
        ),
        ("rate_hz = 2000.0\n", "", "edge.toml: [measurement] key `rate_hz` (in Hz) is missing"),
        (
            "rate_hz = 2000.0",
            "rate_hz = \"2 kHz\"",
            "edge.toml:26: [measurement] rate_hz: invalid type: string \"2 kHz\", expected a number (in Hz)",
        ),
        (
            "\"inertial\"",
            "\"fixed\"",
            "edge.toml:28: [measurement] accelerometer: unknown variant `fixed`, expected `inertial` or `strapdown`",
        ),
        (
            "band_hz = [2.0, 200.0]",
            "band_hz = [2.0]",
            "edge.toml:27: [measurement] band_hz: invalid length 1, expected an array of length 2",
        ),
        // Numbers.
        (
            "rate_hz = 2000.0",
            "rate_hz = -5",
            "edge.toml: [measurement] rate_hz is -5: must be positive",
        ),
        (
            "rate_hz = 2000.0",
            "rate_hz = 1e300",
            "edge.toml: [measurement] rate_hz is 1e300: must be at most 1000000",
        ),
        (
            "seed = 1",
            "seed = -1",
            "edge.toml:31: [search] seed: invalid value: integer `-1`, expected a whole number that is not negative",
        ),
        (
            "rate_hz = 2000.0",
            "rate_hz = nan",
            "edge.toml: [measurement] rate_hz is NaN: must be positive",
        ),
        (
            "[2.0, 200.0]",
            "[200.0, 2.0]",
            "edge.toml: [measurement] band_hz is [200, 2]: the lower edge must be below the upper",
        ),
        (
            "[2.0, 200.0]",
            "[2.0, 1000.0]",
            "edge.toml: [measurement] band_hz ends at 1000 Hz: must stay below 1000 Hz, half of rate_hz",
        ),
        (
            "[2.0, 200.0]",
            "[0.0, 200.0]",
            "edge.toml: [measurement] band_hz[0] is 0: must be positive",
        ),
        (
            "[1.0e7, 2.0e8]",
            "[1.0e7, 1.0e7]",
            "edge.toml: [bounds] stiffness_translation_n_per_m is [1e7, 1e7]: must be 1e-3 <= lower < upper <= 1e12",
        ),
        (
            "[1.0e7, 2.0e8]",
            "[2.0e8, 1.0e7]",
            "edge.toml: [bounds] stiffness_translation_n_per_m is [2e8, 1e7]: must be 1e-3 <= lower < upper <= 1e12",
        ),
        (
            "[1.0e7, 2.0e8]",
            "[1.0e7, 1.0e300]",
            "edge.toml: [bounds] stiffness_translation_n_per_m is [1e7, 1e300]: must be 1e-3 <= lower < upper <= 1e12",
        ),
        (
            "[1.0e2, 5.0e4]",
            "[-1.0e2, 5.0e4]",
            "edge.toml: [bounds] damping_rotation_nms_per_rad is [-1e2, 5e4]: must be 1e-3 <= lower < upper <= 1e12",
        ),
        (
            "gravity_m_per_s2 = [0.0, 0.0, 0.0]",
            "gravity_m_per_s2 = [0.0, 0.0, inf]",
            "edge.toml: [model] gravity_m_per_s2 has a number that is not finite",
        ),
        (
            "rate_hz = 2000.0",
            "rate_hz = 2000.0\nrecord_samples = 5000",
            "edge.toml: [measurement] record_samples is 5000: must be a power of two from 256 to 32768",
        ),
        (
            "[2.0, 200.0]",
            "[2.0, 3.0]",
            "edge.toml: [measurement] band_hz holds 4 bins of a record of 8192 samples, 8 to 4096 can be fitted: \
             widen the band or raise record_samples",
        ),
        // Addresses.
        (
            "\"vcan0\"",
            "\"can 0\"",
            "edge.toml: [bus] interface is \"can 0\": no interface has such a name; try \"can0\"",
        ),
        (
            "unix:flexid.sock",
            "flexid.sock",
            "edge.toml: [server] listen: \"flexid.sock\" is no address: write \"unix:PATH\" or \"tcp:127.0.0.1:PORT\"",
        ),
        (
            "unix:flexid.sock",
            "tcp:0.0.0.0:7000",
            "edge.toml: [server] listen: \"tcp:0.0.0.0:7000\" is open to the network, and the protocol has no \
             password: write \"tcp:127.0.0.1:PORT\"",
        ),
        // Other files.
        (
            "\"mill3-model.toml\"",
            "\"mill4.toml\"",
            "edge.toml: [model] file: mill4.toml cannot be read: it does not exist; a path begins where this file lies, or with /",
        ),
        (
            "\"mill3.dbc\"",
            "\"mill4.dbc\"",
            "edge.toml: [bus] dbc: mill4.dbc cannot be read: it does not exist; a path begins where this file lies, or with /",
        ),
        ("dbc = \"mill3.dbc\"", "dbc = \"edge.toml\"", "edge.toml: is not a DBC file:"),
        // Signals.
        (
            "[\"q1\", \"q2\", \"q3\"]",
            "[\"q1\", \"q2\"]",
            "edge.toml: [signals] joints names 2 signals, but mill3-model.toml has 3 driven joints: name \
             one signal per driven joint, base first",
        ),
        (
            "[\"q1\", \"q2\", \"q3\"]",
            "[\"q1\", \"q2\", \"q4\"]",
            "edge.toml: [signals] joints: \"q4\" is not in mill3.dbc, which has Fx, Fy, Fz, ForceCounter, ax, \
             ay, az, AccelerationCounter, q1, Joint1Counter, q2, Joint2Counter, q3, Joint3Counter",
        ),
        (
            "[\"q1\", \"q2\", \"q3\"]",
            "[\"q1\", \"q2\", \"q1\"]",
            "edge.toml: [signals] names \"q1\" twice: each signal has one meaning",
        ),
        (
            "[\"Fx\", \"Fy\", \"Fz\"]",
            "[\"Fx\", \"Fy\"]",
            "edge.toml:19: [signals] force: invalid length 2, expected an array of length 3",
        ),
        (
            "force = [\"Fx\", \"Fy\", \"Fz\"]",
            "force = { channels = [\"Fx\", \"Fy\"], matrix = [[1, 0], [0, 1], [0, 0]] }",
            "edge.toml: [signals] force: channels names 2: three axes follow from 3 to 12",
        ),
        (
            "force = [\"Fx\", \"Fy\", \"Fz\"]",
            "force = { channels = [\"Fx\", \"Fy\", \"Fz\"], matrix = [[1, 0, 0], [0, 1, 0]] }",
            "edge.toml: [signals] force: matrix has 2 rows: must have three, that give x, y and z, or three further ones",
        ),
        (
            "force = [\"Fx\", \"Fy\", \"Fz\"]",
            "force = { channels = [\"Fx\", \"Fy\", \"Fz\"], matrix = [[1, 0, 0], [0, 1], [0, 0, 1]] }",
            "edge.toml: [signals] force: matrix has a row of 2 numbers, and there are 3 channels: write a number for each",
        ),
        (
            "force = [\"Fx\", \"Fy\", \"Fz\"]",
            "force = { channels = [\"Fx\", \"Fy\", \"Fz\"], matrix = [[1, 0, 0], [0, 1, 0], [1, 1, 0]] }",
            "edge.toml: [signals] force: matrix does not tell x, y and z apart: its first three rows depend on each other",
        ),
        (
            "force = [\"Fx\", \"Fy\", \"Fz\"]",
            "force = { channels = [\"Fx\", \"Fy\", \"Fz\"], matrix = [[1, 0, 0], [0, 1, 0], [0, 0, nan]] }",
            "edge.toml: [signals] force: matrix or offset has a number that is not finite",
        ),
        (
            "force_counter",
            "force_unit = \"kN\"\nforce_counter",
            "edge.toml: [signals] force_unit is \"kN\", and signal Fx has unit \"N\" in mill3.dbc: leave it out",
        ),
        (
            "force_counter",
            "force_unit = \"lb\"\nforce_counter",
            "edge.toml: [signals] force_unit is \"lb\": must be one of N, kN,",
        ),
        (
            "[\"Fx\", \"Fy\", \"Fz\"]",
            "[\"Fx\", \"ACCELERATION.Fy\", \"Fz\"]",
            "edge.toml: [signals] force: \"ACCELERATION.Fy\" is not in mill3.dbc",
        ),
        (
            "[\"Fx\", \"Fy\", \"Fz\"]",
            "[\"Fx\", \"FORCE.Fx\", \"Fz\"]",
            "edge.toml: [signals] names FORCE.Fx as \"Fx\" and as \"FORCE.Fx\": each signal has one meaning",
        ),
    ];
    check("edge.toml", &table);
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = Config::load(Path::new("/nowhere/edge.toml")).unwrap_err().to_string();
    assert_eq!(error, "/nowhere/edge.toml: cannot be read: it does not exist: correct its name");
}

fn check(file: &str, table: &[(&str, &str, &str)]) {
    let mut wrong = Vec::new();
    for (from, to, message) in table {
        let error = load(file, from, to).expect_err(to);
        if !error.starts_with(message) || error.contains('\n') {
            wrong.push(format!("{to}:\n  got  {error}\n  want {message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
