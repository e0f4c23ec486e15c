//! Normal equations of the records that are no longer kept, the seam projected out.
//!
//! The sum of squares of a record is a quadratic about a point near its minimum; all retired records together are one such quadratic, however
//! many they are. All are expanded about one point, that at which the first retires: where the data determine a combination of unknowns alone,
//! quadratics about different points would determine its parts (Huang, Mourikis and Roumeliotis, "Observability-based rules for designing
//! consistent EKF SLAM estimators", 2010). Its unknowns are compliances ([`Straight`]), in which what the data leave open is straight.

use heapless::Vec;

use super::sizes::{ALL, PACKED, ParameterNormal};
use super::straight::Straight;
use crate::linear::normal::{Derivatives, Normal};
use crate::linear::packed::packed;
use crate::sought::{Coordinates, MAX_UNKNOWNS, Sought};

/// Sum of squares of all retired records above its minimum, as a quadratic about one point. `L` is the length of its normal equations.
#[derive(Clone, Debug)]
pub(crate) struct RetiredInformation<const L: usize> {
    pub(super) normal: Normal<L>,
    /// Point of expansion: the value of each unknown.
    at: [f64; ALL],
    pub(super) records: u64,
}

/// All retired records as numbers that can be kept in a file.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Retired {
    /// Lower triangle by rows, the right-hand side as the last.
    normal: Vec<f64, { packed(MAX_UNKNOWNS + 1) }>,
    /// Value of each unknown.
    at: Vec<f64, MAX_UNKNOWNS>,
    records: u64,
}

impl Retired {
    /// Number of the records.
    pub(crate) fn records(&self) -> u64 {
        self.records
    }

    /// The information about so many unknowns; `None` where it is about others, or holds a number that is not finite.
    pub(super) fn information<const L: usize>(
        &self,
        unknowns: usize,
    ) -> Option<RetiredInformation<L>> {
        RetiredInformation::of(&self.normal, &self.at, self.records, unknowns)
    }
}

impl<const L: usize> RetiredInformation<L> {
    /// Information of no record, about so many unknowns.
    pub(crate) fn none(unknowns: usize) -> Self {
        let mut normal = Normal::new();
        normal.reset(unknowns);
        Self { normal, at: [0.0; ALL], records: 0 }
    }

    /// Will be expanded where its unknowns have these values, if it is of no record yet.
    pub(super) fn begin_at(&mut self, values: &[f64]) {
        if self.records == 0 {
            let unknowns = self.normal.unknowns();
            self.at[..unknowns].copy_from_slice(&values[..unknowns]);
        }
    }

    /// Information of retired records, from their normal equations and the values of the unknowns there; `None` where they are not of so many
    /// unknowns, or hold a number that is not finite.
    pub(super) fn of(normal: &[f64], at: &[f64], records: u64, unknowns: usize) -> Option<Self> {
        let fits = normal.len() == packed(unknowns + 1) && at.len() == unknowns;
        if !fits || normal.iter().chain(at).any(|value| !value.is_finite()) {
            return None;
        }
        let mut information = Self::none(unknowns);
        information.normal.entries_mut().copy_from_slice(normal);
        information.at[..unknowns].copy_from_slice(at);
        information.records = records;
        Some(information)
    }

    /// Value of each unknown where it is expanded.
    pub(super) fn at(&self) -> &[f64] {
        &self.at[..self.normal.unknowns()]
    }

    /// Records that it stands for.
    pub(crate) fn records(&self) -> u64 {
        self.records
    }

    /// Takes in a record's normal equations where it is expanded, whose unknowns have these derivatives by its own.
    pub(super) fn take<const M: usize>(&mut self, record: &Normal<M>, derivatives: &[Derivatives]) {
        self.normal.add_mapped(record, &[0.0; ALL], derivatives);
        self.records += 1;
        // What noise has left of the records is no measure of a fit to others.
        let right = self.normal.unknowns();
        *self.normal.entry(right, right) = self.normal.excess();
    }

    /// Adds it to the normal equations of a step from these values, by whose unknowns its own have these derivatives.
    pub(super) fn add_to<const M: usize>(
        &self,
        normal: &mut Normal<M>,
        values: &[f64],
        derivatives: &[Derivatives],
    ) {
        if self.records > 0 {
            normal.add_mapped(&self.normal, &self.from(values), derivatives);
        }
    }

    /// Its sum of squares at these values.
    pub(crate) fn sum_of_squares(&self, values: &[f64]) -> f64 {
        self.normal.sum_of_squares() - self.normal.gain(&self.from(values))
    }

    fn from(&self, values: &[f64]) -> [f64; ALL] {
        let mut moved = [0.0; ALL];
        for (moved, (value, at)) in moved.iter_mut().zip(values.iter().zip(self.at())) {
            *moved = value - at;
        }
        moved
    }
}

impl RetiredInformation<PACKED> {
    /// The retired records as numbers.
    pub(crate) fn retired(&self) -> Retired {
        Retired {
            normal: self.normal.entries().iter().copied().collect(),
            at: self.at().iter().copied().collect(),
            records: self.records,
        }
    }

    /// Coordinates where it is expanded; these, if it is of no record yet.
    pub(super) fn expanded_at(
        &mut self,
        sought: &Sought,
        coordinates: &Coordinates,
    ) -> Coordinates {
        self.begin_at(Straight::at(sought, coordinates).values());
        let mut expanded = *coordinates;
        Straight::go_to(sought, self.at(), &mut expanded);
        expanded
    }

    /// Takes in the normal equations of a record where it is [expanded](RetiredInformation::expanded_at).
    pub(super) fn take_record(
        &mut self,
        record: &ParameterNormal,
        sought: &Sought,
        expanded: &Coordinates,
    ) {
        let straight = Straight::at(sought, expanded);
        self.take(record, &straight.of_unknowns().collect::<Vec<_, MAX_UNKNOWNS>>());
    }

    /// Adds it to the normal equations of a step from these coordinates.
    pub(super) fn add_at(
        &self,
        normal: &mut ParameterNormal,
        sought: &Sought,
        coordinates: &Coordinates,
    ) {
        let straight = Straight::at(sought, coordinates);
        let derivatives: Vec<_, MAX_UNKNOWNS> = straight.by_unknowns().collect();
        self.add_to(normal, straight.values(), &derivatives);
    }

    /// Its sum of squares at these coordinates.
    pub(super) fn sum_at(&self, sought: &Sought, coordinates: &Coordinates) -> f64 {
        if self.records == 0 {
            return 0.0;
        }
        self.sum_of_squares(Straight::at(sought, coordinates).values())
    }

    /// Returns by how much the minimum of `all`, the normal equations with it at these coordinates, exceeds the sum of its minimum and that of
    /// the rest. The two are compared together: a few records change the sum of many by little.
    pub(super) fn contradiction(
        &self,
        all: &ParameterNormal,
        sought: &Sought,
        coordinates: &Coordinates,
    ) -> f64 {
        if self.records == 0 {
            return 0.0;
        }
        let mut own = ParameterNormal::new();
        own.reset(all.unknowns());
        self.add_at(&mut own, sought, coordinates);
        let mut rest = all.clone();
        rest.subtract_complement(&own, 0);
        own.excess() + rest.excess() - all.excess()
    }
}
