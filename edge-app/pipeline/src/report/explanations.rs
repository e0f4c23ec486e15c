//! Explanations of the misfit, in the units of `[accuracy]`.

use std::f64::consts::TAU;

use flexid_core::identify::PlantEstimate;
use flexid_core::imperfection::{Form, FoundImperfection};
use flexid_core::refine;
use flexid_wire::explanation::{Deviation, Explanation};
use flexid_wire::text::clipped;
use flexid_wire::warning::Warning;

use super::kind::{entry, is_listed, unit};
use super::residuals::Residuals;
use crate::model::Model;
use crate::names::of_imperfection;

/// Distance of an explanation from where the fit has ended, in what the fit has found or in the accuracy. Chosen: an error of thirty accuracies is
/// fitted to more than a third; an explanation beyond is a linearisation far outside of where it holds.
const REACH: f64 = 10.0;
/// Share of the misfit from which on an explanation is one: less is 0 % in words.
const EXPLAINS: f64 = 0.005;

/// The warning about the first accuracy that the data contradict very strongly, if there is one.
pub(crate) fn contradicted(of_plant: Option<&PlantEstimate>, model: &Model) -> Option<Warning> {
    let of_plant = of_plant?;
    let residuals = Residuals::of(&of_plant.estimate, None);
    // Else its imperfections may be those of a wrong minimum.
    let all = Some(of_plant).filter(|_| residuals.allow_intervals());
    let mut all = all.into_iter().flat_map(|own| held(&own.explanations, &own.imperfections));
    let strong = all.find(|found| found.is_contradicted_very_strongly())?;
    let Explanation { deviation, times, rivals, .. } = explanation(strong, model, residuals);
    Some(Warning::Contradicted { deviation, times, rivals: rivals.len() as u8 })
}

/// Explanations of the misfit, if the fit is near enough to the records for its linearisation to say so. Where it is not settled, this may be that
/// of a wrong minimum.
pub(super) fn explanations(
    of_plant: Option<&PlantEstimate>,
    model: &Model,
) -> impl Iterator<Item = Explanation> {
    let near = of_plant.filter(|own| Residuals::of(&own.estimate, None).are_sane());
    near.into_iter().flat_map(move |own| {
        let residuals = Residuals::of(&own.estimate, None);
        held(&own.explanations, &own.imperfections)
            .map(move |found| explanation(found, model, residuals))
    })
}

/// The explanations that a report names and that are adopted; or that explain something, and lie so near to where the fit has ended, with
/// these imperfections, that its linearisation holds there.
fn held<'a>(
    explanations: &'a [refine::Explanation],
    fitted: &'a [FoundImperfection],
) -> impl Iterator<Item = &'a refine::Explanation> {
    explanations.iter().filter(move |own| {
        let FoundImperfection { imperfection, prior, value, .. } = own.largest;
        let fitted = fitted.iter().find(|fitted| fitted.imperfection == imperfection);
        let size = fitted.map_or(0.0, |fitted| fitted.value.abs()).max(prior);
        let explains = own.share >= EXPLAINS && value.abs() <= REACH * size;
        is_listed(imperfection) && (own.is_adopted || explains)
    })
}

fn explanation(found: &refine::Explanation, model: &Model, residuals: Residuals) -> Explanation {
    let refine::Explanation { largest, times, share, evidence, is_adopted, rivals } = found;
    let deviation = |found| deviation(found, model, residuals);
    Explanation {
        deviation: deviation(largest),
        times: *times * largest.imperfection.prior_over_accuracy(),
        share: *share,
        evidence: *evidence,
        adopted: *is_adopted,
        rivals: rivals.iter().filter(|own| is_listed(own.imperfection)).map(deviation).collect(),
    }
}

fn deviation(found: &FoundImperfection, model: &Model, residuals: Residuals) -> Deviation {
    let FoundImperfection { imperfection, prior, value, deviation } = *found;
    let prior = prior / imperfection.prior_over_accuracy();
    let name = of_imperfection(model, imperfection);
    let filter = |kind| clipped(name.replace("1/omega^2", kind));
    let (name, value, slope, accuracy, unit) = match imperfection.entry().form {
        // f = 1/(2π √v), and df/dv = −f/(2v).
        Form::Resonance if value > 0.0 => {
            (filter("resonance"), hz(value), 0.5 * hz(value) / value, hz(prior), "Hz")
        }
        // Below zero there is no such frequency. v = −1/(2ω²) is a low-pass of first order with the corner ω.
        Form::Resonance if value < 0.0 => {
            let corner = hz(-2.0 * value);
            (filter("low-pass"), corner, 0.5 * corner / -value, hz(prior), "Hz")
        }
        Form::Corner => (name, value / TAU, 1.0 / TAU, prior / TAU, "Hz"),
        Form::PerKilo => (name, 1e3 * value, 1e3, 1e3 * prior, "1/kNm"),
        _ if imperfection.facts().is_factor => (name, value.exp_m1(), value.exp(), prior, ""),
        _ => (name, value, 1.0, prior, unit(imperfection, model)),
    };
    Deviation {
        entry: entry(imperfection),
        name,
        unit: clipped(unit),
        value,
        std: residuals.inflate(deviation).map(|std| std * slope).filter(|std| std.is_finite()),
        accuracy,
    }
}

