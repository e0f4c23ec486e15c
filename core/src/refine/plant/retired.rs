//! What is left of records that are no longer kept, with the imperfections of the plant.
//!
//! Their sum of squares is a quadratic of the unknowns and of the imperfections that records share. The imperfections of a record alone are eliminated
//! with their priors.

use heapless::Vec;

use super::super::Refinement;
use super::super::compliance::Straight;
use super::super::problem::Problem;
use super::super::retired::RetiredInformation;
use super::super::sizes::{ALL, OF_ALL, PACKED, ParameterNormal};
use super::Plant;
use super::domain::Point;
use crate::chain::JointKind;
use crate::chain::linearise::LinearisationError;
use crate::imperfection::{self, Accuracies, Correction, Imperfection, MAX_IMPERFECTIONS};
use crate::linear::normal::{Derivatives, Normal};
use crate::sought::Sought;
use crate::spectrum::Experiment;

/// By how much an imperfection of the retired records may differ from that of the kept ones, in its accuracy. Chosen: quadratics about two points
/// contradict each other by less, where an elastic centre and the split of a compliance between joint and ground have moved by their standard
/// deviation; no interval is then narrower than a tenth of the accuracies makes it.
const LOOSE: f64 = 0.1;

/// Retired records of a plant.
#[derive(Clone, Debug)]
pub(in crate::refine) struct RetiredOfPlant {
    /// Imperfections, in the unit of each, come before the unknowns.
    information: RetiredInformation<OF_ALL>,
    /// The same, whose imperfections may differ from those of the kept records.
    loosened: RetiredInformation<OF_ALL>,
    /// The imperfections that records share, each with its accuracy.
    shared: Vec<(Imperfection, f64), MAX_IMPERFECTIONS>,
}

/// Retired records of a plant as numbers that can be kept in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RetiredRecords<'a> {
    /// Normal equations: the lower triangle by rows, the right-hand side as the last.
    pub normal: &'a [f64],
    /// Values of imperfections and unknowns about which they are.
    pub at: &'a [f64],
    /// Number of records.
    pub records: u64,
}

impl RetiredOfPlant {
    /// Of no record of a robot with these joints.
    fn none(accuracies: &Accuracies, joints: &[JointKind], sought: &Sought) -> Self {
        let own = imperfection::all(accuracies, joints, 0);
        let of_low_pass = imperfection::of_low_pass(accuracies.delay);
        let shared: Vec<_, _> = own.into_iter().chain(of_low_pass).collect();
        let information = RetiredInformation::none(shared.len() + sought.unknowns());
        Self { loosened: information.clone(), information, shared }
    }

    /// Loosens the imperfections, where the information has changed.
    fn loosen(&mut self) {
        self.loosened.clone_from(&self.information);
        let values = self.information.at().iter().zip(&self.shared).enumerate();
        for (column, (value, (imperfection, accuracy))) in values {
            let slope = straightened(*imperfection, bent(*imperfection, *value))[1];
            let deviation = LOOSE * accuracy * slope;
            self.loosened.normal.loosen(column, deviation * deviation);
        }
    }

    /// Values where the imperfections have those that `of` gives.
    fn values(&self, of: impl Fn(Imperfection) -> f64, straight: &[f64]) -> [f64; ALL] {
        let shared = self.shared.iter().map(|&(own, _)| straightened(own, of(own))[0]);
        let mut values = [0.0; ALL];
        let own = shared.chain(straight.iter().copied());
        values.iter_mut().zip(own).for_each(|(value, own)| *value = own);
        values
    }

    /// Values at a point of a fit with the imperfections `all`, each with its standard deviation.
    fn values_at(
        &self,
        straight: &Straight<'_>,
        point: &Point,
        all: &[(Imperfection, f64)],
    ) -> [f64; ALL] {
        let of = |imperfection| {
            let own = all.iter().position(|(own, _)| *own == imperfection);
            own.map_or(0.0, |index| all[index].1 * point.imperfections[index])
        };
        self.values(of, straight.values())
    }

    /// Its sum of squares at a point of a fit with the imperfections `all`.
    pub(super) fn sum_of_squares(
        &self,
        sought: &Sought,
        point: &Point,
        all: &[(Imperfection, f64)],
    ) -> f64 {
        let straight = Straight::at(sought, &point.coordinates);
        self.loosened.sum_of_squares(&self.values_at(&straight, point, all))
    }

