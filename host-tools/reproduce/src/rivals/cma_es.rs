//! CMA-ES: the crate `cmaes`, an active CMA-ES after Hansen's tutorial and his pycma.
//!
//! It is the most complete crate for CMA-ES (negative weights, the tutorial's stopping rules), takes a seed, lets the
//! loss borrow and needs no LAPACK. The settings are its defaults, which are the tutorial's: population 4 + ⌊3 ln P⌋
//! (14 for P = 36), N. Hansen, "The CMA Evolution Strategy: A Tutorial", table 1.
//!
//! The start is the centre of the cube, with step size 0.3. A run that has converged before the budget is spent
//! starts anew there with twice the population: A. Auger, N. Hansen, "A Restart CMA Evolution Strategy with
//! Increasing Population Size", CEC 2005.
//!
//! The strategy itself is unbounded. Its samples are reflected at the walls, so that the loss is continuous and no
//! penalty has to be weighed.

use cmaes::{CMAESOptions, DVector};

use super::{Loss, Metered, Progress};

/// Step size at the start, in a cube whose side is 1.
const STEP_SIZE: f64 = 0.3;

/// The point of the cube to which reflections at the walls take `x`.
fn fold(x: f64) -> f32 {
    let x = x.rem_euclid(2.0);
    (if x > 1.0 { 2.0 - x } else { x }) as f32
}

/// Minimises `loss` by CMA-ES; arguments as in [`super::Minimise`].
pub fn minimise(
    parameters: usize,
    budget: u64,
    every: u64,
    seed: u64,
    loss: &mut Loss<'_>,
) -> Progress {
    let mut metered = Metered::new(budget, every, loss);
    let mut options = CMAESOptions::new(vec![0.5; parameters], STEP_SIZE).seed(seed);
    while !metered.is_spent() {
        options.max_function_evals = Some(metered.remaining() as usize);
        let evaluate = |x: &DVector<f64>| {
            let point: Vec<f32> = x.iter().copied().map(fold).collect();
            metered.evaluate(&point).unwrap_or(f64::INFINITY)
        };
        // The crate refuses only a cube without dimensions.
        let Ok(mut run) = options.clone().build(evaluate) else { break };
        while run.next().is_none() {}
        options.population_size *= 2;
        options.seed = options.seed.map(|seed| seed.wrapping_add(1));
    }
    metered.progress
}
