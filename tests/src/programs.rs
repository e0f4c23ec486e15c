//! The programs under test as they are shipped: built with the profile `dist`, unless others are named.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

/// The variable with the folder of built programs. Tests that run inside a bus need it, since nothing is built there.
/// Users who have built the programs may set it.
pub const FOLDER: &str = "FLEXID_PROGRAMS";

/// The folder that holds `flexid` and `flexid-edge`. The function builds them, once in a process, unless [`FOLDER`]
/// names the folder.
pub fn folder() -> Result<&'static Path> {
    static BUILT: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let built = BUILT.get_or_init(|| match std::env::var_os(FOLDER) {
        Some(folder) => Ok(folder.into()),
        None => build().map_err(|error| format!("{error:#}")),
    });
    match built {
        Ok(folder) => Ok(folder),
        Err(error) => bail!("{error}"),
    }
}

fn build() -> Result<PathBuf> {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo")))
        .args(["build", "--profile=dist", "--package=flexid", "--package=flexid-edge", "--bins"])
        .args(["--message-format=json-render-diagnostics"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stderr(Stdio::inherit())
        .output()
        .context("cargo cannot be run")?;
    ensure!(output.status.success(), "the programs under test do not build");
    let executables: Vec<PathBuf> = String::from_utf8(output.stdout)?
        .lines()
        .filter_map(|line| {
            let message: Value = serde_json::from_str(line).ok()?;
            Some(PathBuf::from(message["executable"].as_str()?))
        })
        .collect();
    for name in ["flexid", "flexid-edge"] {
        let built = executables.iter().any(|executable| executable.ends_with(name));
        ensure!(built, "the workspace has no program {name}");
    }
    let folder = executables[0].parent().context("a program without a folder")?;
    Ok(folder.to_path_buf())
}
