//! `flexid fleet`: which robot is outside, the exit status, what a robot is, and what is left out.

use std::fs;
use std::path::Path;

use rand_distr::{Distribution as _, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;
use serde_json::{Value, json as value};

use crate::setup::{edit, flexid, folder, found, identified, json, refused, stdout};

/// Scatter of each parameter between robots.
const SPREAD: f64 = 0.02;

fn scale(parameter: &mut Value, factor: f64) {
    *parameter = value!(factor * parameter.as_f64().unwrap());
}

/// The result of a robot of the type: that of the scenario, each parameter off by a draw.
fn robot(folder: &Path, number: u64) -> Value {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1000 + number);
    let normal = Normal::new(0.0, SPREAD).unwrap();
    let mut found = json(folder, "o.json");
    found["origin"]["logs"][0]["sha256"] = value!(format!("{number:064x}"));
    found["origin"]["date"] = value!("2026-03-01T06:00:00Z");
    for joint in found["joints"].as_array_mut().unwrap() {
        for key in ["stiffness", "damping"] {
            let (values, std) = (key, format!("{key}_std"));
            for dof in 0..6 {
                let factor = normal.sample(&mut random).exp();
                scale(&mut joint[values][dof], factor);
                if joint[&std][dof].is_number() {
                    scale(&mut joint[&std][dof], factor);
                }
            }
        }
    }
    found
}

fn write(folder: &Path, name: &str, found: &Value) {
    let file = folder.join(name);
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(file, found.to_string()).unwrap();
}

/// Robots R1 and so on, each a file of the folder `all`. One is off by a factor in one stiffness.
fn robots(folder: &Path, number: u64, off: Option<(u64, f64)>) {
    for own in 1..=number {
        let mut found = robot(folder, own);
        if let Some((_, factor)) = off.filter(|(robot, _)| *robot == own) {
            scale(&mut found["joints"][1]["stiffness"][4], factor);
        }
        write(folder, &format!("all/R{own}.json"), &found);
    }
}

/// Exit status, and what is printed.
fn fleet(folder: &Path, arguments: &str) -> (Option<i32>, String) {
    let output = flexid(folder, &format!("fleet {arguments}"));
    (output.status.code(), String::from_utf8(output.stdout).unwrap())
}

fn parameter<'a>(told: &'a Value, joint: &str, dof: u64, quantity: &str) -> &'a Value {
    let mut all = told["parameters"].as_array().unwrap().iter();
    let is_own = |own: &&Value| {
        (&own["joint"], &own["dof"], &own["quantity"])
            == (&value!(joint), &value!(dof), &value!(quantity))
    };
    all.find(is_own).unwrap()
}

#[test]
fn the_robot_outside_is_named_and_the_exit_status_tells_of_it() {
    let folder = found();
    let folder = folder.path();
    robots(folder, 30, None);
    let (status, text) = fleet(folder, "all");
    let expected = "alike: none of 30 robots is outside in any of 36 parameters\n";
    assert!(status == Some(0) && text.starts_with(expected), "{text}");
    assert!(!text.contains("note:") && text.matches("──\n").count() == 1, "{text}");

    robots(folder, 30, Some((7, 0.8)));
    let (status, text) = fleet(folder, "all");
    let mut lines = text.lines();
    let first = lines.next().unwrap();
    assert!(
        status == Some(1)
            && first.starts_with("outside: R7: joint_2 ry stiffness ")
            && first.ends_with(") below the other 29, of 30 robots"),
        "{text}"
    );
    assert_eq!(
        lines
            .filter(|line| line.starts_with(" R7 ") && line.contains("joint_2 ry stiffness"))
            .count(),
        1
    );

    let (status, text) = fleet(folder, "all --json");
    let told: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((status, &told["outside"], &told["level"]), (Some(1), &value!(true), &value!(0.05)));
    let label = value!({"name": "R1", "file": "all/R1.json", "date": "2026-03-01T06:00:00Z"});
    assert_eq!(told["robots"][0], label);
    let number =
        told["robots"].as_array().unwrap().iter().position(|own| own["name"] == "R7").unwrap();
    let own = parameter(&told, "joint_2", 4, "stiffness");
    let outside: Vec<&Value> =
        own["members"].as_array().unwrap().iter().filter(|own| own["is_outside"] == true).collect();
    let [member] = outside.as_slice() else { panic!("{own}") };
    let judged = &member["judged"];
    assert_eq!((&member["robot"], &judged["others"]), (&value!(number), &value!(29)));
    assert!(
        judged["chance"].as_f64().unwrap() < 0.05 && judged["deviations"].as_f64().unwrap() < -5.0
    );
    // The draw of this robot is in its ratio.
    let truth = json(folder, "all/R7.json")["joints"][1]["stiffness"][4].as_f64().unwrap()
        / json(folder, "o.json")["joints"][1]["stiffness"][4].as_f64().unwrap();
    let [low, high] = [0, 1].map(|end| judged["ratio"]["interval"][end].as_f64().unwrap());
    assert!((low..high).contains(&truth), "{judged}, {truth}");
    assert_eq!(own["population"]["robots"], 29);
    let all = told["parameters"].as_array().unwrap();
    let held = all.iter().filter(|own| {
        let [low, high] =
            [0, 1].map(|end| own["population"]["spread_interval"][end].as_f64().unwrap());
        (low..high).contains(&SPREAD)
    });
    assert!(held.count() >= 31, "{text}");

    // With this level, it is no robot of 1000 fleets.
    assert_eq!(fleet(folder, "all --level 1e-12").0, Some(0));
}

