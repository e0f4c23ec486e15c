//! Normal equations of records that are no longer kept, with the imperfections of the plant.
//!
//! Their sum of squares is a quadratic of the unknowns and of the imperfections that records share. The imperfections of a record alone are eliminated
//! with their priors.

use heapless::Vec;

use super::super::retired::RetiredInformation;
use super::super::sizes::{ALL, OF_ALL, PACKED, ParameterNormal};
use super::super::straight::Straight;
use super::domain::Point;
use crate::chain::JointKind;
use crate::imperfection::{self, Accuracies, Correction, Imperfection, MAX_IMPERFECTIONS};
use crate::linear::normal::{Derivatives, Normal};
use crate::sought::Sought;

/// Standard deviation, in its accuracy, of the difference between an imperfection of the retired records and that of the kept ones. Chosen:
/// quadratics about two points contradict each other by less, where an elastic centre and the split of a compliance between joint and ground have
/// moved by their standard deviation; retired records narrow no interval below what a tenth of the accuracies
/// makes it.
const LOOSE: f64 = 0.1;

/// Retired records of a plant.
#[derive(Clone, Debug)]
pub(in crate::refine) struct RetiredOfPlant {
    /// Imperfections, in the unit of each, come before the unknowns.
    pub(super) information: RetiredInformation<OF_ALL>,
    /// Copy of `information` whose imperfections may differ from those of the kept records.
    loosened: RetiredInformation<OF_ALL>,
    /// The imperfections that records share, each with its accuracy.
    pub(super) shared: Vec<(Imperfection, f64), MAX_IMPERFECTIONS>,
}

impl RetiredOfPlant {
    /// Information of no record of a robot with these joints.
    // Inlined, its normal equations would take room on the stack of the caller.
    #[inline(never)]
    pub(super) fn none(accuracies: &Accuracies, joints: &[JointKind], sought: &Sought) -> Self {
        let own = imperfection::all(accuracies, joints, 0);
        let of_low_pass = imperfection::of_low_pass(accuracies.delay);
        let shared: Vec<_, _> = own.into_iter().chain(of_low_pass).collect();
        let information = RetiredInformation::none(shared.len() + sought.unknowns());
        Self { loosened: information.clone(), information, shared }
    }

    /// Loosens the imperfections, where the information has changed.
    pub(super) fn loosen(&mut self) {
        self.loosened.clone_from(&self.information);
        let values = self.information.at().iter().zip(&self.shared).enumerate();
        for (column, (value, (imperfection, accuracy))) in values {
            let slope = straightened(*imperfection, bent(*imperfection, *value))[1];
            let deviation = LOOSE * accuracy * slope;
            self.loosened.normal.loosen(column, deviation * deviation);
        }
    }

    /// Returns whether the records say something of an imperfection.
    pub(super) fn shows(&self, imperfection: Imperfection) -> bool {
        let column = self.shared.iter().position(|(own, _)| *own == imperfection);
        column.is_some_and(|column| self.information.normal.row(column)[column] > 0.0)
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
    pub(super) fn values_at(
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
    // Inlined, its normal equations would take room on the stack of the caller.
    #[inline(never)]
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
pub(super) fn bent(imperfection: Imperfection, straight: f64) -> f64 {
    match imperfection.exponent() {
        0.0 => straight,
        exponent => libm::log(straight) / exponent,
    }
}

/// Returns the derivative that [`straightened`] gives of each imperfection at a point.
pub(super) fn slopes(point: &Point, all: &[(Imperfection, f64)]) -> impl Fn(usize) -> f64 {
    move |column: usize| {
        let (imperfection, deviation) = all[column];
        straightened(imperfection, deviation * point.imperfections[column])[1]
    }
}

/// Derivatives by unknowns that stand behind so many others.
pub(super) fn behind(first: usize, derivatives: Derivatives) -> Derivatives {
    derivatives.into_iter().map(|(unknown, by)| (first + unknown, by)).collect()
}
