//! Static tests from a file to the report, and mistakes in the file: each gives one line with file, line, column and mend.

use std::fs;
use std::path::Path;

use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::sought::STIFF;
use flexid_core::statics::{Deflection, Gauge, Reading, StaticTest};
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::model::{Kind, Model};
use flexid_pipeline::report::{StaticReport, Summary};
use flexid_pipeline::source::{CandumpLog, Logs};
use flexid_pipeline::{run_offline, run_statics, statics};
use flexid_wire::report::Verdict;
use flexid_wire::warning::Warning;
use nalgebra::Vector3;

const MODEL: &str = include_str!("../../../host-tools/scenario/mill3-model.toml");
const GAUGE: &str = "\
# A dial gauge along z, then a laser tracker.
q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz
0, -0.45, 0.95, 0, 0, -981, 0, 0, 0, , , -1.12e-4, , , 5e-6
0.7, -1.1, 1.9, 500, 0, 0, 0, 20, 0, 1e-4, 2e-5, -3e-5, 5e-6, 5e-6, 5e-6
";

fn parse(text: &str) -> Result<Vec<StaticTest>, String> {
    let model = Model::parse(Path::new("model.toml"), MODEL).unwrap();
    let parsed = statics::parse(Path::new("static.csv"), text, &model);
    parsed.map(|all| all.tests).map_err(|error| error.to_string())
}

#[test]
fn a_table_is_read() {
    let tests = parse(GAUGE).unwrap();
    assert_eq!(tests.len(), 2);
    assert_eq!(tests[0].pose[..], [0.0, -0.45, 0.95]);
    assert_eq!(tests[0].wrench, [0.0, 0.0, -981.0, 0.0, 0.0, 0.0]);
    assert_eq!(tests[0].displacement[..2], [None, None]);
    let reading = tests[0].displacement[2].unwrap();
    assert_eq!((reading.value, reading.deviation), (-1.12e-4, 5e-6));
    assert_eq!(tests[1].readings().count(), 3);
    assert_eq!(tests[1].wrench[4], 20.0);
    // As spreadsheets write it: a byte order mark and Windows' ends of lines.
    let exported = format!("\u{feff}{}", GAUGE.replace('\n', "\r\n").replace("# A", "#A"));
    let exported = exported.replacen("#A dial gauge along z, then a laser tracker.\r\n", "", 1);
    assert_eq!(parse(&exported).unwrap(), tests);
}

#[test]
fn columns_may_come_in_any_order() {
    let turned: Vec<String> = GAUGE
        .lines()
        .skip(1)
        .map(|line| line.split(',').rev().collect::<Vec<_>>().join(","))
        .collect();
    assert_eq!(parse(&turned.join("\n")).unwrap(), parse(GAUGE).unwrap());
}

/// A robot of so many joints, and a load on each axis; the first line names the joints from the base.
#[test]
fn robots_of_one_to_seven_joints_are_read() {
    for count in [1, 7] {
        let mut model = Model::parse(Path::new("model.toml"), MODEL).unwrap();
        model.joints = model.joints.iter().cycle().take(count).cloned().collect();
        let names: Vec<String> = (1..=count).map(|joint| format!("q{joint}")).collect();
        let pose: Vec<f64> = (1..=count).map(|joint| -0.1 * joint as f64).collect();
        let angles: Vec<String> = pose.iter().map(f64::to_string).collect();
        let text = format!(
            "{},fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz\n{},1,2,3,4,5,6,7e-4,,9e-4,1e-6,,3e-6\n",
            names.join(","),
            angles.join(",")
        );
        let tests = statics::parse(Path::new("static.csv"), &text, &model).unwrap().tests;
        let reading = |value, deviation| Some(Reading::stated(value, deviation));
        let displacement = [reading(7e-4, 1e-6), None, reading(9e-4, 3e-6)];
        let wrench = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let pose = pose.into_iter().collect();
        assert_eq!(tests, [StaticTest { pose, wrench, gauge: Gauge::default(), displacement }]);
        let missing = text.replacen(&names[count - 1], "q0", 1);
        let error = statics::parse(Path::new("static.csv"), &missing, &model).unwrap_err();
        let known = format!("known are {},fx,", names.join(","));
        assert!(error.to_string().contains(&known), "{error}");
    }
}