#[test]
fn a_folder_is_a_robot_and_one_alone_stands_for_what_is_in_it() {
    let folder = found();
    let folder = folder.path();
    for own in 1..=5 {
        for (name, date) in [("a", "2026-03-09"), ("b", "2026-03-02")] {
            let mut found = robot(folder, 10 * own + u64::from(name == "b"));
            found["origin"]["date"] = value!(format!("{date}T06:00:00Z"));
            write(folder, &format!("plant/S{own}/{name}.json"), &found);
        }
    }
    write(folder, "plant/S6.json", &robot(folder, 60));
    let names = |text: &str| -> Vec<(String, String)> {
        let told: Value = serde_json::from_str(text).unwrap();
        let of = |own: &Value, key: &str| own[key].as_str().unwrap().to_owned();
        told["robots"]
            .as_array()
            .unwrap()
            .iter()
            .map(|own| (of(own, "name"), of(own, "file")))
            .collect()
    };
    let expected = |file: &dyn Fn(u64) -> String| -> Vec<(String, String)> {
        (1..=6).map(|own| (format!("S{own}"), file(own))).collect()
    };
    let of_plant = |own| match own {
        6 => "plant/S6.json".to_owned(),
        own => format!("plant/S{own}/a.json"),
    };
    let text = stdout(folder, "fleet plant --json");
    assert_eq!(names(&text), expected(&of_plant));
    let paths = "plant/S1 plant/S2/ plant/S3 plant/S4 plant/S5 plant/S6.json";
    let again = stdout(folder, &format!("fleet {paths} --json"));
    assert_eq!(names(&again), names(&text));
    assert!(text.contains("the newest result counts of 5 robots with several"), "{text}");

    // Files of one name have different robots.
    let files: Vec<String> = (1..=4).map(|own| format!("plant/S{own}/a.json")).collect();
    let text = stdout(folder, &format!("fleet {} --json", files.join(" ")));
    assert_eq!(
        names(&text),
        files.iter().map(|own| (own.clone(), own.clone())).collect::<Vec<_>>()
    );
}

#[test]
fn what_a_result_does_not_determine_is_no_part_of_the_population() {
    let folder = found();
    let folder = folder.path();
    robots(folder, 5, None);
    let mean = |told: &Value| {
        parameter(told, "joint_1", 0, "stiffness")["population"]["mean"]["value"].clone()
    };
    let before: Value = serde_json::from_str(&stdout(folder, "fleet all --json")).unwrap();
    for (own, verdict) in [(1, "not_observable"), (2, "fixed")] {
        let mut found = robot(folder, own);
        found["joints"][0]["stiffness"][0] = value!(1e3);
        found["joints"][0]["stiffness_verdict"][0] = value!(verdict);
        write(folder, &format!("all/R{own}.json"), &found);
        let (status, text) = fleet(folder, "all --json");
        let told: Value = serde_json::from_str(&text).unwrap();
        let members = parameter(&told, "joint_1", 0, "stiffness")["members"].as_array().unwrap();
        let robots: Vec<u64> = members.iter().map(|own| own["robot"].as_u64().unwrap()).collect();
        assert_eq!((status, robots), (Some(0), (own..5).collect()), "{text}");
        match own {
            1 => assert!(
                (mean(&told).as_f64().unwrap() / mean(&before).as_f64().unwrap() - 1.0).abs()
                    < 0.03
            ),
            _ => assert_eq!(mean(&told), Value::Null),
        }
    }
    let (_, text) = fleet(folder, "all");
    let line = text.lines().find(|line| line.starts_with(" joint_1 tx stiffness")).unwrap();
    assert_eq!(
        line.split_whitespace().collect::<Vec<_>>(),
        ["joint_1", "tx", "stiffness", "3", "needs", "4"]
    );
    assert!(
        text.starts_with("alike: none of 5 robots is outside in any of 35 parameters\n"),
        "{text}"
    );
}

