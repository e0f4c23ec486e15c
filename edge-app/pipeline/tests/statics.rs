//! Static tests from a file to the report, and mistakes in the file: each gives one line with file, line, column and mend.

use std::fs;
use std::path::Path;

use flexid_core::statics::{Reading, StaticTest};
use flexid_pipeline::config::Config;
use flexid_pipeline::model::Model;
use flexid_pipeline::source::{CandumpLog, Logs};
use flexid_pipeline::{run_offline, run_statics, statics};
use flexid_wire::report::Verdict;
use flexid_wire::warning::Warning;

const MODEL: &str = include_str!("../../../host-tools/scenario/mill3-model.toml");
const GAUGE: &str = "\
# A dial gauge along z, then a laser tracker.
q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz
0, -0.45, 0.95, 0, 0, -981, 0, 0, 0, , , -1.12e-4, , , 5e-6
0.7, -1.1, 1.9, 500, 0, 0, 0, 20, 0, 1e-4, 2e-5, -3e-5, 5e-6, 5e-6, 5e-6
";

fn parse(text: &str) -> Result<Vec<StaticTest>, String> {
    let model = Model::parse(Path::new("model.toml"), MODEL).unwrap();
    statics::parse(Path::new("static.csv"), text, &model).map_err(|error| error.to_string())
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
        let tests = statics::parse(Path::new("static.csv"), &text, &model).unwrap();
        let reading = |value, deviation| Some(Reading { value, deviation });
        let displacement = [reading(7e-4, 1e-6), None, reading(9e-4, 3e-6)];
        let wrench = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let pose = pose.into_iter().collect();
        assert_eq!(tests, [StaticTest { pose, wrench, displacement }]);
        let missing = text.replacen(&names[count - 1], "q0", 1);
        let error = statics::parse(Path::new("static.csv"), &missing, &model).unwrap_err();
        let known = format!("known are {},fx,", names.join(","));
        assert!(error.to_string().contains(&known), "{error}");
    }
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
        (
            ", 5e-6\n0.7",
            ",\n0.7",
            "3: column sz is empty: write the standard deviation of dz (in m)",
        ),
        (", 5e-6\n0.7", ",0\n0.7", "3: column sz is 0e0: must lie between 1e-9 and 0.1 (in m)"),
        (", 5e-6\n0.7", ",5\n0.7", "3: column sz is 5e0: must lie between 1e-9 and 0.1 (in m)"),
        ("-981", "-1e300", "3: column fz is -1e300: must be at most 1e6 (in N)"),
        ("0.7,", "40,", "4: column q1 is 40: joint \"joint_1\" moves in [-3.2, 3.2] rad"),
        ("0.7,", ",", "4: column q1 is empty: must be a number (in rad)"),
        ("0.7,", "", "4: has 14 cells, the first line 15: write as many"),
        (",sz", "", "2: column sz is missing: name q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz"),
        (",sz", ",sx", "2: column sx is there twice: name each once"),
        (
            ",sz",
            ",q4",
            "2: unknown column \"q4\": known are q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz",
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

/// The scenario with `[static]` and this file, as a config.
fn config(csv: Option<&str>) -> Result<Config, String> {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario");
    for name in ["mill3-model.toml", "mill3.dbc"] {
        fs::copy(scenario.join(name), folder.path().join(name)).unwrap();
    }
    let edge = fs::read_to_string(scenario.join("mill3-edge.toml")).unwrap();
    let section = "[static]\nfile = \"static.csv\"\n\n[search]";
    fs::write(folder.path().join("edge.toml"), edge.replacen("[search]", section, 1)).unwrap();
    if let Some(csv) = csv {
        fs::write(folder.path().join("static.csv"), csv).unwrap();
    }
    Config::load(&folder.path().join("edge.toml"))
        .map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn the_config_names_the_file() {
    assert_eq!(config(Some(GAUGE)).unwrap().statics, parse(GAUGE).unwrap());
    let error = config(None).unwrap_err();
    assert!(error.starts_with("static.csv: cannot be read: "), "{error}");
    let error = config(Some(&GAUGE.replace("-981", "x"))).unwrap_err();
    assert!(error.starts_with("static.csv:3: column fz"), "{error}");
}

/// Two tests and no record: a report, and no parameter in it that passes for found.
#[test]
fn static_tests_alone_make_a_report() {
    let finding = run_statics(&config(Some(GAUGE)).unwrap()).unwrap().expect("a finding");
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
    assert!(!residuals.contains("whiteness"), "{residuals}");
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
    let outcome = run_offline(&config, &mut Logs::new([Ok(log)]), |_| {}).unwrap();
    let warnings = outcome.finding.expect("a finding").report.warnings;
    assert!(warnings.contains(&Warning::NoRecord(outcome.state)), "{warnings:?}");
}
