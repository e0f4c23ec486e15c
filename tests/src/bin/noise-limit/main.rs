//! The statistics of the identification: `cargo run --release -p flexid-hil --bin noise-limit`.
//!
//! Robots are drawn from the reference scenario's bounds and simulated in time, by a dense linear model or the
//! nonlinear one; nothing of the identifier's frequency domain takes part in that, nor in the bound that its errors
//! are compared with. Prints a table of figures and limits; the exit status is 1 if one does not hold. Same
//! arguments, same figures.

mod bound;
#[path = "../../../../core/tests/common/mod.rs"]
mod common;
mod coverage;
mod displacement;
mod figure;
mod find;
mod linear;
mod noise_free;
mod nonlinear;
mod records;
mod study;
mod unexcited;
mod wide_bounds;

use std::process::ExitCode;
use std::time::Instant;

use anyhow::Result;
use clap::Parser;
use rayon::ThreadPoolBuilder;

use figure::{Figure, Proven, Table};
use study::Study;

/// Core keeps everything in place and passes it on by value when it is made.
const STACK: usize = 64 << 20;

/// Proves a part of it with so many robots at most; says more if asked to.
type Prove = fn(&Study, usize, bool) -> Result<Vec<Figure>>;

const PARTS: [(&str, Prove); 6] = [
    ("noise-free", noise_free::prove),
    ("coverage", coverage::prove),
    ("unexcited", unexcited::prove),
    ("displacement", displacement::prove),
    ("nonlinear", nonlinear::prove),
    ("wide-bounds", wide_bounds::prove),
];

/// Proves that the identification reaches the noise limit, and that its intervals are honest.
#[derive(Parser)]
struct Args {
    /// Only this part; may be given more than once
    #[arg(long, value_name = "PART", value_parser = PARTS.map(|(name, _)| name))]
    only: Vec<String>,
    /// Robots of each part, at most: fewer for a quick look. Limits on shares and averages widen as these scatter more
    #[arg(long, value_name = "N", default_value_t = usize::MAX, hide_default_value = true)]
    robots: usize,
    /// Threads [default: one a core]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Also what lies behind the figures: parameters and robots, to stderr
    #[arg(long)]
    details: bool,
}

fn main() -> Result<ExitCode> {
    let args = Args::parse();
    let threads = ThreadPoolBuilder::new().num_threads(args.threads).stack_size(STACK).build()?;
    let study = Study::load()?;
    let mut table = Table(Vec::new());
    for (part, prove) in PARTS {
        if !args.only.is_empty() && !args.only.iter().any(|only| only == part) {
            continue;
        }
        eprintln!("{part} ...");
        let begun = Instant::now();
        let figures = threads.install(|| prove(&study, args.robots.max(1), args.details))?;
        table.0.push(Proven { part, figures, took: begun.elapsed() });
    }
    print!("{table}");
    Ok(if table.held() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
