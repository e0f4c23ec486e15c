//! What follows from the end of a fit that counts some of the bins.

use std::boxed::Box;

use super::super::tests::{measurement, plant};
use super::*;
use crate::refine::tests::{BINS, bounds, bushings, chain, problem};
use crate::sought::Sought;

/// Unknowns of the two joints.
const UNKNOWNS: usize = 24;

/// Of a fit whose every imperfection is `off`, and whose next step would gain the square of `slope`, in which noise does not explain what is
/// left: outcome, distance of the bins that count, and whether accuracies have been restated, at its end and where it ends once more.
fn ends(off: f64, slope: f64) -> [(Outcome, usize, bool); 2] {
    let measurement = measurement(&[[0.0; 3]; 4], 0.0, [0.0; 3]);
    let (chain, bounds) = (chain(), bounds());
    let sought = Sought::new(2, &Default::default()).unwrap();
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let experiments: &[Experiment<BINS>] = &[];
    let mut plant = plant();
    let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
    refinement.restart_plant(&mut plant, 0);
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

#[test]
fn a_fit_ends_short_of_its_minimum() {
    assert_eq!(ends(0.5, 1.1), [(Outcome::Converged, 1, false), (Outcome::Converged, 1, false)]);
}
