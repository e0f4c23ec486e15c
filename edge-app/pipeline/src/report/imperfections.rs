//! The imperfections that the data show.

use flexid_core::imperfection::{FoundImperfection, Stated};
use flexid_core::verdict::Trust;
use flexid_wire::confidence::Nuisance;
use flexid_wire::text::clipped;

use super::interval::{log_normal, normal};
use super::kind::{entry, is_listed, unit};
use super::residuals::Residuals;
use super::verdict::verdict;
use crate::model::Model;
use crate::names::of_imperfection;

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
    all.into_iter().map(move |found| {
        let facts = found.imperfection.facts();
        Nuisance {
            entry: Some(entry(found.imperfection)),
            accuracy: (facts.stated == Stated::ByEntry)
                .then(|| found.prior / facts.prior_over_accuracy),
            ..nuisance(found, model, trust, residuals)
        }
    })
}

/// Makes the message of an imperfection, without its accuracy. The interval does not depend on the verdict, since the prior is known in any case.
pub(super) fn nuisance(
    found: &FoundImperfection,
    model: &Model,
    trust: Trust,
    residuals: Residuals,
) -> Nuisance {
    let FoundImperfection { imperfection, prior, value, deviation } = *found;
    // What is larger than its accuracy is known by its own size.
    let (own, _) = trust.verdict(1.0, deviation / prior.max(value.abs()));
    let is_factor = imperfection.facts().is_factor;
    let value = if is_factor { value.exp() } else { value };
    let std = residuals.inflate(deviation).map(|std| if is_factor { std * value } else { std });
    let interval = if is_factor { log_normal } else { normal };
    Nuisance {
        name: of_imperfection(model, imperfection),
        entry: None,
        accuracy: None,
        unit: clipped(unit(imperfection, model)),
        value,
        std,
        interval: std.filter(|_| residuals.allow_intervals()).map(|std| interval(value, std)),
        verdict: verdict(own),
    }
}

#[cfg(test)]
mod tests {
    use flexid_core::imperfection::{Imperfection, Sensor};
    use flexid_wire::report::Verdict;

    use super::*;
    use crate::report::interval::WITHIN;

    #[test]
    fn a_nuisance_is_judged_by_what_was_known_beforehand() {
        let file =
            concat!(env!("CARGO_MANIFEST_DIR"), "/../../host-tools/scenario/mill3-model.toml");
        let model = Model::load(std::path::Path::new(file)).unwrap();
        let found_in = |consistency, imperfection, value, deviation| {
            let found = FoundImperfection { imperfection, prior: 1e-2, value, deviation };
            let (trust, residuals) = (Trust::new(consistency, true), Residuals::noise(consistency));
            nuisance(&found, &model, trust, residuals)
        };
        let found = |imperfection, value, deviation| found_in(1.96, imperfection, value, deviation);
        // The deviations are 1.4 times as large, since the residuals are 1.4 times as large as the noise explains.
        let delay = found(Imperfection::Delay, 3e-4, 1e-4);
        assert_eq!((delay.unit.as_str(), delay.verdict), ("s", Verdict::Identified));
        assert!((delay.std.unwrap() - 1.4e-4).abs() < 1e-12);
        assert!((delay.interval.unwrap()[0] - (3e-4 - WITHIN * 1.4e-4)).abs() < 1e-12);
        let gain = found(Imperfection::Gain(Sensor::Force, 0), 1.005_f64.ln(), 1e-3);
        assert_eq!((gain.unit.as_str(), gain.verdict), ("", Verdict::Weak));
        assert!((gain.std.unwrap() - 1.005 * 1.4e-3).abs() < 1e-12);
        assert!((gain.interval.unwrap()[1] - 1.005 * (WITHIN * 1.4e-3).exp()).abs() < 1e-12);
        // The data add next to nothing, but the prior remains.
        let late = found(Imperfection::Delay, 1e-3, 5e-3);
        assert_eq!(late.verdict, Verdict::NotObservable);
        assert!((late.interval.unwrap()[1] - (1e-3 + WITHIN * 7e-3)).abs() < 1e-12);
        let huge = found_in(100.0, Imperfection::Delay, 1e-3, 5e-4);
        assert_eq!((huge.std, huge.interval), (Some(5e-3), None));
        let broken = found_in(f64::NAN, Imperfection::Delay, 1e-3, 5e-4);
        assert_eq!((broken.verdict, broken.std), (Verdict::NotObservable, None));
    }
}