#[test]
fn other_types_and_too_few_robots_are_refused() {
    let folder = found();
    let folder = folder.path();
    robots(folder, 4, None);
    write(folder, "all/R5/copy.json", &robot(folder, 1));
    fs::write(folder.join("all/cut.json"), "{\"joints\": [").unwrap();
    let (status, text) = fleet(folder, "all");
    assert!(status == Some(0) && text.contains(" none of 4 robots "), "{text}");
    for note in [
        "left out: all/cut.json: is cut off",
        "left out: all/R5/copy.json: is of a log of all/R1.json",
        "left out: all/R5: has no result",
    ] {
        assert!(text.contains(note), "{note:?} is not in\n{text}");
    }
    let message = refused(folder, "fleet all/R1.json all/R2.json all/R3.json all/R5");
    assert!(
        message
            .contains("all/R1.json: 3 robots can be compared, and a fleet needs 4: name a result"),
        "{message}"
    );
    let message = refused(folder, "fleet all/R1.json all/cut.json");
    assert!(message.contains("all/cut.json: is cut off"), "{message}");
    assert!(refused(folder, "fleet all --level 0").contains("--level is 0: must be above 0"));

    let mut other = robot(folder, 9);
    scale(&mut other["robot"]["model"]["joint"][1]["mass_kg"], 1.1);
    write(folder, "all/R6.json", &other);
    let (_, text) = fleet(folder, "all");
    assert!(
        text.contains("note: all/R6.json: the model has another joint_2 mass_kg than the first"),
        "{text}"
    );
    scale(&mut other["robot"]["model"]["joint"][1]["origin_xyz_m"][2], 1.1);
    write(folder, "all/R6.json", &other);
    let message = refused(folder, "fleet all");
    let expected = "all/R6.json: is of another type than all/R1.json: their models differ in joint_2 origin_xyz_m, joint_2 mass_kg: name results of robots of one type";
    assert!(message.contains(expected), "{message}");
    let mut other = robot(folder, 9);
    other["robot"]["model"]["joint"][2]["name"] = value!("wrist");
    other["joints"][2]["name"] = value!("wrist");
    write(folder, "all/R6.json", &other);
    let message = refused(folder, "fleet all");
    assert!(
        message.contains("all/R6.json: is of another type than all/R1.json: it has the joints ")
            && message.contains("wrist (revolute), that the joints joint_1"),
        "{message}"
    );
}

/// With typical accuracies a stiffness is known no better than the masses are, which are those of all robots.
#[test]
fn errors_of_the_model_cancel_between_robots() {
    let folder = folder();
    let folder = folder.path();
    edit(&folder.join("edge.toml"), "assume = \"perfect\"", "");
    identified(folder, "--plant mill3-plant.toml", || ());
    robots(folder, 30, Some((7, 0.8)));
    let (status, text) = fleet(folder, "all --json");
    let told: Value = serde_json::from_str(&text).unwrap();
    assert!(
        status == Some(1)
            && told["verdict"].as_str().unwrap().starts_with("outside: R7: joint_2 ry stiffness "),
        "{}",
        told["verdict"]
    );
    let own = parameter(&told, "joint_2", 4, "stiffness");
    let found = json(folder, "o.json");
    let [std, value] =
        ["stiffness_std", "stiffness"].map(|key| found["joints"][1][key][4].as_f64().unwrap());
    let among = own["members"][0]["relative_std"].as_f64().unwrap();
    println!("alone {:.4}, among robots {among:.4}: {}", std / value, told["verdict"]);
    assert!(among < 0.5 * std / value, "{among} {std} {value}");
}
