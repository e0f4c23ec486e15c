//! Instructions that the evaluations cost, counted by callgrind: the same on every run, however busy the machine,
//! so that limits can be held to.
//!
//! `cargo bench -p flexid-core --bench instructions` prints counts and ratios, and fails if one is beyond its limit. The
//! bench runs itself under Valgrind (`apt-get install valgrind`), which knows no AVX-512: the counts speak of AVX2.
//! Ratios hold whatever the compiler, and so do their limits; the counts themselves are one compiler's, on x86-64.

#[path = "../tests/common/mod.rs"]
mod common;
mod kernels;

use std::collections::BTreeMap;
use std::fs;
use std::hint::black_box;
use std::io::ErrorKind;
use std::path::Path;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, ensure};
use common::fits::{parameters, problem, targets};
use common::milling::experiments;
use common::{MEASUREMENT, Random, bounds, mill3, nominal};
use flexid_core::loss::spectral;
use flexid_core::receptance::lanes::{Kernel, Precision};
use flexid_core::refine::{Problem, Refinement};
use flexid_core::spectrum::Experiment;
use kernels::counted::operations;
use kernels::{BINS, Bins, Gradients, Values, at_most_avx2};

/// Instructions of every case with rustc 1.95 on x86-64, in the order of [`cases`]. Receptances are those of
/// [`BINS`] bins, with three joints where nothing else is said.
const COUNTS: [(&str, f64); 13] = [
    ("receptance f32, 1 joint", 147_243.0),
    ("receptance f32, 2 joints", 423_663.0),
    ("receptance f32, 3 joints", 700_083.0),
    ("receptance f32, 4 joints", 976_503.0),
    ("receptance f32, 5 joints", 1_252_923.0),
    ("receptance f32, 6 joints", 1_529_343.0),
    ("receptance f32, 7 joints", 1_805_763.0),
    ("receptance f32, bin by bin", 7_710_407.0),
    ("receptance f64", 1_399_977.0),
    ("receptance f64 and its gradient", 2_770_446.0),
    ("receptance f64 and its gradient, seam", 3_009_942.0),
    ("loss of three experiments", 556_689.0),
    ("refinement step of three experiments", 149_053_059.0),
];
/// By how much a count may rise before it is a fault, or fall: what costs less than it did may have lost its work. If it
/// has not, its count is to be renewed here.
const SLACK: f64 = 1.05;
/// Valgrind counts a repeated string instruction once a byte: glibc is to do without.
const TUNABLES: &str = "glibc.cpu.x86_rep_movsb_threshold=1000000000:\
                        glibc.cpu.x86_rep_stosb_threshold=1000000000";
/// Given to the bench when it runs under Valgrind.
const COUNTED: &str = "--counted";

/// A cost that must stay within limits.
struct Held<'a> {
    what: &'a str,
    is: f64,
    at_least: f64,
    at_most: f64,
}

impl<'a> Held<'a> {
    fn below(what: &'a str, is: f64, at_most: f64) -> Self {
        Self { what, is, at_least: 0.0, at_most }
    }
}

