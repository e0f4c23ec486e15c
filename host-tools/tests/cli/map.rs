//! `flexid map`: words, files, and arguments that are none.

use std::fs;

use serde_json::Value;

use crate::setup::{found, refused, refuses_bad_results, stdout};

#[test]
fn the_words_the_files_and_json_hold_the_same_map() {
    let folder = found();
    let folder = folder.path();
    let text = stdout(folder, "map o.json --points 5 --out m.csv --out m.svg --positions x,z");
    assert!(
        text.starts_with(
            "compliance, softest direction, µm/N, over joint_2 and joint_3, 25 poses\n least "
        ),
        "{text}"
    );
    assert!(text.contains("\n largest ") && text.contains("\n uncertain: "), "{text}");
    let svg = fs::read_to_string(folder.join("m.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("x of the tool in the base, m"));
    // A polygon for each pose.
    assert!(svg.matches("<polygon").count() >= 25);

    let csv = fs::read_to_string(folder.join("m.csv")).unwrap();
    assert!(
        csv.starts_with("q1,q2,q3,x,y,z,compliance_m_per_n,low,high,uncertain,determined\n"),
        "{csv}"
    );
    let json: Value =
        serde_json::from_str(&stdout(folder, "map o.json --points 5 --json")).unwrap();
    assert_eq!((json.as_array().unwrap().len(), csv.lines().count()), (25, 26));
    let cells: Vec<f64> =
        csv.lines().nth(8).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    let own = &json[7];
    assert!((own["value"]["value"].as_f64().unwrap() / cells[6] - 1.0).abs() < 1e-8);
    // The softest direction gives way as much as any axis, or more.
    let pose = format!("{},{},{}", cells[0], cells[1], cells[2]);
    let at: Value =
        serde_json::from_str(&stdout(folder, &format!("predict o.json --pose {pose} --json")))
            .unwrap();
    for axis in 0..3 {
        assert!(at[0]["compliance"][axis][axis]["value"].as_f64().unwrap() <= cells[6] * 1.000_001);
    }

    let deflected = "map o.json --points 2 --force 0,100,0 --over joint_1,joint_3 --json";
    let deflected: Value = serde_json::from_str(&stdout(folder, deflected)).unwrap();
    let frequencies = "map o.json --points 2 --show frequency --json --out f.svg";
    let frequencies: Value = serde_json::from_str(&stdout(folder, frequencies)).unwrap();
    for (map, column) in [(&deflected, 0), (&frequencies, 1)] {
        for cell in map.as_array().unwrap() {
            let pose: Vec<String> =
                cell["pose"].as_array().unwrap().iter().map(ToString::to_string).collect();
            let at = stdout(
                folder,
                &format!("predict o.json --pose {} --force 0,100,0 --json", pose.join(",")),
            );
            let at: Value = serde_json::from_str(&at).unwrap();
            let expected = if column == 0 {
                let moved = at[0]["deflection"]["translation"].as_array().unwrap().iter();
                moved.map(|own| own["value"].as_f64().unwrap().powi(2)).sum::<f64>().sqrt()
            } else {
                at[0]["modes"][0]["frequency_hz"]["value"].as_f64().unwrap()
            };
            let own = cell["value"]["value"].as_f64().unwrap();
            assert!((own / expected - 1.0).abs() < 1e-6, "{cell} {expected}");
        }
    }
}

#[test]
fn wrong_arguments_are_refused_with_their_mend() {
    let folder = found();
    let folder = folder.path();
    refuses_bad_results(folder, "map FOUND");
    fs::copy(folder.join("o.json"), folder.join("o.csv")).unwrap();
    for (arguments, expected) in [
        ("map o.json --over joint_2", "--over has 1 joint: give two"),
        (
            "map o.json --over joint_2,elbow",
            "--over elbow: no driven joint has this name: there are joint_1, joint_2, joint_3",
        ),
        ("map o.json --over joint_2,joint_2", "--over names joint_2 twice"),
        ("map o.json --pose 1,2", "--pose has 2 angles"),
        ("map o.json --points 1", "--points"),
        ("map o.json --force 0,0,0", "--force is 0: moves nothing"),
        ("map o.json --force 1,0", "--force has 2 numbers: give three"),
        ("map o.json --force 1,0,0 --show frequency", "cannot be used with"),
        ("map o.json --positions x,q", "--positions"),
        ("map o.json --positions x", "--positions names 1 of x, y, z: give two"),
        ("map o.json --positions x,x", "--positions names an axis twice: name two different"),
        ("map o.json --force 1e12,0,0", "--force is 1000000000000: must lie between -1000000 and"),
        ("map o.json --out m.csv --out m.csv", "m.csv: is another result, and would be lost"),
        ("map o.csv --out o.csv", "o.csv: is read by this command, and would be lost"),
        ("map o.json --out m.pdf", "m.pdf: is written as .csv or .svg"),
        ("map o.json --out gone/m.svg", "its folder is not there"),
    ] {
        let message = refused(folder, arguments);
        assert!(message.contains(expected), "{arguments}: {message}");
    }
    assert!(!folder.join("m.pdf").exists());
}
