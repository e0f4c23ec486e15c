//! The page of a small result: what stands in it, in which order, how large it is, and what is missing without the entries of an
//! older file.

mod result;
mod window;

use std::path::Path;

use flexid_pipeline::robot::FoundRobot;
use flexid_report::document::Document;
use flexid_report::render;
use serde_json::{Value, json};

use flexid_report::evidence::POINTS;
use result::{POSES, evidence, result, robot};

fn page(result: &Value) -> String {
    let document = Document::parse(Path::new("found.json"), &result.to_string()).unwrap();
    render(&document, "found.json", Some("00ff"))
}

/// The text of each chart.
fn charts(page: &str) -> Vec<&str> {
    let starts = page.match_indices("<svg ").map(|(start, _)| start);
    starts.map(|start| &page[start..start + page[start..].find("</svg>").unwrap() + 6]).collect()
}

/// Number of dots.
fn dots(chart: &str) -> usize {
    chart.matches("<circle").count()
}

/// Number of lines of this colour.
fn lines(chart: &str, colour: &str) -> usize {
    let chart = roxmltree::Document::parse(chart).unwrap();
    let is_line = |node: &roxmltree::Node<'_, '_>| {
        node.tag_name().name() == "polyline" && node.attribute("stroke") == Some(colour)
    };
    chart.descendants().filter(is_line).count()
}

const ORANGE: &str = "#D57C00";
const BLUE: &str = "#0072B2";
const RED: &str = "#C43C28";
const GREY: &str = "#7F7F7F";

#[test]
fn sections_stand_in_order_and_every_curve_is_drawn() {
    let page = page(&result());
    let sections = [
        "<header>",
        "answer",
        "verdict",
        "spectra",
        "parameters",
        "modes",
        "residuals",
        "imperfections",
        "receptance",
        "correlations",
        "held-out",
        "course",
        "quality",
        "origin",
    ];
    let places: Vec<usize> = sections
        .iter()
        .map(|own| {
            let tag =
                if own.starts_with('<') { (*own).to_owned() } else { format!("id=\"{own}\"") };
            page.find(&tag).unwrap_or_else(|| panic!("no {own}"))
        })
        .collect();
    assert!(places.is_sorted(), "{places:?}");

    let charts = charts(&page);
    // Spectra and residuals along three axes of each record, a receptance of each pose, parameters, correlations, course.
    let spectra = 3 * POSES;
    assert_eq!(charts.len(), 2 * spectra + POSES + 3);
    for chart in &charts[..spectra] {
        assert_eq!([ORANGE, GREY].map(|colour| lines(chart, colour)), [1, 1]);
        assert_eq!(dots(chart), POINTS);
    }
    for chart in &charts[spectra + 1..2 * spectra + 1] {
        assert_eq!([BLUE, RED, GREY].map(|colour| lines(chart, colour)), [1, 1, 1]);
    }
    for chart in &charts[2 * spectra + 1..2 * spectra + 1 + POSES] {
        // Magnitude and phase of nine entries and of three responses to the force. Of the measured ones, three entries are left out. A
        // phase that goes beyond its range is broken.
        assert_eq!(lines(chart, ORANGE), 24);
        assert_eq!(lines(chart, BLUE), 12 + 6 + 3);
        assert!(lines(chart, GREY) >= 24, "{}", lines(chart, GREY));
        let bands = roxmltree::Document::parse(chart).unwrap();
        let bands = bands.descendants().filter(|node| node.tag_name().name() == "polygon").count();
        assert!(bands >= 18, "{bands}");
    }
    for text in [
        "0.381\u{a0}N/µm</strong> <span>±2.0\u{a0}%</span></dd><dd class=\"along\">along (0.71, 0.02, \u{2212}0.70)</dd>",
        "<dt>Tool, stiffest direction</dt><dd class=\"open\">not determined</dd>",
        "6.33\u{a0}Hz</strong> <span>±2.0\u{a0}%</span>",
        "1.10\u{a0}%</strong> <span>no interval</span>",
        "<dt>Drive of joint_1</dt><dd><strong>4.00 MNm/rad</strong>",
        "At the pose of record 3, the newest",
        "The fit explains the records, with reservations.",
        "Reservations: 2 frames are &lt;odd&gt; &amp; lost; look at [bus]; model: every moving link weighs 2 kg.</p>",
        "24 of 36 parameters identified, with a standard deviation of up to 5 %; 9 weak; 3 not observable",
        "Measure the TCP.",
        "2 frames are &lt;odd&gt; &amp; lost",
        "model: every moving link weighs 2 kg: are these placeholders?",
        "Explained: TCP z explains 75 %; off as well: TCP x; as likely: TCP y.",
        "With hysteresis these are the values at 20.0 Hz.",
        "drives: growth with load 0.039 %/kNm (-0.017 to 0.094 %/kNm)",
        "<summary>2 errors as expected</summary>",
        "TCP z 4.0 mm (3.0 to 5.0 mm)</td><td class=\"left\">tcp_m 1.00 mm</td><td class=\"left\">differs from zero</td>",
        "The intervals are robust: no narrower than the numbers scatter between bands of the records. That makes them 1.4 times",
        "look at <code>[bus]</code>: two axes are swapped",
        "robot mill3, 3 joints, 3 records, 2.00 to 200\u{a0}Hz, tool centre point 'tcp'",
        "Stiffness at the tool along the axes of the tool centre point, N/µm, one axis loaded at a time: x ",
        "accelerometer resonance 1.592 kHz (1.576 to 1.608 kHz)",
        "delay 300 µs (290 to 310 µs)",
        "the records show it",
        "<td class=\"left identified\">identified</td>",
        "<code>flexid plan</code> proposes them.",
        "with a FRAC (frequency response assurance criterion, 100\u{a0}% for the same shape) of at least 99.8",
        "SSP, the surface similarity parameter, is 0 where",
        "Of the nine entries, 67\u{a0}% are certain enough",
        "\u{2212}93\u{a0}%",
        "joint_1 tx stiffness 0.700",
        "flexid identify --config edge.toml cut.log",
        "00ff",
        "2.00 to 4.00",
    ] {
        assert!(page.contains(text), "{text:?} is not in the page");
    }
}

