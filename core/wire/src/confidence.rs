//! How far a report can be trusted: the data that a [`Report`](crate::report::Report) leaves out.
//!
//! A [`Confidence`] is the entry `confidence` of the result file of `flexid identify --json`. The field names are part of the
//! contract. Vectors of six have the order `tx ty tz rx ry rz` of the joint frame.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::directions::{MAX_DIRECTIONS, WeakDirection};
use crate::explanation::{Explanation, MAX_EXPLANATIONS};
use crate::left_over::{LeftOver, MAX_LEFT_OVER};
pub use crate::nuisance::{Interval, MAX_NUISANCES, Nuisance, Unit};
use crate::residuals::Residuals;
use crate::text::{Label, Name};
use crate::verdict::MAX_JOINTS;

/// Largest number of unknowns of a fit: twelve parameters per joint, and the nuisances.
pub const MAX_UNKNOWNS: usize = 12 * MAX_JOINTS + MAX_NUISANCES;
/// Largest number of pairs of unknowns.
pub const MAX_PAIRS: usize = MAX_UNKNOWNS * (MAX_UNKNOWNS - 1) / 2;
/// Largest number of records that are predicted from the others.
pub const MAX_HELD_OUT: usize = 16;

/// How far a report can be trusted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Confidence {
    /// Intervals of each joint's parameters, base first.
    pub joints: Vec<JointIntervals, MAX_JOINTS>,
    /// Nuisances that were sought, then imperfections that the data show, as many as fit.
    pub nuisances: Vec<Nuisance, MAX_NUISANCES>,
    /// Accuracies that the data contradict, the one that explains most of the misfit first. If there is none: what explains most of it. Where
    /// the fit is not settled, these may be those of a wrong minimum.
    pub explanations: Vec<Explanation, MAX_EXPLANATIONS>,
    /// Correlations between the unknowns.
    pub correlations: Correlations,
    /// Combinations of unknowns that these poses determine badly or not at all, the worst first.
    pub weak_directions: Vec<WeakDirection, MAX_DIRECTIONS>,
    /// Residuals between model and measurement, and what follows for the model.
    pub residuals: Residuals,
    /// Places where more is left of the records than elsewhere; empty where noise explains the residuals, or the minimum may be a wrong one.
    pub left_over: Vec<LeftOver, MAX_LEFT_OVER>,
    /// Agreement of each record with its prediction by a fit to all others; empty with a single record.
    pub held_out: Vec<HeldOut, MAX_HELD_OUT>,
    /// Number of retired records, which made room for newer ones. The numbers rest on their information matrix, which is
    /// kept; the records themselves are not kept.
    pub retired: u64,
    /// Number of records that were taken but are not in the numbers. They made room in a fit that could not be believed, were
    /// dropped because newer ones contradict them, or were too short to take the place of others.
    pub left_out: u64,
    /// Robust standard deviations over those that follow from accuracies and from noise times √(χ²/dof), at least 1: root mean square over the parameters that the data determine. Robust ones are no smaller than the scatter of the parameters
    /// between bands of the records. `None` where standard deviations are not robust: of perfect accuracies, and where little more than noise is left.
    pub robust_widening: Option<f64>,
}

/// 95 % intervals of one joint's parameters, log-normal.
///
/// An interval is `None` if its parameter is not observable or fixed. All intervals are `None` if the residuals are too large
/// to be caused by noise, if another minimum may be the right one, or if static tests contradict the fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct JointIntervals {
    /// Name of the joint in the model.
    pub name: Name,
    /// Interval of each stiffness: N/m for translations, Nm/rad for rotations.
    pub stiffness_interval: [Option<Interval>; 6],
    /// Interval of each damping: Ns/m for translations, Nms/rad for rotations.
    pub damping_interval: [Option<Interval>; 6],
}

/// Correlation matrix of the unknowns of the fit, in whole per cent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Correlations {
    /// Names of rows and columns. Tied parameters have the name of the first of them; fixed parameters are left out.
    pub unknowns: Vec<Label, MAX_UNKNOWNS>,
    /// Lower triangle without its diagonal, row by row: (1, 0), (2, 0), (2, 1), (3, 0)…, −100 to 100. An entry is 0 if the
    /// data do not determine one of its two unknowns.
    pub percent: Vec<i8, MAX_PAIRS>,
}

impl Correlations {
    /// Every pair once: the larger index, the smaller index, and their correlation in per cent.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize, i8)> {
        let indices = (1..self.unknowns.len()).flat_map(|row| (0..row).map(move |col| (row, col)));
        indices.zip(&self.percent).map(|((row, column), percent)| (row, column, *percent))
    }
}

/// Agreement of a record with its prediction by a fit to all others, along the axes of the TCP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct HeldOut {
    /// Joint angles, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Frequency response assurance criterion: 1 for equal shapes, 0 for shapes that have nothing in common.
    pub frac: [f64; 3],
    /// Variance accounted for: 1 for an exact prediction, below 0 if the model is worse than none.
    pub vaf: [f64; 3],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::clipped;

    #[test]
    fn pairs_are_those_of_the_lower_triangle() {
        let unknowns = ["a", "b", "c"].into_iter().map(clipped).collect();
        let correlations = Correlations { unknowns, percent: [10, 20, 21].into_iter().collect() };
        assert!(correlations.pairs().eq([(1, 0, 10), (2, 0, 20), (2, 1, 21)]));
    }
}
