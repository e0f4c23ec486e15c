//! The sum of squares of a fit to an imperfect plant: at every point the imperfections are at their best, within their priors.
//!
//! The imperfections p are columns of the normal equations behind the seams, which are those of each record, and before the unknowns,
//! which they share with all records. With their priors, of which each is `p = 0 ± 1`, they are eliminated as the seams are (variable
//! projection: Golub and Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares problems whose variables
//! separate", SIAM Journal on Numerical Analysis 10, 1973). What is left is the information about the unknowns that holds whatever the
//! imperfections are.

mod columns;
mod fit;
mod model;

use heapless::Vec;

use super::batch::Bins;
use super::equations::{Assembly, Equations};
use super::proposal::FLOOR;
use super::record::SMALL_SEAM;
use super::residuals::Residuals;
use super::seam::{MAX_SEAM, Seam};
use super::summary::Summary;
use super::{ParameterNormal, Problem};
use crate::calibration::Calibration;
use crate::chain::linearise::LinearisationError;
use crate::imperfection::{self, Accuracies, Imperfection, MAX_IMPERFECTIONS};
use crate::linear::gram::padded;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::receptance::Terms;
use crate::search::MAX_EXPERIMENTS;
use crate::sought::{Coordinates, MAX_UNKNOWNS};
use crate::spectrum::Experiment;
use columns::{Imperfections, STEP};
use model::Imperfect;

/// Columns of a row: seam, imperfections, unknowns, residual; padded.
const WIDE: usize = padded(MAX_SEAM + MAX_IMPERFECTIONS + MAX_UNKNOWNS + 1);
/// Length of the normal equations of a record.
const OF_RECORD: usize = packed(MAX_SEAM + MAX_IMPERFECTIONS + MAX_UNKNOWNS + 1);
/// Length of the normal equations of all records.
const OF_ALL: usize = packed(MAX_IMPERFECTIONS + MAX_UNKNOWNS + 1);

/// Imperfections of a plant and memory for a fit to it. It is large: a program that never makes one holds none of it.
#[derive(Clone, Debug)]
pub struct Plant {
    imperfections: Imperfections,
    /// Seam of each record, at its best where the normal equations were assembled last.
    seams: Vec<Seam, MAX_EXPERIMENTS>,
    /// Normal equations of the record that was assembled last.
    record: Normal<OF_RECORD>,
    /// Normal equations of imperfections and unknowns.
    all: Normal<OF_ALL>,
    /// The same, the imperfections eliminated.
    eliminated: Normal<OF_ALL>,
    /// Standard deviation of each imperfection where the last fit has ended, in that of its prior.
    deviations: [f64; MAX_IMPERFECTIONS],
    joints: usize,
}

/// An imperfection that a fit has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundImperfection {
    /// What is off.
    pub imperfection: Imperfection,
    /// Standard deviation of its prior, in the unit of the [`Imperfection`].
    pub prior: f64,
    /// Most likely value, in the same unit.
    pub value: f64,
    /// Standard deviation of that value, in the same unit.
    pub deviation: f64,
}

impl Plant {
    /// A plant of these accuracies, and of a robot with so many joints.
    pub fn new(accuracies: &Accuracies, joints: usize) -> Self {
        Self {
            imperfections: Imperfections {
                all: imperfection::all(accuracies, joints),
                values: [0.0; MAX_IMPERFECTIONS],
                beside: Vec::new(),
            },
            seams: Vec::new(),
            record: Normal::new(),
            all: Normal::new(),
            eliminated: Normal::new(),
            deviations: [1.0; MAX_IMPERFECTIONS],
            joints,
        }
    }

    /// Whether there is no imperfection.
    pub fn is_perfect(&self) -> bool {
        self.imperfections.all.is_empty()
    }

    /// Number of joints of the robot.
    pub(crate) fn joints(&self) -> usize {
        self.joints
    }

    /// Returns to the plant without imperfections.
    pub(crate) fn restart(&mut self) {
        self.imperfections.values = [0.0; MAX_IMPERFECTIONS];
        self.seams.clear();
    }

    /// Model at a pose, with the present imperfections and one more.
    fn model(
        &self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        pose: &[f64],
        more: Option<(usize, f64)>,
    ) -> Imperfect {
        let calibration = problem.sought.calibration(coordinates);
        let mut model = Imperfect::new(problem, &calibration, pose);
        for (index, &(imperfection, deviation)) in self.imperfections.all.iter().enumerate() {
            let more = more.filter(|(own, _)| *own == index).map_or(0.0, |(_, by)| by);
            let value = self.imperfections.values[index] + more;
            if value != 0.0 {
                model.add(imperfection, value * deviation);
            }
        }
        model
    }

