//! What follows from the end of a fit that counts some of the bins.

use std::boxed::Box;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

use super::super::tests::{measurement, plant};
use super::*;
use crate::refine::tests::{BINS, SAMPLES, bounds, bushings, chain, problem, record};
use crate::sought::Sought;

/// Unknowns of the two joints.
const UNKNOWNS: usize = 24;

/// Of a fit whose every imperfection is `off`, and whose next step would gain the square of `slope`, in which noise does not explain what is
/// left: outcome, distance of the bins that count, and whether accuracies have been restated, at its end and where it ends once more.
fn ends(off: f64, slope: f64) -> [(Outcome, usize, bool); 2] {
    let measurement = measurement(&[[0.0; 3]; 4], 0.0, [0.0; 3]);
    let (chain, bounds) = (chain(), bounds());
    let sought = Sought::new(2).unwrap();
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let experiments: &[Experiment<BINS>] = &[];
    let mut plant = plant();
    let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
    refinement.restart_plant(&mut plant, 0, false);
    plant.every = 4;
    let count = plant.imperfections.all.len();
    plant.point.imperfections[..count].fill(off);
    [(); 2].map(|()| {
        let normal = &mut plant.minimiser.normal;
        normal.reset(count + UNKNOWNS);
        for unknown in 0..count + UNKNOWNS {
            *normal.entry(unknown, unknown) = 1.0;
        }
        let right = count + UNKNOWNS;
        *normal.entry(right, 0) = slope;
        *normal.entry(right, right) = 1000.0 + count as f64 * off * off;
        plant.minimiser.linearised = true;
        let outcome =
            refinement.end_or_go_on(&problem, experiments, &mut plant, Outcome::Converged);
        let is_restated = plant.cost_of_restating() > 0.0;
        (outcome, plant.every, is_restated)
    })
}

#[test]
fn a_plausible_minimum_is_fitted_with_all_bins() {
    assert_eq!(ends(0.5, 0.0), [(Outcome::Improving, 1, false), (Outcome::Converged, 1, false)]);
}

/// With accuracies that are worse as many bins count as before. They are so much worse that the fit ends there.
#[test]
fn an_implausible_minimum_is_fitted_with_some_of_the_bins() {
    assert_eq!(ends(50.0, 0.0), [(Outcome::Improving, 4, true), (Outcome::Converged, 1, true)]);
}

/// With some of the bins a fit may end far from the minimum that may be the right one.
#[test]
fn a_plausible_fit_that_ends_short_of_its_minimum_goes_on_with_all_bins() {
    assert_eq!(ends(0.5, 20.0), [(Outcome::Improving, 1, false), (Outcome::Converged, 1, false)]);
}

/// Of each bin that counts, real and imaginary parts of three axes.
#[test]
fn residuals_are_those_of_the_bins_that_count() {
    let measurement = measurement(&[[0.0; 3]; 4], 0.0, [0.0; 3]);
    let (chain, bounds) = (chain(), bounds());
    let sought = Sought::new(2).unwrap();
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let record = record(&mut Xoshiro256PlusPlus::seed_from_u64(1));
    let experiment = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
    let experiments = [experiment.unwrap()];
    let bins = experiments[0].bins();
    for every in 1..=4 {
        let counted = (0..bins).step_by(every).count();
        assert_eq!(residuals(&problem, &experiments, every), 6 * counted, "{every}");
    }
}
