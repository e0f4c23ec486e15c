//! What experiments say of the parameters of a robot with imperfections.

use flexid_core::imperfection::Group;
use flexid_core::refine::{Information, PlantInformation};
use nalgebra::DMatrix;

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
