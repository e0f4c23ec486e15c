//! `flexid plan`.

use serde_json::Value;

use crate::setup::{edit, flexid, folder, identified, json, stderr};

#[test]
fn what_was_found_is_what_a_plan_starts_from() {
    let folder = folder();
    let (_, found) = identified(folder.path(), "", || ());
    let relative = |joint: &Value, kind: &str| -> Vec<f64> {
        let values = joint[kind].as_array().unwrap().iter();
        let deviations = joint[format!("{kind}_std")].as_array().unwrap().iter();
        let pairs = deviations.zip(values);
        pairs.map(|(std, value)| std.as_f64().unwrap() / value.as_f64().unwrap()).collect()
    };
    let joints = found["joints"].as_array().unwrap().iter();
    let known: Vec<f64> = joints
        .flat_map(|joint| ["stiffness", "damping"].map(|kind| relative(joint, kind)))
        .flatten()
        .collect();
    assert_eq!(known.len(), 36);
    let worst = known.iter().copied().fold(0.0, f64::max);
    let geometric_mean = (known.iter().map(|std| std.ln()).sum::<f64>() / 36.0).exp();

    let command = "plan --config edge.toml --from o.json --poses 8 --experiments 2 --json p.json";
    let output = flexid(folder.path(), command);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = String::from_utf8(output.stdout).unwrap();
    let plan = json(folder.path(), "p.json");
    let number = |prediction: &Value, key: &str| prediction[key].as_f64().unwrap();
    // The bounds add a part in a thousand to what is known so well.
    assert!((number(&plan["now"], "worst") / worst - 1.0).abs() < 1e-9);
    assert!((number(&plan["now"], "uncertainty") / geometric_mean - 1.0).abs() < 1e-3);
    assert_eq!(plan["now"]["identified"], 36);
    let steps = plan["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 2);
    let mut before = number(&plan["now"], "uncertainty");
    for step in steps {
        let after = number(&step["after"], "uncertainty");
        assert!(after < 0.9 * before, "{before} to {after}");
        before = after;
    }
    let worst = steps[1]["after"]["worst_parameter"].as_str().unwrap();
    assert!(table.contains(&format!("worst in the end: {worst}, ")), "{table}");

    // Its standard deviations say nothing if the fit does not hold.
    edit(&folder.path().join("o.json"), "\"consistent\"", "\"model_suspect\"");
    let output = flexid(folder.path(), command);
    assert_eq!(output.status.code(), Some(2));
    let errors = stderr(&output);
    assert!(errors.contains("o.json: its fit is \"model_suspect\""), "{errors}");
}

/// With so little force some of the spindle's runs are lost in the force sensor's noise, and others are not.
#[test]
fn a_plan_goes_without_the_cuts_that_tell_nothing() {
    let folder = folder();
    let command = "plan --config edge.toml --poses 2 --experiments 1 --force 1.1 --json p.json";
    let output = flexid(folder.path(), command);
    let errors = stderr(&output);
    assert!(output.status.success(), "{errors}");
    let warning = "warning: the force is lost in the force sensor's noise in 6 of 18 experiments";
    assert!(errors.starts_with(warning), "{errors}");
    let plan = json(folder.path(), "p.json");
    assert_eq!(plan["candidates"], 12);
}
