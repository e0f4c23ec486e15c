//! `flexid lobes`: table, files, and arguments that are none.

use std::fs;

use serde_json::Value;

use crate::setup::{found, refused, refuses_bad_results, stdout};

const CUT: &str = "--teeth 4 --kt 700 --feed 1,0,0 --rpm 200,3000";

#[test]
fn the_table_the_files_and_json_hold_the_same_limits() {
    let folder = found();
    let folder = folder.path();
    let files = "--out l.csv --out l.svg --points 57";
    let slot = format!("lobes o.json {CUT} --milling up --immersion 1 {files}");
    let text = stdout(folder, &slot);
    assert!(text.starts_with("stable at these speeds: depths below "), "{text}");
    assert!(
        text.contains("\nstable at any speed from 30 to 3000 rpm: depths below ")
            && text.contains(" depth, mm (95 %) "),
        "{text}"
    );

    let json: Value = serde_json::from_str(&stdout(folder, &format!("{slot} --json"))).unwrap();
    let speeds = json["speeds"].as_array().unwrap();
    assert_eq!(
        (speeds.len(), speeds[0]["rpm"].as_f64(), speeds[56]["rpm"].as_f64()),
        (57, Some(200.0), Some(3000.0))
    );
    let least = json["least_depth_m"]["value"].as_f64().unwrap();
    let csv = fs::read_to_string(folder.join("l.csv")).unwrap();
    assert!(csv.starts_with("rpm,depth_mm,low,high,chatter_hz,"), "{csv}");
    for (line, speed) in csv.lines().skip(1).zip(speeds) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let depth = &speed["limit"]["depth_m"];
        let value = depth["value"].as_f64().unwrap();
        assert!((cells[1] / 1e3 / value - 1.0).abs() < 1e-8 && value > 0.999 * least, "{line}");
        assert!(cells[2] < cells[1] && cells[1] < cells[3], "{line}");
        assert!((2.0..=200.0).contains(&cells[4]), "{line}");
    }
    assert_eq!(csv.lines().count(), 58);
    let svg = fs::read_to_string(folder.join("l.svg")).unwrap();
    assert!(
        svg.starts_with("<svg")
            && svg.trim_end().ends_with("</svg>")
            && svg.contains("spindle speed, rpm")
    );

    // A slot by its angles is the same.
    let angles = stdout(folder, &format!("lobes o.json {CUT} --angles 0,180 --points 57"));
    assert_eq!(angles, text);
    // A quarter of the width, milled up, is stable at larger depths; milled down it need not be.
    let quarter = format!("lobes o.json {CUT} --milling up --immersion 0.25 --json");
    let quarter: Value = serde_json::from_str(&stdout(folder, &quarter)).unwrap();
    assert!(quarter["least_depth_m"]["value"].as_f64().unwrap() > 1.3 * least, "{quarter}");
}

/// Four teeth pass at 2 and 200 Hz, the edges of the band, at 30 and 3000 turns a minute.
#[test]
fn nothing_is_stated_of_teeth_that_pass_outside_of_the_band() {
    let folder = found();
    let folder = folder.path();
    let at = |rpm: &str| {
        let cut = "--teeth 4 --kt 700 --feed 1,0,0 --milling up --immersion 1 --points 40";
        let text =
            stdout(folder, &format!("lobes o.json {cut} --rpm {rpm} --out l.csv --out l.svg"));
        let json = stdout(folder, &format!("lobes o.json {cut} --rpm {rpm} --json"));
        let json: Value = serde_json::from_str(&json).unwrap();
        let [csv, svg] =
            ["l.csv", "l.svg"].map(|own| fs::read_to_string(folder.join(own)).unwrap());
        assert_eq!(json["stated_rpm"], serde_json::json!([30.0, 3000.0]));
        let speeds = json["speeds"].as_array().unwrap();
        for (line, speed) in csv.lines().skip(1).zip(speeds) {
            let (cells, rpm) =
                (line.split(',').collect::<Vec<_>>(), speed["rpm"].as_f64().unwrap());
            let is_beyond = !(30.0..=3000.0).contains(&rpm);
            assert_eq!(
                (cells[8], &speed["is_beyond"]),
                (["0", "1"][usize::from(is_beyond)], &Value::from(is_beyond))
            );
            assert!(!is_beyond || (speed["limit"].is_null() && cells[1].is_empty()), "{line}");
        }
        let beyond = speeds.iter().filter(|own| own["is_beyond"] == true).count();
        assert_eq!(
            (text.contains("no statement"), svg.contains("no statement")),
            (beyond > 0, beyond > 0)
        );
        (text, beyond)
    };
    let (fast, beyond) = at("1500,18000");
    assert!((10..40).contains(&beyond), "{beyond}");
    assert!(fast.starts_with("stable from 1500 to 2") && fast.contains(" no statement "), "{fast}");
    let says = "\nno statement above 3000 rpm: there the teeth pass above 200.0 Hz, where the band that was fitted ends\n for 18000 rpm fit cuts up to 1200 Hz";
    assert!(fast.contains(says), "{fast}");
    let (slow, beyond) = at("20,600");
    assert!(beyond > 0 && slow.contains("\nno statement below 30 rpm: "), "{slow}");
    let (none, beyond) = at("3001,24000");
    assert!(
        beyond == 40 && none.starts_with("stable at any speed from 30 to 3000 rpm: "),
        "{none}"
    );
    let (all, beyond) = at("30,3000");
    assert!(beyond == 0 && all.starts_with("stable at these speeds: "), "{all}");
}

