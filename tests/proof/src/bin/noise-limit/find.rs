//! A robot found from its records, and the report to its user.

use anyhow::{Context, Result, ensure};
use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::identify::{
    Acceptance, Estimate, Identifier, MAX_NOISE_ROUNDS, Phase, PlantEstimate,
};
use flexid_core::imperfection::Accuracies;
use flexid_core::parameters::{Bounds, Bushings};
use flexid_core::refine::{Explanation, Plant};
use flexid_core::sought::Sought;
use flexid_core::spectrum::{Experiment, Measurement};
use flexid_core::statics::StaticTest;
use flexid_core::verdict::Verdict;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::records::{BINS, Record, experiment};
use crate::study::logarithms;

/// The task of the identification: model, bounds, measurement, imperfections that are sought, and static tests.
pub(crate) struct Task<'a> {
    pub(crate) chain: &'a Chain,
    pub(crate) bounds: Bounds,
    pub(crate) measurement: Measurement,
    /// Keys of the imperfections that are sought, each with the standard deviation of its prior.
    pub(crate) sought: &'a [(&'a str, f64)],
    pub(crate) statics: Vec<StaticTest>,
}

/// The result of the identification.
pub(crate) struct Found {
    pub(crate) estimate: Box<Estimate>,
    /// Standard deviation of each logarithm, as reported; infinite where there is none.
    pub(crate) deviations: Vec<f64>,
    pub(crate) verdicts: Vec<Verdict>,
    /// Number of searches.
    pub(crate) starts: u32,
    /// Accuracies that the data contradict; none if no plant was fitted.
    pub(crate) explanations: Vec<Explanation>,
    /// The fit with these adopted; `None` if no plant was fitted.
    pub(crate) adopted: Option<Box<Self>>,
    /// Tones of each record: frequency, Hz, and amplitude, m/s².
    pub(crate) tones: Vec<Vec<(f64, f64)>>,
}

impl Task<'_> {
    /// What is sought.
    pub(crate) fn sought(&self) -> Result<Sought> {
        let mut sought = Sought::new(self.chain.joints().len())?;
        for (key, prior) in self.sought {
            sought.seek(key, *prior)?;
        }
        Ok(sought)
    }

    /// An identifier for this task.
    pub(crate) fn identifier(
        &self,
        random: Xoshiro256PlusPlus,
    ) -> Result<Box<Identifier<Xoshiro256PlusPlus>>> {
        let Self { chain, bounds, measurement, statics, .. } = self;
        let new = Identifier::new((*chain).clone(), *bounds, *measurement, Level::new(), random);
        let mut identifier = Box::new(new);
        identifier.seek(self.sought()?)?;
        identifier.add_statics(statics)?;
        Ok(identifier)
    }
}

/// Identifies a robot from records to the end, as the daemon does.
pub(crate) fn find(task: &Task, records: &[Record], random: Xoshiro256PlusPlus) -> Result<Found> {
    let identifier = settled(task, records, random)?;
    let estimate = identifier.estimate().context("a settled identifier without an estimate")?;
    Ok(Found::new(estimate, identifier.progress().effort.starts))
}

/// The identifier that has settled on these records.
pub(crate) fn settled(
    task: &Task,
    records: &[Record],
    random: Xoshiro256PlusPlus,
) -> Result<Box<Identifier<Xoshiro256PlusPlus>>> {
    let mut experiments = experiments(task, records)?;
    let mut identifier = task.identifier(random)?;
    identifier.renew(&experiments);
    while identifier.step(&mut experiments) != Phase::Settled {}
    Ok(identifier)
}

/// Identifies a robot whose plant has these accuracies, as the daemon does.
pub(crate) fn find_on_plant(
    task: &Task,
    accuracies: &Accuracies,
    records: &[Record],
    random: Xoshiro256PlusPlus,
) -> Result<Found> {
    let OnPlant { mut identifier, mut experiments, mut plant, found } =
        settled_on_plant(task, accuracies, records, random)?;
    plant.adopt(true);
    let adopted = identifier.estimate_of_plant(&mut experiments, &mut plant, || true);
    let adopted = adopted.context("a plant that adopts without an estimate")?;
    let starts = identifier.progress().effort.starts;
    let tones = experiments.iter().map(|one| one.tones_hz().collect()).collect();
    let adopted = Some(Box::new(Found::of_plant(&adopted, starts)));
    Ok(Found { adopted, tones, ..Found::of_plant(&found, starts) })
}

/// A fit to a plant, and what it rests on.
pub(crate) struct OnPlant {
    pub(crate) identifier: Box<Identifier<Xoshiro256PlusPlus>>,
    pub(crate) experiments: Vec<Experiment<BINS>>,
    /// It stands where the fit has ended.
    pub(crate) plant: Box<Plant>,
    pub(crate) found: PlantEstimate,
}

