//! How many intervals of a finding hold the truth.

use std::fmt;

use flexid_pipeline::dynamics::{Robot, TWO_SIDED};
use flexid_pipeline::names::{DAMPING_UNITS, DOF_NAMES, STIFFNESS_UNITS};
use flexid_wire::answer::{Answer, Number};
use flexid_wire::confidence::Interval;
use flexid_wire::finding::Finding;
use flexid_wire::report::{JointReport, Verdict};
use flexid_wire::words::{InUnit, Within};
use serde::Serialize;

use crate::truth::Shared;

/// The intervals of identified parameters and of the answer that hold the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coverage {
    /// Identified stiffnesses.
    pub stiffness: Tally,
    /// Identified dampings.
    pub damping: Tally,
    /// Numbers of the answer: tool, lowest mode and drives.
    pub answer: Tally,
    /// True if the truth of tool and lowest mode is known.
    pub tool_is_known: bool,
}

/// Intervals that are compared with the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Tally {
    /// Number of intervals.
    pub intervals: usize,
    /// Number of those that hold the truth.
    pub hold: usize,
    /// The others.
    pub misses: Vec<Miss>,
}

/// A number whose interval does not hold the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Miss {
    /// Name of the number.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// The estimate.
    pub value: f64,
    /// Its 95 % interval.
    pub interval: Interval,
    /// The truth.
    pub truth: f64,
    /// Distance of the truth from the estimate in standard deviations of its logarithm, above 0 where the truth is larger.
    pub deviations: f64,
}

impl Tally {
    fn add(&mut self, name: impl fmt::Display, unit: &'static str, own: Number, truth: f64) {
        let Number { value, interval: Some(interval) } = own else { return };
        self.intervals += 1;
        let [low, high] = interval;
        if (low..=high).contains(&truth) {
            self.hold += 1;
            return;
        }
        let side = if truth > value { high } else { low };
        let deviations = TWO_SIDED * (truth / value).ln() / (side / value).ln().abs();
        let name = name.to_string();
        self.misses.push(Miss { name, unit, value, interval, truth, deviations });
    }
}

impl Coverage {
    /// The intervals of `finding` beside the truth, as far as it is known.
    pub fn of(finding: &Finding, truth: &Shared) -> Self {
        let (mut stiffness, mut damping) = (Tally::default(), Tally::default());
        let joints = finding.report.joints.iter().zip(&finding.confidence.joints);
        for ((joint, intervals), truth) in joints.zip(&truth.bushings) {
            let Some(truth) = truth else { continue };
            let JointReport { name, stiffness_verdict, damping_verdict, .. } = joint;
            for (dof, of) in DOF_NAMES.iter().enumerate() {
                if stiffness_verdict[dof] == Verdict::Identified {
                    let unit = STIFFNESS_UNITS[dof];
                    let interval = intervals.stiffness_interval[dof];
                    let own = Number { value: joint.stiffness[dof], interval };
                    let name = format_args!("{name} {of} stiffness");
                    stiffness.add(name, unit, own, truth.stiffness[dof]);
                }
                if damping_verdict[dof] == Verdict::Identified {
                    let unit = DAMPING_UNITS[dof];
                    let interval = intervals.damping_interval[dof];
                    let own = Number { value: joint.damping[dof], interval };
                    damping.add(format_args!("{name} {of} damping"), unit, own, truth.damping[dof]);
                }
            }
        }
        let mut answer = Tally::default();
        if let Some(own) = &finding.answer {
            add_drives(&mut answer, own, finding, truth);
            if let Some(robot) = &truth.robot {
                add_tool(&mut answer, own, robot);
            }
        }
        Self { stiffness, damping, answer, tool_is_known: truth.robot.is_some() }
    }
}

/// Adds the drives of an answer.
fn add_drives(tally: &mut Tally, answer: &Answer, finding: &Finding, truth: &Shared) {
    for drive in &answer.drives {
        let joints = finding.report.joints.iter().zip(&truth.bushings);
        let own = joints.filter(|(joint, _)| joint.name == drive.joint).find_map(|(_, own)| *own);
        if let (Some(number), Some(truth)) = (drive.stiffness, own) {
            let dof = usize::from(drive.dof);
            let unit = STIFFNESS_UNITS[dof];
            tally.add(format_args!("drive of {}", drive.joint), unit, number, truth.stiffness[dof]);
        }
    }
}

