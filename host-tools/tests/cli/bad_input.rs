//! Bad input: status 2, and one line that names place and mend.

use std::fs::{self, File};

use crate::setup::{edit, flexid, folder, found, refused, refuses_bad_results, stderr};

#[test]
fn bad_input_ends_with_status_2_and_one_line_that_names_place_and_mend() {
    // Arguments; file, text and its replacement; what stderr says.
    type Case = (&'static str, Option<[&'static str; 3]>, &'static [&'static str]);
    let cases: [Case; 60] = [
        ("model import gone.urdf --tcp tcp -o m.toml", None, &["gone.urdf: cannot be read"]),
        (
            "model import mill3.urdf --tcp hand -o m.toml",
            None,
            &["mill3.urdf: --tcp hand: no such link; the file has base_link, link_1, link_2"],
        ),
        (
            "model import mill3.urdf -o m.toml",
            None,
            &[
                "mill3.urdf: --tcp is missing: name the link at the tool's tip",
                "the chains end in tcp; all links are base_link, link_1, link_2, link_3, tcp",
            ],
        ),
        (
            "model import mill3.urdf",
            None,
            &["mill3.urdf: --tcp is missing: name the link at the tool's tip"],
        ),
        ("model import mill3.urdf --tcp tcp", None, &["flexid: -o MODEL.toml is missing"]),
        ("model import mill3.toml -o m.toml", None, &["mill3.toml: is a scenario, and no URDF: "]),
        (
            "model import mill3.toml --tcp tcp -o m.toml",
            None,
            &["mill3.toml: is a scenario, and no URDF: "],
        ),
        (
            "model import edge.toml --tcp tcp -o m.toml",
            None,
            &["edge.toml: is a configuration, and no URDF: "],
        ),
        (
            "model import mill3.dbc --tcp tcp -o m.toml",
            None,
            &["mill3.dbc: is a DBC file, and no URDF: "],
        ),
        (
            "check --config mill3-model.toml",
            None,
            &["mill3-model.toml: is the model of a robot: a file with the keys model, bounds"],
        ),
        (
            "check --config mill3.toml",
            None,
            &["mill3.toml: is a scenario: a file with the keys model, bounds"],
        ),
        ("check --config mill3.urdf", None, &["mill3.urdf: is a URDF", "and no TOML file"]),
        (
            "check --config edge.toml edge.toml",
            None,
            &["edge.toml: is a configuration, and neither a log of candump -L nor a table"],
        ),
        (
            "identify --config edge.toml mill3.dbc",
            None,
            &["mill3.dbc: is a DBC file, and neither a log of candump -L nor a table"],
        ),
        (
            "predict edge.toml",
            None,
            &["edge.toml: is a configuration: give a file as `flexid identify --json` writes it"],
        ),
        (
            "simulate --config edge.toml --plant mill3.toml --candump o.log",
            None,
            &["mill3.toml: is a scenario: a file with the keys force_sensor"],
        ),
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
            &[
                "flexid: ",
                "not provided: <--can <IFACE>|--candump <OUT.log>|--tables <DIR>> (see --help)",
            ],
        ),
        ("simulate --config edge.toml --can nocan9", None, &["--can nocan9: interface \"nocan9\""]),
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
            &[
                "mill3.urdf: is a URDF (`flexid model import` makes a model file of it), and neither a log of candump -L nor a table: name one",
            ],
        ),
        ("plan --config edge.toml --force -1", None, &["--force -1: must be above 0 N"]),
        ("plan --config edge.toml --poses 1 --force 0.001", None, &["--force 0.001: is lost in"]),
        (
            "plan --config edge.toml --poses 1",
            Some(["mill3.toml", "peak_tangential_n = 400.0", "peak_tangential_n = 0.001"]),
            &["mill3.toml: [force] peak_tangential_n is 0.001: is lost in", "in every cut: allow"],
        ),
        (
            "plan --config edge.toml --box 9,10,0,1,0,1",
            None,
            &["--box holds no tool: the robot reaches x -", " m"],
        ),
        ("plan --config edge.toml --box 0,1,0,1", None, &["--box has 4 numbers: give six"]),
        (
            "plan --config edge.toml --box 0,1,1,0,0,1",
            None,
            &["--box has Y from 1 to 0: give the lower end first"],
        ),
        (
            "plan --config edge.toml --poses 0",
            None,
            &["'--poses <N|FILE.csv>': 0 is not in 1..=4096"],
        ),
        ("plan --config edge.toml --poses gone.csv", None, &["gone.csv: cannot be read"]),
        (
            "plan --config edge.toml --poses mill3.dbc",
            None,
            &["mill3.dbc: is a DBC file, and no table"],
        ),
        ("plan --config edge.toml --near 0,1", None, &["--near has 2 angles: this robot has 3"]),
        ("plan --config edge.toml --near gone.json", None, &["gone.json: cannot be read"]),
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

