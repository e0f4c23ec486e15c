//! What is left of records that are no longer kept: their normal equations, the seam projected out.
//!
//! About the estimate at which a record retires, its sum of squares is a quadratic of the unknowns; all retired records
//! together are one such quadratic, however many they are.

use heapless::Vec;

use super::sizes::ParameterNormal;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::sought::MAX_UNKNOWNS;

/// Sum of squares of all retired records as a quadratic about one point.
#[derive(Clone, Debug)]
pub(crate) struct RetiredInformation {
    normal: ParameterNormal,
    /// Where it is expanded: the value of each unknown.
    at: [f64; MAX_UNKNOWNS],
    records: u64,
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
    /// How many.
    pub(crate) fn records(&self) -> u64 {
        self.records
    }
}

impl RetiredInformation {
    /// Of no record, about `so` many unknowns.
    pub(crate) fn none(unknowns: usize) -> Self {
        let mut normal = Normal::new();
        normal.reset(unknowns);
        Self { normal, at: [0.0; MAX_UNKNOWNS], records: 0 }
    }

    /// Of retired records; `None` where they are not of so many unknowns, or hold a number that is not finite.
    pub(crate) fn of(retired: &Retired, unknowns: usize) -> Option<Self> {
        let Retired { normal, at, records } = retired;
        let fits = normal.len() == packed(unknowns + 1) && at.len() == unknowns;
        if !fits || normal.iter().chain(at).any(|value| !value.is_finite()) {
            return None;
        }
        let mut information = Self::none(unknowns);
        information.normal.entries_mut().copy_from_slice(normal);
        information.at[..unknowns].copy_from_slice(at);
        information.records = *records;
        Some(information)
    }

    /// The retired records that it is of.
    pub(crate) fn retired(&self) -> Retired {
        Retired {
            normal: self.normal.entries().iter().copied().collect(),
            at: self.at.iter().copied().take(self.normal.unknowns()).collect(),
            records: self.records,
        }
    }

    /// Records that it stands for.
    pub(crate) fn records(&self) -> u64 {
        self.records
    }

    /// Takes in a record's normal equations, of which the first `eliminated` unknowns are gone, at these values.
    pub(crate) fn take<const M: usize>(
        &mut self,
        record: &Normal<M>,
        eliminated: usize,
        values: &[f64; MAX_UNKNOWNS],
    ) {
        self.normal.shift(&self.from(values));
        self.at = *values;
        self.normal.add_complement(record, eliminated);
        self.records += 1;
    }

    /// Adds it to the normal equations of a step from these values.
    pub(crate) fn add_to(&self, normal: &mut ParameterNormal, values: &[f64; MAX_UNKNOWNS]) {
        if self.records > 0 {
            let mut own = self.normal.clone();
            own.shift(&self.from(values));
            normal.add_complement(&own, 0);
        }
    }

    /// Its sum of squares at these values.
    pub(crate) fn sum_of_squares(&self, values: &[f64; MAX_UNKNOWNS]) -> f64 {
        self.normal.sum_of_squares() - self.normal.gain(&self.from(values))
    }

    /// What `all`, the normal equations with it at these values, must spend because it and the rest of them want other
    /// values. The two are compared together: a few records change the sum of many by little.
    pub(crate) fn contradiction(&self, all: &ParameterNormal, values: &[f64; MAX_UNKNOWNS]) -> f64 {
        if self.records == 0 {
            return 0.0;
        }
        let mut own = self.normal.clone();
        own.shift(&self.from(values));
        let mut rest = all.clone();
        rest.subtract_complement(&own, 0);
        own.excess() + rest.excess() - all.excess()
    }

    fn from(&self, values: &[f64; MAX_UNKNOWNS]) -> [f64; MAX_UNKNOWNS] {
        core::array::from_fn(|i| values[i] - self.at[i])
    }
}
