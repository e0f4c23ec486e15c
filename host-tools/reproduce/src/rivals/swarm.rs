//! Particle swarm: argmin's canonical swarm with a global best.
//!
//! argmin is the best known optimisation crate in Rust, and its swarm follows a paper exactly: M. Zambrano-Bigiarini,
//! M. Clerc, R. Rojas, "Standard Particle Swarm Optimisation 2011 at CEC-2013", chapter II.A, with that standard's
//! inertia 1/(2 ln 2), both accelerations 1/2 + ln 2, and 40 particles. The particles start uniform in the cube. A
//! particle that would leave the cube is set on its wall.

use std::cell::RefCell;

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::particleswarm::ParticleSwarm;
// argmin uses the generation of rand before this one.
use rand_xoshiro_0_7::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::{Loss, Metered, Progress};

/// Swarm size of the standard.
const PARTICLES: usize = 40;

/// The loss as a cost function of argmin. argmin shares its cost functions, and ours counts.
struct Cost<'a, 'b>(RefCell<&'a mut Metered<'b>>);

/// The error that ends argmin's run.
#[derive(Debug, thiserror::Error)]
#[error("the budget is spent")]
struct Spent;

impl CostFunction for Cost<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Self::Param) -> Result<f64, Error> {
        let point: Vec<f32> = point.iter().map(|&x| x as f32).collect();
        Ok(self.0.borrow_mut().evaluate(&point).ok_or(Spent)?)
    }
}

/// Minimises `loss` by a particle swarm; arguments as in [`super::Minimise`].
pub fn minimise(
    parameters: usize,
    budget: u64,
    every: u64,
    seed: u64,
    loss: &mut Loss<'_>,
) -> Progress {
    let mut metered = Metered::new(budget, every, loss);
    if parameters > 0 {
        let walls = (vec![0.0; parameters], vec![1.0; parameters]);
        let swarm = ParticleSwarm::new(walls, PARTICLES)
            .with_rng_generator(Xoshiro256PlusPlus::seed_from_u64(seed));
        // The run ends only by the error that the budget is spent.
        let _spent = Executor::new(Cost(RefCell::new(&mut metered)), swarm).run();
    }
    metered.progress
}