/// The frequency of which this is 1/ω².
fn hz(squared_period: f64) -> f64 {
    1.0 / (TAU * squared_period.sqrt())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use flexid_core::imperfection::{Imperfection, Sensor};

    use super::*;
    use crate::config::Config;

    /// Each value and its accuracy are in the unit of the entry, and the standard deviation is that of the value by differences.
    #[test]
    fn deviations_are_in_the_units_of_accuracy() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
        let model = Config::load(&file).unwrap().model;
        let period = |hz: f64| (TAU * hz).powi(-2);
        for (imperfection, value, prior, key, unit, expected, accuracy) in [
            (Imperfection::Delay, 1e-4, 2e-5, "delay_s", "s", 1e-4, 2e-5),
            (Imperfection::Gain(Sensor::Force, 2), 1.1_f64.ln(), 5e-3, "force_gain", "", 0.1, 5e-3),
            (
                Imperfection::Resonance(Sensor::Force),
                period(1600.0),
                period(3000.0),
                "force_resonance_hz",
                "Hz",
                1600.0,
                3000.0,
            ),
            (
                Imperfection::HighPass(Sensor::Accelerometer),
                TAU * 0.16,
                TAU * 0.1,
                "accelerometer_high_pass_hz",
                "Hz",
                0.16,
                0.1,
            ),
            (Imperfection::Load, 2e-5, 1e-5, "drive_growth_per_knm", "1/kNm", 0.02, 0.01),
            // Its prior is wider than its accuracy.
            (Imperfection::Ground(0), 1e-9, 1.3 * 5e-10, "ground_m_per_n", "m/N", 1e-9, 5e-10),
        ] {
            let made = |value: f64, deviation: f64| {
                let found = FoundImperfection { imperfection, prior, value, deviation };
                deviation_of(&found, &model)
            };
            let deviation = 1e-4 * value;
            let found = made(value, deviation);
            assert_eq!((found.entry.key(), found.unit.as_str()), (key, unit));
            assert!((found.value / expected - 1.0).abs() < 1e-9, "{found:?}");
            assert!((found.accuracy / accuracy - 1.0).abs() < 1e-9, "{found:?}");
            let moved = (made(value + deviation, deviation).value - found.value).abs();
            assert!((found.std.unwrap() / moved - 1.0).abs() < 1e-3, "{found:?}");
        }
        let imperfection = Imperfection::Resonance(Sensor::Force);
        let negative =
            FoundImperfection { imperfection, prior: 1e-9, value: -1e-9, deviation: f64::INFINITY };
        let found = deviation_of(&negative, &model);
        assert_eq!((found.name.as_str(), found.unit.as_str()), ("force sensor low-pass", "Hz"));
        // ω = 1/√(2e-9)
        assert!((found.value * TAU / 22_360.68 - 1.0).abs() < 1e-6 && found.std.is_none());
    }

    #[test]
    fn an_explanation_of_nothing_or_far_from_where_the_fit_has_ended_is_left_out() {
        let delay = |value| FoundImperfection {
            imperfection: Imperfection::Delay,
            prior: 2e-5,
            value,
            deviation: 1e-6,
        };
        for (fitted, value, share, is_adopted, count) in [
            (1e-5, 1.9e-4, 0.9, false, 1),
            (1e-5, 1.9e-4, 0.006, false, 1),
            (1e-5, 1.9e-4, 0.004, false, 0),
            (1e-5, 1.9e-4, 0.004, true, 1),
            (1e-5, 2.1e-4, 0.9, false, 0),
            (1e-5, 2.1e-4, 0.9, true, 1),
            (1e-4, 9e-4, 0.9, false, 1),
            (1e-4, -1.1e-3, 0.9, false, 0),
        ] {
            let found = refine::Explanation {
                largest: delay(value),
                times: 5.0,
                share,
                evidence: 20.0,
                is_adopted,
                rivals: Default::default(),
            };
            let held = held(std::slice::from_ref(&found), &[delay(fitted)]).count();
            assert_eq!(held, count, "{fitted} {value} {share}");
        }
    }

    fn deviation_of(found: &FoundImperfection, model: &Model) -> Deviation {
        deviation(found, model, Residuals::noise(1.0))
    }
}
