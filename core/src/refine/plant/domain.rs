//! Values of unknowns and imperfections, and where they may lie.

use fearless_simd::Level;
use heapless::Vec;

use super::super::objective::Domain;
use super::super::problem::Problem;
use super::super::proposal::{Room, Step};
use super::super::sizes::ALL;
use crate::imperfection::{Imperfection, MAX_IMPERFECTIONS};
use crate::sought::{Coordinates, MAX_UNKNOWNS};

/// Values of unknowns and imperfections.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) coordinates: Coordinates,
    /// Values in standard deviations.
    pub(super) imperfections: [f64; MAX_IMPERFECTIONS],
}

/// Imperfections, and behind them the unknowns of a problem.
pub(super) struct PlantDomain<'a> {
    problem: &'a Problem<'a>,
    /// For each imperfection, true if it is positive.
    are_positive: Vec<bool, MAX_IMPERFECTIONS>,
}

impl<'a> PlantDomain<'a> {
    pub(super) fn new(problem: &'a Problem<'a>, imperfections: &[(Imperfection, f64)]) -> Self {
        let are_positive = imperfections.iter().map(|(imperfection, _)| imperfection.is_positive());
        Self { problem, are_positive: are_positive.collect() }
    }
}

impl Domain<ALL> for PlantDomain<'_> {
    type Point = Point;

    fn level(&self) -> Level {
        self.problem.level
    }

    fn room(&self, point: &Point) -> Room<ALL> {
        let mut room = [[f64::NEG_INFINITY, f64::INFINITY]; ALL];
        let values = self.are_positive.iter().zip(&point.imperfections);
        for (room, (is_positive, value)) in room.iter_mut().zip(values) {
            if *is_positive {
                room[0] = -value;
            }
        }
        let of_unknowns = self.problem.room(&point.coordinates);
        room[self.are_positive.len()..][..MAX_UNKNOWNS].copy_from_slice(&of_unknowns);
        room
    }

    fn advance(&self, point: &Point, step: &Step<ALL>) -> Point {
        let (of_imperfections, of_unknowns) = step.split_at(self.are_positive.len());
        let mut advanced = *point;
        for (value, change) in advanced.imperfections.iter_mut().zip(of_imperfections) {
            *value += change;
        }
        let mut step = [0.0; MAX_UNKNOWNS];
        step.copy_from_slice(&of_unknowns[..MAX_UNKNOWNS]);
        advanced.coordinates = self.problem.advance(&point.coordinates, &step);
        advanced
    }
}
