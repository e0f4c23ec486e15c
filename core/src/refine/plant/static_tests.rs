//! The columns of static tests, against differences of the displacement.

use std::boxed::Box;

use super::super::tests::{bounds, bushings, chain, problem};
use super::tests::{inside, measurement, plant};
use super::*;
use crate::mounting::Gauge;
use crate::refine::Problem;
use crate::sought::{Coordinates, Sought};
use crate::statics::{Reading, StaticTest};

/// Residuals of a test where the plant stands, in standard deviations.
fn residuals(plant: &Plant, problem: &Problem<'_>) -> [f64; 3] {
    let rows = plant.statics(problem).rows(&problem.statics[0]).unwrap();
    let last = plant.imperfections.all.len() + problem.sought.unknowns();
    [0, 1, 2].map(|axis| rows[axis][last])
}

/// Without gravity, whose sag the derivatives hold. Every imperfection that changes the robot is off; the others have no column.
#[test]
fn columns_of_static_tests_equal_differences() {
    let measurement = measurement(&[[0.0; 3]; 4], 0.0, [0.0; 3]);
    let (chain, bounds) = (chain(), bounds());
    let sought = Sought::new(2).unwrap();
    let tests = [StaticTest {
        pose: [0.4, -0.3].into_iter().collect(),
        wrench: [800.0, -500.0, 300.0, 60.0, 90.0, -40.0],
        gauge: Gauge { place: [0.1, -0.2, 0.05], ..Gauge::default() },
        displacement: [1e-5, 2e-5, -3e-5].map(|value| Some(Reading::stated(value, 1e-6))),
    }];
    let problem = Problem { statics: &tests, ..problem(&chain, &measurement, &bounds, &sought) };
    let mut plant = plant();
    plant.point.coordinates = sought.coordinates(&bushings());
    plant.point.imperfections = inside(&plant.imperfections.all, 0.3);
    let rows = Box::new(plant.statics(&problem).rows(&tests[0]).unwrap());
    let all = plant.imperfections.all.clone();
    let count = all.len();
    let mut agrees = |column: usize, step: f64, at: &dyn Fn(&mut Plant, f64)| {
        let standing = plant.point;
        let [up, down] = [step, -step].map(|by| {
            at(&mut plant, by);
            let residuals = residuals(&plant, &problem);
            plant.point = standing;
            residuals
        });
        let mut largest = 0.0_f64;
        for axis in 0..3 {
            let numeric = (down[axis] - up[axis]) / (2.0 * step);
            let ours = rows[axis][column];
            // The columns are differences themselves, to one side.
            let size = 5e-3 * numeric.abs() + 1e-3;
            assert!((ours - numeric).abs() < size, "{column} {axis}: {ours} {numeric}");
            largest = largest.max(ours.abs());
        }
        largest
    };
    for (column, (imperfection, _)) in all.iter().enumerate() {
        let at = |plant: &mut Plant, by: f64| plant.point.imperfections[column] += by;
        let largest = agrees(column, 1e-2, &at);
        let shows = matches!(
            imperfection,
            Imperfection::ToolCentrePoint(_)
                | Imperfection::ElasticCentre(..)
                | Imperfection::Ground(_)
                | Imperfection::Hysteresis
                | Imperfection::Hose
        );
        assert!(largest > 1e-3 || !shows, "{imperfection:?}");
        assert!(largest == 0.0 || imperfection.is_of_robot(), "{imperfection:?}");
    }
    for unknown in 0..sought.unknowns() {
        let at = |plant: &mut Plant, by: f64| {
            let mut step: Coordinates = [0.0; _];
            step[unknown] = by;
            sought.advance(&mut plant.point.coordinates, &step);
        };
        assert!(agrees(count + unknown, 1e-3, &at) > 0.0, "{unknown}");
    }
}