/// Records 1 and 2 are on one path, and record 3 is on another one.
#[test]
fn paths_are_drawn_on_the_way_of_the_tool() {
    let mut result = result();
    assert!(!page(&result).contains("Along the path"));
    let part = |part: usize| json!([0.02 * part as f64, -0.4, 0.9]);
    for (record, first) in [0, 8, 40].into_iter().enumerate() {
        let parts: Vec<Value> = (first..first + 8).map(part).collect();
        result["records"][record]["path"] = json!(parts);
    }
    let page = page(&result);
    for text in [
        "Path 1: records 1 to 2, 16 parts, ",
        "from (0.000, −0.400, 0.900) to (0.300, −0.400, 0.900) rad (m)",
        "Path 2: record 3, 8 parts, ",
        "Record 2, the middle one of its 8 parts, at ",
    ] {
        assert!(page.contains(text), "{text:?}");
    }
    let is_of_path = |chart: &&&str| chart.contains("way of the tool / mm");
    let all = charts(&page);
    let of_path: Vec<&&str> = all.iter().filter(is_of_path).collect();
    assert_eq!(of_path.len(), 2);
    // Modes and stiffness are joined over all places; a receptance is one line in each of three panels.
    for chart in of_path {
        assert!(lines(chart, BLUE) >= 1 + 1 + 3, "{}", lines(chart, BLUE));
        assert_eq!(lines(chart, ORANGE), 1 + 3);
    }
}

/// Ten accuracies are neither contradicted nor as expected where the fit allows no interval.
#[test]
fn an_error_without_an_interval_is_not_known() {
    let mut result = result();
    for own in result["confidence"]["nuisances"].as_array_mut().unwrap() {
        own["interval"] = json!(null);
        own["value"] = json!(1e-2);
        own["entry"] = json!("tcp_m");
    }
    let page = page(&result);
    let unknown = "<summary>4 errors not known: the fit allows no interval</summary>";
    assert!(page.contains(unknown) && !page.contains(" as expected</summary>"));
    assert!(!page.contains("No accuracy is contradicted"));
}