/// A fixed joint, such as a pedestal, has no column: q1 is the angle of the first driven joint, q2 that of the second.
#[test]
fn a_fixed_joint_has_no_column() {
    let mut model = Model::parse(Path::new("model.toml"), MODEL).unwrap();
    let fixed = &mut model.joints[1];
    (fixed.kind, fixed.axis, fixed.limits) = (Kind::Fixed, [0.0; 3], [0.0; 2]);
    let parse = |text: &str| statics::parse(Path::new("static.csv"), text, &model);
    let error = parse(GAUGE).unwrap_err().to_string();
    assert!(error.contains("unknown column \"q3\": known are q1,q2,fx,fy"), "{error}");
    // The second driven joint is joint_3.
    let text = GAUGE.replace("q1,q2,q3", "q1,q2").replace("-0.45, ", "").replace("-1.1, ", "");
    let tests = parse(&text).unwrap().tests;
    assert_eq!(tests[0].pose[..], [0.0, 0.95]);
    let error = parse(&text.replace("0.95", "95")).unwrap_err().to_string();
    assert!(error.contains("column q2 is 95: joint \"joint_3\" moves in"), "{error}");
}

#[test]
fn mistakes_name_line_column_and_mend() {
    let table = [
        ("-981", "abc", "3: column fz is \"abc\": must be a number (in N)"),
        ("-981", "", "3: column fz is empty: write 0 where there is no load"),
        ("-981", "inf", "3: column fz is \"inf\": must be a number (in N)"),
        ("-981", "0", "3: has no load: one of fx,fy,fz,mx,my,mz must not be 0"),
        ("-1.12e-4", "", "3: has no displacement: fill one of dx,dy,dz"),
        ("-1.12e-4", "-0.112", "3: column dz is -0.112: must be at most 0.1 (in m)"),
        (", 5e-6\n0.7", ",0\n0.7", "3: column sz is 0e0: must lie between 1e-9 and 0.1 (in m)"),
        (", 5e-6\n0.7", ",5\n0.7", "3: column sz is 5e0: must lie between 1e-9 and 0.1 (in m)"),
        ("-981", "-1e300", "3: column fz is -1e300: must be at most 1e6 (in N)"),
        (
            "0.7,",
            "40,",
            "4: column q1 is 40: joint \"joint_1\" moves in [-3.2, 3.2] rad: looks like degrees: name the column q1_deg",
        ),
        ("0.7,", "400,", "4: column q1 is 400: joint \"joint_1\" moves in [-3.2, 3.2] rad"),
        ("0.7,", ",", "4: column q1 is empty: must be a number (in rad)"),
        ("0.7,", "", "4: has 14 cells, the first line 15: write as many"),
        (",sz", "", "3: has 15 cells, the first line 14: write as many"),
        (",dz", "", "2: column dz is missing: name q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz"),
        (",q2", "", "2: column q2 is missing: name q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz"),
        (",sz", ",sx", "2: column sx is there twice: name each once"),
        (
            ",sz",
            ",q4",
            "2: unknown column \"q4\": known are q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz,\
             q1_deg,q2_deg,q3_deg,px,py,pz,gx,gy,gz,dx_base,dy_base,dz_base",
        ),
        (
            "q1,q2,q3",
            "q1;q2;q3",
            "2: unknown column \"q1;q2;q3\": separate columns with commas, and write decimals with points",
        ),
    ];
    for (from, to, message) in table {
        assert!(GAUGE.contains(from), "{from:?}");
        let error = parse(&GAUGE.replacen(from, to, 1)).unwrap_err();
        assert_eq!(error, format!("static.csv:{message}"));
    }
    // Whatever precedes a line, and however lines end.
    let exported = format!(
        "\u{feff}{}",
        GAUGE.replace("\n0.7", "\n\n# Here it goes wrong.\n,,,\n\n0.7,x").replace('\n', "\r\n")
    );
    assert_eq!(
        parse(&exported).unwrap_err(),
        "static.csv:8: has 16 cells, the first line 15: write as many"
    );
    let header = GAUGE.lines().nth(1).unwrap();
    for nothing in ["", header] {
        let error = parse(nothing).unwrap_err();
        assert!(
            error.starts_with("static.csv: has no static test: the first line is q1,"),
            "{error}"
        );
    }
    let line = GAUGE.lines().nth(2).unwrap();
    let long = format!("{header}\n{}", format!("{line}\n").repeat(65));
    assert_eq!(
        parse(&long).unwrap_err(),
        "static.csv:66: is one test too many: at most 64 are used"
    );
}