fn main() -> Result<ExitCode> {
    if std::env::args().any(|argument| argument == COUNTED) {
        let cases = cases();
        ensure!(cases.len() == COUNTS.len(), "{} cases, {} counts", cases.len(), COUNTS.len());
        cases.into_iter().for_each(|mut case| measured(&mut case));
        return Ok(ExitCode::SUCCESS);
    }
    let counts = count()?;
    let absolute = COUNTS.iter().map(|&(what, usual)| {
        let (at_least, at_most) = if cfg!(target_arch = "x86_64") {
            (usual / SLACK, usual * SLACK)
        } else {
            (1.0, f64::INFINITY)
        };
        Held { what, is: counts[what], at_least, at_most }
    });
    let mut kept = true;
    for Held { what, is, at_least, at_most } in absolute.chain(ratios(&counts)) {
        let digits = if is < 1000.0 { 3 } else { 0 };
        let verdict = if is > at_most {
            "   TOO MUCH"
        } else if is < at_least {
            "   TOO LITTLE"
        } else {
            ""
        };
        println!(
            "{what:<60} {is:>12.digits$}, {at_least:>12.digits$} to {at_most:>12.digits$}{verdict}"
        );
        kept &= (at_least..=at_most).contains(&is);
    }
    Ok(if kept { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The function that callgrind looks for: it counts while this runs, and writes a file whenever it ends.
#[inline(never)]
fn measured(case: &mut Case) {
    case();
}

type Case = Box<dyn FnMut()>;

fn cases() -> Vec<Case> {
    let level = at_most_avx2();
    let mut cases: Vec<Case> = Vec::new();
    for joints in 1..=7 {
        let bins = Bins::<f32>::new(joints);
        cases.push(Box::new(move || kept(f32::dispatch(level, Values(black_box(&bins))))));
    }
    let single = Bins::<f32>::new(3);
    cases.push(Box::new(move || kept(Values(black_box(&single)).run::<f32>(0.0))));
    let double = Bins::<f64>::new(3);
    cases.push(Box::new(move || kept(f64::dispatch(level, Values(black_box(&double))))));
    for seam in [false, true] {
        let double = Bins::<f64>::new(3);
        cases.push(Box::new(move || {
            kept(f64::dispatch(level, Gradients { bins: black_box(&double), seam }));
        }));
    }

    let searched = milled();
    let guess = Random::new(2).bushings(3);
    let targets = targets(&mill3(), &MEASUREMENT, &searched);
    cases.push(Box::new(move || {
        kept(spectral::losses(&targets, black_box(&searched), &guess, level));
    }));
    let (chain, bounds, refined) = (mill3(), bounds(), milled());
    let mut guess = nominal();
    guess.iter_mut().flat_map(|bushing| &mut bushing.stiffness).for_each(|k| *k *= 1.1);
    let sought = parameters(3);
    let mut refinement = Box::new(Refinement::new(&sought, &guess));
    cases.push(Box::new(move || {
        let problem = Problem { level, ..problem(&chain, &MEASUREMENT, &bounds, &sought) };
        kept(refinement.step(&problem, &refined));
    }));
    cases
}

fn milled() -> Vec<Experiment<{ common::BINS }>> {
    experiments(&nominal(), &mut Random::new(1))
}

/// So that the compiler cannot leave out what made it.
fn kept<T>(result: T) {
    black_box(&result);
}

/// The cost of each case.
fn count() -> Result<BTreeMap<&'static str, f64>> {
    // What an earlier run has left must not pass for this one's.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("instructions");
    match fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            return Err(error).context("old counts");
        }
        _ => fs::create_dir_all(&folder)?,
    }
    let out = folder.join("case");
    let status = Command::new("valgrind")
        .env("GLIBC_TUNABLES", TUNABLES)
        .args(["--quiet", "--tool=callgrind"])
        .args(["--toggle-collect=instructions::measured", "--dump-after=instructions::measured"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(std::env::current_exe()?)
        .arg(COUNTED)
        .status()
        .context("valgrind does not start: apt-get install valgrind")?;
    ensure!(status.success(), "under valgrind the bench ends with {status}");
    (1..)
        .zip(COUNTS)
        .map(|(part, (what, _))| {
            let file = format!("{}.{part}", out.display());
            let text = fs::read_to_string(&file).with_context(|| file.clone())?;
            let sum = text.lines().find_map(|line| line.strip_prefix("summary: "));
            let sum = sum.with_context(|| format!("{file} has no summary"))?;
            Ok((what, sum.trim().parse()?))
        })
        .collect()
}

/// A limit that holds for any compiler.
fn ratios<'a>(counts: &BTreeMap<&'static str, f64>) -> Vec<Held<'a>> {
    let single = counts["receptance f32, 3 joints"];
    let gradient = counts["receptance f64 and its gradient"];
    let joints = |from: &str, to: &str| counts[to] - counts[from];
    let milled = milled();
    let searched: usize = milled.iter().map(|one| one.thinned.omega.len()).sum();
    let refined: usize = milled.iter().map(Experiment::bins).sum();
    // AVX2 takes eight numbers at once.
    let needed = operations(Values(&Bins::new(3)));
    let needed = (needed.multiplications + needed.additions) as f64 / 8.0;
    let seam = counts["receptance f64 and its gradient, seam"];
    vec![
        Held::below(
            "receptance f64 and its gradient, by receptance f64",
            gradient / counts["receptance f64"],
            2.5,
        ),
        Held::below("the same, seam", seam / counts["receptance f64"], 2.5),
        Held::below(
            "joints 4 to 7, by joints 1 to 4",
            joints("receptance f32, 4 joints", "receptance f32, 7 joints")
                / joints("receptance f32, 1 joint", "receptance f32, 4 joints"),
            1.02,
        ),
        Held::below(
            "receptance f32, by receptance f32 bin by bin",
            single / counts["receptance f32, bin by bin"],
            0.125,
        ),
        Held::below("receptance f32, by its vectors of arithmetic", single / needed, 2.5),
        Held::below(
            "loss, by receptance f32 of as many bins",
            counts["loss of three experiments"] / (single * searched as f64 / BINS as f64),
            1.1,
        ),
        Held::below(
            "refinement step, by receptance f64 of as many bins",
            counts["refinement step of three experiments"]
                / (counts["receptance f64"] * refined as f64 / BINS as f64),
            55.0,
        ),
    ]
}