#[test]
fn wrong_arguments_are_refused_with_their_mend() {
    let folder = found();
    let folder = folder.path();
    refuses_bad_results(folder, &format!("lobes FOUND {CUT} --angles 0,90"));
    fs::copy(folder.join("o.json"), folder.join("o.svg")).unwrap();
    let cut = |change: &str| format!("lobes o.json --teeth 4 --kt 700 {change}");
    for (arguments, expected) in [
        (format!("lobes o.json {CUT}"), "--milling <WAY>"),
        (format!("lobes o.json {CUT} --milling up"), "--immersion <RATIO>"),
        (
            format!("lobes o.json {CUT} --milling up --immersion 1.2"),
            "--immersion is 1.2: must be above 0, and at most 1",
        ),
        (
            format!("lobes o.json {CUT} --angles 90,20"),
            "--angles are 90,20: give two between 0 and 180 deg",
        ),
        (format!("lobes o.json {CUT} --angles 0,90 --depth 0"), "--depth is 0: must be above 0"),
        (
            format!("lobes o.json {CUT} --angles 0,90 --kr=-1"),
            "--kr is -1: must lie between 0.01 and 10",
        ),
        (
            format!("lobes o.json {CUT} --angles 0,90 --pose 0"),
            "--pose has 1 angles: this robot has 3 driven joints",
        ),
        (format!("lobes o.json {CUT} --angles 0,90 --axis 1,0,0"), "--feed is along --axis"),
        (
            format!("lobes o.svg {CUT} --angles 0,90 --out o.svg"),
            "o.svg: is read by this command, and would be lost",
        ),
        (
            format!("lobes o.json {CUT} --angles 0,90 --out l.png"),
            "l.png: is written as .csv or .svg",
        ),
        (format!("lobes o.json {CUT} --angles 0,90 --out gone/l.svg"), "its folder is not there"),
        (cut("--angles 0,90 --feed 1,0 --rpm 1,2"), "--feed has 2 numbers: give three"),
        (
            cut("--angles 0,90 --feed 1,0,0 --rpm 900,600"),
            "--rpm is 900,600: give two speeds above 0, the lower first",
        ),
        (
            "lobes o.json --teeth 4 --kt -3 --angles 0,90 --feed 1,0,0 --rpm 1,2".into(),
            "--kt is -3: must lie between 1 and 100000 N/mm²",
        ),
        (format!("lobes o.json {CUT} --angles 0,90 --kr 0"), "--kr is 0: must lie between"),
        (
            format!("lobes o.json {CUT} --angles 0,90 --kr 1e20"),
            "--kr is 100000000000000000000: must",
        ),
        (format!("lobes o.json {CUT} --angles 0,90").replace("700", "0"), "--kt is 0: must lie"),
        (format!("lobes o.json {CUT} --angles 0,90").replace("700", "1e20"), "and 100000 N/mm²"),
        (
            format!("lobes o.json {CUT} --angles 0,90").replace(",3000", ",1e9"),
            "--rpm is 1000000000: must lie between 200 and 1000000 turns a minute",
        ),
        (format!("lobes o.json {CUT} --angles 0,90").replace("teeth 4", "teeth 0"), "--teeth"),
    ] {
        let message = refused(folder, &arguments);
        assert!(message.contains(expected), "{arguments}: {message}");
    }
    assert!(!folder.join("l.png").exists());
}