    /// Adds it to the normal equations of a step of such a fit.
    pub(super) fn add_to(
        &self,
        normal: &mut Normal<OF_ALL>,
        sought: &Sought,
        point: &Point,
        all: &[(Imperfection, f64)],
    ) {
        let straight = Straight::at(sought, &point.coordinates);
        let slope = slopes(point, all);
        let of_shared = self.shared.iter().map(|(imperfection, _)| {
            let own = all.iter().position(|(own, _)| own == imperfection);
            own.map(|column| (column, slope(column) * all[column].1)).into_iter().collect()
        });
        let of_unknowns = straight.by_unknowns().map(|own| behind(all.len(), own));
        let derivatives: Vec<Derivatives, ALL> = of_shared.chain(of_unknowns).collect();
        let values = self.values_at(&straight, point, all);
        self.loosened.add_to(normal, &values, &derivatives);
    }

    /// The information about the unknowns of a robot whose imperfections have these values.
    pub(in crate::refine) fn with(&self, correction: &Correction) -> RetiredInformation<PACKED> {
        let of = |imperfection| {
            let own = correction.values().iter().find(|(own, _)| *own == imperfection);
            own.map_or(0.0, |(_, value)| *value)
        };
        let (of_shared, at) = self.loosened.at().split_at(self.shared.len());
        let itself = (0..at.len()).map(|unknown| [(unknown, 1.0)].into_iter().collect());
        let held = of_shared.iter().map(|_| Derivatives::new());
        let itself: Vec<Derivatives, ALL> = itself.collect();
        let derivatives: Vec<Derivatives, ALL> = held.chain(itself.iter().cloned()).collect();
        let mut normal = ParameterNormal::new();
        normal.reset(at.len());
        self.loosened.add_to(&mut normal, &self.values(of, at), &derivatives);
        let mut retired = RetiredInformation::none(at.len());
        retired.begin_at(at);
        retired.take(&normal, &itself);
        retired.records = self.information.records();
        retired
    }
}

/// An imperfection of this value where a common factor is straight, and its derivative by that value.
fn straightened(imperfection: Imperfection, value: f64) -> [f64; 2] {
    let exponent = imperfection.exponent();
    if exponent == 0.0 {
        return [value, 1.0];
    }
    let factor = libm::exp(exponent * value);
    [factor, exponent * factor]
}

/// The value of an imperfection from that where a common factor is straight.
fn bent(imperfection: Imperfection, straight: f64) -> f64 {
    match imperfection.exponent() {
        0.0 => straight,
        exponent => libm::log(straight) / exponent,
    }
}

/// That derivative of each imperfection at a point.
fn slopes(point: &Point, all: &[(Imperfection, f64)]) -> impl Fn(usize) -> f64 {
    move |column: usize| {
        let (imperfection, deviation) = all[column];
        straightened(imperfection, deviation * point.imperfections[column])[1]
    }
}

/// Derivatives by unknowns that stand behind so many others.
fn behind(first: usize, derivatives: Derivatives) -> Derivatives {
    derivatives.into_iter().map(|(unknown, by)| (first + unknown, by)).collect()
}

