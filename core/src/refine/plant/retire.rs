//! A record that is no longer kept retires where the plant stands.

use heapless::Vec;

use super::super::Refinement;
use super::super::basis::Asked;
use super::super::problem::Problem;
use super::super::retired::RetiredInformation;
use super::super::sizes::ALL;
use super::super::straight::Straight;
use super::Plant;
use super::domain::Point;
use super::retired::{RetiredOfPlant, behind, bent, slopes};
use crate::chain::linearise::LinearisationError;
use crate::chi_square::rarely_exceeded;
use crate::linear::normal::Derivatives;
use crate::sought::{MAX_UNKNOWNS, Sought};
use crate::spectrum::Experiment;

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

impl Refinement {
    /// Adds the information of a record that will not be kept, of this number, to that of the retired ones. The first is expanded where the plant
    /// stands.
    ///
    /// # Errors
    /// The robot has no equilibrium there; then nothing is added.
    // Inlined, its normal equations would take room on the stack of the caller.
    #[inline(never)]
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
        let assembled = self.assemble_on_plant(problem, experiment, record, plant, Asked::Fit);
        let expanded = core::mem::replace(&mut plant.point, standing);
        assembled?;
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

    /// Drops the retired records here and in a plant, whose fit goes on without them. Returns their number.
    pub(crate) fn forget_retired(&mut self, sought: &Sought, plant: &mut Plant) -> u64 {
        self.set_retired_aside(sought);
        let forgotten = self.end_setting_aside(false);
        self.follow_retired(plant);
        plant.minimiser.restart();
        forgotten
    }

    /// Takes over the retired records of a plant, if they or the imperfections of the model have changed. The plant drops those that have been
    /// dropped here.
    pub(crate) fn follow_retired(&mut self, plant: &mut Plant) {
        if core::mem::take(&mut self.has_forgotten) {
            plant.retired = None;
        }
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
    /// Returns whether the retired records contradict the others where the last fit has ended, with residuals of so many times the power of noise: the
    /// minimum of both exceeds the sum of their own by more than noise makes it. They do where the robot has changed. They also do where they have retired
    /// while few poses had been seen: the robot was then far from where they are expanded, and their sum of squares is no quadratic that wide.
    // Inlined, the normal equations would take room on the stack of the caller.
    #[inline(never)]
    pub(crate) fn contradicts_retired(&mut self, problem: &Problem<'_>, inflation: f64) -> bool {
        let Self { imperfections, point, minimiser, factor, whole, retired, .. } = self;
        let Some(retired) = retired.as_ref().filter(|own| own.information.records() > 0) else {
            return false;
        };
        let all = &minimiser.normal;
        let (own, rest) = (factor, whole);
        own.reset(all.unknowns());
        retired.add_to(own, problem.sought, point, &imperfections.all);
        rest.reset(all.unknowns());
        rest.add_complement(all, 0);
        rest.subtract_complement(own, 0);
        let contradiction = own.excess() + rest.excess() - all.excess();
        contradiction > inflation * rarely_exceeded(own.unknowns() as f64)
    }

    /// Point about which the retired records are expanded: that where the plant stands, if there are none yet. The imperfections of records keep
    /// their values.
    // Inlined, its normal equations would take room on the stack of the caller.
    #[inline(never)]
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
        let information = &self.retired.as_ref()?.information;
        if information.records() == 0 {
            return None;
        }
        let (normal, at) = (information.normal.entries(), information.at());
        Some(RetiredRecords { normal, at, records: information.records() })
    }

    /// Takes these as the retired records of a fit that seeks `sought`. `None` if they are of other numbers of imperfections or unknowns, or hold a
    /// number that no fit leaves; then nothing has changed. Robot and accuracies must be the same; the caller ensures that.
    pub fn resume_retired(&mut self, records: &RetiredRecords<'_>, sought: &Sought) -> Option<()> {
        let RetiredRecords { normal, at, records } = *records;
        let mut retired = RetiredOfPlant::none(&self.accuracies, &self.joints, sought);
        let unknowns = retired.shared.len() + sought.unknowns();
        retired.information = RetiredInformation::of(normal, at, records, unknowns)?;
        let (of_shared, of_unknowns) = retired.information.at().split_at(retired.shared.len());
        let mut all = of_shared.iter().zip(&retired.shared).map(|(value, own)| bent(own.0, *value));
        let mut coordinates = [0.0; MAX_UNKNOWNS];
        Straight::go_to(sought, of_unknowns, &mut coordinates);
        if !(all.all(f64::is_finite) && coordinates.iter().all(|value| value.is_finite())) {
            return None;
        }
        retired.loosen();
        self.retired = Some(retired);
        Some(())
    }
}

#[cfg(test)]
mod tests;