/// A fault of the readings comes before what is off, and what is as likely absent is not named.
#[test]
fn the_gravest_step_comes_first() {
    let page = page(&result());
    let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("no {text:?}"));
    let steps = place("What to do next");
    let axes = steps + page[steps..].find("Look at <code>[bus]</code>").unwrap();
    let tcp = steps + page[steps..].find("Measure the TCP.").unwrap();
    assert!(axes < tcp && tcp < place("flexid plan"));
    assert!(
        !page.to_lowercase().contains("look at the ground") && !page.contains("ground tx explains")
    );
}

/// Friction has the loads of the cut beside it: the third joint bears the force at the distance of the tool.
#[test]
fn what_is_not_linear_is_compared_with_friction() {
    let mut result = result();
    assert!(!page(&result).contains("joints slip"));
    result["warning_kinds"] = json!([{ "objection": { "distortion": { "part": 0.3 } } }]);
    let tool = result["robot"]["model"]["tcp"]["xyz_m"].clone();
    let [x, z] = [0, 2].map(|axis| tool[axis].as_f64().unwrap());
    let load =
        format!("and joint_3 with up to {:.0} Nm; the drives of large robots", 120.0 * x.hypot(z));
    let page = page(&result);
    assert!(page.contains("joints slip: the largest force of these records was 120 N (root mean square), which loads joint_1"));
    assert!(page.contains(&load), "{load}");
}

/// Static tests show neither dampings nor modes, and another run brings none.
#[test]
fn a_page_of_static_tests_has_what_they_show() {
    let mut result = result();
    result["fit"]["records"] = json!(0);
    result["robot"]["poses"] = json!([]);
    for entry in ["records", "measured_receptance", "course", "data_quality"] {
        result.as_object_mut().unwrap().remove(entry);
    }
    let page = page(&result);
    for text in [
        "12 of 18 stiffnesses identified",
        "robot mill3, 3 joints, static tests alone, tool",
        "Add static tests: other poses",
    ] {
        assert!(page.contains(text), "{text:?} is not in the page");
    }
    for text in
        ["no entry", "id=\"modes\"", "id=\"receptance\"", "200\u{a0}Hz", " damping: ", ">damping<"]
    {
        assert!(!page.contains(text), "{text:?} is in the page");
    }
    assert_eq!(charts(&page).len(), 2);
    // A fit of cuts has them.
    assert!(self::page(&self::result()).contains(">damping<"));
}

/// `plan` refuses a result whose fit is not consistent.
#[test]
fn a_fit_that_is_not_settled_is_no_ground_for_a_plan() {
    for (acceptance, class) in [("unsettled", "caution"), ("model_suspect", "bad")] {
        let mut result = result();
        result["fit"]["acceptance"] = json!(acceptance);
        let page = page(&result);
        assert!(page.contains(&format!("<h1 class=\"{class}\">")), "{acceptance}");
        assert!(page.contains("without <code>--from</code>") && !page.contains("proposes them"));
        let maybe = "If this minimum is the right one, then the following is off.";
        assert_eq!(page.contains(maybe), acceptance == "unsettled");
        let errors = "the errors hold only if this minimum is the right one";
        assert_eq!(page.contains(errors), acceptance == "unsettled");
        assert!(!page.contains("But only if robot, sensors and ground are exactly"));
    }
    let first = "Check masses, TCP, sensor mounting, axes and units: what the best minimum leaves";
    for consistency in [9.0, 11.0] {
        let mut result = result();
        result["fit"]["acceptance"] = json!("unsettled");
        result["fit"]["consistency"] = json!(consistency);
        result["confidence"]["explanations"] = json!([]);
        result["warnings"] = json!([]);
        result["warning_kinds"] = json!([]);
        assert_eq!(page(&result).contains(first), consistency > 10.0);
    }
}

