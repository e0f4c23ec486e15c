//! The force of a milling cutter on the robot, on a grid much finer than the sensor's.
//!
//! The force has edges where teeth enter and leave. The edges have frequencies that would fold back when the sensor
//! samples them. A low-pass therefore removes everything above 0.4 of the sample rate *before* the force is applied,
//! so that robot and sensor see the same force.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};
use realfft::RealFftPlanner;

use super::course::Course;
use super::scenario::{Cutting, Experiment, Feed, Sampling};

/// Steps of the fine grid per sample.
pub const OVERSAMPLING: usize = 25;
/// Times at which the tool of a robot that stands enters and leaves, in parts of the record.
const CUT: [f64; 2] = [0.05, 0.80];
/// Edges of the low-pass, in parts of the sample rate. It passes what is below the first and stops what is above the
/// second.
const EDGES: [f64; 2] = [0.25, 0.40];
/// Attenuation above the second edge, dB.
const ATTENUATION_DB: f64 = 90.0;
/// Exponent of two. Lengths of transforms are multiples of this power of two, since they are fast.
const SMOOTH: u32 = 12;

/// Force along the TCP's axes, N. A robot that feeds cuts while its feed is up to speed ([`Course::cut_s`]), by as much as is engaged. There is one
/// value each `1 / (OVERSAMPLING · rate_hz)` seconds from time 0.
pub fn milling(
    cutting: &Cutting,
    experiment: &Experiment,
    sampling: &Sampling,
    rng: &mut impl Rng,
) -> Vec<Vector3<f64>> {
    let steps = sampling.samples() * OVERSAMPLING;
    let rate = sampling.rate_hz * OVERSAMPLING as f64;
    let standing = || CUT.map(|part| part * steps as f64 / rate);
    let [enter, leave] = experiment.course.as_ref().map_or_else(standing, Course::cut_s);
    // The noise is white up to half the sample rate. The factor scales it to the fine grid.
    let roughness = cutting.roughness * (OVERSAMPLING as f64).sqrt();
    let raw: Vec<_> = (0..steps)
        .map(|step| {
            let noise: f64 = StandardNormal.sample(rng);
            let time = step as f64 / rate;
            if !(enter..leave).contains(&time) {
                return Vector3::zeros();
            }
            let angle = spindle_angle(experiment.spindle_rpm, time - enter, leave - enter);
            let (engaged, heading) = match &experiment.course {
                Some(course) => {
                    (experiment.engagement.at(course.distance(time)), course.heading(time))
                }
                None => (1.0, Vector3::x()),
            };
            let axes = axes(experiment.feed, heading);
            engaged * (1.0 + roughness * noise) * (axes * cutter(cutting, angle))
        })
        .collect();
    filter(&raw, &low_pass())
}

/// Force of a hammer's blow along a direction, as [`milling`] has it: half a sine of this peak, N, and width, s, after a rest.
pub fn blow(
    direction: &Vector3<f64>,
    peak_n: f64,
    width_s: f64,
    sampling: &Sampling,
) -> Vec<Vector3<f64>> {
    let steps = sampling.samples() * OVERSAMPLING;
    let rate = sampling.rate_hz * OVERSAMPLING as f64;
    let begin = CUT[0] * steps as f64 / rate;
    let raw: Vec<_> = (0..steps)
        .map(|step| {
            let part = (step as f64 / rate - begin) / width_s;
            let size = if (0.0..1.0).contains(&part) { peak_n * (PI * part).sin() } else { 0.0 };
            size * direction
        })
        .collect();
    filter(&raw, &low_pass())
}

/// Angle of the spindle at each sample of an experiment, rad. Before and after the cut its speed is constant.
pub fn spindle(experiment: &Experiment, sampling: &Sampling) -> Vec<f64> {
    let standing = || CUT.map(|part| part * sampling.duration_s);
    let [enter, leave] = experiment.course.as_ref().map_or_else(standing, Course::cut_s);
    let [first, last] = experiment.spindle_rpm.map(|rpm| 2.0 * PI / 60.0 * rpm);
    let angle = |n: usize| {
        let time = n as f64 / sampling.rate_hz;
        let within = time.clamp(enter, leave) - enter;
        let cut = spindle_angle(experiment.spindle_rpm, within, leave - enter);
        cut + first * (time - enter).min(0.0) + last * (time - leave).max(0.0)
    };
    (0..sampling.samples()).map(angle).collect()
}

