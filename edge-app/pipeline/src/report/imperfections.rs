//! The imperfections that the data show.

use flexid_core::imperfection::Stated;
use flexid_core::refine::FoundImperfection;
use flexid_core::verdict::Trust;
use flexid_wire::confidence::Nuisance;
use flexid_wire::text::clipped;

use super::interval::{log_normal, normal};
use super::kind::{entry, is_listed, name, unit};
use super::residuals::Residuals;
use super::verdict::verdict;
use crate::model::Model;

/// Part of its prior's standard deviation below which the data determine an imperfection. Chosen: they then say more than the prior.
const DETERMINED: f64 = 0.5;
/// Standard deviations of its prior beyond which an imperfection is worth a look: a normal distribution exceeds it once in twenty.
const CONSPICUOUS: f64 = 2.0;

/// Returns the imperfections that are larger than their accuracies promise, and then those that the data determine. Of each, the first
/// is the one that explains most: it differs from zero by most of its own standard deviations.
pub(super) fn conspicuous(
    found: &[FoundImperfection],
    model: &Model,
    trust: Trust,
    residuals: Residuals,
) -> impl Iterator<Item = Nuisance> {
    let size = |found: &FoundImperfection| (found.value / found.prior).abs();
    let mut all: Vec<&FoundImperfection> = found
        .iter()
        .filter(|found| is_listed(found.imperfection))
        .filter(|found| found.deviation < DETERMINED * found.prior || size(found) > CONSPICUOUS)
        .collect();
    let significance = |found: &FoundImperfection| (found.value / found.deviation).abs();
    let is_conspicuous = |found: &FoundImperfection| size(found) > CONSPICUOUS;
    all.sort_by(|one, other| {
        let larger = is_conspicuous(other).cmp(&is_conspicuous(one));
        larger.then(significance(other).total_cmp(&significance(one)))
    });
    all.into_iter().map(move |found| nuisance(found, model, trust, residuals))
}

fn nuisance(
    found: &FoundImperfection,
    model: &Model,
    trust: Trust,
    residuals: Residuals,
) -> Nuisance {
    let FoundImperfection { imperfection, prior, value, deviation } = *found;
    // What is larger than its accuracy is known by its own size.
    let (own, _) = trust.verdict(1.0, deviation / prior.max(value.abs()));
    let facts = imperfection.facts();
    let is_factor = facts.is_factor;
    let value = if is_factor { value.exp() } else { value };
    let std = residuals.inflate(deviation).map(|std| if is_factor { std * value } else { std });
    let interval = if is_factor { log_normal } else { normal };
    Nuisance {
        name: name(imperfection, model),
        entry: Some(entry(imperfection)),
        accuracy: (facts.stated == Stated::ByEntry).then(|| prior / facts.prior_over_accuracy),
        unit: clipped(unit(imperfection, model)),
        value,
        std,
        interval: std.filter(|_| residuals.allow_intervals()).map(|std| interval(value, std)),
        verdict: verdict(own),
    }
}
