//! What explains the misfit, in the units of `[accuracy]`.

use std::f64::consts::TAU;

use flexid_core::identify::PlantEstimate;
use flexid_core::imperfection::{Imperfection, Sensor};
use flexid_core::refine::{self, FoundImperfection};
use flexid_wire::accuracy::Accuracy;
use flexid_wire::explanation::{Deviation, Explanation};
use flexid_wire::text::clipped;
use flexid_wire::warning::Warning;

use super::imperfections::{is_factor, name, sensor, unit};
use super::residuals::Residuals;
use crate::model::Model;

/// The warning about the first accuracy that the data contradict very strongly, if there is one.
pub(crate) fn contradicted(of_plant: Option<&PlantEstimate>, model: &Model) -> Option<Warning> {
    // Else its imperfections may be those of a wrong minimum.
    let is_believed =
        |of_plant: &&PlantEstimate| Residuals::of(&of_plant.estimate).allow_intervals();
    let of_plant = of_plant.filter(is_believed);
    let found = of_plant.into_iter().flat_map(|of_plant| &of_plant.explanations);
    let mut all = found.zip(explanations(of_plant, model));
    let (_, strong) = all.find(|(found, _)| found.is_contradicted_very_strongly())?;
    let Explanation { deviation, times, rivals, .. } = strong;
    Some(Warning::Contradicted { deviation, times, rivals: rivals.len() as u8 })
}

/// What explains the misfit.
pub(super) fn explanations(
    of_plant: Option<&PlantEstimate>,
    model: &Model,
) -> impl Iterator<Item = Explanation> {
    of_plant.into_iter().flat_map(move |of_plant| {
        reported(&of_plant.explanations, model, Residuals::of(&of_plant.estimate))
    })
}

/// The explanations of a fit with these residuals, if it is near enough to the records for its linearisation to say so. Where it is
/// not settled, they may be those of a wrong minimum.
fn reported(
    found: &[refine::Explanation],
    model: &Model,
    residuals: Residuals,
) -> impl Iterator<Item = Explanation> {
    let near = Some(found).filter(|_| residuals.are_sane());
    near.into_iter().flatten().map(move |one| explanation(one, model, residuals))
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
        rivals: rivals.iter().map(deviation).collect(),
    }
}

fn deviation(found: &FoundImperfection, model: &Model, residuals: Residuals) -> Deviation {
    let FoundImperfection { imperfection, prior, value, deviation } = *found;
    let prior = prior / imperfection.prior_over_accuracy();
    let name = name(imperfection, model);
    let (name, value, slope, accuracy, unit) = match imperfection {
        // f = 1/(2π √v), and df/dv = −f/(2v).
        Imperfection::Resonance(of) if value > 0.0 => {
            let name = clipped(format_args!("{} resonance", sensor(of)));
            (name, hz(value), 0.5 * hz(value) / value, hz(prior), "Hz")
        }
        // Below zero there is no such frequency. v = −1/(2ω²) is a low-pass of first order with the corner ω.
        Imperfection::Resonance(of) if value < 0.0 => {
            let name = clipped(format_args!("{} low-pass", sensor(of)));
            let corner = hz(-2.0 * value);
            (name, corner, 0.5 * corner / -value, hz(prior), "Hz")
        }
        Imperfection::HighPass(_) => (name, value / TAU, 1.0 / TAU, prior / TAU, "Hz"),
        Imperfection::Load => (name, 1e3 * value, 1e3, 1e3 * prior, "1/kNm"),
        _ if is_factor(imperfection) => (name, value.exp_m1(), value.exp(), prior, ""),
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

/// The entry of `[accuracy]` that speaks of an imperfection.
pub(super) fn entry(imperfection: Imperfection) -> Accuracy {
    use Sensor::{Accelerometer, Force};
    match imperfection {
        Imperfection::Delay => Accuracy::DelayS,
        Imperfection::Gain(Force, _) => Accuracy::ForceGain,
        Imperfection::Gain(Accelerometer, _) => Accuracy::AccelerationGain,
        Imperfection::Crosstalk(Force, ..) => Accuracy::ForceCrosstalk,
        Imperfection::Crosstalk(Accelerometer, ..) => Accuracy::AccelerationCrosstalk,
        Imperfection::Turn(Force, _) => Accuracy::ForceAngleRad,
        Imperfection::Turn(Accelerometer, _) => Accuracy::AccelerometerAngleRad,
        Imperfection::ToolTurn(_) => Accuracy::ToolAngleRad,
        Imperfection::ToolCentrePoint(_) => Accuracy::TcpM,
        Imperfection::AccelerometerPlace(_) => Accuracy::AccelerometerPlaceM,
        Imperfection::Resonance(Force) => Accuracy::ForceResonanceHz,
        Imperfection::Resonance(Accelerometer) => Accuracy::AccelerometerResonanceHz,
        Imperfection::HighPass(Force) => Accuracy::ForceHighPassHz,
        Imperfection::HighPass(Accelerometer) => Accuracy::AccelerometerHighPassHz,
        Imperfection::Mass(_) => Accuracy::LinkMass,
        Imperfection::CentreOfMass(..) => Accuracy::CentreOfMassM,
        Imperfection::JointAngle(_) => Accuracy::JointAngleRad,
        Imperfection::ElasticCentre(..) => Accuracy::ElasticCentreM,
        Imperfection::Inertia(_) => Accuracy::LinkInertia,
        Imperfection::Hysteresis => Accuracy::Hysteresis,
        Imperfection::Servo(_) => Accuracy::DriveGrowth,
        Imperfection::Load => Accuracy::DriveGrowthPerKnm,
        Imperfection::Ground(..3) | Imperfection::GroundDamping(..3) => Accuracy::GroundMPerN,
        Imperfection::Ground(_) | Imperfection::GroundDamping(_) => Accuracy::GroundRadPerNm,
        Imperfection::BaseMass => Accuracy::BaseMass,
        Imperfection::Hose => Accuracy::HoseNPerM,
        Imperfection::HoseDamping => Accuracy::HoseNsPerM,
        Imperfection::RecordDelay(_) => Accuracy::DelayOfRecordS,
        Imperfection::RecordStiffness(_) => Accuracy::StiffnessOfRecord,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

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
    fn a_fit_that_is_not_settled_is_explained_if_it_is_near_the_records() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
        let model = Config::load(&file).unwrap().model;
        let largest = FoundImperfection {
            imperfection: Imperfection::Delay,
            prior: 2e-5,
            value: 1e-4,
            deviation: 1e-6,
        };
        let found = refine::Explanation {
            largest,
            times: 5.0,
            share: 0.9,
            evidence: 20.0,
            is_adopted: false,
            rivals: Default::default(),
        };
        for (consistency, count) in [(1.0, 1), (9.0, 1), (11.0, 0), (f64::NAN, 0)] {
            let residuals = Residuals::unsettled(consistency);
            let reported = reported(std::slice::from_ref(&found), &model, residuals);
            assert_eq!(reported.count(), count, "{consistency}");
        }
    }

    fn deviation_of(found: &FoundImperfection, model: &Model) -> Deviation {
        deviation(found, model, Residuals::noise(1.0))
    }
}
