//! The page of a small result: what stands in it, in which order, how large it is, and what is missing without the entries of an
//! older file.

use std::path::Path;

use flexid_pipeline::model::Model;
use flexid_pipeline::robot::{FoundRobot, JointBounds};
use flexid_report::document::Document;
use flexid_report::evidence::{
    DataQuality, Evidence, MeasuredPoint, MeasuredReceptance, Octave, Origin, POINTS,
    RecordEvidence, RecordSpectra, Step,
};
use flexid_report::render;
use serde_json::{Value, json};

/// Poses of the result.
const POSES: usize = 3;

fn robot() -> FoundRobot {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario/mill3-model.toml");
    let model = Model::load(&file).unwrap();
    let size = 12 * model.joints.len();
    let mut covariance = vec![0.0; size * (size + 1) / 2];
    for index in 0..size {
        covariance[(index + 1) * (index + 2) / 2 - 1] = 1e-4;
    }
    FoundRobot {
        gravity_m_per_s2: [0.0; 3],
        band_hz: [2.0, 200.0],
        poses: (0..POSES).map(|pose| vec![0.3 * pose as f64, -0.4, 0.9]).collect(),
        bounds: vec![
            JointBounds { stiffness: [[1e5, 1e9]; 6], damping: [[1e2, 1e6]; 6] };
            model.joints.len()
        ],
        imperfections: Vec::new(),
        covariance,
        model,
    }
}

