//! A fit to an imperfect plant: unknowns and imperfections together.
//!
//! The imperfections p are columns of the normal equations behind the seams, which are those of each record, and before the unknowns,
//! which they share with all records. Each has a prior, which is `p = 0 ± 1` in its standard deviation. Where the fit has ended, they
//! are eliminated as the seams are. What is left is the information about the unknowns that holds whatever the imperfections are.
//!
//! | file                            | what                                                            |
//! | ------------------------------- | --------------------------------------------------------------- |
//! | `imperfect`                     | the model with its imperfections                                |
//! | `change`, `derived`             | derivatives of the model by the imperfections                   |
//! | `motion`, `columns`             | derivatives of a reading by them                                |
//! | `sag`                           | derivatives by these and the stiffnesses through the sag        |
//! | `correction`                    | from a fit to a model that has its imperfections, and back      |
//! | `imperfections`, `objective`, `domain` | the sum of squares over unknowns and imperfections       |
//! | `fit`, `levels`, `thinned`      | its minimum, and how a fit begins                               |
//! | `jackknife`                     | standard deviations where noise does not explain the residuals  |
//! | `structure`                     | links that give way                                             |
//! | `information`                   | what records and priors say of unknowns and imperfections       |
//! | `retired`, `retire`             | records that are no longer kept, with the imperfections         |
//! | `mechanics`, `places`           | the robot that a fit has found, without its sensors             |
//! | `restated`, `factors`           | accuracies that the data contradict                             |
//! | `diagnosis`                     | which of them are wrong, and what explains as much              |
//! | `explanation`, `evidence`       | the misfit as a function of the imperfections                   |

pub(super) mod change;
pub(super) mod columns;
mod correction;
pub(super) mod derived;
mod diagnosis;
mod domain;
mod evidence;
mod explanation;
mod factors;
mod fit;
pub(super) mod imperfect;
mod imperfections;
mod information;
mod jackknife;
mod levels;
mod mechanics;
mod motion;
mod movement;
mod noise;
mod objective;
mod places;
mod restated;
mod retire;
mod retired;
mod sag;
mod structure;
mod thinned;

use heapless::Vec;

use super::damping::Damping;
use super::levenberg_marquardt::{LEAST_DAMPING, LevenbergMarquardt, Limits};
use super::sizes::{OF_ALL, WIDE_OF_RECORD};
use super::stagnation::{OF_PLANT, Stagnation};
use super::summary::Summary;
use crate::MAX_JOINTS;
use crate::chain::{Chain, JointKind};
use crate::imperfection::{self, Accuracies, FoundImperfection, Imperfection, MAX_IMPERFECTIONS};
use crate::linear::normal::Normal;
use crate::sought::MAX_UNKNOWNS;
pub use diagnosis::{Explanation, MAX_EXPLANATIONS, MAX_RIVALS};
use domain::Point;
use factors::Restated;
use imperfections::Imperfections;
pub use information::PlantInformation;
pub use mechanics::Mechanics;
pub use places::Places;
pub use retire::RetiredRecords;
use retired::RetiredOfPlant;

/// Limits of a fit. Chosen: all unknowns together end within a tenth of a standard deviation of the minimum; a fit typically takes a
/// sixth of these steps.
const LIMITS: Limits =
    Limits { negligible: 1e-2, iterations: 60, damping: Damping::bracketed(LEAST_DAMPING) };