/// Angles in degrees, displacements along the base, and points of load and gauge, as a trial with a weight at a hook has them.
const HOOK: &str = "\
q1_deg,q2,q3_deg,fx,fy,fz,mx,my,mz,px,py,pz,dx_base,dy_base,dz_base,gx,gy,gz
90,-0.45,45,0,0,-100,0,0,0,0.2,,,,,-1e-4,0,0,0.5
0,-0.45,0,0,0,-100,1,0,0,,,,2e-5,,-1e-4,,,
";

#[test]
fn optional_columns_are_read() {
    let tests = parse(HOOK).unwrap();
    let quarter = std::f64::consts::FRAC_PI_2;
    assert_eq!(tests[0].pose[..], [quarter, -0.45, quarter / 2.0]);
    // p × f: 0.2 m along x and −100 N along z turn about y.
    assert_eq!(tests[0].wrench, [0.0, 0.0, -100.0, 0.0, 20.0, 0.0]);
    assert_eq!(tests[1].wrench, [0.0, 0.0, -100.0, 1.0, 0.0, 0.0]);
    assert_eq!([tests[0].gauge.place, tests[1].gauge.place], [[0.0, 0.0, 0.5], [0.0; 3]]);
    // Turned by a quarter about z, then by 45° − 0.45 about y: the base's y is the tool's x in part.
    let turn = quarter / 2.0 - 0.45;
    let expected =
        [[0.0, -1.0, 0.0], [turn.cos(), 0.0, turn.sin()], [-turn.sin(), 0.0, turn.cos()]];
    for (own, expected) in tests[0].gauge.axes.iter().zip(expected) {
        for (own, expected) in own.iter().zip(expected) {
            assert!((own - expected).abs() < 1e-12, "{:?}", tests[0].gauge);
        }
    }
    let readings: Vec<_> = tests.iter().flat_map(StaticTest::readings).collect();
    assert_eq!(readings.len(), 3);
    assert!(readings.iter().all(|(_, reading)| !reading.is_stated));
    // Some state theirs.
    let some = parse(&GAUGE.replacen(", 5e-6\n0.7", ",\n0.7", 1)).unwrap();
    assert!(
        !some[0].displacement[2].unwrap().is_stated && some[1].displacement[2].unwrap().is_stated
    );
}

