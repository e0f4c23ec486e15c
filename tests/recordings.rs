//! Every folder of `recordings` is a test: `flexid identify` finds the robot that made it.

use std::fs;
use std::iter::zip;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use flexid_hil::bench::Bench;
use flexid_hil::report::{Confidence, HeldOut, Report};
use flexid_hil::truth::{Bounds, Truth};
use libtest_mimic::{Arguments, Failed, Trial};
use serde_json::Value;

/// Time after which a program that works on a recording is taken to hang.
const HANGS: Duration = Duration::from_secs(300);

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
    arguments.test_threads = Some(1); // the printed times are those of one test at a time
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
    // A robot that stands gives one record an experiment.
    let records = |one: &Value| one["records"].as_u64().unwrap_or(1);
    let records: u64 = experiments.iter().map(records).sum();
    let has_bounds = fs::read_to_string(recording.join("edge.toml"))?.contains("[bounds]");

    let mut command = vec!["identify", "--config", "edge.toml", "--json", "report.json"];
    let truth_file = recording.join("truth.json");
    command.extend(["--truth", truth_file.to_str().context("a path that is not UTF-8")?]);
    let logs = contents(&bench.path(""))?;
    let logs = logs.iter().filter_map(|file| file.file_name()?.to_str());
    command.extend(logs.filter(|name| name.ends_with(".log") || is_cut(name)));
    let ended = bench.flexid("identify", command)?.succeed(HANGS)?;

    let report = Report::last_of(&fs::read_to_string(bench.path("report.json"))?)?;
    println!("{:?}", report.fit);
    let truth = Truth::of_recording(&truth)?;
    // The deviation needs the bounds, and the displacement error needs the scenario's unseen poses.
    if has_bounds {
        let bounds = Bounds::of(&bench.path("edge.toml"))?;
        let deviation = truth.parameter_deviation(&report, &bounds)?;
        let displacement = displacement_error(&ended.output).context(ended.output)?;
        println!("deviation {deviation:.5}, displacement error {displacement} %");
        ensure!(deviation <= 0.005, "parameter deviation {deviation}");
        ensure!(displacement <= 1.0, "displacement error {displacement} % on unseen poses");
    }
    ensure!(report.fit.frames_lost == lost, "{} frames lost, not {lost}", report.fit.frames_lost);
    ensure!(report.fit.records == records, "{} records, not {records}", report.fit.records);
    intervals_are_honest(&report, &truth)?;
    noise_explains_the_rest(&report)
}

/// A table of a cut. The scenario has tables of poses beside it.
fn is_cut(name: &str) -> bool {
    name.starts_with("cut") && name.ends_with(".csv")
}

/// The truth lies in the intervals as often as their confidence states, and the errors have the size of their
/// deviations.
fn intervals_are_honest(report: &Report, truth: &Truth) -> Result<()> {
    let (mut given, mut covered, mut scores) = (0, 0, Vec::new());
    for (joint, intervals) in report.joints.iter().zip(&report.confidence.joints) {
        ensure!(joint.name == intervals.name, "{} is not {}", intervals.name, joint.name);
        let truth = truth.joint(&joint.name)?;
        let stiffness = zip(joint.stiffness, truth.stiffness)
            .zip(zip(joint.stiffness_std, intervals.stiffness_interval))
            .zip(&joint.stiffness_verdict);
        let damping = zip(joint.damping, truth.damping)
            .zip(zip(joint.damping_std, intervals.damping_interval))
            .zip(&joint.damping_verdict);
        for (((value, truth), (deviation, interval)), verdict) in stiffness.chain(damping) {
            let covers = |[lower, upper]: [f64; 2]| (lower..=upper).contains(&truth);
            given += usize::from(interval.is_some());
            covered += usize::from(interval.is_some_and(covers));
            if verdict == "identified" {
                let deviation = deviation.context("identified without a standard deviation")?;
                scores.push((value / truth).ln() * value / deviation);
            }
        }
    }
    let identified = scores.len();
    let score = (scores.iter().map(|score| score * score).sum::<f64>() / identified as f64).sqrt();
    let parameters = 12 * report.joints.len();
    println!(
        "{covered} of {given} intervals of {parameters} parameters cover, {identified} identified, their errors {score:.2} σ"
    );
    // The cuts excite five in six of each recording's parameters.
    ensure!(6 * given >= 5 * parameters, "{given} of {parameters} parameters have an interval");
    // The errors are correlated. Fewer than 28 of 36 intervals of 95 % cover for less than one robot in a hundred.
    ensure!(36 * covered >= 28 * given, "{covered} of {given} intervals cover the truth");
    // The root mean square is 1 ± 0.2, and lies outside these limits as seldom.
    ensure!((0.6..1.6).contains(&score), "the errors of what is identified are {score} σ");
    Ok(())
}

/// The engine moves as the model, and each record agrees with the prediction from the others.
fn noise_explains_the_rest(report: &Report) -> Result<()> {
    let Confidence { correlations, residuals, held_out, .. } = &report.confidence;
    let unknowns = 12 * report.joints.len();
    ensure!(correlations.unknowns.len() == unknowns, "{:?}", correlations.unknowns);
    let pairs = unknowns * (unknowns - 1) / 2;
    ensure!(correlations.percent.len() == pairs, "{} pairs", correlations.percent.len());
    let vaf = held_out.iter().flat_map(|record| record.vaf).fold(1.0, f64::min);
    println!("held out: VAF {vaf:.4} at least; structure objects: {}", residuals.structure_objects);
    ensure!(!residuals.size_objects, "χ²/dof is {}", report.fit.consistency);
    ensure!(held_out.len() as u64 == report.fit.records, "{} held out", held_out.len());
    for HeldOut { frac, vaf } in held_out {
        let predicted = frac.iter().chain(vaf).all(|part| (0.99..=1.0).contains(part));
        ensure!(predicted, "a record held out is predicted to FRAC {frac:?} and VAF {vaf:?}");
    }
    Ok(())
}

/// The median over directions and unseen poses, %, from what `identify --truth` prints:
/// `displacement error on 10 unseen poses: median 0.061 %, maximum 0.310 %`.
fn displacement_error(output: &str) -> Option<f64> {
    let (_, numbers) = output.split_once("displacement error on ")?;
    numbers.split_once("median ")?.1.split_once(" %")?.0.parse().ok()
}

/// The contents of a folder, in the order of the names.
fn contents(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}
