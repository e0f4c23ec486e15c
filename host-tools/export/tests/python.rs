//! Python interpreters.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use flexid_export::{Format, export};

use crate::scenario::{EARTH, Scenario};

/// Folder of files that the tests write.
pub(crate) const FOLDER: &str = env!("CARGO_TARGET_TMPDIR");

/// Runs a command and returns its standard output.
pub(crate) fn run(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    Err(format!("{command:?}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Returns a Python that imports MuJoCo and NumPy: the system's, or one in the target folder that gets them from the registry.
pub(crate) fn with_mujoco() -> &'static str {
    static PYTHON: OnceLock<String> = OnceLock::new();
    PYTHON.get_or_init(|| {
        let imports = |python: &str| run(Command::new(python).args(["-c", "import mujoco, numpy"]));
        if imports("python3").is_ok() {
            return "python3".to_string();
        }
        let environment = Path::new(FOLDER).join("mujoco");
        let python = environment.join("bin/python").to_string_lossy().into_owned();
        if imports(&python).is_err() {
            run(Command::new("python3").args(["-m", "venv"]).arg(&environment)).unwrap();
            run(Command::new(&python).args(["-m", "pip", "install", "-q", "mujoco", "numpy"]))
                .unwrap();
            imports(&python).unwrap();
        }
        python
    })
}

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