fn evidence(robot: &FoundRobot) -> Evidence {
    let hz: Vec<f64> = (0..POINTS).map(|i| 2.0 * 100_f64.powf(i as f64 / POINTS as f64)).collect();
    let curve = |size: f64| -> [Vec<f64>; 3] { std::array::from_fn(|_| vec![size; POINTS]) };
    let point = |frequency_hz: &f64| {
        let entry = Some([1e-7 / frequency_hz, -1e-8]);
        MeasuredPoint {
            frequency_hz: *frequency_hz,
            measured: [[entry, None, entry]; 3],
            modelled: [[entry; 3]; 3],
            direction: [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
            measured_along: [[1e-8, -1e-8]; 3],
            modelled_along: [[1e-8, -1e-8]; 3],
            coherence: [0.9; 3],
        }
    };
    let record = |(index, pose): (usize, &Vec<f64>)| RecordEvidence {
        number: index as u64 + 1,
        start_s: 5.0 * index as f64,
        seconds: 4.096,
        rate_hz: 2000.0,
        has_doubtful_rate: false,
        starts_at_rest: true,
        pose: pose.clone(),
        pose_number: index + 1,
        rms_force_n: 120.0,
        lines: 0,
        octaves: vec![
            Octave { band_hz: [2.0, 4.0], clear: 0.2 },
            Octave { band_hz: [4.0, 8.0], clear: 1.0 },
        ],
        spectra: RecordSpectra {
            frequency_hz: hz.clone(),
            force: curve(1.0),
            force_noise: curve(0.01),
            measured: curve(0.5),
            modelled: curve(0.5),
            residual: curve(0.004),
            noise: curve(0.002),
        },
    };
    let measured = |(index, pose): (usize, &Vec<f64>)| MeasuredReceptance {
        pose: pose.clone(),
        records: vec![index as u64 + 1],
        segments: 15,
        segment_s: 0.512,
        points: hz.iter().map(point).collect(),
    };
    let step =
        |step: u64| Step { step, starts: 1, records: 3, misfit: 1.0 + 1e3 / (1.0 + step as f64) };
    Evidence {
        records: robot.poses.iter().enumerate().map(record).collect(),
        measured_receptance: robot.poses.iter().enumerate().map(measured).collect(),
        course: (0..200).map(step).collect(),
        data_quality: DataQuality {
            frames: 1000,
            readings: 900,
            lost: 3,
            ..DataQuality::default()
        },
    }
}

fn result() -> Value {
    let robot = robot();
    let joints: Vec<Value> = robot
        .model
        .joints
        .iter()
        .map(|joint| {
            json!({
                "name": joint.name,
                "stiffness": [6e7, 6e7, 6e7, 4e6, 4e6, 4e6], "stiffness_std": [6e5, 6e5, 6e5, 4e4, 4e4, null],
                "stiffness_verdict":
                    ["identified", "identified", "identified", "identified", "weak", "not_observable"],
                "damping": [2e4, 2e4, 2e4, 2e3, 2e3, 2e3], "damping_std": [2e2, 2e2, 2e2, 2e1, 2e1, 2e1],
                "damping_verdict": ["identified", "identified", "identified", "identified", "weak", "weak"],
            })
        })
        .collect();
    let interval = |value: f64| json!([0.98 * value, 1.02 * value]);
    let intervals: Vec<Value> = (0..joints.len())
        .map(|_| {
            json!({
                "stiffness_interval": [interval(6e7), interval(6e7), interval(6e7), interval(4e6), interval(4e6), null],
                "damping_interval": ([2e4, 2e4, 2e4, 2e3, 2e3, 2e3].map(interval)),
            })
        })
        .collect();
    let mut result = json!({
        "schema": 1,
        "joints": joints,
        "fit": {
            "records": 3, "frames": 49152, "frames_lost": 3, "ssp": 0.001, "ssp_max": 0.02, "consistency": 1.0,
            "search_evaluations": 2000, "refine_iterations": 12, "starts": 1, "bridged": 0, "seconds": 1.2,
            "acceptance": "consistent", "found_by": "descent", "random_searches": 0, "branches": 1,
        },
        "warnings": ["2 frames are <odd> & lost", "look at `[bus]`: two axes are swapped"],
        "warning_kinds": [{ "misfit": 2 }, { "wrong_axes": {} }],
        "model_warnings": ["every moving link weighs 2 kg: are these placeholders?"],
        "confidence": {
            "joints": intervals,
            "nuisances": [
                {
                    "name": "accelerometer 1/omega^2", "entry": "accelerometer_resonance_hz", "unit": "s^2",
                    "value": 1e-8, "std": 1e-10, "interval": [9.8e-9, 1.02e-8], "verdict": "weak",
                },
                {
                    "name": "TCP z", "entry": "tcp_m", "accuracy": 1e-3, "unit": "m",
                    "value": 4e-3, "std": 5e-4, "interval": [3e-3, 5e-3], "verdict": "identified",
                },
                {
                    "name": "drives: growth with load", "entry": "drive_growth_per_knm", "unit": "1/Nm",
                    "value": 3.9e-7, "std": 2.8e-7, "interval": [-1.7e-7, 9.4e-7], "verdict": "identified",
                },
                // As older files state it.
                { "name": "delay", "unit": "s", "value": 3e-4, "std": 5e-6, "interval": [2.9e-4, 3.1e-4], "verdict": "identified" },
            ],
            "explanations": [{
                "text": "TCP z explains 75 %", "alike": "off as well: TCP x", "alternatives": "as likely: TCP y",
                "remedy": "measure the TCP", "other": 1,
            }, {
                "text": "ground tx explains 4 %", "remedy": "look at the ground", "deviation": { "value": 5e-13, "std": 5e-13 },
            }],
            "correlations": { "unknowns": ["joint_1 tx stiffness", "joint_2 tx stiffness"], "percent": [-93] },
            "weak_directions": [{
                "text": "joint_1 tx stiffness and joint_2 tx stiffness trade off in these poses (31 %)",
                "shares": [{ "name": "joint_1 tx stiffness", "weight": 0.7 }],
            }],
            "residuals": { "text": "noise explains them", "whiteness": 0.4 },
            "left_over": [],
            "held_out": [{ "pose": [0.0, -0.4, 0.9], "frac": [0.999, 0.998, 0.9999], "vaf": [0.99, 0.98, -0.1] }],
            "robust_widening": 1.42,
        },
        "robot": robot,
        "origin": Origin {
            version: "0.1.0".into(),
            command: "flexid identify --config edge.toml cut.log".into(),
            ..Origin::default()
        },
    });
    let evidence = serde_json::to_value(evidence(&robot)).unwrap();
    result.as_object_mut().unwrap().extend(evidence.as_object().unwrap().clone());
    result
}

fn page(result: &Value) -> String {
    let document = Document::parse(Path::new("found.json"), &result.to_string()).unwrap();
    render(&document, "found.json", Some("00ff"))
}

/// The text of each chart.
fn charts(page: &str) -> Vec<&str> {
    let starts = page.match_indices("<svg ").map(|(start, _)| start);
    starts.map(|start| &page[start..start + page[start..].find("</svg>").unwrap() + 6]).collect()
}

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
        "verdict",
        "receptance",
        "residuals",
        "modes",
        "parameters",
        "imperfections",
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
    // One receptance a pose, one residual a record, parameters, correlations, course.
    assert_eq!(charts.len(), 2 * POSES + 3);
    for chart in &charts[..POSES] {
        // Magnitude and phase of nine entries and of three responses to the force. Of the measured ones, three entries are left out. A
        // phase that goes beyond its range is broken.
        assert!(lines(chart, ORANGE) >= 24, "{}", lines(chart, ORANGE));
        assert_eq!(lines(chart, BLUE), 12 + 6 + 3);
        assert_eq!(lines(chart, GREY), 24);
        let bands = roxmltree::Document::parse(chart).unwrap();
        let bands = bands.descendants().filter(|node| node.tag_name().name() == "polygon").count();
        assert!(bands >= 18, "{bands}");
    }
    for chart in &charts[POSES..2 * POSES] {
        assert_eq!([BLUE, RED, GREY].map(|colour| lines(chart, colour)), [3, 3, 3]);
    }
    for text in [
        "The fit explains the records, with reservations. 24 of 36 parameters are identified",
        "Measure the TCP.",
        "2 frames are &lt;odd&gt; &amp; lost",
        "model: every moving link weighs 2 kg: are these placeholders?",
        "Explained: TCP z explains 75 %; off as well: TCP x; as likely: TCP y.",
        "drives: growth with load 0.039 %/kNm (-0.017 to 0.094 %/kNm)",
        "Compatible with zero, or a factor with 1 (1): drives",
        "TCP z 4.0 mm (3.0 to 5.0 mm)</td><td class=\"left\">tcp_m 1.00 mm</td><td class=\"left\">differs from zero</td>",
        "The intervals are robust: no narrower than the numbers scatter between bands of the records. That makes them 1.4 times",
        "look at <code>[bus]</code>: two axes are swapped",
        "robot mill3, 3 joints, 3 records, 2.00 to 200\u{a0}Hz, tool centre point 'tcp'",
        "Stiffness at the tool, N/m, one axis loaded at a time: x ",
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

/// What is wrong with the readings comes before what is off, and what is as likely absent is not named.
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
        "12 of 18 stiffnesses are identified",
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

/// As many poses and records as a fit keeps.
#[test]
fn a_page_of_many_poses_is_small() {
    let mut result = result();
    let poses: Vec<Vec<f64>> = (0..16).map(|pose| vec![0.1 * f64::from(pose), -0.4, 0.9]).collect();
    let robot = FoundRobot { poses, ..robot() };
    let evidence = serde_json::to_value(evidence(&robot)).unwrap();
    result["robot"] = json!(robot);
    result.as_object_mut().unwrap().extend(evidence.as_object().unwrap().clone());
    let page = page(&result);
    assert!(page.contains("10 further poses not drawn"));
    assert!(page.len() < 2 << 20, "{} bytes", page.len());
}

#[test]
fn an_older_file_leaves_parts_out_and_says_so() {
    let mut older = result();
    let entries =
        ["confidence", "records", "measured_receptance", "course", "data_quality", "origin"];
    for entry in entries {
        older.as_object_mut().unwrap().remove(entry);
    }
    let page = page(&older);
    for entry in entries {
        assert!(page.contains(&format!("no entry <code>{entry}</code>")), "{entry}");
    }
    let charts = charts(&page);
    assert_eq!(charts.len(), POSES + 1);
    assert!(lines(charts[0], ORANGE) >= 18);
    assert_eq!(lines(charts[0], BLUE), 0);
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
