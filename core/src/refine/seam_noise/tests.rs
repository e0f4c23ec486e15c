//! K against the normal equations of records that hold noise alone.

use std::boxed::Box;

use super::super::leverage::tests::{divided, measurement, noise, robot};
use super::super::objective::Objective as _;
use super::super::retired::RetiredInformation;
use super::super::sizes::ParameterNormal;
use super::super::tests::{bounds, problem};
use super::*;
use crate::sought::Sought;

/// Records of noise.
const RECORDS: u64 = 300;

/// Over 300 records a diagonal entry of their mean scatters by some hundredths.
#[test]
fn it_is_the_mean_information_of_records_of_noise() {
    let (chain, bushings) = robot(2);
    let (measurement, bounds) = (measurement([0.0; 3]), bounds());
    let sought = Sought::parameters_of(&chain);
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let retired = RetiredInformation::none(sought.unknowns());
    let at = sought.coordinates(&bushings);
    let record = divided(&chain, &measurement);
    let none = || {
        let mut normal = Box::new(ParameterNormal::new());
        normal.reset(sought.unknowns());
        normal
    };
    let (mut mean, mut found) = (none(), none());
    let mut workspace = Box::new(Workspace::new());
    for seed in 0..RECORDS {
        let own = [noise(record.clone(), seed)];
        let mut objective = SumOfSquares::new(&problem, &own, &retired, &mut workspace, 1);
        let mut normal = none();
        objective.linearise(&at, &mut normal).unwrap();
        mean.add_complement(&*normal, 0);
        if seed == 0 {
            objective.add_noise(&at, (0, &own[0]), &mut *found).unwrap();
        }
    }
    for unknown in 0..sought.unknowns() {
        let [mean, found] = [&mean, &found].map(|own| own.row(unknown)[unknown]);
        let mean = mean / RECORDS as f64;
        assert!((found / mean - 1.0).abs() < 0.15, "{unknown}: {found:e}, not {mean:e}");
    }
}

/// So many consecutive rows have the covariance of white noise, wherever they begin.
#[test]
fn rows_of_the_matrix_are_white() {
    const ROWS: usize = 128;
    for first in [0, 48, 112] {
        for (i, j) in [(0, 0), (0, 1), (3, 80), (17, 63), (80, 80)] {
            let rows = first..first + ROWS;
            let sum: f64 = rows.map(|row| hadamard(row, i) * hadamard(row, j)).sum();
            assert_eq!(sum, if i == j { ROWS as f64 } else { 0.0 }, "{first} {i} {j}");
        }
    }
}
