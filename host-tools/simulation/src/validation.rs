//! How well a fitted model predicts displacements, and how far its parameters are from the truth.

use flexid_core::chain::Chain;
use flexid_core::imperfection::Imperfection;
use flexid_core::parameters::{Bounds, Bushing};
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::model::Model;
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use realfft::RealFftPlanner;

use crate::experiment::Cut;
use crate::linear;
use crate::scenario::Scenario;
use crate::truth::Shared;

/// Number of poses and cuts on which a fit is tested.
const UNSEEN: usize = 10;
/// Seed of the poses and cuts, the same in every run.
const UNSEEN_SEED: u64 = 1000;

/// Displacement errors over directions and experiments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorSummary {
    /// Median over directions and experiments.
    pub median: f64,
    /// Largest error of a direction.
    pub max: f64,
}

/// RMS(x − x̂) / RMS(x) of each direction in `band_hz` over the record.
pub fn displacement_error(
    reference: &[Vector3<f64>],
    model: &[Vector3<f64>],
    rate_hz: f64,
    band_hz: [f64; 2],
) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let difference = reference.iter().zip(model).map(|(x, y)| x[axis] - y[axis]).collect();
        let error = band_power(difference, rate_hz, band_hz);
        (error / band_power(reference.iter().map(|x| x[axis]).collect(), rate_hz, band_hz)).sqrt()
    })
}

/// Power of the record's discrete Fourier transform in the band.
fn band_power(mut series: Vec<f64>, rate_hz: f64, [lower, upper]: [f64; 2]) -> f64 {
    let resolution = rate_hz / series.len() as f64;
    let transform = RealFftPlanner::new().plan_fft_forward(series.len());
    let mut spectrum = transform.make_output_vec();
    if transform.process(&mut series, &mut spectrum).is_err() {
        return f64::NAN;
    }
    let hertz = |bin: usize| bin as f64 * resolution;
    let in_band = |&(bin, _): &(usize, _)| (lower..=upper).contains(&hertz(bin));
    spectrum.iter().enumerate().filter(in_band).map(|(_, value)| value.norm_sqr()).sum()
}

/// Quality of the estimate, as text: its parameter deviation, and its displacement error on unseen poses if there is
/// a scenario, the truth is known of each joint, and no mass is sought. For masses other than the model's the truth is not known.
///
/// # Errors
/// A config that was loaded gives no error.
pub fn compare(
    config: &Config,
    scenario: Option<&Scenario>,
    truth: &Shared,
    estimate: &[Bushing],
) -> Result<String, BadInput> {
    let deviation = deviation(&truth.bushings, estimate, &config.bounds);
    let mut lines = format!(
        "parameter deviation {deviation:.5} (mean distance from the truth, over the width of the bounds)\n"
    );
    if !truth.left_out.is_empty() {
        lines += &format!("not compared: {}\n", truth.left_out.join("; "));
    }
    let masses =
        config.sought.imperfections().iter().any(|(own, _)| matches!(own, Imperfection::Mass(_)));
    let whole = truth.whole();
    if let Some((scenario, truth)) = scenario.filter(|_| !masses).zip(whole.as_deref()) {
        let chain = config.model.chain().map_err(|error| BadInput::new(&config.file, error))?;
        let pair = [truth, estimate];
        let error = on_unseen_poses(scenario, &config.model, &chain, pair, UNSEEN, UNSEEN_SEED);
        lines += &format!(
            "displacement error on {UNSEEN} unseen poses: median {:.3} %, maximum {:.3} %\n \
             (both robots with the masses of the model, not with those that the fit may have found; stiffnesses that are all off by \
             0.1 % make about 1 %: resonances move)\n",
            100.0 * error.median,
            100.0 * error.max
        );
    }
    Ok(lines)
}

