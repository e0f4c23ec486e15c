//! How far to trust a report: what a [`Report`](crate::report::Report) leaves out.
//!
//! Serialised with `serde_json`, a [`Confidence`] stands under `confidence` in the result file of `flexid identify
//! --json`: field names are part of the contract. Vectors of six are in the order `tx ty tz rx ry rz` of the joint frame.

use heapless::{String, Vec};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::messages::{Name, Text};
use crate::report::{MAX_JOINTS, Verdict};

/// Most nuisances: a delay, two sensors' gains, a misalignment, and a mass for each joint.
pub const MAX_NUISANCES: usize = 10 + MAX_JOINTS;
/// Most unknowns of a fit: twelve parameters for each joint, and the nuisances.
pub const MAX_UNKNOWNS: usize = 12 * MAX_JOINTS + MAX_NUISANCES;
/// Most pairs of them.
pub const MAX_PAIRS: usize = MAX_UNKNOWNS * (MAX_UNKNOWNS - 1) / 2;
/// Most directions that are told of.
pub const MAX_DIRECTIONS: usize = 8;
/// Most unknowns that a direction names.
pub const MAX_SHARES: usize = 6;
/// Most records that are predicted from the others.
pub const MAX_HELD_OUT: usize = 16;

/// The name of an unknown, such as `joint_1 tx stiffness` or `delay`: at most 48 bytes of UTF-8.
pub type Label = String<48>;
/// The name of a unit: at most 8 bytes of UTF-8, none for a factor.
pub type Unit = String<8>;
/// Least and most of what has given such data with a probability of 95 %.
pub type Interval = [f64; 2];

/// How far to trust the report that came before it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Confidence {
    /// Base first.
    pub joints: Vec<JointIntervals, MAX_JOINTS>,
    /// What was sought beside the joints.
    pub nuisances: Vec<Nuisance, MAX_NUISANCES>,
    /// How the unknowns depend on each other.
    pub correlations: Correlations,
    /// What these poses do not tell, or hardly; the worst first.
    pub weak_directions: Vec<WeakDirection, MAX_DIRECTIONS>,
    /// What is left between model and measurement, and what it says of the model.
    pub residuals: Residuals,
    /// Each record as a fit to all the others predicts it; empty with a single one.
    pub held_out: Vec<HeldOut, MAX_HELD_OUT>,
    /// Records that made room for newer ones, of those that the numbers rest on: what they told is kept, as their information
    /// matrix, but not they themselves.
    pub retired: u64,
    /// Records that were taken in and are not in the numbers: they made room in a fit that could not be believed, were forgotten
    /// since newer ones contradict them, or too short to take the place of others.
    pub left_out: u64,
}

/// The 95 % intervals of one joint's parameters, log-normal.
///
/// `None` where there is no honest one: where the parameter is not observable or fixed, and for all where the residuals
/// are so large that their cause is no noise, where another minimum may be the right one, or where static tests contradict
/// the fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct JointIntervals {
    /// The joint's name in the model.
    pub name: Name,
    /// N/m for translations, Nm/rad for rotations.
    pub stiffness_interval: [Option<Interval>; 6],
    /// Ns/m for translations, Nms/rad for rotations.
    pub damping_interval: [Option<Interval>; 6],
}

/// What a sensor or the model of the masses is off by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Nuisance {
    /// What.
    pub name: Label,
    /// s, rad, or none.
    pub unit: Unit,
    /// In this unit.
    pub value: f64,
    /// Standard deviation in the same unit; `None` where the fit is broken.
    pub std: Option<f64>,
    /// 95 %, in the same unit; `None` where no joint's parameter has one.
    pub interval: Option<Interval>,
    /// How much the data add to what was known of it beforehand: whether they leave 5 % or less of that standard deviation,
    /// or 30 %.
    pub verdict: Verdict,
}

/// The correlation matrix of what the fit sought, whole per cents.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Correlations {
    /// Names of rows and columns. Parameters that are tied have the name of the first of them; fixed ones are not there.
    pub unknowns: Vec<Label, MAX_UNKNOWNS>,
    /// The lower triangle without its diagonal, row by row: (1, 0), (2, 0), (2, 1), (3, 0)…, −100 to 100; 0 where the data
    /// do not tell one of the two.
    pub percent: Vec<i8, MAX_PAIRS>,
}

impl Correlations {
    /// Every pair once: the larger index, the smaller index, and their correlation in per cent.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize, i8)> {
        let indices = (1..self.unknowns.len()).flat_map(|row| (0..row).map(move |col| (row, col)));
        indices.zip(&self.percent).map(|((row, column), percent)| (row, column, *percent))
    }
}

/// A combination of unknowns that the data tell badly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct WeakDirection {
    /// Standard deviation along it: of the parameters' logarithms, that is relative, and of nuisances as a part of what was
    /// known of them beforehand; `None` where the data do not tell it at all.
    pub relative_std: Option<f64>,
    /// Who takes part most, largest first.
    pub shares: Vec<Share, MAX_SHARES>,
    /// Such as `joint_1 tx stiffness and joint_2 tx stiffness trade off in these poses (31 %)`; no percentage where a
    /// nuisance is named.
    pub text: Text,
}

/// The part of one unknown in a direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Share {
    /// One of [`Correlations::unknowns`].
    pub name: Label,
    /// Component of the direction, whose length is 1 over all unknowns.
    pub weight: f32,
}

/// What is left between model and measurement: whether noise explains its size ([`Fit::consistency`]) and its shape.
///
/// [`Fit::consistency`]: crate::report::Fit::consistency
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Residuals {
    /// How much structure the residuals have along the band, in standard deviations of what noise has: about N(0, 1) if
    /// the model is right.
    pub whiteness: f64,
    /// They are larger than noise explains.
    pub size_objects: bool,
    /// They have more structure than noise explains.
    pub whiteness_objects: bool,
    /// Both in words.
    pub text: Text,
}

/// How well a record is predicted by a fit to all the others, along the axes of the TCP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct HeldOut {
    /// Joint angles, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Frequency response assurance criterion: 1 where the shapes are equal, 0 where they have nothing in common.
    pub frac: [f64; 3],
    /// Variance accounted for: 1 where all is predicted, below 0 where the model is worse than none.
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
