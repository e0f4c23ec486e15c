//! `flexid compensate`: the file that it writes, and paths that are none.

use std::fs;

use serde_json::Value;

use crate::setup::{flexid, found, refused, refuses_bad_results, stderr, stdout};

#[test]
fn the_file_has_deflections_offsets_and_what_is_left() {
    let folder = found();
    let folder = folder.path();
    let path = "# a path\nq1_deg,q2,q3,fx,fy,fz\n0,-0.45,0.95,120,-80,200\n\n20,-0.7,1.1,0,0,0\n";
    fs::write(folder.join("path.csv"), path).unwrap();
    let text = stdout(folder, "compensate o.json path.csv -o out.csv");
    assert!(text.starts_with("2 places\n most deflected, line 3, µm: x "), "{text}");
    assert!(
        text.contains(" largest offsets, mrad (mm), to be added to the commanded angles: q1 "),
        "{text}"
    );

    let csv = fs::read_to_string(folder.join("out.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let at = |row: usize, name: &str| -> f64 {
        rows[row][rows[0].iter().position(|own| *own == name).unwrap()].parse().unwrap()
    };
    // The same deflection as `predict` has, and three joints take the translation back.
    let predicted = stdout(folder, "predict o.json --pose 0,-0.45,0.95 --force 120,-80,200 --json");
    let predicted: Value = serde_json::from_str(&predicted).unwrap();
    for (axis, name) in ["dx", "dy", "dz"].iter().enumerate() {
        let own = &predicted[0]["deflection"]["translation"][axis];
        let [low, high] = [0, 1].map(|end| own["interval"][end].as_f64().unwrap());
        // Beyond what the interval justifies the file has no digits.
        let justified = |wrong: f64| wrong.abs() < 0.005 * (high - low);
        assert!(justified(at(1, name) - own["value"].as_f64().unwrap()), "{own}");
        assert!(justified(at(1, &format!("{name}_low")) - low), "{own}");
        assert!(at(1, &format!("{name}_left")).abs() < 1e-12, "{csv}");
        assert_eq!(at(2, name), 0.0);
    }
    assert!(
        at(1, "q2_offset_low") < at(1, "q2_offset") && at(1, "q2_offset") < at(1, "q2_offset_high")
    );
    assert!((at(2, "q1") - 20_f64.to_radians()).abs() < 1e-12);

    assert_eq!([at(1, "q2_offset_determined"), at(1, "dx_determined")], [1.0, 1.0]);
    assert!(!text.contains("not determined"), "{text}");

    // What is left is as uncertain as the deflection.
    let width = |name: &str| at(1, &format!("{name}_high")) - at(1, &format!("{name}_low"));
    assert!((width("dx_left") / width("dx") - 1.0).abs() < 0.01 && width("dx") > 0.0);

    fs::write(folder.join("huge.csv"), "q1,q2,q3,fx,fy,fz\n0,-0.45,0.95,0,2e5,0\n").unwrap();
    let output = flexid(folder, "compensate o.json huge.csv -o huge-out.csv");
    let warned = stderr(&output);
    assert!(
        output.status.success() && warned.starts_with("warning: huge.csv:2: offset of q"),
        "{warned}"
    );

    let json = stdout(folder, "compensate o.json path.csv -o out.csv --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json[1]["line"], 5);
    assert_eq!(json[0]["offsets"][1]["determined"], true);
    let off = json[0]["offsets"][1]["value"].as_f64().unwrap() - at(1, "q2_offset");
    assert!(off.abs() < 0.005 * (at(1, "q2_offset_high") - at(1, "q2_offset_low")), "{off}");
}

#[test]
fn bad_paths_are_refused_with_line_column_and_mend() {
    let folder = found();
    let folder = folder.path();
    fs::write(folder.join("path.csv"), "q1,q2,q3,fx,fy,fz\n0,-0.45,0.95,1,2,3\n").unwrap();
    refuses_bad_results(folder, "compensate FOUND path.csv -o out.csv");
    for (path, expected) in [
        ("", "has no place: the first line is q1,q2,q3,fx,fy,fz, each other a place"),
        ("q1,q2,q3,fx,fy,fz\n", "has no place"),
        ("q1,q2,fx,fy,fz\n0,0,1,2,3\n", "bad.csv:1: column q3 is missing"),
        (
            "q1,q2,q3,fx,fy,fz,feed\n0,0,0,1,2,3,4\n",
            "bad.csv:1: unknown column \"feed\": known are q1,q2,q3,fx,fy,fz,mx,my,mz,q1_deg",
        ),
        (
            "0,-0.5,0.9,1,2,3\n",
            "bad.csv:1: has no names of columns: the first line is q1,q2,q3,fx,fy,fz",
        ),
        (
            "Q1,Q2,Q3,FX,FY,FZ\n0,-0.5,0.9,1,2,3\n",
            "bad.csv:1: unknown column \"Q1\": did you mean q1? the first line is q1,q2,q3,fx,fy,fz",
        ),
        ("q1;q2;q3;fx;fy;fz\n", "separate columns with commas"),
        ("q1,q2,q3,fx,fy,fz\n0,0,0,1,2\n", "bad.csv:2: has 5 cells, the first line 6"),
        (
            "q1,q2,q3,fx,fy,fz\n0,-0.5,0.9,1,2,3\n0,-0.5,x,1,2,3\n",
            "bad.csv:3: column q3 is \"x\": must be a number (in rad)",
        ),
        (
            "q1,q2,q3,fx,fy,fz\n0,-0.5,90,1,2,3\n",
            "joint \"joint_3\" moves in [-1.8, 2.6] rad: looks like degrees: name the column q3_deg",
        ),
        ("q1,q2,q3,fx,fy,fz\n0,-0.5,0.9,1,,3\n", "bad.csv:2: column fy is empty: write 0"),
        (
            "q1,q2,q3,fx,fy,fz\n0,-0.5,0.9,1e9,2,3\n",
            "bad.csv:2: column fx is 1e9: must be at most 1e6",
        ),
        (
            "q1,q2,q3,fx,fy,fz\n0,-0.5,0.9,nan,2,3\n",
            "column fx is \"nan\": must be a number (in N)",
        ),
    ] {
        fs::write(folder.join("bad.csv"), path).unwrap();
        let message = refused(folder, "compensate o.json bad.csv -o out.csv");
        assert!(message.contains(expected), "{path:?}: {message}");
    }
    fs::write(folder.join("bad.csv"), [0xff, 0xfe, 0x00]).unwrap();
    fs::File::create(folder.join("huge.csv")).unwrap().set_len(17 << 20).unwrap();
    for (arguments, expected) in [
        ("compensate o.json bad.csv -o out.csv", "bad.csv: is not text"),
        ("compensate o.json gone.csv -o out.csv", "gone.csv: cannot be read"),
        ("compensate o.json huge.csv -o out.csv", "huge.csv: is larger than 16 MiB"),
        (
            "compensate o.json o.json -o out.csv",
            "o.json: is a result of `flexid identify --json`, and no table: name a file of comma-separated",
        ),
        ("compensate o.json path.csv -o gone/out.csv", "its folder is not there"),
        ("compensate o.json path.csv", "--out <OUT.csv>"),
    ] {
        let message = refused(folder, arguments);
        assert!(message.contains(expected), "{arguments}: {message}");
    }
    assert!(!folder.join("out.csv").exists());
}