/// Adds tool and lowest mode of an answer, if the true robot stands at its pose.
fn add_tool(tally: &mut Tally, answer: &Answer, robot: &Robot) {
    let Ok(at) = robot.at(&answer.pose) else { return };
    let Some(compliance) = at.compliance() else { return };
    let [softest, _, stiffest] = at.principal(&compliance);
    for (name, own, truth) in [
        ("tool, softest direction", answer.softest, softest),
        ("tool, stiffest direction", answer.stiffest, stiffest),
    ] {
        if let Some(number) = own.stiffness {
            tally.add(name, "N/m", number, truth.compliance.value.recip());
        }
    }
    let [_, upper] = robot.band_hz();
    let Some(mode) = at.lowest_mode(upper) else { return };
    if let Some(number) = answer.lowest_mode.frequency_hz {
        tally.add("lowest mode", "Hz", number, mode.frequency_hz.value);
    }
    if let Some(number) = answer.lowest_mode.damping_ratio {
        tally.add("damping ratio of the lowest mode", "", number, mode.damping_ratio.value);
    }
}

/// A line for the parameters and one for the answer, and one for each interval that misses.
impl fmt::Display for Coverage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stiffness, damping, answer, tool_is_known } = self;
        let sum = |of: fn(&Tally) -> usize| of(stiffness) + of(damping);
        let (hold, intervals) = (sum(|own| own.hold), sum(|own| own.intervals));
        writeln!(
            f,
            "truth: {hold} of {intervals} intervals hold (of those identified): {stiffness} stiffnesses, {damping} dampings"
        )?;
        let mut misses = stiffness.misses.iter().chain(&damping.misses);
        misses.try_for_each(|miss| writeln!(f, " {miss}"))?;
        let without = if *tool_is_known {
            ""
        } else {
            " (its drives alone: the plant has no tool stiffness and modes that TRUTH states)"
        };
        writeln!(f, "truth: {answer} intervals of the answer hold{without}")?;
        answer.misses.iter().try_for_each(|miss| writeln!(f, " {miss}"))
    }
}

/// For example `36 of 36`.
impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.hold, self.intervals)
    }
}

/// For example `missed: joint_2 rx damping 12.1 kNms/rad (±1.8 %), truth 12.5 kNms/rad: +3.6 standard deviations`.
impl fmt::Display for Miss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, unit, value, interval, truth, deviations } = self;
        let in_unit = |value: f64| match *unit {
            "" => format!("{:.3} %", 100.0 * value),
            unit => InUnit { value, unit }.to_string(),
        };
        let [own, truth] = [*value, *truth].map(in_unit);
        let within = Within { value: *value, interval: *interval };
        write!(
            f,
            "missed: {name} {own} ({within}), truth {truth}: {deviations:+.1} standard deviations"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_holds_the_truth_or_is_listed() {
        let mut tally = Tally::default();
        let number = |interval| Number { value: 100.0, interval };
        tally.add("a", "N/m", number(Some([90.0, 110.0])), 109.0);
        tally.add("b", "N/m", number(None), 500.0);
        tally.add("c", "Nms/rad", number(Some([98.0, 102.0])), 96.0);
        assert_eq!(tally.to_string(), "1 of 2");
        let lines: Vec<_> = tally.misses.iter().map(ToString::to_string).collect();
        assert_eq!(
            lines,
            ["missed: c 100 Nms/rad (±2.0 %), truth 96.0 Nms/rad: -4.0 standard deviations"]
        );
        let coverage = Coverage {
            stiffness: tally.clone(),
            damping: Tally::default(),
            answer: tally,
            tool_is_known: false,
        };
        let text = coverage.to_string();
        assert!(
            text.starts_with("truth: 1 of 2 intervals hold (of those identified): 1 of 2 stiffnesses, 0 of 0 dampings\n missed: c "),
            "{text}"
        );
        assert!(
            text.contains("\ntruth: 1 of 2 intervals of the answer hold (its drives alone"),
            "{text}"
        );
    }
}