#[test]
fn mistakes_in_optional_columns_name_line_column_and_mend() {
    for (from, to, message) in [
        ("0.2", "x", "2: column px is \"x\": must be a number (in m)"),
        ("0.2", "200", "2: column px is 2e2: must be at most 5e0 (in m from the TCP)"),
        ("0.5", "500", "2: column gz is 5e2: must be at most 5e0 (in m from the TCP)"),
        ("0.5", "nan", "2: column gz is \"nan\": must be a number (in m)"),
        ("90", "200", "2: column q1_deg is 200: joint \"joint_1\" moves in [-183.3, 183.3] deg"),
        ("90", "", "2: column q1_deg is empty: must be a number (in deg)"),
        ("-1e-4", "", "2: has no displacement: fill one of dx_base,dy_base,dz_base"),
        ("-1e-4", "-1", "2: column dz_base is -1: must be at most 0.1 (in m)"),
        (
            "dy_base",
            "dy",
            "1: columns dy and dx_base are along other axes: take those of the TCP or those of the base",
        ),
        ("q2", "q1", "1: columns q1 and q1_deg are the same angle: name one"),
        ("px", "p_x", "1: unknown column \"p_x\": known are "),
    ] {
        assert!(HOOK.contains(from), "{from:?}");
        let error = parse(&HOOK.replacen(from, to, 1)).unwrap_err();
        assert!(error.starts_with(&format!("static.csv:{message}")), "{error}");
    }
    // A stroke has no degrees.
    let mut model = Model::parse(Path::new("model.toml"), MODEL).unwrap();
    model.joints[0].kind = Kind::Prismatic;
    let error = statics::parse(Path::new("static.csv"), HOOK, &model).unwrap_err().to_string();
    assert!(error.starts_with("static.csv:1: unknown column \"q1_deg\": known are q1,"), "{error}");
}

/// The scenario with `[static]` and this file, as a config.
fn config(csv: Option<&str>) -> Result<Config, String> {
    config_of(csv, |edge| edge, Config::load)
}