impl Refinement {
    /// Adds the information of a record that will not be kept, of this number, to that of the retired ones. The first is expanded where the plant
    /// stands.
    ///
    /// # Errors
    /// The robot has no equilibrium there; then nothing is added.
    pub(crate) fn retire_on_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
        record: usize,
        plant: &mut Plant,
    ) -> Result<(), LinearisationError> {
        plant.count_all_bins();
        let standing = plant.point;
        plant.point = plant.expanded_at(problem.sought);
        let assembled = self.assemble_on_plant(problem, experiment, record, plant);
        let expanded = core::mem::replace(&mut plant.point, standing);
        assembled?;
        plant.eliminate_own(problem, &expanded, record);
        let Plant { imperfections, factor, minimiser, retired, .. } = plant;
        minimiser.linearised = false;
        let Some(retired) = retired else { return Ok(()) };
        let shared = &retired.shared;
        let all = &imperfections.all;
        let straight = Straight::at(problem.sought, &expanded.coordinates);
        let slope = slopes(&expanded, all);
        let of_all = all.iter().enumerate().map(|(column, (imperfection, deviation))| {
            // Those of the record are gone.
            let own = shared.iter().position(|(own, _)| own == imperfection);
            let by = 1.0 / (deviation * slope(column));
            own.map(|own| (own, by)).into_iter().collect()
        });
        let of_unknowns = straight.of_unknowns().map(|own| behind(shared.len(), own));
        let derivatives: Vec<Derivatives, ALL> = of_all.chain(of_unknowns).collect();
        retired.information.take(factor, &derivatives);
        retired.loosen();
        self.is_behind_retired = true;
        Ok(())
    }

    /// Takes over the retired records of a plant, if they or the imperfections of the model have changed.
    pub(crate) fn follow_retired(&mut self, plant: &Plant) {
        if self.is_behind_retired
            && self.aside.is_none()
            && let Some(retired) = &plant.retired
        {
            self.retired = retired.with(&self.workspace.correction);
            self.minimiser.linearised = false;
            self.is_behind_retired = false;
        }
    }
}

impl Plant {
    /// Eliminates the imperfections of record number `record` alone from its normal equations, taken at a point and without its seam. What is left is
    /// in `factor`.
    pub(super) fn eliminate_own(&mut self, problem: &Problem<'_>, point: &Point, record: usize) {
        let Self { imperfections, record: of_record, factor, .. } = self;
        factor.reset(imperfections.all.len() + problem.sought.unknowns());
        factor.add_complement(of_record, problem.seam_unknowns());
        for (index, (imperfection, _)) in imperfections.all.iter().enumerate() {
            if imperfection.is_of_record(record) {
                factor.add_prior(index, point.imperfections[index]);
                factor.eliminate_one(index);
            }
        }
    }

    /// Point about which the retired records are expanded: that where the plant stands, if there are none yet. The imperfections of records keep
    /// their values.
    fn expanded_at(&mut self, sought: &Sought) -> Point {
        let Self { accuracies, joints, imperfections, point, retired, .. } = self;
        let all = &imperfections.all;
        let none = || RetiredOfPlant::none(accuracies, joints, sought);
        let retired = retired.get_or_insert_with(none);
        let values = retired.values_at(&Straight::at(sought, &point.coordinates), point, all);
        retired.information.begin_at(&values);
        let mut expanded = *point;
        let (of_shared, of_unknowns) = retired.information.at().split_at(retired.shared.len());
        Straight::go_to(sought, of_unknowns, &mut expanded.coordinates);
        for ((imperfection, _), value) in retired.shared.iter().zip(of_shared) {
            if let Some(column) = all.iter().position(|(own, _)| own == imperfection) {
                let value = bent(*imperfection, *value);
                expanded.imperfections[column] = value / all[column].1;
            }
        }
        expanded
    }

    /// Number of retired records.
    pub fn retired(&self) -> u64 {
        self.retired.as_ref().map_or(0, |retired| retired.information.records())
    }

    /// The retired records, to be stored. `None` if there are none.
    pub fn retired_records(&self) -> Option<RetiredRecords<'_>> {
        let RetiredOfPlant { information, .. } = self.retired.as_ref()?;
        let (normal, at) = (information.normal.entries(), information.at());
        Some(RetiredRecords { normal, at, records: information.records() })
    }

    /// Takes these as the retired records of a fit that seeks `sought`. `None` if they are of another robot, of other accuracies or of other unknowns,
    /// or hold a number that is not finite; then nothing has changed.
    pub fn resume_retired(&mut self, records: &RetiredRecords<'_>, sought: &Sought) -> Option<()> {
        let RetiredRecords { normal, at, records } = *records;
        let mut retired = RetiredOfPlant::none(&self.accuracies, &self.joints, sought);
        let unknowns = retired.shared.len() + sought.unknowns();
        retired.information = RetiredInformation::of(normal, at, records, unknowns)?;
        retired.loosen();
        self.retired = Some(retired);
        Some(())
    }

    /// Drops the retired records.
    pub(crate) fn forget_retired(&mut self) {
        self.retired = None;
    }
}
