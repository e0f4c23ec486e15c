//! Python interpreters with packages of others, by which files are checked.

use std::path::Path;
use std::process::Command;
use std::sync::Mutex;

/// Held while packages are installed: tests run at once.
static INSTALLING: Mutex<()> = Mutex::new(());

/// Runs a command and returns its standard output.
pub(crate) fn run(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    Err(format!("{command:?}: {}", String::from_utf8_lossy(&output.stderr)))
}

/// Returns a Python that imports NumPy and a package: the system's, or one in the target folder that gets both from the registry.
pub(crate) fn with(package: &str) -> String {
    let _installing = INSTALLING.lock();
    let imports =
        |python: &str| run(Command::new(python).args(["-c", &format!("import {package}, numpy")]));
    if imports("python3").is_ok() {
        return "python3".to_string();
    }
    let environment = Path::new(env!("CARGO_TARGET_TMPDIR")).join(package);
    let python = environment.join("bin/python").to_string_lossy().into_owned();
    if imports(&python).is_err() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&environment)).unwrap();
        run(Command::new(&python).args(["-m", "pip", "install", "-q", package, "numpy"])).unwrap();
        imports(&python).unwrap();
    }
    python
}
