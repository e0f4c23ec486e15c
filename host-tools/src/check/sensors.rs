//! Judges the axes of the sensors: swapped, reversed, stuck, clipped; spikes and repeated samples.

use flexid_pipeline::check::Survey;
use flexid_pipeline::text::count;
use flexid_wire::axes::{SignedAxis, WrongAxes};
use flexid_wire::implausible::{Implausible, Signals, WrongSamples};
use flexid_wire::warning::Warning;
use flexid_wire::words::Percent;

use super::Severity::{Doubtful, Note, Wrong};
use super::words::{enumerate, frames};
use super::{Finding, Severity, unless_all_is_lost};

pub(super) const ABOUT: &str = "sensors";
/// Share of the samples in which an axis does not move, from which on it counts as stuck throughout: half of them. An axis that is stuck
/// for a shorter time leaves records without that fault.
const THROUGHOUT: f64 = 0.5;

/// Judges the sensors of a survey.
pub(super) fn judge(survey: &Survey) -> Vec<Finding> {
    let mut findings: Vec<Finding> = of_axes(survey).into_iter().collect();
    let implausible = survey.implausible.iter();
    findings.extend(implausible.filter_map(|readings| of_readings(readings, survey)));
    if let Some(signals) = &survey.at_limit {
        let finding = format!("at the limit of the signal: {}", frames(signals));
        let mend = "widen the range of the sensor or of its signal";
        findings.push(Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend));
    }
    let spiked = survey.counts.stream.spiked;
    if spiked > 0 {
        let finding = format!("{} refused because of spikes", count(spiked, "record"));
        let mend = "check wiring, shield and supply";
        findings.push(Finding::new(unless_all_is_lost(survey), ABOUT, finding, mend));
    }
    if findings.iter().all(|finding| finding.severity == Severity::Right)
        && survey.usable().next().is_some()
    {
        let finding = "no axis is stuck, clipped or repeated, and no sample is a spike";
        findings.push(Finding::right(ABOUT, finding));
    }
    findings
}

/// Judges whether the robot takes up energy from the cut.
fn of_axes(survey: &Survey) -> Option<Finding> {
    let mend = "correct order or signs in [signals] or [bus] dbc, or turn the axes in [mounting]";
    match &survey.axes {
        Some(Warning::WrongAxes(axes)) => Some(Finding::new(Wrong, ABOUT, wrong_axes(axes), mend)),
        Some(other) => Some(Finding::new(Wrong, ABOUT, other.to_string(), mend)),
        // Only records that start at rest show it.
        None => survey.usable().any(|record| record.starts_at_rest).then(|| {
            Finding::right(
                ABOUT,
                "order and signs of the axes go together: the robot takes up energy",
            )
        }),
    }
}

fn wrong_axes(WrongAxes { share, force, acceleration }: &WrongAxes) -> String {
    let named = [("force", force), ("acceleration", acceleration)];
    let named = named.into_iter().filter_map(|(sensor, axes)| {
        let axes = axes.as_ref()?.map(|axis: SignedAxis| axis.to_string()).join(", ");
        Some(format!("the x, y, z of the {sensor} are its signals {axes}"))
    });
    let named: Vec<String> = named.collect();
    let otherwise = if named.is_empty() {
        "axes of force or acceleration are swapped or reversed".to_owned()
    } else {
        format!("it does not if {}", named.join(", or "))
    };
    format!("the robot gives off energy ({} of the power): {otherwise}", Percent(*share))
}

