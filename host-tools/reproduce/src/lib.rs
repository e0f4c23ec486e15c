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

use method::{METHODS, Method, SAMPLES};
use robot::{Robot, Study};
use solve::Outcome;
use tables::{DisplacementIllustration, Run, SearchIllustration, Tables};

/// Amount of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of robots that every method meets. `None`: each method meets its own number
    /// ([`method::Method::robots`]).
    pub robots: Option<usize>,
    /// Iterations of the random search.
    pub iterations: u32,
    /// Samples of the global sensitivity analysis. It costs this number times P + 1 evaluations.
    pub sobol_samples: u32,
}

impl Effort {
    /// A full reproduction: ten minutes on two cores.
    pub const FULL: Self = Self { seed: 2, robots: None, iterations: 500, sobol_samples: 256 };
    /// The report with rough numbers, in less than a minute.
    pub const QUICK: Self = Self { seed: 2, robots: Some(3), iterations: 50, sobol_samples: 16 };

    /// Number of robots that `method` meets, from the first on.
    pub fn robots_of(&self, method: &Method) -> usize {
        self.robots.unwrap_or(method.robots)
    }

    /// Number of robots altogether.
    pub fn robots(&self) -> usize {
        METHODS.iter().map(|method| self.robots_of(method)).max().unwrap_or(0)
    }

    /// Number of robots on whose unseen experiments fits are tested: those that all methods meet whose fits are
    /// tested.
    pub fn validated(&self) -> usize {
        let tried = METHODS.iter().filter(|method| method.is_validated());
        tried.map(|method| self.robots_of(method)).min().unwrap_or(0)
    }

    /// Number of trials: one method on one robot each.
    pub fn trials(&self) -> usize {
        METHODS.iter().map(|method| self.robots_of(method)).sum()
    }

    /// Number of evaluations of every method.
    pub fn evaluations(&self) -> u64 {
        u64::from(self.iterations) * u64::from(SAMPLES)
    }
}

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
