//! `flexid history`: what has changed over many results, the exit status, the page, and what is left out.

use std::fs;
use std::path::Path;

use serde_json::{Value, json as value};

use crate::setup::{edit, flexid, folder, found, json, refused, stderr, stdout};

/// Results of so many days in the folder `all`: a stiffness is 15 % less from the fifth on.
fn results(folder: &Path, days: usize) {
    fs::create_dir_all(folder.join("all")).unwrap();
    for day in 1..=days {
        let mut found = json(folder, "o.json");
        found["origin"]["logs"][0]["sha256"] = value!(format!("{day:064x}"));
        found["origin"]["date"] = value!(format!("2026-03-{day:02}T06:00:00Z"));
        if day >= 5 {
            let own = &mut found["joints"][1]["stiffness"][4];
            *own = value!(0.85 * own.as_f64().unwrap());
        }
        // The names are in another order than the dates.
        fs::write(folder.join(format!("all/{}.json", 99 - day)), found.to_string()).unwrap();
    }
}

/// Exit status, and what is printed.
fn history(folder: &Path, arguments: &str) -> (Option<i32>, String) {
    let output = flexid(folder, &format!("history {arguments}"));
    (output.status.code(), String::from_utf8(output.stdout).unwrap())
}

#[test]
fn a_change_is_named_with_its_day_and_the_exit_status_tells_of_it() {
    let folder = found();
    let folder = folder.path();
    results(folder, 4);
    let (status, text) = history(folder, "all");
    let expected = "unchanged: none of 36 parameters in 4 findings, 2026-03-01 to 2026-03-04\n";
    assert!(status == Some(0) && text.starts_with(expected), "{text}");

    results(folder, 5);
    assert_eq!(history(folder, "all --new").0, Some(1));
    results(folder, 8);
    let (status, text) = history(folder, "all");
    let expected = "changed: joint_2 ry stiffness fell by 15.0 % (";
    let ending = " since 2026-03-05, in 8 findings, 2026-03-01 to 2026-03-08\n";
    assert!(status == Some(1) && text.starts_with(expected) && text.contains(ending), "{text}");
    assert_eq!(text.lines().filter(|line| line.ends_with(" 2026-03-05 ")).count(), 1);
    // It came to light before.
    assert_eq!(history(folder, "all --new").0, Some(0));

    let (status, text) = history(folder, "all --json --html page.html");
    let told: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(
        (status, &told["changed"], &told["newly"]),
        (Some(1), &value!(true), &value!(false))
    );
    assert_eq!(
        told["findings"][0],
        value!({"file": "all/98.json", "date": "2026-03-01T06:00:00Z"})
    );
    let all = told["parameters"].as_array().unwrap().iter();
    let steps: Vec<&Value> = all.flat_map(|own| own["steps"].as_array().unwrap()).collect();
    let [step] = steps.as_slice() else { panic!("{steps:?}") };
    assert_eq!(step["since"], 4);
    let [low, high] = [0, 1].map(|end| step["ratio"]["interval"][end].as_f64().unwrap());
    assert!((low..high).contains(&0.85), "{step}");
    let page = fs::read_to_string(folder.join("page.html")).unwrap();
    assert!(page.contains("since 2026-03-05") && page.contains("joint_2 ry stiffness"));
    assert_eq!(page.matches("<svg").count(), 37);
    assert!(page.len() < 2 << 20 && !page.contains("NaN"), "{}", page.len());
}

#[test]
fn what_is_no_finding_of_its_own_is_left_out_and_named() {
    let folder = found();
    let folder = folder.path();
    results(folder, 3);
    fs::write(folder.join("all/notes.txt"), "not read").unwrap();
    fs::write(folder.join("all/cut.json"), "{\"joints\": [").unwrap();
    let mut again = json(folder, "all/98.json");
    fs::write(folder.join("all/again.json"), again.to_string()).unwrap();
    again["origin"]["logs"][0]["sha256"] = value!("00");
    again["fit"]["acceptance"] = value!("model_suspect");
    fs::write(folder.join("all/suspect.json"), again.to_string()).unwrap();
    let (status, text) = history(folder, "all");
    assert!(status == Some(0) && text.contains(" in 3 findings, "), "{text}");
    for note in [
        "left out: all/cut.json: is cut off",
        "is of a log of all/",
        "left out: all/suspect.json: MODEL SUSPECT",
    ] {
        assert!(text.contains(note), "{note:?} is not in\n{text}");
    }

    let message = refused(folder, "history all/98.json all/again.json");
    assert!(
        message.contains("1 of 2 results can be compared, and a history needs two"),
        "{message}"
    );
    let message = refused(folder, "history all/98.json all/cut.json");
    assert!(message.contains("all/cut.json: is cut off"), "{message}");
    assert!(refused(folder, "history all --level 0").contains("--level is 0: must be above 0"));
}

/// A plant with typical errors mills twice, and has lost 5 % of a stiffness in between. What both fits do not know of the plant cancels.
#[test]
fn errors_that_two_cuts_share_cancel() {
    let folder = folder();
    let folder = folder.path();
    edit(&folder.join("edge.toml"), "assume = \"perfect\"", "");
    for (seed, name) in [(1, "before"), (2, "after")] {
        if seed == 2 {
            edit(&folder.join("mill3.toml"), "8.6e6, 3.7e7]", "8.17e6, 3.7e7]");
        }
        stdout(
            folder,
            &format!(
                "simulate --config edge.toml --plant mill3-plant.toml --seed {seed} --candump {name}.log"
            ),
        );
        stdout(folder, &format!("identify --config edge.toml {name}.log --json {name}.json"));
    }
    let widths = |command: &str| {
        let output = flexid(folder, &format!("{command} before.json after.json --json"));
        assert!(output.status.code().is_some_and(|own| own < 2), "{}", stderr(&output));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        let parameters = told["parameters"].as_array().unwrap().clone();
        let ratio = |own: &Value| {
            if command == "compare" { own["ratio"].clone() } else { own["line"]["ratio"].clone() }
        };
        let all = parameters.iter().map(|own| {
            let ratio = ratio(own);
            let [low, high] = [0, 1].map(|end| ratio["interval"][end].as_f64().unwrap());
            let changed = (&own["joint"], &own["dof"], &own["quantity"])
                == (&value!("joint_2"), &value!(4), &value!("stiffness"));
            let truth = if changed { 0.95 } else { 1.0 };
            (ratio["relative_std"].as_f64().unwrap(), (low..=high).contains(&truth), changed)
        });
        all.collect::<Vec<_>>()
    };
    let (apart, together) = (widths("compare"), widths("history"));
    let narrower: Vec<f64> =
        apart.iter().zip(&together).map(|(one, other)| one.0 / other.0).collect();
    let held = together.iter().filter(|own| own.1).count();
    let changed = together.iter().position(|own| own.2).unwrap();
    println!("narrower {narrower:.2?}, held {held} of {}, {:?}", together.len(), together[changed]);
    assert!(together[changed].1 && narrower[changed] > 2.0, "{narrower:?}");
    assert!(10 * held >= 9 * together.len(), "{held} of {}", together.len());
    let (_, text) = history(folder, "before.json after.json");
    assert!(text.starts_with("changed: joint_2 ry stiffness fell by "), "{text}");
}