/// Imperfections of a plant and memory for a fit to it. It is large: a program that never makes one holds none of it.
#[derive(Clone, Debug)]
pub struct Plant {
    accuracies: Accuracies,
    imperfections: Imperfections,
    /// Holds the normal equations of imperfections and unknowns.
    minimiser: LevenbergMarquardt<OF_ALL>,
    /// Present point of the fit.
    point: Point,
    /// Accuracies that the data contradict.
    restated: Restated,
    /// True if a fit takes the accuracies as those that explain the records best.
    adopts: bool,
    /// Relative error of the model that the weights allow for.
    relative_error: f64,
    /// Distance of the bins that count, 1 where all do.
    every: usize,
    /// How far the last steps have come.
    stagnation: Stagnation,
    /// Normal equations of the record that was assembled last.
    record: Normal<WIDE_OF_RECORD>,
    /// Normal equations of a record of which parts are left out.
    whole: Normal<WIDE_OF_RECORD>,
    /// Factor of the normal equations.
    factor: Normal<OF_ALL>,
    /// Sums over the residuals where the normal equations were assembled last.
    summary: Summary,
    /// Standard deviation of each imperfection where the last fit has ended, in that of its prior.
    deviations: [f64; MAX_IMPERFECTIONS],
    /// Retired records. `None` if there are none.
    retired: Option<RetiredOfPlant>,
    /// Motion of the drive of each joint of the robot.
    joints: Vec<JointKind, MAX_JOINTS>,
}

impl Plant {
    /// A plant of these accuracies, and of a robot with the joints of `chain`.
    pub fn new(accuracies: &Accuracies, chain: &Chain) -> Self {
        let joints = chain.kinds();
        Self {
            imperfections: Imperfections::new(imperfection::all(accuracies, &joints, 0)),
            accuracies: *accuracies,
            minimiser: LevenbergMarquardt::new(LIMITS),
            point: Point {
                coordinates: [0.0; MAX_UNKNOWNS],
                imperfections: [0.0; MAX_IMPERFECTIONS],
            },
            restated: Restated::default(),
            adopts: false,
            relative_error: 0.0,
            every: 1,
            stagnation: Stagnation::new(OF_PLANT),
            record: Normal::new(),
            whole: Normal::new(),
            factor: Normal::new(),
            summary: Summary::default(),
            deviations: [1.0; MAX_IMPERFECTIONS],
            retired: None,
            joints,
        }
    }

    /// Standard deviation of the logarithm of all stiffnesses in a record to come. `None` if they are the same in all records.
    pub fn record_stiffness(&self) -> Option<f64> {
        let imperfection = Imperfection::RecordStiffness(Mechanics::RECORD);
        let std = self.accuracies.record_stiffness * self.restated.factor(imperfection);
        (std > 0.0).then_some(std)
    }

    /// Sets whether estimates of this plant from now on adopt what explains the records: an accuracy that they contradict is taken as worse by as
    /// much as makes them most likely, and the fit is made again.
    pub fn adopt(&mut self, adopts: bool) {
        self.adopts = adopts;
    }

    /// Returns whether nothing is off, in any number of records.
    pub fn is_perfect(&self) -> bool {
        let Accuracies { structure_translation, structure_rotation, .. } = self.accuracies;
        let is_rigid = [structure_translation, structure_rotation] == [0.0; 2];
        is_rigid && imperfection::all(&self.accuracies, &self.joints, 2).is_empty()
    }

    /// Returns whether the records that are fitted can have imperfections that a fit seeks.
    pub(crate) fn has_imperfections(&self) -> bool {
        !self.imperfections.all.is_empty()
    }

    /// Returns whether the robot has the joints of `chain`.
    pub(crate) fn is_of(&self, chain: &Chain) -> bool {
        self.joints == chain.kinds()
    }

    /// The imperfections where the last fit has ended.
    pub(crate) fn found(&self) -> Vec<FoundImperfection, MAX_IMPERFECTIONS> {
        let found =
            |(index, &(imperfection, prior)): (usize, &(Imperfection, f64))| FoundImperfection {
                imperfection,
                prior: prior / self.restated.factor(imperfection),
                value: prior * self.point.imperfections[index],
                deviation: prior * self.deviations[index],
            };
        self.imperfections.all.iter().enumerate().map(found).collect()
    }
}

#[cfg(test)]
mod divided_tests;
#[cfg(test)]
mod static_tests;
#[cfg(test)]
mod tests;
