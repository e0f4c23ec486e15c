//! The sum of squares of a fit to an imperfect plant: at every point the imperfections are at their best, within their priors.
//!
//! The imperfections p are columns of the normal equations behind the seams, which are those of each record, and before the unknowns,
//! which they share with all records. With their priors, of which each is `p = 0 ± 1`, they are eliminated as the seams are (variable
//! projection: Golub and Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares problems whose variables
//! separate", SIAM Journal on Numerical Analysis 10, 1973). What is left is the information about the unknowns that holds whatever the
//! imperfections are.

mod change;
mod columns;
mod fit;
mod imperfect;
mod objective;

use heapless::Vec;

use super::levenberg_marquardt::{LevenbergMarquardt, Limits};
use super::seam::MAX_SEAM;
use super::summary::Summary;
use crate::imperfection::{self, Accuracies, Imperfection, MAX_IMPERFECTIONS};
use crate::linear::gram::padded;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::receptance::Filter;
use crate::sought::MAX_UNKNOWNS;
use columns::Imperfections;
use objective::Point;

/// Largest number of imperfections and unknowns.
const ALL: usize = MAX_IMPERFECTIONS + MAX_UNKNOWNS;
/// Columns of a row: seam, imperfections, unknowns, residual; padded.
const WIDE: usize = padded(MAX_SEAM + ALL + 1);
/// Length of the normal equations of a record.
const OF_RECORD: usize = packed(MAX_SEAM + ALL + 1);
/// Length of the normal equations of all records.
const OF_ALL: usize = packed(ALL + 1);

/// Limits of a fit. Chosen: all unknowns together end within a tenth of a standard deviation of the minimum; a fit typically takes a
/// third of these steps.
const LIMITS: Limits = Limits { negligible: 1e-2, iterations: 30 };

/// Imperfections of a plant and memory for a fit to it. It is large: a program that never makes one holds none of it.
#[derive(Clone, Debug)]
pub struct Plant {
    imperfections: Imperfections,
    /// Holds the normal equations of imperfections and unknowns.
    minimiser: LevenbergMarquardt<OF_ALL>,
    /// Where the fit stands.
    point: Point,
    /// Normal equations of the record that was assembled last.
    record: Normal<OF_RECORD>,
    /// Factor of the normal equations.
    factor: Normal<OF_ALL>,
    /// Of the residuals where the normal equations were assembled last.
    summary: Summary,
    /// Standard deviation of each imperfection where the last fit has ended, in that of its prior.
    deviations: [f64; MAX_IMPERFECTIONS],
    joints: usize,
}

/// An imperfection that a fit has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundImperfection {
    /// What is off.
    pub imperfection: Imperfection,
    /// Standard deviation of its prior, in the unit of the [`Imperfection`].
    pub prior: f64,
    /// Most likely value, in the same unit.
    pub value: f64,
    /// Standard deviation of that value, in the same unit.
    pub deviation: f64,
}

impl Plant {
    /// A plant of these accuracies, and of a robot with so many joints.
    pub fn new(accuracies: &Accuracies, joints: usize) -> Self {
        Self {
            imperfections: Imperfections {
                all: imperfection::all(accuracies, joints),
                from_parent: Vec::new(),
                changes: Vec::new(),
                accelerometer_filter: Filter::default(),
            },
            minimiser: LevenbergMarquardt::new(LIMITS),
            point: Point {
                coordinates: [0.0; MAX_UNKNOWNS],
                imperfections: [0.0; MAX_IMPERFECTIONS],
            },
            record: Normal::new(),
            factor: Normal::new(),
            summary: Summary::default(),
            deviations: [1.0; MAX_IMPERFECTIONS],
            joints,
        }
    }

    /// Whether there is no imperfection.
    pub fn is_perfect(&self) -> bool {
        self.imperfections.all.is_empty()
    }

    /// Number of joints of the robot.
    pub(crate) fn joints(&self) -> usize {
        self.joints
    }

    /// The imperfections where the last fit has ended.
    pub(crate) fn found(&self) -> Vec<FoundImperfection, MAX_IMPERFECTIONS> {
        let found =
            |(index, &(imperfection, prior)): (usize, &(Imperfection, f64))| FoundImperfection {
                imperfection,
                prior,
                value: prior * self.point.imperfections[index],
                deviation: prior * self.deviations[index],
            };
        self.imperfections.all.iter().enumerate().map(found).collect()
    }
}

#[cfg(test)]
mod tests;
