//! The page that `flexid report` and `flexid identify --report` make of a result.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::setup::{add_static_test, fitted, flexid, folder, found, json, stderr};

fn succeed(folder: &Path, arguments: &str) {
    let output = flexid(folder, arguments);
    assert!(output.status.success(), "{arguments}: {}", stderr(&output));
}

fn text(folder: &Path, file: &str) -> String {
    fs::read_to_string(folder.join(file)).unwrap()
}

fn without_seconds(mut result: Value) -> Value {
    result["fit"]["seconds"] = Value::Null;
    result
}

/// `identify --report` writes what `report` makes of the result; another run gives the same result but for the seconds, whatever its outputs
/// are called.
#[test]
fn a_page_is_made_of_the_result_alone() {
    let folder = found();
    let folder = folder.path();
    let (_, found) = fitted(folder);
    succeed(folder, "identify --config edge.toml o.log --json again.json --report page.html");
    assert_eq!(without_seconds(json(folder, "again.json")), without_seconds(found.clone()));
    succeed(folder, "report again.json --out again.html");
    assert_eq!(text(folder, "again.html"), text(folder, "page.html"));

    let page = text(folder, "page.html");
    assert!((100_000..2 << 20).contains(&page.len()), "{} bytes", page.len());
    let joint = &found["joints"][0]["name"];
    for part in [
        "The fit explains the records",
        joint.as_str().unwrap(),
        "flexid identify --config edge.toml o.log",
        "But only if robot, sensors and ground are exactly as they are stated",
    ] {
        assert!(page.contains(part), "{part:?}");
    }
    assert!(!page.contains("no entry"));

    // A page beside the result, where no name is given.
    let output = flexid(folder, "report o.json");
    assert!(output.status.success() && folder.join("o.html").exists());
    assert_eq!(stderr(&output), "o.html: report written\n");
    let output = flexid(folder, "report o.json --out /dev/stdout");
    assert_eq!(
        (output.stdout, output.stderr),
        (fs::read(folder.join("o.html")).unwrap(), Vec::new())
    );
}

/// The page shows of the records what a fit to the scenario's noise leaves.
#[test]
fn the_result_carries_what_the_page_needs() {
    let folder = found();
    let folder = folder.path();
    let found = json(folder, "o.json");
    let origin = &found["origin"];
    assert_eq!(origin["command"], "flexid identify --config edge.toml o.log");
    assert_eq!(origin["version"], env!("CARGO_PKG_VERSION"));
    let files = origin["configuration"]
        .as_array()
        .unwrap()
        .iter()
        .chain(origin["logs"].as_array().unwrap());
    let names: Vec<&str> = files
        .map(|file| {
            assert_eq!(file["sha256"].as_str().unwrap().len(), 64, "{file}");
            file["name"].as_str().unwrap()
        })
        .collect();
    assert_eq!(names, ["edge.toml", "mill3-model.toml", "mill3.dbc", "o.log"]);

    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|own| own.as_f64().unwrap()).collect()
    };
    let records = found["records"].as_array().unwrap();
    assert_eq!(records.len() as u64, found["fit"]["records"].as_u64().unwrap());
    for record in records {
        let spectra = &record["spectra"];
        for axis in 0..3 {
            let [residual, noise, measured] =
                ["residual", "noise", "measured"].map(|own| numbers(&spectra[own][axis]));
            let squares = residual.iter().zip(&noise).map(|(own, noise)| (own / noise).powi(2));
            let mean = squares.sum::<f64>() / noise.len() as f64;
            assert!((0.8..1.2).contains(&mean), "{mean}");
            // The record stands clear of the noise.
            let clear = measured.iter().zip(&noise).filter(|(own, noise)| *own > *noise).count();
            assert!(2 * clear > noise.len(), "{clear} of {}", noise.len());
        }
    }
    for pose in found["measured_receptance"].as_array().unwrap() {
        let points = pose["points"].as_array().unwrap();
        // Measured and fitted acceleration go through the same estimate, and agree.
        let mut apart = Vec::new();
        for point in points {
            for row in 0..3 {
                for column in 0..3 {
                    let of = |own: &str| &point[own][row][column];
                    let (measured, modelled) = (of("measured"), of("modelled"));
                    assert_eq!(measured.is_null(), modelled.is_null());
                    if !measured.is_null() {
                        let (a, b) = (numbers(measured), numbers(modelled));
                        let size = b[0].hypot(b[1]);
                        apart.push((a[0] - b[0]).hypot(a[1] - b[1]) / size);
                    }
                }
            }
        }
        apart.sort_by(f64::total_cmp);
        assert!(apart.len() > points.len(), "{} entries of {} points", apart.len(), points.len());
        let median = apart[apart.len() / 2];
        assert!(median < 0.2, "{median}");
    }
    let last = found["course"].as_array().unwrap().last().unwrap()["misfit"].as_f64().unwrap();
    assert!((0.7..1.3).contains(&last), "{last}");
}

/// Static tests alone have no records. Their page says so.
#[test]
fn static_tests_alone_have_a_page() {
    let folder = folder();
    let folder = folder.path();
    add_static_test(folder);
    succeed(folder, "identify --config edge.toml --json s.json --report s.html");
    let page = text(folder, "s.html");
    assert!(page.contains("static tests alone"));
    assert!(!page.contains("no entry"));
    assert_eq!(json(folder, "s.json")["origin"]["logs"], serde_json::json!([]));
}

#[test]
fn a_wrong_result_is_refused_with_its_place_and_mend() {
    let folder = found();
    let folder = folder.path();
    let found = json(folder, "o.json");
    let mut no_robot = found.clone();
    no_robot.as_object_mut().unwrap().remove("robot");
    fs::write(folder.join("daemon.json"), no_robot.to_string()).unwrap();
    fs::write(folder.join("empty.json"), "").unwrap();
    let whole = text(folder, "o.json");
    fs::write(folder.join("cut.json"), &whole[..whole.len() / 2]).unwrap();
    fs::write(folder.join("huge.json"), " ".repeat((16 << 20) + 1)).unwrap();
    fs::write(folder.join("o.html"), &whole).unwrap();
    for (arguments, expected) in [
        ("report gone.json --out x", "gone.json: cannot be read"),
        ("report empty.json --out x", "empty.json: is empty: give a file as"),
        ("report cut.json --out x", "give a file as `flexid identify --json` writes it"),
        ("report huge.json --out x", "huge.json: is larger than 16 MiB"),
        ("report edge.toml --out x", "edge.toml: "),
        ("report daemon.json --out x", "has no robot"),
        ("report o.json --out gone/x", "its folder is not there"),
        (
            "report o.html",
            "o.html: is read by this command, and would be lost: name another file for the result",
        ),
        ("identify --config edge.toml o.log --report gone/x", "its folder is not there"),
    ] {
        let output = flexid(folder, arguments);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {message}");
        assert_eq!(message.lines().count(), 1, "{arguments}: {message}");
        assert!(message.contains(expected), "{arguments}: {message}");
    }
    assert!(!folder.join("x").exists());

    // A result without the entries of this version has a page that says what it leaves out.
    let mut older = found;
    let entries = ["records", "measured_receptance", "course", "data_quality", "origin"];
    for entry in entries {
        older.as_object_mut().unwrap().remove(entry).unwrap();
    }
    fs::write(folder.join("older.json"), older.to_string()).unwrap();
    succeed(folder, "report older.json --out older.html");
    let page = text(folder, "older.html");
    for entry in entries {
        assert!(page.contains(&format!("no entry <code>{entry}</code>")), "{entry}");
    }
}