/// Messages on a file that is empty, that is cut off, that is large and of zeros, and that is a letter.
struct Said([&'static str; 4]);

const TOML: Said = Said([
    "is empty: give a TOML file",
    "the last line is wrong, or the file is cut off here",
    "is larger than 16 MiB",
    "expected",
]);
const DBC: Said = Said([
    "is empty: name the DBC file of this bus",
    "cannot be read: mend it, or copy the file again",
    "is larger than 16 MiB",
    "is not a DBC file: line 1 cannot be read",
]);
const LOG: Said = Said([
    "is empty: record it with `candump -L can0 > cut.log`",
    "the last line is cut off",
    "is neither a candump log nor a table: line 1 is longer than",
    "is not a candump log: line 1 is no line of `candump -L`",
]);
const TRUTH: Said = Said([
    "is empty: give a file as `flexid simulate --truth-json` writes it",
    "is cut off at line 1: copy it again, or give a file as `flexid simulate --truth-json`",
    "is larger than 16 MiB",
    "is no JSON from line 1 on: give a file as `flexid simulate --truth-json` writes it",
]);
const URDF: Said =
    Said(["is empty: name a URDF file", "not a URDF", "is larger than 16 MiB", "not a URDF"]);
const TABLE: Said =
    Said(["the first line is q1", "has 1 cells", "is larger than 16 MiB", "unknown column"]);

/// Each command with each file that it reads: missing, empty, cut off, large, of another kind.
#[test]
fn no_command_takes_a_file_that_is_none() {
    let folder = found();
    let folder = folder.path();
    let force = "(1767000000.000060) can0 101#03000000FEFFFE0E\n";
    let names = "q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz";
    let static_test = "0,-0.45,0.95,0,0,-981,0,0,0,,,-1.12e-4,,,5e-6\n";
    for (file, text) in [
        ("cut.log", force.repeat(4)),
        ("truth.json", "{\"truth\": {\"joint_1\": {\"stiffness\": [1,2,3,4,5,6]}}}".to_owned()),
        ("path.csv", format!("q1,q2,q3,fx,fy,fz\n{}", "0,-0.5,0.9,0,200,0\n".repeat(3))),
        ("static.csv", format!("{names}\n{}", static_test.repeat(3))),
    ] {
        fs::write(folder.join(file), text).unwrap();
    }
    edit(&folder.join("edge.toml"), "[search]", "[static]\nfile = \"static.csv\"\n\n[search]");
    for (arguments, file, said) in [
        ("check --config edge.toml", "edge.toml", TOML),
        ("check --config edge.toml", "mill3-model.toml", TOML),
        ("check --config edge.toml", "mill3.dbc", DBC),
        ("check --config edge.toml", "static.csv", TABLE),
        ("check --config edge.toml cut.log", "cut.log", LOG),
        ("identify --config edge.toml cut.log", "edge.toml", TOML),
        ("identify --config edge.toml cut.log", "mill3-model.toml", TOML),
        ("identify --config edge.toml cut.log", "mill3.dbc", DBC),
        ("identify --config edge.toml cut.log", "static.csv", TABLE),
        ("identify --config edge.toml cut.log --truth truth.json", "truth.json", TRUTH),
        ("plan --config edge.toml", "edge.toml", TOML),
        ("plan --config edge.toml", "mill3-model.toml", TOML),
        ("plan --config edge.toml", "mill3.toml", TOML),
        ("compensate o.json path.csv -o x", "path.csv", TABLE),
        ("model import mill3.urdf --tcp tcp -o x", "mill3.urdf", URDF),
        ("simulate --config edge.toml --candump x", "edge.toml", TOML),
        ("simulate --config edge.toml --candump x", "mill3-model.toml", TOML),
        ("simulate --config edge.toml --candump x", "mill3.dbc", DBC),
        ("simulate --config edge.toml --candump x", "mill3.toml", TOML),
        (
            "simulate --config edge.toml --plant mill3-plant.toml --candump x",
            "mill3-plant.toml",
            TOML,
        ),
    ] {
        let path = folder.join(file);
        let whole = fs::read(&path).unwrap();
        let refuses = |expected: &str| {
            // What `check` could read of a log is printed all the same.
            let message = refused(folder, arguments);
            for part in [file, expected] {
                assert!(message.contains(part), "{arguments}, {file}: {message:?} has no {part:?}");
            }
            for part in ["EOF", "invalid type", "missing field", " column 1"] {
                assert!(!message.contains(part), "{arguments}, {file}: {message:?} has {part:?}");
            }
            assert!(!folder.join("x").exists(), "{arguments}, {file} leaves x behind");
        };
        fs::remove_file(&path).unwrap();
        refuses("cannot be read");
        let Said([empty, cut_off, large, letter]) = said;
        fs::write(&path, "").unwrap();
        refuses(empty);
        fs::write(&path, half(&whole)).unwrap();
        refuses(cut_off);
        File::create(&path).unwrap().set_len(17 << 20).unwrap();
        refuses(large);
        fs::write(&path, "Dear reader,\nwell\n").unwrap();
        refuses(letter);
        fs::write(&path, whole).unwrap();
    }
    // A result is checked by one reader, and each command calls it.
    let cut = "--teeth 2 --kt 700 --milling down --immersion 0.5 --feed 1,0,0 --rpm 60,1200";
    for arguments in [
        "plan --config edge.toml --from FOUND",
        "predict FOUND",
        "compare FOUND o.json",
        "compare o.json FOUND",
        &format!("lobes FOUND {cut}"),
        "compensate FOUND path.csv -o x",
        "map FOUND",
        "export FOUND --format mjcf --out x",
        "report FOUND --out x",
    ] {
        refuses_bad_results(folder, arguments);
    }
}

/// The first half: of a file in lines those up to the middle and the beginning of one; of a line the first half.
fn half(whole: &[u8]) -> Vec<u8> {
    let half = &whole[..whole.len() / 2];
    match half.iter().rposition(|byte| *byte == b'\n') {
        // Each line of a log begins with the time in parentheses.
        Some(end) if whole.starts_with(b"(") => [&half[..=end], b"(17"].concat(),
        Some(end) => [&half[..=end], b"ra"].concat(),
        None => half.to_vec(),
    }
}