    /// Linearises the model at a pose about the present imperfections. Returns its terms, and the nuisances with the imperfections.
    fn linearise(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        pose: &[f64],
    ) -> Result<(Terms<f64>, Calibration), LinearisationError> {
        let bushings = problem.sought.bushings(coordinates);
        let model = self.model(problem, coordinates, pose, None);
        let mut terms = model.terms(problem, &bushings)?;
        if problem.sought.seeks_masses() {
            terms = terms.with_masses();
        }
        self.imperfections.beside.clear();
        for index in 0..self.imperfections.all.len() {
            if self.imperfections.all[index].0.is_of_model() {
                let moved = self.model(problem, coordinates, pose, Some((index, STEP)));
                let beside = moved.terms(problem, &bushings)?;
                // There is room for all of them.
                let _ = self.imperfections.beside.push(beside);
            }
        }
        Ok((terms, *model.calibration()))
    }

    /// Assembles the normal equations of one record, its seam eliminated.
    fn assemble_record<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        experiment: &Experiment<B>,
        seam: &Seam,
    ) -> Result<Residuals, LinearisationError> {
        let (terms, calibration) = self.linearise(problem, coordinates, &experiment.pose)?;
        let unknowns = problem.seam_unknowns();
        let assembly = Assembly::<_, WIDE, _> {
            terms: &terms,
            record: Bins::of(experiment),
            equations: Equations::All(seam),
            sought: problem.sought,
            calibration: &calibration,
            further: &mut self.imperfections,
            normal: &mut self.record,
            level: problem.level,
        };
        let residuals = run(assembly);
        let standing = seam.to_solution(problem.chain.joints().len());
        self.record.prefer_small(&standing[..unknowns], SMALL_SEAM);
        self.record.eliminate(unknowns);
        Ok(residuals)
    }

    /// Assembles the normal equations of imperfections and unknowns, where the imperfections are at their present values. The seams
    /// move to where they are best.
    fn assemble<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        experiments: &[Experiment<B>],
    ) -> Result<Summary, LinearisationError> {
        let joints = problem.chain.joints().len();
        let seam_unknowns = problem.seam_unknowns();
        let imperfections = self.imperfections.all.len();
        self.all.reset(imperfections + problem.sought.unknowns());
        let mut summary = Summary::default();
        for (index, experiment) in experiments.iter().enumerate() {
            let standing = self.seams.get(index).copied().unwrap_or(Seam::ZERO);
            let residuals = self.assemble_record(problem, coordinates, experiment, &standing)?;
            summary.push(&residuals);
            self.all.add_complement(&self.record, seam_unknowns);
            let mut solution = standing.to_solution(joints);
            let mut change = [0.0; MAX_SEAM];
            self.record.substitute(seam_unknowns, &mut change);
            for (value, change) in solution.iter_mut().zip(change) {
                *value += change;
            }
            let best = Seam::from_solution(&solution[..seam_unknowns], joints);
            match self.seams.get_mut(index) {
                Some(seam) => *seam = best,
                // A record for which there is no room starts from no seam each time.
                None => drop(self.seams.push(best)),
            }
        }
        for index in 0..imperfections {
            self.all.add_prior(index, self.imperfections.values[index]);
        }
        Ok(summary)
    }

    /// Computes the standard deviation of each imperfection, in that of its prior: `|u|` with `L u = e`, and the factor L of the
    /// information of imperfections and unknowns, to which an undetermined unknown adds a floor. `others` are the normal equations of the unknowns apart from the records.
    fn determine(&mut self, others: &ParameterNormal) {
        let Self { all, eliminated, imperfections, deviations, .. } = self;
        let (count, total) = (imperfections.all.len(), all.unknowns());
        eliminated.clone_from(all);
        for i in count..total {
            for j in count..=i {
                *eliminated.entry(i, j) += others.row(i - count)[j - count];
            }
            *eliminated.entry(i, i) += FLOOR;
        }
        eliminated.eliminate(total);
        for (index, deviation) in deviations.iter_mut().enumerate().take(count) {
            let mut u = [0.0; MAX_IMPERFECTIONS + MAX_UNKNOWNS];
            for i in index..total {
                let row = eliminated.row(i);
                let known: f64 = row[index..i].iter().zip(&u[index..i]).map(|(l, u)| l * u).sum();
                let own = if i == index { 1.0 } else { 0.0 };
                u[i] = if row[i] > 0.0 { (own - known) / row[i] } else { 0.0 };
            }
            *deviation = libm::sqrt(u.iter().map(|u| u * u).sum());
        }
    }

    /// The imperfections where the last fit has ended.
    pub(crate) fn found(&self) -> Vec<FoundImperfection, MAX_IMPERFECTIONS> {
        let found =
            |(index, &(imperfection, prior)): (usize, &(Imperfection, f64))| FoundImperfection {
                imperfection,
                prior,
                value: prior * self.imperfections.values[index],
                deviation: prior * self.deviations[index],
            };
        self.imperfections.all.iter().enumerate().map(found).collect()
    }
}

/// [`Assembly::run`], compiled once: not again for each number of bins, in each crate.
#[inline(never)]
fn run(assembly: Assembly<'_, &mut Imperfections, WIDE, OF_RECORD>) -> Residuals {
    assembly.run()
}

#[cfg(test)]
mod tests;