/// The config of [`config`], with changes.
fn config_of(
    csv: Option<&str>,
    change: impl Fn(String) -> String,
    load: impl Fn(&Path) -> Result<Config, BadInput>,
) -> Result<Config, String> {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario");
    for name in ["mill3-model.toml", "mill3.dbc"] {
        fs::copy(scenario.join(name), folder.path().join(name)).unwrap();
    }
    let edge = fs::read_to_string(scenario.join("mill3-edge.toml")).unwrap();
    let section = "[static]\nfile = \"static.csv\"\n\n[search]";
    let edge = change(edge.replacen("[search]", section, 1));
    fs::write(folder.path().join("edge.toml"), edge).unwrap();
    if let Some(csv) = csv {
        fs::write(folder.path().join("static.csv"), csv).unwrap();
    }
    load(&folder.path().join("edge.toml"))
        .map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn the_config_names_the_file() {
    let statics = config(Some(GAUGE)).unwrap().statics;
    assert_eq!((statics.tests, statics.lines), (parse(GAUGE).unwrap(), vec![3, 4]));
    let error = config(None).unwrap_err();
    assert!(error.starts_with("edge.toml: [static] file: static.csv cannot be read: "), "{error}");
    let error = config(Some(&GAUGE.replace("-981", "x"))).unwrap_err();
    assert!(error.starts_with("static.csv:3: column fz"), "{error}");
}

/// Two tests and no record: a report, and no parameter in it that passes for found.
#[test]
fn static_tests_alone_make_a_report() {
    let (finding, statics, _) =
        run_statics(&config(Some(GAUGE)).unwrap()).unwrap().expect("a finding");
    assert_eq!(statics.tests.iter().map(|test| test.line).collect::<Vec<_>>(), [3, 4]);
    let report = finding.report;
    assert_eq!(report.fit.records, 0);
    // Nobody asked for records.
    let said = report.warnings.iter().any(|warning| matches!(warning, Warning::NoRecord(_)));
    assert!(!said, "{:?}", report.warnings);
    let confidence = finding.confidence;
    // Nor for dampings, which no static test determines; and nothing along a band was measured.
    for direction in &confidence.weak_directions {
        assert!(!direction.to_string().contains("damping"), "{direction}");
    }
    let residuals = confidence.residuals.to_string();
    assert!(!residuals.contains("structure"), "{residuals}");
    for joint in &report.joints {
        let verdicts = joint.stiffness_verdict.iter().chain(&joint.damping_verdict);
        assert!(verdicts.copied().all(|verdict| verdict == Verdict::NotObservable));
    }
}

/// A log of another bus: that it brought no record must not be lost behind what the static tests determine.
#[test]
fn a_log_without_a_record_is_reported() {
    let config = config(Some(GAUGE)).unwrap();
    let log = CandumpLog::new(Path::new("other.log"), "(1.0) vcan0 7FF#00\n".as_bytes());
    let outcome = run_offline(&config, &mut Logs::new([Ok(log)]), |_| {}, |_| {}).unwrap();
    let warnings = outcome.finding.expect("a finding").report.warnings;
    assert!(warnings.contains(&Warning::NoRecord(outcome.state)), "{warnings:?}");
}

/// Degree of freedom of each joint's drive.
const DRIVES: [usize; 3] = [5, 4, 4];
/// Standard deviation of the readings of [`trial`], m.
const NOISE: f64 = 2e-6;

/// Thirty weights on the scenario's robot as a spreadsheet has them, at a hook and along the base; no noise is stated. The reading in
/// line `wrong` is off by `error`, m. The robot gives way about its drives, by 3e6 Nm/rad.
fn trial(wrong: usize, error: f64) -> String {
    let model = Model::parse(Path::new("model.toml"), MODEL).unwrap();
    let chain = model.chain().unwrap();
    let driven = |drive: &usize| {
        let stiffness = std::array::from_fn(|dof| if dof == *drive { 3e6 } else { STIFF });
        Bushing { stiffness, damping: [1e4; 6] }
    };
    let bushings: Bushings = DRIVES.iter().map(driven).collect();
    let mut text =
        "# A weight at a hook.\nq1,q2,q3,fx,fy,fz,mx,my,mz,px,py,pz,dx_base,dy_base,dz_base\n"
            .to_owned();
    // Irregular, and the same each time.
    let irregular = |index: usize, step: f64| ((index as f64 + 1.0) * step).fract() * 2.0 - 1.0;
    for index in 0..30 {
        let [a, b, c, d, e, f] =
            [0.618, 0.755, 0.57, 0.32, 0.91, 0.43].map(|step| irregular(index, step));
        let pose = [2.0 * a, 0.7 * b - 0.75, 1.0 + c];
        let (force, hook) = (Vector3::new(800.0 * d, 800.0 * e, 800.0 * f), [0.1 * a, 0.2, 0.0]);
        let torque = Vector3::from(hook).cross(&force);
        let wrench = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
        let linear = chain.linearise(&pose, Vector3::zeros(), &bushings).unwrap();
        let gauge = Gauge::default().along_base(&chain, &pose);
        let exact = Deflection::new(&linear, &bushings, &wrench, &gauge).unwrap().displacement;
        let line = index + 3;
        let cells = (0..3).map(|axis| {
            let noise =
                (0..12).map(|n| irregular(7 * index + axis + 31 * n, 0.377 + 0.01 * n as f64));
            let off = if line == wrong && axis == 2 { error } else { 0.0 };
            // Twelve uniform numbers from −1 to 1 have the variance 4.
            format!("{:e}", exact[axis] + 0.5 * NOISE * noise.sum::<f64>() + off)
        });
        let numbers = pose.iter().chain(force.iter()).chain(&[0.0; 3]).chain(&hook);
        let cells: Vec<String> = numbers.map(|value| format!("{value:e}")).chain(cells).collect();
        text += &format!("{}\n", cells.join(","));
    }
    text
}

/// Without what describes records, with bounds that hold the stiffness of [`trial`].
fn alone(edge: String) -> String {
    let section = |edge: String, name: &str| {
        let begin = edge.find(&format!("[{name}]")).unwrap();
        let length = edge[begin + 1..].find("\n[").map_or(edge.len() - begin, |end| end + 2);
        format!("{}{}", &edge[..begin], &edge[begin + length..])
    };
    ["bounds", "bus", "signals", "measurement", "server"].into_iter().fold(edge, section)
}

fn only_drives(edge: String) -> String {
    alone(edge).replacen("[static]", "[parameters]\ndrive_only = true\n\n[static]", 1)
}

fn outlier(warnings: &[Warning]) -> Option<u64> {
    warnings.iter().find_map(|warning| match warning {
        Warning::StaticOutlier { line, .. } => Some(*line),
        _ => None,
    })
}

/// A config of static tests alone, every stiffness and the drives alone: a gross error is named with its line, a clean table names none.
#[test]
fn the_line_with_a_gross_error_is_named() {
    for change in [alone, only_drives] {
        for (wrong, error, named) in
            [(0, 0.0, None), (17, 40.0 * NOISE, Some(17)), (32, -1e-3, Some(32))]
        {
            let trial = trial(wrong, error);
            let config = config_of(Some(&trial), change, Config::load_statics).unwrap();
            let (finding, statics, _) = run_statics(&config).unwrap().expect("a finding");
            let summary = Summary(&finding.report).to_string();
            assert_eq!(outlier(&finding.report.warnings), named, "{summary}");
            let StaticReport { deviation_m, deviation_is_estimated, tests } = statics;
            assert!(deviation_is_estimated && tests.len() == 30 && tests[0].line == 3);
            if named.is_none() {
                let ratio = deviation_m.unwrap() / NOISE;
                assert!((0.8..1.25).contains(&ratio), "{ratio}");
            }
        }
    }
}

/// Each drive is found, and all else is given; nothing is said of dampings.
#[test]
fn drives_alone_are_sought() {
    let config = config_of(Some(&trial(0, 0.0)), only_drives, Config::load_statics).unwrap();
    let (finding, ..) = run_statics(&config).unwrap().expect("a finding");
    for (joint, drive) in finding.report.joints.iter().zip(DRIVES) {
        for dof in 0..6 {
            let (own, verdict) = (joint.stiffness[dof], joint.stiffness_verdict[dof]);
            let expected = if dof == drive { Verdict::Identified } else { Verdict::Fixed };
            assert_eq!(verdict, expected, "{} {dof}: {own:e}", joint.name);
        }
    }
    let summary = Summary(&finding.report).to_string();
    let counts = "3 of 18 stiffnesses identified, 0 weak, 0 not observable, 15 fixed";
    assert!(summary.contains(counts), "{summary}");
}

/// The daemon and whatever needs records say what to add; so does a file that has a part.
#[test]
fn records_need_their_sections() {
    let trial = trial(0, 0.0);
    let mend = "add what host-tools/scenario/edge.toml has there; a file for tables (CSV, LVM) has no [bus], and is for \
                `flexid identify`, `check` and `plan`; a file of static tests alone has none of the three, and is for \
                `flexid identify` without a log";
    let error = config_of(Some(&trial), alone, Config::load).unwrap_err();
    assert_eq!(error, format!("edge.toml: [bus], [signals], [measurement] are missing: {mend}"));
    let half =
        |edge: String| alone(edge) + "\n[measurement]\nrate_hz = 2000.0\nband_hz = [2.0, 200.0]\n";
    let error = config_of(Some(&trial), half, Config::load).unwrap_err();
    assert_eq!(error, format!("edge.toml: [bus], [signals] are missing: {mend}"));
    let error = config_of(Some(&trial), half, Config::load_statics).unwrap_err();
    assert_eq!(error, format!("edge.toml: [signals] is missing: {mend}"));
    // Without static tests there is nothing to fit.
    let nothing = |edge: String| alone(edge).replacen("[static]\nfile = \"static.csv\"\n", "", 1);
    let error = config_of(Some(&trial), nothing, Config::load_statics).unwrap_err();
    assert!(error.starts_with("edge.toml: [signals], [measurement] are missing"), "{error}");
}