/// Value of a force on the fine grid at `time`, in samples: the cubic through the four nearest steps. It misses a
/// sine of 200 Hz by 1e-8 at the 50 kHz of the reference scenario. It is 0 outside the grid.
pub fn between(force: &[Vector3<f64>], time: f64) -> Vector3<f64> {
    let step = time * OVERSAMPLING as f64;
    let (first, x) = (step.floor() as isize - 1, step - step.floor());
    let weights = [
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0,
        (x + 1.0) * x * (x - 1.0) / 6.0,
    ];
    let value = |step: isize| usize::try_from(step).ok().and_then(|step| force.get(step));
    let inside = usize::try_from(first).ok().and_then(|first| force.get(first..first + 4));
    match inside {
        Some(values) => values.iter().zip(weights).map(|(value, weight)| weight * value).sum(),
        None => {
            (first..).zip(weights).filter_map(|(step, weight)| Some(weight * value(step)?)).sum()
        }
    }
}

/// Angle that the spindle has turned after `time` of a cut in which its speed grows evenly, rad.
fn spindle_angle([first, last]: [f64; 2], time: f64, cut: f64) -> f64 {
    2.0 * PI / 60.0 * (first * time + 0.5 * (last - first) * time * time / cut)
}

/// Force of all teeth on the robot when the first has turned by `angle`, N: along the feed, across it, and along the tool.
fn cutter(cutting: &Cutting, angle: f64) -> Vector3<f64> {
    let mut along = Vector3::zeros();
    for tooth in 0..cutting.teeth {
        let angle =
            (angle + 2.0 * PI * f64::from(tooth) / f64::from(cutting.teeth)).rem_euclid(2.0 * PI);
        if angle > cutting.immersion_deg.to_radians() {
            continue;
        }
        let (sin, cos) = angle.sin_cos();
        let tangential = cutting.peak_tangential_n * sin;
        let radial = cutting.radial_ratio * tangential;
        along += Vector3::new(
            -tangential * cos - radial * sin,
            tangential * sin - radial * cos,
            cutting.axial_ratio * tangential,
        );
    }
    along
}

/// Directions of the components of [`cutter`], along the axes of a TCP that is fed towards `heading`.
fn axes(feed: Feed, heading: Vector3<f64>) -> Matrix3<f64> {
    let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
    match feed {
        Feed::X => Matrix3::from_columns(&[x, y, z]),
        Feed::Y => Matrix3::from_columns(&[y, z, x]),
        Feed::Z => Matrix3::from_columns(&[z, x, y]),
        Feed::Path => {
            let along = (heading - heading.z * z).normalize();
            Matrix3::from_columns(&[along, z.cross(&along), z])
        }
    }
}

/// Half of a symmetric low-pass, centre first: a sinc under Kaiser's window.
fn low_pass() -> Vec<f64> {
    let [pass, stop] = EDGES.map(|edge| edge / OVERSAMPLING as f64);
    let half = ((ATTENUATION_DB - 7.95) / (14.36 * (stop - pass)) / 2.0).ceil() as usize;
    let beta = 0.1102 * (ATTENUATION_DB - 8.7);
    let cutoff = 2.0 * PI * 0.5 * (pass + stop);
    let mut taps: Vec<f64> = (0..=half)
        .map(|tap| {
            let at = tap as f64;
            let sinc = if tap == 0 { cutoff } else { (cutoff * at).sin() / at };
            sinc * bessel_i0(beta * (1.0 - (at / half as f64).powi(2)).sqrt())
        })
        .collect();
    let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f64>();
    taps.iter_mut().for_each(|tap| *tap /= sum);
    taps
}

/// Modified Bessel function of the first kind, order 0, by its series.
fn bessel_i0(x: f64) -> f64 {
    let mut term = 1.0;
    (1..60).fold(1.0, |sum, k| {
        term *= (x / 2.0 / f64::from(k)).powi(2);
        sum + term
    })
}