/// Displacement errors of `estimate` at `count` poses and cuts that no identification has seen, drawn
/// with `seed` within the joints' limits. Both robots are linearised.
pub fn on_unseen_poses(
    scenario: &Scenario,
    model: &Model,
    chain: &Chain,
    [truth, estimate]: [&[Bushing]; 2],
    count: usize,
    seed: u64,
) -> ErrorSummary {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let sampling = &scenario.measurement;
    let errors = (0..count).flat_map(|_| {
        let experiment = scenario.draw_experiment(model, &mut rng);
        let cut = Cut::new(&experiment, &scenario.cutting, sampling, &mut rng);
        let [reference, fitted] =
            [truth, estimate].map(|robot| linear::displacement(chain, robot, &cut));
        displacement_error(&reference, &fitted, sampling.rate_hz, sampling.band_hz)
    });
    summarise(errors.collect())
}

fn summarise(mut errors: Vec<f64>) -> ErrorSummary {
    errors.sort_by(f64::total_cmp);
    let len = errors.len();
    match errors.last() {
        Some(&max) => ErrorSummary { median: 0.5 * (errors[(len - 1) / 2] + errors[len / 2]), max },
        None => ErrorSummary { median: f64::NAN, max: f64::NAN },
    }
}

/// Mean over all parameters of |P − P̂| / bound range (the paper's E, section 5.1).
pub fn parameter_deviation(truth: &[Bushing], estimate: &[Bushing], bounds: &Bounds) -> f64 {
    let truth: Vec<_> = truth.iter().copied().map(Some).collect();
    deviation(&truth, estimate, bounds)
}

/// The parameter deviation over the joints whose truth is known.
fn deviation(truth: &[Option<Bushing>], estimate: &[Bushing], bounds: &Bounds) -> f64 {
    let share = |a: &[f64; 6], b: &[f64; 6], ranges: &[[f64; 2]; 6]| -> f64 {
        (0..6).map(|dof| (a[dof] - b[dof]).abs() / (ranges[dof][1] - ranges[dof][0])).sum()
    };
    let own = truth.iter().zip(estimate).zip(&bounds.joints);
    let known = own.filter_map(|((a, b), own)| Some((a.as_ref()?, b, own)));
    let sum: f64 = known
        .map(|(a, b, own)| {
            share(&a.stiffness, &b.stiffness, &own.stiffness)
                + share(&a.damping, &b.damping, &own.damping)
        })
        .sum();
    sum / (12 * truth.iter().flatten().count()) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::{mill3, model};

    #[test]
    fn only_the_band_counts() {
        let wave =
            |hertz: f64, at: usize| (2.0 * std::f64::consts::PI * hertz * at as f64 / 2000.0).sin();
        let series = |in_band: f64, outside: f64| -> Vec<Vector3<f64>> {
            (0..2000)
                .map(|at| Vector3::repeat(in_band * wave(50.0, at) + outside * wave(400.0, at)))
                .collect()
        };
        let errors = displacement_error(&series(1.0, 0.0), &series(0.9, 5.0), 2000.0, [2.0, 200.0]);
        assert!(errors.iter().all(|error| (error - 0.1).abs() < 1e-9), "{errors:?}");
    }

    /// Stiffnesses that are all 0.1 % too high give an error of about 0.9 %, as a careful study of this robot found.
    #[test]
    fn stiffer_by_a_thousandth_is_wrong_by_a_hundredth() {
        let (scenario, chain) = mill3();
        let mut estimate = scenario.truth.clone();
        for bushing in &mut estimate {
            bushing.stiffness = bushing.stiffness.map(|stiffness| 1.001 * stiffness);
        }
        let pair = [scenario.truth.as_slice(), &estimate];
        let error = on_unseen_poses(&scenario, &model(), &chain, pair, 3, 1);
        assert!((0.003..0.02).contains(&error.median), "{error:?}");
        assert!(error.max >= error.median && error.max < 0.1, "{error:?}");
        let same = [scenario.truth.as_slice(), &scenario.truth];
        assert_eq!(on_unseen_poses(&scenario, &model(), &chain, same, 1, 1).max, 0.0);
    }

    #[test]
    fn the_deviation_is_the_mean_over_the_bound_range() {
        let (scenario, _) = mill3();
        let mut estimate = scenario.truth.clone();
        estimate[2].damping[5] += 0.36 * (5.0e4 - 1.0e2);
        let deviation = parameter_deviation(&scenario.truth, &estimate, &scenario.bounds);
        assert!((deviation - 0.01).abs() < 1e-12, "{deviation}");
    }
}
