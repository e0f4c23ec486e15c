//! The reference scenario in a folder of its own.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// Beside the crate, or beside the folder that it lies in.
fn scenario() -> PathBuf {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    crates.map(|folder| folder.join("scenario")).find(|folder| folder.is_dir()).unwrap()
}

/// A folder with the scenario in it; its configuration is called `edge.toml`.
pub(crate) fn folder() -> TempDir {
    let folder = example();
    let [ours, name] = ["mill3-edge.toml", "edge.toml"].map(|name| folder.path().join(name));
    fs::rename(ours, name).unwrap();
    folder
}

/// A folder with the files as they are shipped: `edge.toml` is the example for a real robot.
#[allow(dead_code)] // not every test needs it
pub(crate) fn example() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&scenario(), folder.path());
    folder
}

/// Copies all files of a folder.
pub(crate) fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

/// Replaces `from`, which must be there, in a file.
#[allow(dead_code)] // not every test changes one
pub(crate) fn edit(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{} has no {from}", file.display());
    fs::write(file, text.replacen(from, to, 1)).unwrap();
}
