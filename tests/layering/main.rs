//! The packages that each crate must never reach by its dependency graph, and the few files that may touch the bus.

mod circles;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Packages of sockets, and packages that use them.
const SOCKETS: &[&str] = &["socketcan", "nix", "socket2", "rustix", "libc", "tokio", "mio"];

/// Packages of linear algebra.
const ALGEBRA: &[&str] = &["nalgebra", "simba", "microfft", "fearless_simd"];

/// Packages of robot descriptions, plots and terminal user interfaces.
const FRONT: &[&str] =
    &["roxmltree", "ratatui", "crossterm", "indicatif", "comfy-table", "plotters", "axum"];

#[test]
fn core_reaches_neither_the_wire_nor_the_system() {
    let reached = reached("flexid-core");
    never("flexid-core", &reached, &["flexid-wire", "flexid-pipeline", "serde_json", "serde"]);
    never("flexid-core", &reached, SOCKETS);
    no_std("flexid-core", &reached, "core/src");
}

#[test]
fn wire_is_plain_numbers() {
    let reached = reached("flexid-wire");
    never("flexid-wire", &reached, &["flexid-core", "flexid-pipeline", "serde_json"]);
    never("flexid-wire", &reached, SOCKETS);
    never("flexid-wire", &reached, ALGEBRA);
    no_std("flexid-wire", &reached, "core/wire/src");
}

#[test]
fn the_edge_reaches_no_host_tool() {
    for package in ["flexid-edge", "flexid-pipeline"] {
        let reached = reached(package);
        for (tool, _) in packages("host-tools") {
            never(package, &reached, &[&tool]);
        }
        never(package, &reached, FRONT);
    }
}

#[test]
fn the_pipeline_reaches_no_daemon() {
    never("flexid-pipeline", &reached("flexid-pipeline"), &["flexid-edge"]);
}

#[test]
fn what_commands_call_reaches_no_command() {
    let called = [
        "flexid-simulation",
        "flexid-export",
        "flexid-prediction",
        "flexid-report",
        "flexid-fleet",
    ];
    for package in called {
        never(package, &reached(package), &["flexid", "flexid-edge", "flexid-console", "clap"]);
    }
}

/// Its optimisers, a second nalgebra among them, take as long to build as all commands.
#[test]
fn the_reproduction_is_a_program_of_its_own() {
    never("flexid", &reached("flexid"), &["flexid-reproduce", "argmin"]);
    never("flexid-reproduce", &reached("flexid-reproduce"), &["flexid"]);
}

#[test]
fn nothing_reaches_the_tests() {
    let of_tests: Vec<String> = packages("tests").into_iter().map(|(name, _)| name).collect();
    let of_tests: Vec<&str> = of_tests.iter().map(String::as_str).collect();
    assert!(of_tests.contains(&"flexid-hil"), "{of_tests:?}");
    for (package, _) in packages(".") {
        if !of_tests.contains(&package.as_str()) {
            never(&package, &reached(&package), &of_tests);
        }
    }
}

#[test]
fn one_file_reads_the_bus_and_one_writes_it() {
    for source in ["edge-app/pipeline/src", "host-tools/simulation/src"] {
        let files = files_with(source, "socketcan::");
        let openers = files.iter().filter(|file| read(file).contains("CanSocket"));
        assert_eq!(openers.count(), 1, "{source}: socketcan is imported in {files:?}");
    }
}

/// The packages of the workspace whose folders are `folder` or below it, by name, with their folders.
fn packages(folder: &str) -> Vec<(String, PathBuf)> {
    let workspace: toml::Table = read(Path::new(ROOT).join("Cargo.toml")).parse().expect("TOML");
    let members = workspace["workspace"]["members"].as_array().expect("members");
    let members = members.iter().map(|member| member.as_str().expect("a folder"));
    let package = |member: &str| {
        let folder = Path::new(ROOT).join(member);
        let own: toml::Table = read(folder.join("Cargo.toml")).parse().expect("TOML");
        (own["package"]["name"].as_str().expect("a name").to_owned(), folder)
    };
    let found: Vec<_> = members
        .filter(|member| folder == "." || Path::new(member).starts_with(folder))
        .map(package)
        .collect();
    assert!(!found.is_empty(), "no package is in {folder}");
    found
}

/// The packages that `package` is built from, as `name`, and their features that are on, as `name/feature`.
fn reached(package: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--package", package, "--edges", "normal,build", "--no-dedupe"])
        .args(["--prefix", "none", "--format", "{p}|{f}"])
        .current_dir(ROOT)
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut reached = BTreeSet::new();
    for line in String::from_utf8(output.stdout).expect("UTF-8").lines() {
        let (described, features) = line.split_once('|').expect("two fields");
        let name = described.split(' ').next().expect("a name");
        reached.extend(features.split(',').map(|feature| format!("{name}/{feature}")));
        reached.insert(name.to_string());
    }
    assert!(reached.contains(package), "cargo tree does not print {package}: {reached:?}");
    reached
}

fn never(package: &str, reached: &BTreeSet<String>, forbidden: &[&str]) {
    let found: Vec<_> = forbidden.iter().filter(|name| reached.contains(**name)).collect();
    assert!(found.is_empty(), "{package} must never reach {found:?}");
}

/// Checks that neither a feature of a dependency nor the package's own sources use the standard library or an
/// allocator.
fn no_std(package: &str, reached: &BTreeSet<String>, sources: &str) {
    let found: Vec<_> =
        reached.iter().filter(|name| name.ends_with("/std") || name.ends_with("/alloc")).collect();
    assert!(found.is_empty(), "{package} must never reach {found:?}");
    assert_eq!(files_with(sources, "extern crate alloc"), [""; 0]);
    let root = read(Path::new(ROOT).join(sources).join("lib.rs"));
    assert!(root.contains("#![no_std]"), "{package} is not no_std");
}

/// The Rust files below `folder` that contain `text`.
fn files_with(folder: &str, text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![PathBuf::from(ROOT).join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a readable folder") {
            let path = entry.expect("a readable entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs")
                && read(&path).contains(text)
            {
                found.push(path.display().to_string());
            }
        }
    }
    found
}

fn read(file: impl AsRef<Path>) -> String {
    fs::read_to_string(file).expect("a readable text")
}