/// Convolution with a symmetric filter, of which `half` is the half from the centre; zero outside. It uses the
/// spectra, since there are many taps.
fn filter(raw: &[Vector3<f64>], half: &[f64]) -> Vec<Vector3<f64>> {
    let mut filtered = vec![Vector3::zeros(); raw.len()];
    let is_loaded = |force: &Vector3<f64>| *force != Vector3::zeros();
    let (Some(first), Some(last)) =
        (raw.iter().position(is_loaded), raw.iter().rposition(is_loaded))
    else {
        return filtered;
    };
    // Beyond the reach of the taps the force is exactly zero.
    let reach = half.len() - 1;
    let start = first.saturating_sub(reach);
    let filtered_part = &mut filtered[start..raw.len().min(last + reach + 1)];
    let loaded = &raw[first..=last];
    let length = (loaded.len() + 2 * reach).next_multiple_of(1 << SMOOTH);
    let mut planner = RealFftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let mut series = forward.make_input_vec();
    let spectrum = |series: &mut [f64]| {
        let mut spectrum = forward.make_output_vec();
        // All buffers have the lengths that the plans need.
        let _ = forward.process(series, &mut spectrum);
        spectrum
    };
    // The filter is centred on 0 and wraps around the end, so that it shifts nothing and its spectrum is real.
    series[..=reach].copy_from_slice(half);
    for (tap, &value) in half.iter().enumerate().skip(1) {
        series[length - tap] = value;
    }
    let passes: Vec<f64> = spectrum(&mut series).iter().map(|bin| bin.re / length as f64).collect();
    for axis in 0..3 {
        series.fill(0.0);
        for (value, force) in series.iter_mut().zip(loaded) {
            *value = force[axis];
        }
        let mut spectrum = spectrum(&mut series);
        for (bin, passes) in spectrum.iter_mut().zip(&passes) {
            *bin *= passes;
        }
        let _ = inverse.process(&mut spectrum, &mut series);
        // Values before the first lie at the end.
        let values = series.iter().cycle().skip(length - (first - start));
        for (force, &value) in filtered_part.iter_mut().zip(values) {
            force[axis] = value;
        }
    }
    filtered
}

