//! Genetic algorithm: the crate `genetic_algorithm`, with real-valued genes.
//!
//! It is maintained, takes a seed, runs in the caller's thread and lets the loss borrow. radiate, as well maintained,
//! needs a `'static` loss. The other crates are not maintained, have no seed, or have a linear algebra of their own.
//!
//! Settings: population 100, uniform crossover and tournaments of four with elites at the rates of the crate's own
//! example for continuous genes. The mutation is that of the breeder genetic algorithm, H. Mühlenbein, D.
//! Schlierkamp-Voosen, "Predictive Models for the Breeder Genetic Algorithm", Evolutionary Computation 1(1), 1993:
//! one gene in P, by up to a tenth of its range (here evenly).
//!
//! The first generation is uniform in the cube. A gene that would leave its bounds is set on its wall.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use genetic_algorithm::strategy::evolve::prelude::*;

use super::{Loss, Metered, Progress};

const POPULATION: usize = 100;
/// Share of the population that has offspring.
const PARENTS: f32 = 0.7;
/// Share of the pairs of parents that cross. The others are copied and mutate.
const CROSSOVER: f32 = 0.8;
/// Share of a generation that is offspring.
const REPLACEMENT: f32 = 0.5;
/// Share of a generation that survives as the best.
const ELITE: f32 = 0.02;
const TOURNAMENT: usize = 4;
/// Largest step of a mutation, in a cube whose side is 1.
const MUTATION_RANGE: f32 = 0.1;

/// The loss as a fitness function of the crate. The crate calls clones, which could be in several threads.
#[derive(Clone)]
struct Rank<'a, 'b> {
    metered: &'a Mutex<Metered<'b>>,
    /// Ends the run after the generation in which the budget was spent.
    is_spent: Arc<AtomicBool>,
}

impl fmt::Debug for Rank<'_, '_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Rank")
    }
}

impl Fitness for Rank<'_, '_> {
    type Genotype = RangeGenotype<f32>;

    fn calculate_for_chromosome(
        &mut self,
        chromosome: &FitnessChromosome<Self>,
        _: &FitnessGenotype<Self>,
    ) -> Option<FitnessValue> {
        let mut metered = self.metered.lock().unwrap_or_else(PoisonError::into_inner);
        let loss = metered.evaluate(&chromosome.genes);
        self.is_spent.store(metered.is_spent(), Ordering::Relaxed);
        loss.map(rank)
    }
}

/// An integer with the order of `loss`. The crate compares only integers, and a loss over many decades has no single
/// scale.
fn rank(loss: f64) -> FitnessValue {
    let bits = loss.to_bits() as FitnessValue;
    if bits < 0 { FitnessValue::MIN - bits } else { bits }
}

/// Minimises `loss` by a genetic algorithm; arguments as in [`super::Minimise`].
pub fn minimise(
    parameters: usize,
    budget: u64,
    every: u64,
    seed: u64,
    loss: &mut Loss<'_>,
) -> Progress {
    let metered = Mutex::new(Metered::new(budget, every, loss));
    let is_spent = Arc::new(AtomicBool::new(false));
    let genotype = RangeGenotype::builder()
        .with_genes_size(parameters)
        .with_allele_range(0.0..=1.0)
        .with_mutation_type(MutationType::Range(MUTATION_RANGE))
        .build();
    // The crate refuses only a cube without dimensions.
    if let Ok(genotype) = genotype {
        let _evolved = Evolve::builder()
            .with_genotype(genotype)
            .with_target_population_size(POPULATION)
            .with_select(SelectTournament::new(REPLACEMENT, ELITE, TOURNAMENT))
            .with_crossover(CrossoverUniform::new(PARENTS, CROSSOVER))
            .with_mutate(MutateSingleGene::new(1.0))
            .with_fitness(Rank { metered: &metered, is_spent: is_spent.clone() })
            .with_fitness_ordering(FitnessOrdering::Minimize)
            .with_max_generations(usize::MAX)
            .with_abort_flag(is_spent)
            .with_rng_seed_from_u64(seed)
            .call();
    }
    metered.into_inner().unwrap_or_else(PoisonError::into_inner).progress
}

#[cfg(test)]
mod tests {
    use super::rank;

    #[test]
    fn ranks_order_as_losses() {
        let losses =
            [f64::MIN, -1.0, -1e-300, -0.0, 1e-300, 1.0, 1.0 + f64::EPSILON, f64::INFINITY];
        assert!(losses.map(rank).is_sorted_by(|a, b| a < b || (*a == 0 && *b == 0)));
        assert_eq!(rank(-0.0), rank(0.0));
    }
}
