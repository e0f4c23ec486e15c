//! What experiments say of the parameters of a robot with imperfections.

use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::imperfection::Group;
use flexid_core::parameters::Bushings;
use flexid_core::refine::{Basis, Information, Plant, PlantInformation, Problem, Refinement};
use flexid_core::sought::Sought;
use flexid_core::spectrum::Measurement;
use flexid_core::statics::StaticTest;
use nalgebra::DMatrix;

use crate::config::Config;
use crate::record::Experiment;

/// Information of experiments about the imperfections that they share, each in the standard deviation of its prior, and behind them about the
/// unknowns.
#[derive(Clone, Debug)]
pub struct Knowledge {
    matrix: DMatrix<f64>,
    imperfections: usize,
}

impl Knowledge {
    /// What an experiment says; `None` if a number of it is not finite.
    pub fn of(information: &PlantInformation<'_>) -> Option<Self> {
        let all = information.imperfections();
        let is_shared = |index: &usize| all[*index].0.facts().group != Group::Record;
        let shared = (0..all.len()).filter(is_shared);
        let imperfections = shared.clone().count();
        let places: Vec<usize> = shared.chain(all.len()..information.size()).collect();
        let entry = |row: usize, column: usize| information.get(places[row], places[column]);
        let matrix = DMatrix::from_fn(places.len(), places.len(), entry);
        matrix.iter().all(|own| own.is_finite()).then_some(Self { matrix, imperfections })
    }

    /// What the priors of these imperfections say, and nothing of the unknowns.
    pub fn of_priors(other: &Self) -> Self {
        let size = other.matrix.nrows();
        let is_prior = |row, column| row == column && row < other.imperfections;
        let matrix = DMatrix::from_fn(size, size, |row, column| f64::from(is_prior(row, column)));
        Self { matrix, ..*other }
    }

    /// Adds what another experiment says.
    pub fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
    }

    /// What is known of the unknowns whatever the imperfections are, within their priors: `N_uu − N_up N_pp⁻¹ N_pu`.
    ///
    /// # Panics
    /// If the priors have not been added.
    pub fn of_unknowns(&self) -> Information {
        let Self { matrix, imperfections: count } = self;
        let unknowns = matrix.nrows() - count;
        let own = matrix.view((*count, *count), (unknowns, unknowns));
        let shared = matrix.view((*count, 0), (unknowns, *count));
        let factor = matrix.view((0, 0), (*count, *count)).into_owned().cholesky();
        let factor = factor.expect("the priors make it positive definite");
        let left = own - shared * factor.solve(&shared.transpose());
        Information::of_entries(unknowns, |row, column| left[(row, column)])
    }
}

/// A robot about which experiments say something.
#[derive(Clone, Copy, Debug)]
pub struct Assumed<'a> {
    /// Accuracies, bounds and the mounting of the sensors.
    pub config: &'a Config,
    /// Unknowns of a fit.
    pub sought: &'a Sought,
    /// The robot without its joints' bushings.
    pub chain: &'a Chain,
    /// Its bushings, base first.
    pub bushings: &'a Bushings,
}

impl Assumed<'_> {
    /// What an experiment says; `None` if the robot has no equilibrium in it. The calling thread needs a large stack.
    pub fn of_experiment(&self, experiment: &Experiment, basis: Basis) -> Option<Knowledge> {
        let Self { config, sought, chain, bushings } = self;
        let measurement = config.measurement();
        let problem = self.problem(&measurement, &[]);
        let mut plant = Box::new(Plant::new(&config.accuracies, chain));
        let mut refinement = Box::new(Refinement::new(sought, bushings));
        let mut experiment = Box::new(experiment.clone());
        experiment.tell_movement();
        let own = refinement.information_on_plant(&problem, &experiment, basis, &mut plant).ok()?;
        Knowledge::of(&own)
    }

    /// What static tests say; `None` where the robot has no equilibrium under gravity.
    pub fn of_statics(&self, tests: &[StaticTest]) -> Option<Knowledge> {
        let Self { config, sought, chain, bushings } = self;
        let measurement = config.measurement();
        let problem = self.problem(&measurement, tests);
        let mut plant = Box::new(Plant::new(&config.accuracies, chain));
        let refinement = Box::new(Refinement::new(sought, bushings));
        Knowledge::of(&refinement.information_of_statics(&problem, &mut plant).ok()?)
    }

    /// What the priors of the imperfections say.
    ///
    /// # Panics
    /// Never: without a static test there is no pose without an equilibrium.
    pub fn priors(&self) -> Knowledge {
        Knowledge::of_priors(&self.of_statics(&[]).expect("no test has no equilibrium"))
    }

    /// The problem of a fit to these static tests.
    pub fn problem<'p>(
        &'p self,
        measurement: &'p Measurement,
        statics: &'p [StaticTest],
    ) -> Problem<'p> {
        Problem {
            chain: self.chain,
            measurement,
            bounds: &self.config.bounds,
            sought: self.sought,
            statics,
            level: Level::new(),
        }
    }
}
