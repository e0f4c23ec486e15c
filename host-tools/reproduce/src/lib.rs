//! A reproduction of the paper's tables and figures. Paired tests compare the methods over the robots that both met,
//! from the same experiments, with the same number of evaluations. The cost of sensitivities comes on top. flexid has
//! a budget of its own, and noise.
//!
//! | module                        | holds                                                                    |
//! | ----------------------------- | ------------------------------------------------------------------------ |
//! | [`method`]                    | the methods, as combinations of what the paper tests one by one          |
//! | [`robot`]                     | a robot drawn from the bounds, and its experiments                       |
//! | [`displacement`]              | the displacement of reference and model, and the losses between them     |
//! | `thinning`                    | the receptance at every bin, computed where it is sharp                  |
//! | [`test_stand`]                | losses and parameter deviation of a guess                                |
//! | [`sobol`], [`rivals`]         | global sensitivity analysis; genetic algorithm, particle swarm, CMA-ES   |
//! | [`solve`], [`flexid`]         | one method on one robot                                                  |
//! | [`statistics`], [`compare`]   | intervals, paired tests, power                                           |
//! | [`illustration`]              | figures 3 and 5                                                          |
//! | [`choices`]                   | the points that the paper leaves open                                    |
//! | [`tables`], [`report`]        | the results: `tables.json` and `report.html`                             |
#![forbid(unsafe_code)]

pub mod choices;
pub mod compare;
pub mod displacement;
mod effort;
pub mod flexid;
pub mod illustration;
pub mod method;
#[cfg(test)]
#[path = "../../simulation/src/reference.rs"]
mod reference;
pub mod report;
pub mod rivals;
pub mod robot;
pub mod sobol;
pub mod solve;
pub mod statistics;
pub mod tables;
pub mod test_stand;
mod thinning;

use std::time::Instant;

use fearless_simd::Level;
use flexid_pipeline::input::BadInput;
use rayon::iter::{IntoParallelIterator as _, IntoParallelRefIterator as _, ParallelIterator as _};

pub use effort::Effort;
use method::{METHODS, Method, SAMPLES};
use robot::{Robot, Study};
use solve::Outcome;
use tables::{DisplacementIllustration, Run, SearchIllustration, Tables};

/// Stack of a thread that runs methods, bytes: flexid's records and experiments have a fixed size.
pub const STACK: usize = 64 << 20;

/// All results of one robot.
struct Findings {
    /// Outcomes in the order of [`METHODS`]; `None` for a method that does not meet the robot.
    outcomes: Vec<Option<Outcome>>,
    /// Figures 3 and 5, of the first robot only.
    illustrations: Option<(SearchIllustration, DisplacementIllustration)>,
}

/// Runs every method on every robot, on all threads of the present pool, whose stacks must have [`STACK`] bytes. It
/// calls `tick` after each of [`Effort::trials`].
///
/// # Errors
/// A robot drawn from the scenario does not withstand its force, or its losses leave the range of floating point.
pub fn run(
    study: &Study,
    effort: &Effort,
    level: Level,
    tick: impl Fn() + Sync,
) -> Result<Tables, BadInput> {
    let start = Instant::now();
    let mut findings: Vec<Findings> = (0..effort.robots() as u64)
        .into_par_iter()
        .map(|number| {
            let unseen = if number < effort.validated() as u64 { robot::UNSEEN } else { 0 };
            examine(study, &study.draw(effort.seed, number, unseen)?, effort, level, &tick)
        })
        .collect::<Result<_, _>>()?;
    let illustrations = findings.first_mut().and_then(|first| first.illustrations.take());
    let (search, displacement) = illustrations.unwrap_or_default();
    let methods = compare::rows(&findings);
    Ok(Tables {
        run: Run {
            seed: effort.seed,
            robots: effort.robots(),
            iterations: effort.iterations,
            samples: SAMPLES,
            evaluations: effort.evaluations(),
            parameters: study.parameters(),
            experiments: study.scenario.experiments.len(),
            unseen: robot::UNSEEN,
            scenario: (!study.is_reference).then(|| study.file.display().to_string()),
            simd: format!("{level:?}").split('(').next().unwrap_or_default().to_lowercase(),
        },
        comparisons: compare::comparisons(&methods),
        methods,
        sensitivity_cost: compare::sensitivity_costs(&findings),
        search,
        displacement,
        choices: choices::choices(study, effort),
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Runs every method on one robot.
fn examine(
    study: &Study,
    robot: &Robot,
    effort: &Effort,
    level: Level,
    tick: &(impl Fn() + Sync),
) -> Result<Findings, BadInput> {
    let solve = |method: &Method| {
        if robot.number >= effort.robots_of(method) as u64 {
            return Ok(None);
        }
        let outcome = solve::solve(method, study, robot, effort, level).map_err(|error| {
            let message = format!(
                "the global sensitivity analysis fails: {error}: are these a robot's numbers?"
            );
            BadInput::new(&study.file, message)
        })?;
        tick();
        Ok(Some(outcome))
    };
    let outcomes = METHODS.par_iter().map(solve).collect::<Result<Vec<_>, BadInput>>()?;
    let illustrations = (robot.number == 0).then(|| {
        (
            illustration::search(study, robot, effort, level),
            illustration::displacement(study, robot, &outcomes),
        )
    });
    Ok(Findings { outcomes, illustrations })
}