/// The fit to a plant of these accuracies, with its noise read again as the daemon does.
pub(crate) fn settled_on_plant(
    task: &Task,
    accuracies: &Accuracies,
    records: &[Record],
    random: Xoshiro256PlusPlus,
) -> Result<OnPlant> {
    settled_on_plant_from(task, accuracies, experiments(task, records)?, random)
}

/// Identifies a robot whose plant has these accuracies from experiments. Perfect ones are those of no plant.
pub(crate) fn find_from(
    task: &Task,
    accuracies: &Accuracies,
    mut experiments: Vec<Experiment<BINS>>,
    random: Xoshiro256PlusPlus,
) -> Result<Found> {
    if accuracies.are_perfect() {
        let mut identifier = task.identifier(random)?;
        identifier.renew(&experiments);
        while identifier.step(&mut experiments) != Phase::Settled {}
        let estimate = identifier.estimate().context("a settled identifier without an estimate")?;
        return Ok(Found::new(estimate, identifier.progress().effort.starts));
    }
    let OnPlant { identifier, found, .. } =
        settled_on_plant_from(task, accuracies, experiments, random)?;
    Ok(Found::of_plant(&found, identifier.progress().effort.starts))
}

fn settled_on_plant_from(
    task: &Task,
    accuracies: &Accuracies,
    mut experiments: Vec<Experiment<BINS>>,
    random: Xoshiro256PlusPlus,
) -> Result<OnPlant> {
    ensure!(!experiments.is_empty(), "no record");
    let mut identifier = task.identifier(random)?;
    let mut plant = Box::new(Plant::new(accuracies, task.chain));
    identifier.renew(&experiments);
    for round in 0.. {
        while identifier.step_on_plant(&mut experiments, &mut plant) != Phase::Settled {}
        let found = identifier.estimate_of_plant(&mut experiments, &mut plant, || true);
        let found = found.context("a settled identifier without an estimate")?;
        if round == MAX_NOISE_ROUNDS
            || !identifier.read_noise_again(&mut experiments, Some(&plant), &found.estimate)
        {
            return Ok(OnPlant { identifier, experiments, plant, found });
        }
        identifier.renew_noise(&experiments);
    }
    unreachable!("the last round returns")
}

fn experiments(task: &Task, records: &[Record]) -> Result<Vec<Experiment<BINS>>> {
    records.iter().map(|one| experiment(task.chain, &task.measurement, one)).collect()
}

impl Found {
    fn of_plant(found: &PlantEstimate, starts: u32) -> Self {
        let PlantEstimate { estimate, explanations, .. } = found;
        Self { explanations: explanations.to_vec(), ..Self::new(estimate, starts) }
    }

    /// The verdicts and the deviations are those of the reports that users read.
    pub(crate) fn new(estimate: &Estimate, starts: u32) -> Self {
        let trust = estimate.trust();
        let bushings = estimate.bushings.iter().zip(&estimate.standard_deviations);
        let (verdicts, deviations) = bushings
            .flat_map(|(value, deviation)| {
                let values = value.stiffness.into_iter().chain(value.damping);
                values.zip(deviation.stiffness.into_iter().chain(deviation.damping))
            })
            .map(|(value, deviation)| {
                let (verdict, reported) = trust.verdict(value, deviation);
                (verdict, reported.map_or(f64::INFINITY, |deviation| deviation / value))
            })
            .unzip();
        Self {
            estimate: Box::new(estimate.clone()),
            deviations,
            verdicts,
            starts,
            explanations: Vec::new(),
            adopted: None,
            tones: Vec::new(),
        }
    }

    /// Returns whether noise alone explains the residuals.
    pub(crate) fn is_consistent(&self) -> bool {
        self.estimate.acceptance == Acceptance::Consistent
    }

    /// Returns whether the verdict of parameter `index` is identified.
    pub(crate) fn identifies(&self, index: usize) -> bool {
        self.verdicts[index] == Verdict::Identified
    }

    /// Number of parameters whose verdict is identified.
    pub(crate) fn identified(&self) -> usize {
        self.count(Verdict::Identified)
    }

    /// Number of parameters with this verdict.
    pub(crate) fn count(&self, wanted: Verdict) -> usize {
        self.verdicts.iter().filter(|verdict| **verdict == wanted).count()
    }

    /// Errors of the logarithms.
    pub(crate) fn errors(&self, truth: &Bushings) -> Vec<f64> {
        let found = logarithms(&self.estimate.bushings);
        found.iter().zip(logarithms(truth)).map(|(found, truth)| found - truth).collect()
    }
}
