//! The inputs of a refinement, and the domain of its coordinates.

use fearless_simd::Level;

use super::compliance;
use super::objective::Domain;
use super::proposal::{Room, Step};
use super::seam::{self, Seam};
use crate::chain::Chain;
use crate::linear::normal::Normal;
use crate::parameters::Bounds;
use crate::sought::{Coordinates, Sought};
use crate::spectrum::{Experiment, Measurement};
use crate::statics::StaticTest;

/// Largest change of a parameter's logarithm in a step. Chosen: the linearisation hardly holds for a factor of e.
const LONGEST_STEP: f64 = 1.0;

/// The inputs of a refinement.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The robot.
    pub chain: &'a Chain,
    /// Measured directions, sensors and band.
    pub measurement: &'a Measurement,
    /// Bounds of the parameters.
    pub bounds: &'a Bounds,
    /// The unknowns.
    pub sought: &'a Sought,
    /// Static tests, [checked](crate::statics::check), which are fitted with the records.
    pub statics: &'a [StaticTest],
    /// Instruction set.
    pub level: Level,
}

impl Problem<'_> {
    /// Real unknowns of the seam of each record.
    pub(crate) fn seam_unknowns(&self) -> usize {
        seam::unknowns(self.chain.joints().len(), self.measurement.feels_gravity())
    }

    /// Eliminates the seam at which the normal equations of a record were taken.
    pub(super) fn eliminate_seam<const L: usize>(&self, seam: &Seam, record: &mut Normal<L>) {
        let unknowns = self.seam_unknowns();
        let standing = seam.to_solution(self.chain.joints().len());
        record.prefer_small(&standing[..unknowns], seam.cost);
        record.eliminate_with(self.level, unknowns);
    }

    /// Unknowns of the seam that a record can determine: no jump along an axis that is not measured.
    pub(crate) fn seam_unknowns_of<const B: usize>(&self, experiment: &Experiment<B>) -> usize {
        if !experiment.is_record() {
            return 0;
        }
        let jumps = seam::unknowns(0, self.measurement.feels_gravity()) / 3;
        self.seam_unknowns() - jumps * (3 - experiment.measured_axes())
    }
}

/// Coordinates within the bounds, and steps along compliances.
impl Domain for Problem<'_> {
    type Point = Coordinates;

    fn level(&self) -> Level {
        self.level
    }

    fn room(&self, coordinates: &Coordinates) -> Room {
        let ranges = self.sought.ranges(coordinates, self.bounds);
        compliance::room(self.sought, &ranges, LONGEST_STEP)
    }

    fn advance(&self, coordinates: &Coordinates, step: &Step) -> Coordinates {
        let ranges = self.sought.ranges(coordinates, self.bounds);
        let moved = compliance::logarithms(self.sought, &ranges, step);
        let mut advanced = *coordinates;
        self.sought.advance(&mut advanced, &moved);
        advanced
    }
}
