//! The next experiment: the pose and the cut that shrink the uncertainty of the parameters most.
//!
//! The Fisher information of an experiment about the parameters depends on the pose, the force, the noise and the
//! parameters, but not on the reading of the accelerometer. It can be computed before the experiment is done. The
//! plan chooses experiments one after the other from poses in the place of the work and from the scenario's
//! cuts. It simulates each chosen experiment before it chooses the next. It does not check whether a pose is clear of
//! walls and workpieces.
//!
//! | module         | holds                                                     |
//! | -------------- | --------------------------------------------------------- |
//! | [`start`]      | the information at the start: bounds, or an estimate      |
//! | [`candidates`] | the experiments to choose from, and their information     |
//! | [`greedy`]     | the choice                                                |
//! | [`own`]        | cuts that the user means to mill                          |
//! | [`prediction`] | the expected precision of the parameters                  |
//! | [`table`]      | the plan for people                                       |

pub mod candidates;
pub mod greedy;
pub mod own;
mod parameters;
pub mod prediction;
pub mod start;
pub mod table;

use std::cmp::Ordering;

use flexid_core::refine::Information;
use flexid_pipeline::check::Examined;
use flexid_pipeline::knowledge::Knowledge;
use flexid_pipeline::names::name;
use flexid_simulation::scenario::{Experiment, Feed};
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};
use serde::Serialize;

use candidates::{Candidate, Candidates};
use greedy::Criterion;
use own::Own;
pub(crate) use parameters::parameters;
use prediction::{Prediction, deviations};
use start::Start;

use crate::place::tool;

/// Experiments, best for a robot without imperfections, of which the best for a robot with them is chosen. Chosen: a core weighs them in a second.
const SHORTLIST: usize = 16;

/// Experiments in the order in which they should be done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// Criterion by which experiments are compared.
    pub criterion: Criterion,
    /// Largest force of a tooth along the cutting speed, N.
    pub peak_tangential_n: f64,
    /// Number of experiments to choose from, without those given up.
    pub candidates: usize,
    /// Number of experiments that the plan gave up, because the simulated robot does not withstand them.
    pub given_up: usize,
    /// Prediction before the first experiment.
    pub now: Prediction,
    /// Cuts of the user, in their order. The chosen experiments stand in place of them.
    pub own: Vec<OwnStep>,
    /// Chosen experiments, best first.
    pub steps: Vec<Step>,
    /// All parameters; tied ones count once.
    pub parameters: Vec<Expected>,
}

/// A parameter, and its relative standard deviations: infinite (`null` in JSON) where the experiments do not determine it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Expected {
    /// Name, for example `joint_1 tx stiffness`.
    pub name: String,
    /// Before the first experiment.
    pub now: f64,
    /// After all cuts of the user; `None` without any.
    pub own: Option<f64>,
    /// After all chosen experiments.
    pub steps: f64,
}

/// A cut of the user.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OwnStep {
    /// Its name.
    pub name: String,
    /// Joint angles at the start, rad (m).
    pub pose: Vec<f64>,
    /// Place of the tool at the start along the axes of the base, m.
    pub tool_m: [f64; 3],
    /// Its path in words; `None` where the robot stands.
    pub path: Option<String>,
    /// Spindle speed at the beginning and at the end of the cut, revolutions per minute.
    pub spindle_rpm: [f64; 2],
    /// Axis of the TCP along which the cutter's force takes the tool to be fed.
    pub feed: Feed,
    /// Number of records that a fit takes.
    pub records: usize,
    /// Time of these that a fit uses, s.
    pub seconds: f64,
    /// Prediction after this cut and all before it.
    pub after: Prediction,
}

/// One experiment of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Place of the tool along the axes of the base, m.
    pub tool_m: [f64; 3],
    /// Spindle speed at the beginning and at the end of the cut, revolutions per minute.
    pub spindle_rpm: [f64; 2],
    /// Axis of the TCP along which the tool is fed.
    pub feed: Feed,
    /// Prediction after this experiment and all before it.
    pub after: Prediction,
}

