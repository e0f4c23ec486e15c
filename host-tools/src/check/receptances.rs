//! Judges modal tests: what they hold and what they lack, their signs, and whether they contradict each other.
//!
//! A force moves what it acts on along with it: at the accelerometer's place and along its axis, the real part of the mobility A/s is positive
//! at each frequency, since the robot takes power and gives none. There, too, the response along y to a force along x is that along x to a
//! force along y (Maxwell and Betti).

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use flexid_core::spectrum::MeasuredBin;
use flexid_pipeline::config::Config;
use flexid_pipeline::receptance::Receptance;
use flexid_pipeline::same_pose;
use flexid_pipeline::text::count;
use nalgebra::{Complex, Rotation3, Vector3};

use super::Finding;
use super::Severity::{Doubtful, Note, Wrong};
use super::words::{enumerate, hz};

/// The subject of the findings of this file.
pub(super) const ABOUT: &str = "modal tests";
const AXES: [&str; 3] = ["x", "y", "z"];
/// Fewest poses, as of records.
const POSES: usize = 3;
/// Largest distance of force and accelerometer that are at one place, m. Chosen: the size of a sensor.
const NEAR_M: f64 = 0.01;
/// Angle between axes that are the same, rad. Chosen: a careful mounting reaches a tenth of it.
const ALONG: f64 = 0.1;
/// Part of the power that a robot gives off beyond which a sign is wrong. Chosen: that of swapped axes in a cut.
const GIVEN: f64 = 0.03;
/// Relative difference of two reciprocal responses beyond which one is wrong. Chosen: an axis that is 6° off changes the smaller response by as much as
/// that.
const UNLIKE: f64 = 0.5;

/// How many receptances there are, and in how many poses.
pub(super) fn counted(config: &Config) -> String {
    let all = &config.receptances;
    let poses = (0..all.len())
        .filter(|index| !all[..*index].iter().any(|own| same_pose(&own.pose, &all[*index].pose)));
    let poses = poses.count();
    format!("{} in {}", count(all.len() as u64, "force direction"), count(poses as u64, "pose"))
}

/// Judges the receptances of a configuration.
pub(super) fn judge(config: &Config) -> Vec<Finding> {
    let all = &config.receptances;
    if all.is_empty() {
        return Vec::new();
    }
    let mut findings = vec![of_number(config)];
    for (index, own) in all.iter().enumerate() {
        findings.extend(of_power(config, own));
        findings.extend(of_band(config, own));
        let others = &all[index + 1..];
        findings.extend(others.iter().filter_map(|other| of_reciprocity(config, own, other)));
    }
    findings.extend(of_missing(all));
    findings
}

/// Number of poses.
fn of_number(config: &Config) -> Finding {
    let all = &config.receptances;
    let mut poses: Vec<&[f64]> = Vec::new();
    for own in all {
        if !poses.iter().any(|pose| same_pose(pose, &own.pose)) {
            poses.push(&own.pose);
        }
    }
    let errors = all.iter().flat_map(|own| own.axes.iter().flatten().filter_map(relative));
    let mut errors: Vec<f64> = errors.collect();
    errors.sort_unstable_by(f64::total_cmp);
    let middle = errors.get(errors.len() / 2).copied().unwrap_or(f64::INFINITY);
    let finding = format!("{}, known to {:.1} % (median)", counted(config), 100.0 * middle);
    if poses.len() < POSES && config.model.driven().count() > 1 {
        let mend = "test in three poses or more, as different as possible";
        return Finding::new(Doubtful, ABOUT, finding, mend);
    }
    Finding::right(ABOUT, finding)
}

/// Standard deviation of the magnitude of a bin, relative. `None` where nothing is known.
fn relative(bin: &MeasuredBin) -> Option<f64> {
    let [re, im] = bin.accelerance;
    let relative = (0.5 * bin.variance).sqrt() / re.hypot(im);
    relative.is_finite().then_some(relative)
}

/// The axis of the accelerometer along a force that acts at its place, and whether they point the same way.
fn at_accelerometer(config: &Config, own: &Receptance) -> Option<(usize, f64)> {
    let mounting = &config.mounting;
    let axes: &Rotation3<f64> = &mounting.accelerometer_axes;
    let is_near = (Vector3::from(own.point) - mounting.accelerometer).norm() < NEAR_M;
    let along = |axis: usize| axes.matrix()[(own.force_axis, axis)];
    let axis = (0..3).find(|axis| along(*axis).abs() > ALONG.cos())?;
    is_near.then(|| (axis, along(axis).signum()))
}

