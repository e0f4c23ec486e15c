//! Every folder of `recordings` is a test: `flexid identify` finds the robot that made it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use flexid_hil::bench::Bench;
use flexid_hil::report::Report;
use flexid_hil::truth::{Bounds, Truth};
use libtest_mimic::{Arguments, Failed, Trial};
use serde_json::Value;

fn main() -> ExitCode {
    let recordings = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings");
    let tests = match contents(Path::new(recordings)) {
        Ok(entries) => entries.into_iter().filter(|entry| entry.is_dir()).map(test).collect(),
        Err(error) => {
            eprintln!("{error:#}");
            return ExitCode::FAILURE;
        }
    };
    let mut arguments = Arguments::from_args();
    arguments.test_threads = Some(1); // each is held to a time
    libtest_mimic::run(&arguments, tests).exit_code()
}

fn test(recording: PathBuf) -> Trial {
    let name = recording.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let run = move || identify(&recording).map_err(|error| Failed::from(format!("{error:#}")));
    Trial::test(name, run)
}

fn identify(recording: &Path) -> Result<()> {
    let bench = Bench::recording(recording)?;
    let truth: Value = serde_json::from_str(&fs::read_to_string(recording.join("truth.json"))?)?;
    let experiments = truth["experiments"].as_array().context("truth.json: no experiments")?;
    let sum = |key| experiments.iter().filter_map(|one| one[key].as_u64()).sum::<u64>();
    let lost = sum("dropped_force") + sum("dropped_acc");

    let mut command = vec!["identify", "--config", "edge.toml", "--json", "report.json"];
    let truth_file = recording.join("truth.json");
    command.extend(["--truth", truth_file.to_str().context("a path that is not UTF-8")?]);
    let logs = contents(&bench.path(""))?;
    let logs = logs.iter().filter_map(|file| file.file_name()?.to_str());
    command.extend(logs.filter(|name| name.ends_with(".log")));
    let limit = Duration::from_secs(10) * u32::try_from(experiments.len())?;
    let ended = bench.flexid("identify", command)?.succeed(limit)?;

    let report = Report::last_of(&fs::read_to_string(bench.path("report.json"))?)?;
    let bounds = Bounds::of(&bench.path("edge.toml"))?;
    let deviation = Truth::of_recording(&truth)?.parameter_deviation(&report, &bounds)?;
    let displacement = displacement_error(&ended.output).context(ended.output)?;
    println!("deviation {deviation:.5}, displacement error {displacement} %, {:?}", report.fit);
    ensure!(deviation <= 0.005, "parameter deviation {deviation}");
    ensure!(displacement <= 1.0, "displacement error {displacement} % on unseen poses");
    ensure!(report.fit.frames_lost == lost, "{} frames lost, not {lost}", report.fit.frames_lost);
    ensure!(report.fit.records == experiments.len() as u64, "{} records", report.fit.records);
    Ok(())
}

/// The median over directions and unseen poses, %, from what `identify --truth` prints:
/// `displacement error on 10 unseen poses: median 0.061 %, maximum 0.310 %`.
fn displacement_error(output: &str) -> Option<f64> {
    let (_, numbers) = output.split_once("displacement error on ")?;
    numbers.split_once("median ")?.1.split_once(" %")?.0.parse().ok()
}

/// What is in a folder, in the order of the names.
fn contents(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}