/// Chooses `count` experiments, or fewer if the robot withstands none of those that are left. It may choose one more
/// than once. It calls `chosen` once for each. It predicts what the user's `own` cuts give in place of them.
pub fn plan(
    workplace: &Candidates<'_>,
    start: &Start,
    candidates: &[Candidate],
    own: &[Own],
    criterion: Criterion,
    count: usize,
    chosen: impl Fn(),
) -> Plan {
    let (config, sought) = (workplace.config, workplace.sought);
    let bounds = Information::of_bounds(sought, &config.bounds);
    let within_bounds = |information: &Information| {
        let mut known = information.clone();
        known.add(&bounds);
        known
    };
    let predict = |information: &Information| {
        let uncertainty = criterion.uncertainty(&within_bounds(information), parameters(sought));
        Prediction::new(&config.model, sought, information, uncertainty)
    };
    let mut others = start.information.clone();
    others.add(&Information::of_priors(sought));
    let of = |known: &Knowledge| {
        let mut information = known.of_unknowns();
        information.add(&others);
        information
    };
    let assumed = workplace.assumed();
    let mut known = assumed.priors();
    let statics = assumed.of_statics(&config.statics.tests);
    if let Some(statics) = statics.filter(|_| !start.has_statics) {
        known.add(&statics);
    }
    let (at_first, now) = (of(&known), predict(&of(&known)));
    let mut with_own = known.clone();
    let own_step = |Own { experiment, survey, path }: &Own| {
        survey.knowledge.iter().for_each(|records| with_own.add(records));
        let Experiment { name, pose, spindle_rpm, feed, .. } = experiment.clone();
        let used_s =
            |own: &Examined| own.travel.as_ref().map_or(own.seconds, |travel| travel.even_s());
        OwnStep {
            name,
            tool_m: tool(workplace.chain, &pose).into(),
            pose,
            path: path.clone(),
            spindle_rpm,
            feed,
            records: survey.usable().count(),
            seconds: survey.usable().map(used_s).sum(),
            after: predict(&of(&with_own)),
        }
    };
    let own_steps: Vec<_> = own.iter().map(own_step).collect();
    let mut left: Vec<&Candidate> = candidates.iter().collect();
    let mut steps = Vec::new();
    while steps.len() < count {
        let informations: Vec<_> = left.iter().map(|one| &one.information).collect();
        let within = within_bounds(&of(&known));
        let ranked = greedy::ranked(criterion, &within, &informations, parameters(sought));
        let shortlist = &ranked[..ranked.len().min(SHORTLIST)];
        let weighed = |index: &usize| {
            let planned = workplace.plan(&left[*index].experiment)?;
            let mut with = known.clone();
            with.add(&planned);
            let size = criterion.uncertainty(&within_bounds(&of(&with)), parameters(sought));
            size.is_finite().then_some(size)
        };
        let sizes: Vec<Option<f64>> = shortlist.par_iter().map(weighed).collect();
        let sizes = || shortlist.iter().zip(&sizes);
        if let Some((&lost, _)) = sizes().find(|(_, size)| size.is_none()) {
            left.remove(lost);
            continue;
        }
        let best = sizes().min_by(|a, b| a.1.partial_cmp(b.1).unwrap_or(Ordering::Equal));
        let Some((&best, _)) = best else { break };
        // Only chosen experiments are simulated.
        let Some(simulated) = workplace.simulate(&left[best].experiment) else {
            left.remove(best);
            continue;
        };
        known.add(&simulated);
        let Experiment { pose, spindle_rpm, feed, .. } = left[best].experiment.clone();
        let tool_m = tool(workplace.chain, &pose).into();
        steps.push(Step { pose, tool_m, spindle_rpm, feed, after: predict(&of(&known)) });
        chosen();
    }
    let [first, mine, last] =
        [&at_first, &of(&with_own), &of(&known)].map(|known| deviations(sought, known));
    let parameter = |unknown: usize| {
        let coordinate = sought.coordinate(unknown);
        Expected {
            name: coordinate.map(|own| name(&config.model, own).to_string()).unwrap_or_default(),
            now: first[unknown],
            own: (!own.is_empty()).then(|| mine[unknown]),
            steps: last[unknown],
        }
    };
    Plan {
        criterion,
        peak_tangential_n: workplace.cutting.peak_tangential_n,
        candidates: left.len(),
        given_up: candidates.len() - left.len(),
        now,
        own: own_steps,
        steps,
        parameters: (0..parameters(sought)).map(parameter).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::path::Path;

    use flexid_core::sought::Sought;
    use flexid_pipeline::config::Config;
    use flexid_simulation::scenario::Scenario;
    use rayon::ThreadPoolBuilder;

    use super::*;
    use crate::place::Place;

    /// A pose with the tool on the axis of joint 1, which hardly moves it.
    const SINGULAR: [f64; 3] = [0.0, -2.0, 0.243];

    /// Runs `test` with the reference scenario and a start without information.
    fn at_work(keys: &[(&str, f64)], test: impl FnOnce(&Candidates<'_>, &Start) + Send) {
        let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenario/mill3-edge.toml"));
        let config = Config::load(file).unwrap();
        let scenario = Scenario::of(&config).unwrap();
        let mut sought = Sought::new(3).unwrap();
        keys.iter().for_each(|(key, prior)| sought.seek(key, *prior).unwrap());
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
        let threads = ThreadPoolBuilder::new().stack_size(16 << 20).build().unwrap();
        threads.install(|| test(&workplace, &start));
    }

    /// Poses in the place of the scenario's experiments.
    fn poses(workplace: &Candidates<'_>, count: usize) -> Vec<Vec<f64>> {
        let references = workplace.scenario.poses();
        let (model, chain) = (&workplace.config.model, workplace.chain);
        Place::about(model, chain, workplace.config.gravity, &references, None, false)
            .poses(count)
            .poses
    }

    /// The first choice is the best of all candidates. It differs between the criteria, and never has the singular
    /// pose.
    #[test]
    fn the_first_choice_is_the_best() {
        at_work(&[], |workplace, start| {
            let mut poses = poses(workplace, 16);
            poses.push(SINGULAR.to_vec());
            let candidates = workplace.evaluate(&poses, || ()).unwrap();
            let bounds = Information::of_bounds(workplace.sought, &workplace.config.bounds);
            let unknowns = workplace.sought.unknowns();
            let best = [Criterion::D, Criterion::A].map(|criterion| {
                let size = |candidate: &Candidate| {
                    let mut known = bounds.clone();
                    known.add(&candidate.information);
                    let covariance = known.covariance();
                    match criterion {
                        Criterion::D => -known.log_determinant(unknowns),
                        Criterion::A => {
                            (0..unknowns).map(|i| covariance.deviation(i).powi(2)).sum()
                        }
                    }
                };
                let sizes: Vec<f64> = candidates.iter().map(size).collect();
                let best = (0..sizes.len()).min_by(|&a, &b| sizes[a].total_cmp(&sizes[b])).unwrap();
                let plan = plan(workplace, start, &candidates, &[], criterion, 1, || ());
                let Step { pose, spindle_rpm, feed, after, .. } = &plan.steps[0];
                let Experiment { pose: its_pose, spindle_rpm: its_rpm, feed: its_feed, .. } =
                    &candidates[best].experiment;
                assert_eq!((pose, spindle_rpm, feed), (its_pose, its_rpm, its_feed));
                assert_ne!(pose[..], SINGULAR);
                assert!(after.uncertainty < 0.01 * plan.now.uncertainty);
                best
            });
            assert_ne!(best[0], best[1], "the candidates do not distinguish the criteria");
        });
    }

    /// A common factor of all masses and parameters has the effect of the accelerometer's gain. Only the priors
    /// separate the two, and no experiment determines the parameters better than the priors do.
    #[test]
    fn priors_count_as_in_a_fit() {
        let prior = 0.02;
        at_work(&[("acceleration_gain", prior), ("link_mass", prior)], |workplace, start| {
            let candidates = workplace.evaluate(&poses(workplace, 4), || ()).unwrap();
            let plan = plan(workplace, start, &candidates, &[], Criterion::D, 1, || ());
            let Prediction { identified, weak, not_observable, median, .. } = plan.steps[0].after;
            assert_eq!((identified + weak, not_observable), (36, 0));
            // Three gains and three masses share the factor.
            assert!((prior / 6.0..2.0 * prior).contains(&median), "{median}");
        });
    }

    #[test]
    fn what_the_robot_does_not_stand_is_not_recommended() {
        at_work(&[], |workplace, start| {
            let mut candidates = workplace.evaluate(&poses(workplace, 1), || ()).unwrap();
            candidates.truncate(2);
            let sound = candidates[0].experiment.clone();
            // Without the simulation this candidate is better than the other.
            let twice = candidates[0].information.clone();
            candidates[1].information.add(&twice);
            candidates[1].experiment.pose = vec![f64::NAN; 3];
            let chosen = Cell::new(0);
            let note = || chosen.set(chosen.get() + 1);
            let planned = plan(workplace, start, &candidates, &[], Criterion::D, 2, note);
            assert_eq!(chosen.get(), 2);
            assert_eq!((planned.candidates, planned.given_up), (1, 1));
            let poses: Vec<_> = planned.steps.iter().map(|step| &step.pose).collect();
            assert_eq!(poses, [&sound.pose; 2]);
            assert!(
                plan(workplace, start, &candidates[1..], &[], Criterion::D, 2, || ())
                    .steps
                    .is_empty()
            );
        });
    }
}