/// A force that moves what it acts on against itself.
fn of_power(config: &Config, own: &Receptance) -> Option<Finding> {
    let (axis, sign) = at_accelerometer(config, own)?;
    let [mut taken, mut given] = [0.0, 0.0];
    for (index, bin) in own.axes[axis].iter().enumerate() {
        let Some(error) = relative(bin) else { continue };
        let s = Complex::new(own.decay, TAU * (own.first_hz + index as f64 * own.spacing_hz));
        let [re, im] = bin.accelerance;
        let mobility = sign * Complex::new(re, im) / s;
        // Power that is not clear of the noise says nothing.
        let noise = 3.0 * error * mobility.norm();
        taken += (mobility.re - noise).max(0.0);
        given += (-mobility.re - noise).max(0.0);
    }
    (given > GIVEN * (taken + given)).then(|| {
        let force = AXES[own.force_axis];
        Finding::new(
            Wrong,
            ABOUT,
            format!(
                "{}: the robot gives off power where a force along {force} acts: {:.0} % of the power at the accelerometer",
                own.file.display(),
                100.0 * given / (taken + given)
            ),
            "turn the sign of the response or of the force, or correct [receptance] axes, unit (displacement or acceleration) or decay_per_s",
        )
    })
}

/// Two responses that should be the same.
fn of_reciprocity(config: &Config, one: &Receptance, other: &Receptance) -> Option<Finding> {
    let [(first, of_first), (second, of_second)] =
        [at_accelerometer(config, one)?, at_accelerometer(config, other)?];
    let is_same_grid = one.first_hz == other.first_hz && one.spacing_hz == other.spacing_hz;
    if first == second || !same_pose(&one.pose, &other.pose) || !is_same_grid {
        return None;
    }
    let (mut apart, mut size) = (0.0, 0.0);
    for (a, b) in one.axes[second].iter().zip(&other.axes[first]) {
        if let (Some(error_a), Some(error_b)) = (relative(a), relative(b)) {
            let of = |bin: &MeasuredBin| Complex::new(bin.accelerance[0], bin.accelerance[1]);
            let (a, b) = (of_second * of(a), of_first * of(b));
            // In logarithms, so that resonances do not outweigh the rest.
            let weight = 1.0 / (a.norm_sqr() + b.norm_sqr()).max(f64::MIN_POSITIVE);
            let noise = (error_a * a.norm()).powi(2) + (error_b * b.norm()).powi(2);
            apart += weight * ((a - b).norm_sqr() - 2.0 * noise).max(0.0);
            size += 1.0;
        }
    }
    (size > 0.0 && apart > UNLIKE * UNLIKE * size).then(|| {
        let [x, y] = [AXES[one.force_axis], AXES[other.force_axis]];
        Finding::new(
            Doubtful,
            ABOUT,
            format!(
                "{}: the response along {y} to a force along {x} and that along {x} to a force along {y} differ, and should be the same",
                one.file.display()
            ),
            "look whether response and reference are exchanged, or a sign or direction is wrong",
        )
    })
}

/// A part of the band without responses.
fn of_band(config: &Config, own: &Receptance) -> Option<Finding> {
    let [lower, upper] = config.band_hz;
    let [lowest, highest] = own.range_hz();
    (lowest > lower + own.spacing_hz || highest < upper - own.spacing_hz).then(|| {
        let finding = format!(
            "{}: responses to a force along {} from {} to {} Hz, of a band from {} to {} Hz",
            own.file.display(),
            AXES[own.force_axis],
            hz(lowest),
            hz(highest),
            hz(lower),
            hz(upper)
        );
        Finding::new(Note, ABOUT, finding, "the rest of [measurement] band_hz is not fitted")
    })
}

/// Directions that were not measured.
fn of_missing(all: &[Receptance]) -> Vec<Finding> {
    let mut files: BTreeMap<&std::path::Path, [[bool; 3]; 3]> = BTreeMap::new();
    for own in all {
        let entries = files.entry(&own.file).or_default();
        for (axis, bins) in own.axes.iter().enumerate() {
            entries[axis][own.force_axis] |= !bins.is_empty();
        }
    }
    let missing = files.into_iter().filter_map(|(file, entries)| {
        let names = (0..9).filter(|entry| !entries[entry / 3][entry % 3]);
        let names: Vec<String> =
            names.map(|entry| format!("H{}{}", AXES[entry / 3], AXES[entry % 3])).collect();
        (!names.is_empty()).then(|| {
            let finding = format!("{}: not measured are {}", file.display(), enumerate(names));
            Finding::new(
                Note,
                ABOUT,
                finding,
                "right if no such response was wanted (response, force)",
            )
        })
    });
    missing.collect()
}
