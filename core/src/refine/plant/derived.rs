//! Derivatives of the model of a record by imperfections.

use heapless::VecView;

use super::super::model::Model;
use super::super::problem::Problem;
use super::change::{Change, STEP};
use super::imperfect::Imperfect;
use super::sag::Sag;
use crate::chain::linearise::{LinearChain, LinearisationError};
use crate::imperfection::Imperfection;
use crate::parameters::Bushings;

/// The model about which the derivatives are, in the record of this number.
pub(in crate::refine) struct Base<'a> {
    pub(in crate::refine) problem: &'a Problem<'a>,
    pub(in crate::refine) record: usize,
    /// Its chain at rest.
    pub(in crate::refine) linear: &'a LinearChain,
    pub(in crate::refine) model: &'a Model,
    pub(in crate::refine) bushings: &'a Bushings,
}

/// Fills `changes` with the derivative by each of these imperfections that is of the model, and `sags` with those of the loads on them. `moved` makes the
/// model in which the imperfection of this number is [`STEP`] of its standard deviations larger.
pub(in crate::refine) fn derive(
    base: &Base<'_>,
    imperfections: impl Iterator<Item = Imperfection>,
    moved: impl Fn(usize) -> Imperfect,
    sags: &mut [Sag],
    changes: &mut VecView<Change>,
) -> Result<(), LinearisationError> {
    let Base { problem, record, linear, model, bushings } = *base;
    let elongations = linear.elongations();
    changes.clear();
    for (index, imperfection) in imperfections.enumerate() {
        let change = if imperfection.is_of_another_record(record) {
            sags.iter_mut().for_each(Sag::push_none);
            Change::NONE
        } else if imperfection.is_of_model() {
            let moved = moved(index);
            let there = moved.linearise_at(problem, &elongations);
            let terms = moved.model(&there, bushings)?.terms;
            if !sags.is_empty() {
                let loads = moved.gravity_loads(problem, &elongations);
                sags.iter_mut().for_each(|sag| sag.push(&loads));
            }
            Change::between([linear, &there], [&model.terms, &terms], STEP)
        } else {
            continue;
        };
        // There is room for all of them.
        let _ = changes.push(change);
    }
    Ok(())
}
