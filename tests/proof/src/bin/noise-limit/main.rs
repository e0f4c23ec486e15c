//! The statistics of the identification: `cargo run --release -p flexid-proof --bin noise-limit`.
//!
//! Robots are drawn from the reference scenario's bounds and simulated in time, by a dense linear model or by the
//! nonlinear one. Neither the simulation nor the bound with which the errors are compared uses the identifier's
//! frequency domain. The linear model takes its sag from core. The program prints a table of figures and limits. Its
//! exit status is 1 if one does not hold. The same arguments give the same figures.

mod arms;
mod bound;
mod clocks;
#[path = "../../../../../core/tests/common/mod.rs"]
mod common;
mod coverage;
mod deviations;
mod displacement;
mod figure;
mod find;
mod folding;
mod folding_on_plants;
mod hammer;
mod imperfect;
mod intervals;
mod linear;
mod menu;
mod noise_free;
mod nonlinear;
mod nuisances;
mod oracle;
mod plants;
mod predictions;
mod receptances;
mod records;
mod run;
mod spectra;
mod spread;
mod statics;
mod study;
mod unexcited;
mod wide_bounds;

use std::process::ExitCode;
use std::time::Instant;

use anyhow::Result;
use clap::Parser;
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use figure::{Figure, Proven, Table};
use study::Study;

/// Stack of a thread, bytes. Core keeps its data in place and returns them by value.
const STACK: usize = 64 << 20;

/// A part of the proof.
struct Part {
    name: &'static str,
    /// The proof with this number of robots; it prints details if the flag is set.
    prove: fn(&Study, usize, bool) -> Result<Vec<Figure>>,
    /// Number of robots of the full proof, and of the quick one, which leaves out parts of none.
    robots: [usize; 2],
}

const PARTS: [Part; 22] = [
    Part { name: "noise-free", prove: noise_free::prove, robots: [200, 16] },
    Part { name: "coverage", prove: coverage::prove, robots: [1000, 24] },
    Part { name: "unexcited", prove: unexcited::prove, robots: [100, 5] },
    Part { name: "displacement", prove: displacement::prove, robots: [20, 0] },
    Part { name: "nonlinear", prove: nonlinear::prove, robots: [20, 2] },
    Part { name: "nuisances", prove: nuisances::prove, robots: [100, 1] },
    Part { name: "plants", prove: plants::prove, robots: [200, 4] },
    Part {
        name: "plants-of-six",
        prove: |study, robots, details| plants::prove(&study.of_six()?, robots, details),
        robots: [200, 2],
    },
    Part { name: "statics", prove: statics::prove, robots: [40, 0] },
    Part { name: "hammer", prove: hammer::prove, robots: [10, 0] },
    Part {
        name: "hammer-of-six",
        prove: |study, robots, details| hammer::prove(&study.of_six()?, robots, details),
        robots: [10, 0],
    },
    Part { name: "receptances", prove: receptances::prove, robots: [20, 0] },
    Part { name: "clocks", prove: clocks::prove, robots: [10, 0] },
    Part {
        name: "clocks-of-six",
        prove: |study, robots, details| clocks::prove(&study.of_six()?, robots, details),
        robots: [10, 0],
    },
    Part { name: "predictions", prove: predictions::prove, robots: [200, 2] },
    Part { name: "predictions-of-six", prove: predictions::prove_of_six_joints, robots: [40, 0] },
    Part { name: "deviations", prove: deviations::prove, robots: [516, 4] },
    Part { name: "folding", prove: folding::prove, robots: [100, 1] },
    Part { name: "folding-on-plants", prove: folding_on_plants::prove, robots: [20, 0] },
    Part { name: "arms", prove: arms::prove, robots: [100, 3] },
    Part { name: "wide-bounds", prove: wide_bounds::prove, robots: [100, 6] },
    Part { name: "no-bounds", prove: wide_bounds::prove_from_masses, robots: [100, 6] },
];

/// Proves that the identification reaches the noise limit, and that its intervals are honest.
#[derive(Parser)]
struct Args {
    /// Only this part; may be given more than once
    #[arg(long, value_name = "PART", value_parser = PARTS.map(|part| part.name))]
    only: Vec<String>,
    /// Few robots: minutes on two cores. Limits on shares and averages widen as these scatter more
    #[arg(long)]
    quick: bool,
    /// Robots of each part, at most
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    robots: Option<u32>,
    /// Number of the first robot on a drawn plant: plants of other numbers are drawn with other seeds
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    first: u64,
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
    let study = Study::load()?.beginning_at(args.first);
    let begun = Instant::now();
    let size = |part: &Part| {
        let robots = part.robots[usize::from(args.quick)];
        args.robots.map_or(robots, |most| robots.min(most as usize))
    };
    let is_wanted = |part: &&Part| {
        size(part) > 0 && (args.only.is_empty() || args.only.iter().any(|only| only == part.name))
    };
    let proven = |part: &Part| -> Result<Proven> {
        let Part { name, prove, .. } = part;
        let robots = size(part);
        let figures = prove(&study, robots, args.details)?;
        eprintln!("{name}: {robots} robots, after {:.0} s", begun.elapsed().as_secs_f64());
        Ok(Proven { part: name, figures })
    };
    // At once: a part of few robots does not keep all cores at work.
    let parts = || PARTS.par_iter().filter(is_wanted).map(proven).collect::<Result<Vec<_>>>();
    let table = Table(threads.install(parts)?);
    print!("{table}");
    println!("\nTook {:.0} s", begun.elapsed().as_secs_f64());
    Ok(if table.held() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
