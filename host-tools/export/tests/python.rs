//! Scripts as Python reads them.

use std::path::Path;
use std::process::Command;

use flexid_export::{Format, export};

use crate::FOLDER;
use crate::packages::run;
use crate::scenario::{EARTH, Scenario};

/// The script for Drake is valid Python, also with names that have to be escaped.
#[test]
fn drakes_script_compiles() {
    let mut scenario = Scenario::load("mill6", EARTH);
    scenario.model.name = "a \"quoted\" \\ name\nin two lines".to_string();
    let text = export(&scenario.robot(0), Format::Drake).unwrap();
    let file = Path::new(FOLDER).join("drake.py");
    std::fs::write(&file, text).unwrap();
    run(Command::new("python3").args(["-m", "py_compile"]).arg(&file)).unwrap();
}