#[cfg(test)]
mod along_path;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::mill3;
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn reference() -> (Vec<Vector3<f64>>, Sampling) {
        let (scenario, _) = mill3();
        let sampling = scenario.measurement;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        (milling(&scenario.cutting, &scenario.experiments[0], &sampling, &mut rng), sampling)
    }

    /// `(re, im)` of the Fourier sum at one frequency in parts of the rate of the series.
    fn fourier(series: impl Iterator<Item = f64>, frequency: f64) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (n, value) in series.enumerate() {
            let (sin, cos) = (2.0 * PI * frequency * n as f64).sin_cos();
            sum[0] += value * cos;
            sum[1] -= value * sin;
        }
        sum
    }

    /// The spectrum of the sensor's samples is that of the continuous force, the cubics between the steps of the fine
    /// grid, to 1e-5 in the band.
    #[test]
    fn the_samples_have_the_spectrum_of_what_was_applied() {
        let (force, sampling) = reference();
        // The times lie away from the steps of the grid.
        const DENSE: usize = 2 * OVERSAMPLING;
        let times = (0..sampling.samples() * DENSE).map(|n| (n as f64 + 0.4) / DENSE as f64);
        let dense: Vec<_> = times.map(|time| between(&force, time)).collect();
        let samples: Vec<_> = force.iter().step_by(OVERSAMPLING).collect();
        for axis in 0..3 {
            let (mut error, mut power) = (0.0, 0.0);
            for bin in (8..820).step_by(29) {
                let frequency = bin as f64 / sampling.duration_s / sampling.rate_hz;
                let sampled = fourier(samples.iter().map(|f| f[axis]), frequency);
                let [re, im] = fourier(dense.iter().map(|f| f[axis]), frequency / DENSE as f64)
                    .map(|part| part / DENSE as f64);
                let (sin, cos) = (2.0 * PI * frequency * 0.4 / DENSE as f64).sin_cos();
                let applied = [re * cos + im * sin, im * cos - re * sin];
                error += (0..2).map(|part| (sampled[part] - applied[part]).powi(2)).sum::<f64>();
                power += applied.iter().map(|part| part * part).sum::<f64>();
            }
            let ratio = (error / power).sqrt();
            assert!(ratio < 1e-5, "axis {axis}: {ratio:e}");
            assert!(ratio > 1e-12, "axis {axis}: {ratio:e} is too good to be a comparison");
        }
    }

    /// The filter equals the sum that defines a convolution, for a series loaded to both ends, in the middle, and
    /// nowhere.
    #[test]
    fn the_filter_is_a_convolution() {
        let half = [0.5, 0.2, -0.1, 0.03];
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
        for loaded in [0..50, 20..23, 0..1, 49..50, 0..0, 1..48] {
            let mut raw = vec![Vector3::zeros(); 50];
            for force in &mut raw[loaded] {
                *force = Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
            }
            for (n, found) in filter(&raw, &half).into_iter().enumerate() {
                let tap = |m: usize| half.get(n.abs_diff(m)).copied().unwrap_or(0.0);
                let sum: Vector3<f64> = raw.iter().enumerate().map(|(m, f)| tap(m) * f).sum();
                assert!((found - sum).norm() < 1e-15, "{n}: {found} is not {sum}");
                let is_silent = raw.iter().enumerate().all(|(m, f)| tap(m) * f == Vector3::zeros());
                assert!(!is_silent || found == Vector3::zeros(), "{n}: {found} is not silent");
            }
        }
    }

    #[test]
    fn nothing_is_left_that_would_fold_back() {
        let (force, sampling) = reference();
        let fine_rate = sampling.rate_hz * OVERSAMPLING as f64;
        let size = |hertz: f64| {
            let [re, im] = fourier(force.iter().map(|f| f[1]), hertz / fine_rate);
            re.hypot(im)
        };
        let in_band = (10..60).map(|n| size(3.3 * f64::from(n))).fold(0.0, f64::max);
        let beyond = (0..60).map(|n| size(810.0 + 41.0 * f64::from(n))).fold(0.0, f64::max);
        assert!(beyond < 1e-5 * in_band, "{beyond} beyond 800 Hz, {in_band} in the band");
    }

    #[test]
    fn cuts_from_5_to_80_percent_with_the_force_of_the_cutter() {
        let (force, _) = reference();
        let len = force.len();
        assert!(force[..len * 47 / 1000].iter().all(|f| *f == Vector3::zeros()));
        assert!(force[len * 803 / 1000..].iter().all(|f| *f == Vector3::zeros()));
        // A tooth that leaves at 90 degrees: 400 N across, 160 N against the feed, 120 N along the tool.
        let (scenario, _) = mill3();
        let leaving = |feed| axes(feed, Vector3::x()) * cutter(&scenario.cutting, 0.5 * PI);
        assert!((leaving(Feed::X) - Vector3::new(-160.0, 400.0, 120.0)).norm() < 1e-9);
        assert!((leaving(Feed::Y) - Vector3::new(120.0, -160.0, 400.0)).norm() < 1e-9);
        assert!((leaving(Feed::Z) - Vector3::new(400.0, 120.0, -160.0)).norm() < 1e-9);
        let most = force.iter().map(|f| f.y).fold(0.0, f64::max);
        assert!((380.0..480.0).contains(&most), "{most} N");
    }

    #[test]
    fn the_spindle_gathers_speed_evenly() {
        // From 600 to 4200 rpm in 3 s: 40 revolutions a second on average.
        assert!((spindle_angle([600.0, 4200.0], 3.0, 3.0) / (2.0 * PI) - 120.0).abs() < 1e-9);
        let step = 1e-6;
        let speed = |t| {
            (spindle_angle([600.0, 4200.0], t + step, 3.0) - spindle_angle([600.0, 4200.0], t, 3.0))
                / step
        };
        assert!((speed(0.0) - 2.0 * PI * 10.0).abs() < 1e-3);
        assert!((speed(3.0) - 2.0 * PI * 70.0).abs() < 1e-3);
    }
}