fn of_readings(readings: &Implausible, survey: &Survey) -> Option<Finding> {
    let (severity, finding, mend) = match readings {
        Implausible::Stuck(signals) => (
            stuck(signals, survey),
            format!("stuck while others move: {}", frames(signals)),
            "check the sensor and its wiring",
        ),
        // Records that are clipped have been refused, and the others are usable.
        Implausible::Flat(signals) => (
            unless_all_is_lost(survey),
            format!("never above a value that is reached often: {}", frames(signals)),
            "widen the range of the sensor",
        ),
        Implausible::Clipped(samples) => (
            of_samples(samples, survey),
            format!("clipped: {}", wrong_samples(samples)),
            "take a larger range, or cut less",
        ),
        Implausible::Held(samples) => (
            of_samples(samples, survey),
            format!("repeated while others move: {}", wrong_samples(samples)),
            "set the rate of the sensor to that of the bus, and check its cable",
        ),
        Implausible::Spikes(signals) => (
            Doubtful,
            format!("spikes of single samples: {}", frames(signals)),
            "check wiring, shield and supply",
        ),
        // The units have findings of their own.
        Implausible::BeyondLimits(_)
        | Implausible::GravityDenied { .. }
        | Implausible::GravityInUnit { .. } => return None,
    };
    Some(Finding::new(severity, ABOUT, finding, mend))
}

/// Severity of axes that are stuck.
fn stuck(signals: &Signals, survey: &Survey) -> Severity {
    // Each sensor has half of the frames.
    let samples = 0.5 * survey.counts.stream.frames as f64;
    let longest = signals.iter().map(|signal| signal.frames).max().unwrap_or_default();
    if longest as f64 >= THROUGHOUT * samples { Wrong } else { unless_all_is_lost(survey) }
}

/// Severity of wrong samples: those of records that were not refused are bridged.
fn of_samples(samples: &WrongSamples, survey: &Survey) -> Severity {
    if samples.refused > 0 { unless_all_is_lost(survey) } else { Note }
}

fn wrong_samples(samples: &WrongSamples) -> String {
    let signals = enumerate(
        samples
            .signals
            .iter()
            .map(|signal| format!("{} in {}", signal.signal, count(signal.frames, "sample"))),
    );
    match samples.refused {
        0 => format!("{signals} (bridged)"),
        refused => format!("{signals} ({} refused)", count(refused, "record")),
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::implausible::SignalFrames;
    use flexid_wire::text::clipped;

    use super::*;
    use crate::check::Severity::Right;
    use crate::check::fixture::{empty, good};

    fn signals(frames: u64) -> Signals {
        [SignalFrames { signal: clipped("Fz"), frames }].into_iter().collect()
    }

    fn gravest(survey: &Survey) -> Finding {
        judge(survey).into_iter().min_by_key(|finding| finding.severity).unwrap()
    }

    #[test]
    fn an_axis_that_is_stuck_in_all_frames_prevents_identification() {
        let mut survey = good();
        assert_eq!(gravest(&survey).severity, Right);
        for (frames, severity) in [(2048, Doubtful), (20_480, Wrong)] {
            survey.implausible = vec![Implausible::Stuck(signals(frames))];
            assert_eq!(gravest(&survey).severity, severity, "{frames}");
        }
        assert_eq!(gravest(&survey).finding, "stuck while others move: Fz in 20480 frames");
    }

    #[test]
    fn wrong_samples_are_wrong_if_no_record_is_left() {
        let samples = |refused| WrongSamples { signals: signals(9), refused };
        let severity = |mut survey: Survey, refused| {
            survey.implausible = vec![Implausible::Clipped(samples(refused))];
            gravest(&survey).severity
        };
        assert_eq!(severity(good(), 0), Note);
        assert_eq!(severity(good(), 1), Doubtful);
        assert_eq!(severity(empty(), 1), Wrong);
        assert_eq!(wrong_samples(&samples(1)), "Fz in 9 samples (1 record refused)");
    }

    #[test]
    fn swapped_axes_are_named() {
        let axis = |axis, negative| SignedAxis { axis, negative };
        let force = Some([axis(0, false), axis(2, true), axis(1, false)]);
        let mut survey = good();
        let axes = WrongAxes { share: 0.09, force, acceleration: None };
        survey.axes = Some(Warning::WrongAxes(axes));
        assert_eq!(gravest(&survey).severity, Wrong);
        assert_eq!(
            gravest(&survey).finding,
            "the robot gives off energy (9.0 % of the power): it does not if the x, y, z of the force are its signals x, -z, y"
        );
    }
}
