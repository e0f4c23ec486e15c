//! The reproduction of the paper, held in place: a quick run whose numbers are frozen, and the same bytes again.

use std::path::Path;

use flexid_pipeline::config::Config;
use flexid_reproduce::robot::Study;
use flexid_reproduce::tables::Tables;
use flexid_reproduce::{self as reproduce, Effort, report};
use rayon::ThreadPoolBuilder;
use serde_json::{Map, Value, json};

fn study() -> Study {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario");
    Study::new(&Config::load(&folder.join("mill3-edge.toml")).unwrap(), true).unwrap()
}

fn quick(level: fearless_simd::Level) -> Tables {
    let threads = ThreadPoolBuilder::new().stack_size(reproduce::STACK).build().unwrap();
    threads.install(|| reproduce::run(&study(), &Effort::QUICK, level, || {})).unwrap()
}

/// Numbers to six digits, without what differs from run to run.
fn frozen(value: Value) -> Value {
    let entry = |(key, value): (String, Value)| (key != "seconds").then(|| (key, frozen(value)));
    match value {
        Value::Object(map) => {
            Value::Object(map.into_iter().filter_map(entry).collect::<Map<_, _>>())
        }
        Value::Array(values) => Value::Array(values.into_iter().map(frozen).collect()),
        Value::Number(number) if number.is_f64() => {
            let digits = format!("{:.5e}", number.as_f64().unwrap());
            json!(digits.parse::<f64>().unwrap())
        }
        other => other,
    }
}

/// A text that is too long to be read gives way to its sum and its length.
fn summarise(value: &mut Value) {
    fn sum(value: &Value) -> (f64, usize) {
        match value {
            Value::Array(values) => {
                values.iter().map(sum).fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
            }
            Value::Object(values) => {
                values.values().map(sum).fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
            }
            number => (number.as_f64().unwrap_or(0.0), 1),
        }
    }
    let short = |value: &mut Value| {
        let (sum, count) = sum(value);
        *value = json!({ "count": count, "sum": sum });
    };
    for method in value["methods"].as_array_mut().unwrap() {
        short(&mut method["curve"]);
    }
    short(&mut value["search"]["loss"]);
    for series in ["time_s", "reference_m", "models_m"] {
        short(&mut value["displacement"][series]);
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn a_quick_run_gives_the_frozen_numbers() {
    let level = fearless_simd::Level::new().as_avx2().expect("the numbers are frozen for AVX2");
    let tables = quick(fearless_simd::Level::Avx2(level));
    let mut value = serde_json::to_value(&tables).unwrap();
    summarise(&mut value);
    // The crate of CMA-ES chooses its own instruction set.
    value["methods"].as_array_mut().unwrap().retain(|method| method["key"] != "cma_es");
    value["comparisons"].as_array_mut().unwrap().retain(|test| test["method"] != "cma_es");
    let text = serde_json::to_string_pretty(&frozen(value)).unwrap();
    insta::assert_snapshot!("quick", text);

    // What must hold whatever the numbers are frozen to.
    let deviation =
        |key: &str| tables.methods.iter().find(|method| method.key == key).unwrap().deviation.mean;
    assert!(deviation("flexid") < 0.005, "{}", deviation("flexid"));
    assert!(deviation("jacobian") < deviation("baseline"));
    let html = report::render(&tables);
    assert!(html.contains("Jacobian Sensitivity") && !html.contains("NaN"));
}
