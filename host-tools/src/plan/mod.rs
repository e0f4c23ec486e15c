//! The next experiment: which pose and which cut would shrink the uncertainty of the parameters most.
//!
//! What an experiment tells of the parameters (its Fisher information) depends on pose, force and noise, and on the
//! parameters themselves, but not on what the accelerometer will read: it is known before anybody mills. Experiments
//! are chosen one after the other from a grid of poses within the joints' limits and of cuts that the scenario knows.
//! Whether a pose is clear of walls and workpieces is for who drives the robot.
//!
//! | module         | holds                                                     |
//! | -------------- | --------------------------------------------------------- |
//! | [`start`]      | what is known already: nothing but bounds, or an estimate |
//! | [`candidates`] | the experiments to choose from, and what each would tell  |
//! | [`greedy`]     | the choice                                                |
//! | [`prediction`] | what the parameters will be known to                      |
//! | [`table`]      | the plan for people                                       |

pub mod candidates;
pub mod greedy;
pub mod prediction;
pub mod start;
pub mod table;

use std::path::Path;

use flexid_core::refine::Information;
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};
use serde::Serialize;

use crate::simulation::scenario::{Experiment, Feed};
use candidates::{Candidate, Candidates};
use greedy::Criterion;
use prediction::Prediction;
use start::Start;

/// Experiments in the order in which they should be done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// What makes one experiment better than another.
    pub criterion: Criterion,
    /// Experiments that were chosen from.
    pub candidates: usize,
    /// Before the first.
    pub now: Prediction,
    /// Best first.
    pub steps: Vec<Step>,
}

/// One experiment of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Spindle speed at the beginning and at the end of the cut, revolutions per minute.
    pub spindle_rpm: [f64; 2],
    /// Axis of the TCP along which the tool is fed.
    pub feed: Feed,
    /// After it, and all before.
    pub after: Prediction,
}

/// Chooses `count` experiments, fewer if no other tells anything.
pub fn plan(
    workplace: &Candidates<'_>,
    start: &Start,
    candidates: &[Candidate],
    criterion: Criterion,
    count: usize,
) -> Plan {
    let (config, sought, prior) = (workplace.config, workplace.sought, workplace.prior());
    let mut told = start.information.clone();
    let predict = |told: &Information| {
        let mut with_prior = told.clone();
        with_prior.add(&prior);
        let uncertainty = criterion.uncertainty(&with_prior, sought.unknowns());
        Prediction::new(config, sought, told, uncertainty)
    };
    let now = predict(&told);
    let mut known = told.clone();
    known.add(&prior);
    let informations: Vec<_> = candidates.iter().map(|one| &one.information).collect();
    let chosen = greedy::choose(criterion, &known, &informations, sought.unknowns(), count);
    // What has been chosen is worth a simulation.
    let simulated =
        chosen.par_iter().map(|&index| workplace.simulate(&candidates[index].experiment));
    let simulated: Vec<Option<Information>> = simulated.collect();
    let steps = chosen.iter().zip(simulated).map(|(&index, simulated)| {
        let Candidate { experiment, information } = &candidates[index];
        told.add(simulated.as_ref().unwrap_or(information));
        let Experiment { pose, spindle_rpm, feed, .. } = experiment.clone();
        Step { pose, spindle_rpm, feed, after: predict(&told) }
    });
    let steps = steps.collect();
    Plan { criterion, candidates: candidates.len(), now, steps }
}

/// The file's name without its folder.
fn file_name(file: &Path) -> std::path::Display<'_> {
    file.file_name().map_or(file, Path::new).display()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use flexid_core::calibration::Nuisances;
    use flexid_core::unknowns::Sought;
    use flexid_edge::config::Config;
    use rayon::ThreadPoolBuilder;

    use super::*;
    use crate::simulation::scenario::Scenario;

    /// The tool on the axis of joint 1, whose turning hardly moves it.
    const SINGULAR: [f64; 3] = [0.0, -2.0, 0.243];

    /// The first choice is better than the median candidate, and never that at the singular pose.
    #[test]
    fn the_first_choice_beats_the_median() {
        let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenario/edge.toml"));
        let config = Config::load(file).unwrap();
        let scenario = Scenario::of(&config).unwrap();
        let sought = Sought::new(3, &Nuisances::default());
        let start = Start::unknown(&config, &sought);
        let chain = config.model.chain().unwrap();
        let workplace = Candidates {
            config: &config,
            chain: &chain,
            scenario: &scenario,
            cutting: scenario.cutting,
            bushings: &start.bushings,
            sought: &sought,
        };
        let mut poses = workplace.poses(8);
        poses.push(SINGULAR.to_vec());
        let threads = ThreadPoolBuilder::new().stack_size(16 << 20).build().unwrap();
        threads.install(|| {
            let candidates = workplace.evaluate(&poses, || ()).unwrap();
            let prior = workplace.prior();
            for criterion in [Criterion::D, Criterion::A] {
                let size = |candidate: &Candidate| {
                    let mut known = prior.clone();
                    known.add(&candidate.information);
                    criterion.uncertainty(&known, sought.unknowns())
                };
                let mut sizes: Vec<f64> = candidates.iter().map(size).collect();
                sizes.sort_unstable_by(f64::total_cmp);
                let plan = plan(&workplace, &start, &candidates, criterion, 1);
                let ratio = sizes[sizes.len() / 2] / sizes[0];
                assert!(ratio > 1.2, "{criterion:?}: {ratio}");
                assert_ne!(plan.steps[0].pose, SINGULAR);
                assert!(plan.steps[0].after.uncertainty < 0.01 * plan.now.uncertainty);
            }
        });
    }
}
