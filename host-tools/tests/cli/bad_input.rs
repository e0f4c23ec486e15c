//! Bad input: status 2, and one line that names place and mend.

use crate::setup::{edit, flexid, folder, stderr};

#[test]
fn bad_input_ends_with_status_2_and_one_line_that_names_place_and_mend() {
    // Arguments; file, text and its replacement; what stderr says.
    type Case = (&'static str, Option<[&'static str; 3]>, &'static [&'static str]);
    let cases: [Case; 41] = [
        ("model import gone.urdf --tcp tcp -o m.toml", None, &["gone.urdf: cannot be read"]),
        (
            "model import mill3.urdf --tcp hand -o m.toml",
            None,
            &["mill3.urdf: --tcp hand: no such link; the file has base_link, link_1, link_2"],
        ),
        ("model import mill3.toml --tcp tcp -o m.toml", None, &["mill3.toml: not a URDF: "]),
        (
            "model import mill3.urdf --tcp tcp -o m.toml",
            Some(["mill3.urdf", "<mass value=\"485\"/>", "<mass value=\"0\"/>"]),
            &["mill3.urdf: no mass on link 'link_2' (moved by 'joint_2')", "<mass value=\"kg\"/>"],
        ),
        // The model says that joint_1 has no drive, and then no joint angle is of it.
        (
            "simulate --config edge.toml --candump o.log",
            Some(["mill3-model.toml", "kind = \"revolute\"", "kind = \"fixed\""]),
            &["mill3-model.toml: joint \"joint_1\": axis is that of a drive", "remove axis"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some([
                "mill3-model.toml",
                "kind = \"revolute\"\norigin_xyz_m = [0.0, 0.0, 0.5]\norigin_rpy_rad = [0.0, 0.0, 0.0]\n\
                 axis = [0.0, 0.0, 1.0]\nlimits = [-3.2, 3.2]",
                "kind = \"fixed\"\norigin_xyz_m = [0.0, 0.0, 0.5]\norigin_rpy_rad = [0.0, 0.0, 0.0]",
            ]),
            &[
                "edge.toml: [signals] joints names 3 signals, but",
                "has 2 driven joints: name one signal per driven joint",
            ],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["mill3-model.toml", "kind = \"revolute\"", "kind = \"rigid\""]),
            &["mill3-model.toml:", "unknown variant `rigid`", "`fixed`"],
        ),
        ("simulate --config gone.toml --candump o.log", None, &["gone.toml: cannot be read"]),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "rate_hz = 2000.0", "rate_hz = -5"]),
            &["edge.toml: [measurement] rate_hz is -5: must be positive"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "[simulation]", "[simulations]"]),
            &["edge.toml:", "simulations"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "rate_hz = 2000.0", "rate_hz = 1000.0"]),
            &["edge.toml: [measurement] rate_hz is 1000, but mill3.toml has 2000: make them equal"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["mill3.toml", "teeth = 2", "teeth = 0"]),
            &["mill3.toml: [force] teeth is 0: must lie between 1 and 1000"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["mill3.toml", "teeth = 2", "tooth = 2"]),
            &["mill3.toml:", "[force] tooth: unknown key `tooth`: did you mean `teeth`"],
        ),
        (
            "simulate --config edge.toml --candump o.log --truth-json gone/t.json",
            None,
            &["gone/t.json: cannot be written: its folder is not there: make it first"],
        ),
        (
            "simulate --config edge.toml --candump gone/o.log",
            None,
            &["gone/o.log: cannot be written: its folder is not there: make it first"],
        ),
        ("simulate --config edge.toml --repeat 1000000000", None, &["--repeat", "1..=10000"]),
        ("simulate --config edge.toml --experiments 1000000000", None, &["1..=10000"]),
        ("simulate --config edge.toml --experiments 0", None, &["--experiments", "1..=10000"]),
        ("simulate --config edge.toml --candump o.log --drop 1", None, &["--drop 1: must be"]),
        ("simulate --config edge.toml --candump o.log --truth me", None, &["drawn:SEED"]),
        (
            "simulate --config edge.toml",
            None,
            &["flexid: ", "not provided: <--can <IFACE>|--candump <OUT.log>> (see --help)"],
        ),
        ("simulate --config edge.toml --can nocan9", None, &["--can nocan9: interface \"nocan9\""]),
        (
            "",
            None,
            &[
                "flexid: 'flexid' requires a subcommand",
                "identify, plan, predict, compare, lobes, compensate, map, export, report, reproduce, watch, web",
                "(see --help)",
            ],
        ),
        ("model", None, &["flexid: 'flexid model' requires a subcommand", "import"]),
        ("simulate", None, &["flexid: ", "--config <EDGE.toml>", "(see --help)"]),
        (
            "identify --config edge.toml",
            None,
            &["edge.toml: nothing to identify from: name a LOG", "[static]"],
        ),
        ("found", None, &["flexid: unrecognized subcommand 'found'"]),
        ("watch unix:s --records 0 --until identified", None, &["--records", "(see --help)"]),
        // All of these before the recording is even opened.
        (
            "identify --config edge.toml gone.log --json .",
            None,
            &[".: cannot be written: is a folder: name"],
        ),
        (
            "identify --config edge.toml gone.log --truth gone.json",
            None,
            &["gone.json: cannot be read"],
        ),
        (
            "identify --config edge.toml gone.log --truth edge.toml",
            None,
            &["edge.toml: ", "give a file as `flexid simulate --truth-json` writes it"],
        ),
        (
            "model import mill3.urdf --tcp tcp -o gone/m.toml",
            None,
            &["gone/m.toml: cannot be written: its folder is not there: make it first"],
        ),
        ("identify --config edge.toml gone.log", None, &["gone.log: cannot be read"]),
        (
            "identify --config edge.toml mill3.urdf",
            None,
            &["mill3.urdf: no record to identify from: waiting for frames"],
        ),
        ("plan --config edge.toml --force -1", None, &["--force -1: must be above 0 N"]),
        ("plan --config edge.toml --poses 1 --force 0.001", None, &["--force 0.001: is lost in"]),
        (
            "plan --config edge.toml --poses 1",
            Some(["mill3.toml", "peak_tangential_n = 400.0", "peak_tangential_n = 0.001"]),
            &["mill3.toml: [force] peak_tangential_n is 0.001: is lost in", "in every cut: allow"],
        ),
        ("plan --config edge.toml --from gone.json", None, &["gone.json: cannot be read"]),
        (
            "plan --config edge.toml --from edge.toml",
            None,
            &["edge.toml: ", "give a file as `flexid identify --json` writes it"],
        ),
        (
            "plan --config edge.toml",
            Some(["mill3.toml", "g_per_sqrt_hz = 5.0e-5", "g_per_sqrt_hz = 0.0"]),
            &["mill3.toml: [measurement] acceleration_noise_g_per_sqrt_hz is 0: give"],
        ),
        ("watch flexid.sock", None, &["ADDRESS: \"flexid.sock\" is no address", "unix:PATH"]),
    ];
    for (arguments, change, said) in cases {
        let folder = folder();
        if let Some([file, from, to]) = change {
            edit(&folder.path().join(file), from, to);
        }
        let output = flexid(folder.path(), arguments);
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {errors}");
        for part in said {
            assert!(errors.contains(part), "{arguments}: {errors:?} does not say {part:?}");
        }
        let complaint = errors.lines().filter(|line| !line.starts_with("warning: ")).count();
        assert_eq!(complaint, 1, "{arguments}: {errors}");
        for left in ["m.toml", "o.log"] {
            assert!(!folder.path().join(left).exists(), "{arguments} left {left} behind");
        }
    }
}