/// The explanation of the example, with another share of the misfit. A remedy stands beside an accuracy that the records contradict.
#[test]
fn explanations_of_little_may_be_effects() {
    for (acceptance, share, is_contradicted, expected) in [
        ("model_suspect", 0.28, true, true),
        ("model_suspect", 0.28, false, false),
        ("model_suspect", 0.9, true, false),
        ("model_suspect", 0.0, true, false),
        ("consistent", 0.28, true, false),
    ] {
        let mut result = result();
        result["fit"]["acceptance"] = json!(acceptance);
        let explanation = &mut result["confidence"]["explanations"][0];
        explanation["share"] = json!(share);
        explanation["remedy"] = if is_contradicted { json!("do it") } else { json!(null) };
        let caveat = "What follows explains in all 28\u{a0}% of the misfit";
        assert_eq!(
            page(&result).contains(caveat),
            expected,
            "{acceptance} {share} {is_contradicted}"
        );
    }
}

/// No script, nothing from elsewhere, small, and the same again.
#[test]
fn the_page_stands_alone() {
    let page = page(&result());
    for outside in ["http:", "https:", "//", "<script", "<link", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.contains("prefers-color-scheme: dark") && page.contains("@media print"));
    assert!(page.len() < 2 << 20, "{} bytes", page.len());
    assert_eq!(page, self::page(&result()));
}

/// The largest number of poses and records that a fit keeps.
#[test]
fn a_page_of_many_poses_is_small() {
    let mut result = result();
    let poses: Vec<Vec<f64>> = (0..16).map(|pose| vec![0.1 * f64::from(pose), -0.4, 0.9]).collect();
    let robot = FoundRobot { poses, ..robot() };
    let evidence = serde_json::to_value(evidence(&robot)).unwrap();
    result["robot"] = json!(robot);
    result.as_object_mut().unwrap().extend(evidence.as_object().unwrap().clone());
    let page = page(&result);
    assert!(page.contains("12 further poses not drawn"));
    assert!(page.len() < 2 << 20, "{} bytes", page.len());
}

#[test]
fn an_older_file_leaves_parts_out_and_says_so() {
    let mut older = result();
    let entries = [
        "answer",
        "confidence",
        "records",
        "measured_receptance",
        "course",
        "data_quality",
        "origin",
    ];
    for entry in entries {
        older.as_object_mut().unwrap().remove(entry);
    }
    let page = page(&older);
    for entry in entries {
        assert!(page.contains(&format!("no entry <code>{entry}</code>")), "{entry}");
    }
    let charts = charts(&page);
    assert_eq!(charts.len(), 1 + POSES);
    assert!(lines(charts[1], GREY) >= 18);
    assert_eq!([BLUE, ORANGE].map(|colour| lines(charts[1], colour)), [0, 0]);
}

#[test]
fn entries_that_do_not_go_together_are_refused() {
    type Change = fn(&mut Value);
    let changes: [(Change, &str); 5] = [
        (|own| drop(own.as_object_mut().unwrap().remove("robot")), "has no robot"),
        (
            |own| drop(own["records"][1]["spectra"]["noise"][2].as_array_mut().unwrap().pop()),
            "records[1].spectra has curves of different lengths",
        ),
        (
            |own| drop(own["confidence"]["joints"].as_array_mut().unwrap().pop()),
            "confidence.joints is of another robot",
        ),
        (
            |own| own["confidence"]["correlations"]["percent"] = json!([1, 2]),
            "confidence.correlations.percent does not go with its unknowns",
        ),
        (|own| own["course"] = json!("long"), "give a file as `flexid identify --json` writes it"),
    ];
    for (change, expected) in changes {
        let mut wrong = result();
        change(&mut wrong);
        let error = Document::parse(Path::new("wrong.json"), &wrong.to_string()).unwrap_err();
        let message = error.to_string();
        assert!(message.starts_with("wrong.json: ") && message.contains(expected), "{message}");
    }
}
