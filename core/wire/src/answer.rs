//! The robot as a whole at one pose: how soft its tool is, its lowest mode, and the stiffnesses of its drives.
//!
//! An [`Answer`] is the entry `answer` of the result file of `flexid identify --json`. The field names are part of the contract. A
//! number that the records do not determine is left out: none stands in its place.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::confidence::Interval;
use crate::report::MAX_JOINTS;
use crate::text::Name;
use crate::words::{InUnit, ThreeDigits, Within};

/// The robot as a whole at one pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Answer {
    /// Joint angles, rad (m): those of the newest record of the fit, or without records of the last static test.
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Number of that record among all that came, from 1; `None` of a static test.
    pub record: Option<u64>,
    /// Static stiffness of the tool where a force moves it farthest.
    pub softest: ToolStiffness,
    /// Static stiffness of the tool where a force moves it least.
    pub stiffest: ToolStiffness,
    /// Mode of the lowest natural frequency.
    pub lowest_mode: LowestMode,
    /// Stiffness of each driven joint, base first.
    pub drives: Vec<Drive, MAX_JOINTS>,
}

/// A number with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Number {
    /// Most likely value.
    pub value: f64,
    /// 95 % interval; `None` if the fit allows none, or if the number was fixed.
    pub interval: Option<Interval>,
}

/// Force per displacement of the tool along one direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct ToolStiffness {
    /// Stiffness, N/m; `None` if it is not determined.
    pub stiffness: Option<Number>,
    /// Unit vector along the axes of the tool centre point; `None` if it is not determined.
    pub direction: Option<[f64; 3]>,
}

/// The mode of the lowest natural frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct LowestMode {
    /// Natural frequency, Hz; `None` if it is not determined, or if no mode lies in the band of the fit.
    pub frequency_hz: Option<Number>,
    /// Damping ratio, 1 at the border to aperiodic; `None` if it is not determined.
    pub damping_ratio: Option<Number>,
}

/// The stiffness of a joint about the axis of its drive, or along it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Drive {
    /// Name of the joint in the model.
    pub joint: Name,
    /// Degree of freedom of the drive in the joint frame, 0 to 5: `tx ty tz rx ry rz`.
    pub dof: u8,
    /// Nm/rad of a joint that turns, N/m of one that slides; `None` if it is not determined.
    pub stiffness: Option<Number>,
}

impl Answer {
    /// The parts of the answer, each with its name: a line for each of tool, lowest mode and drives.
    pub fn parts(&self) -> [(&'static str, Part<'_>); 3] {
        [
            ("tool", Part::Tool(self)),
            ("lowest mode", Part::Mode(&self.lowest_mode)),
            ("drives", Part::Drives(&self.drives)),
        ]
    }

    /// Pose and axes in which it holds.
    pub fn place(&self) -> Place<'_> {
        Place(self)
    }
}

/// A part of an answer, for people.
#[derive(Clone, Copy, Debug)]
pub enum Part<'a> {
    /// Both stiffnesses of the tool.
    Tool(&'a Answer),
    /// The lowest mode.
    Mode(&'a LowestMode),
    /// The stiffnesses of the drives.
    Drives(&'a [Drive]),
}

/// Pose and axes of an answer, for people.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a>(&'a Answer);

/// In place of a number.
const UNKNOWN: &str = "not determined";
/// In place of an interval.
const NO_INTERVAL: &str = " (no interval)";

/// For example `tool 0.381 (±2.0 %) to 0.870 N/µm (±1.1 %), lowest mode 6.33 Hz (±0.2 %), damping 1.10 % (1.07 to 1.13 %), at the pose of
/// record 3`.
impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.softest.stiffness, self.stiffest.stiffness) {
            (Some(soft), Some(stiff)) => {
                write!(f, "tool {}{}", ThreeDigits(soft.value * N_PER_UM), Of(soft))?;
                write!(f, " to {} N/µm{}", ThreeDigits(stiff.value * N_PER_UM), Of(stiff))?;
            }
            (None, None) => write!(f, "tool stiffness {UNKNOWN}")?,
            _ => write!(f, "tool softest {}, stiffest {}", self.softest, self.stiffest)?,
        }
        write!(f, ", lowest mode {}, {}", self.lowest_mode, At(self))
    }
}

/// N/µm in a N/m.
const N_PER_UM: f64 = 1e-6;

/// For example `0.381 N/µm (±2.0 %)`.
impl fmt::Display for ToolStiffness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.stiffness {
            Some(own) => write!(f, "{} N/µm{}", ThreeDigits(own.value * N_PER_UM), Of(own)),
            None => f.write_str(UNKNOWN),
        }
    }
}

/// For example `6.33 Hz (±0.2 %), damping 1.10 % (1.07 to 1.13 %)`.
impl fmt::Display for LowestMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(frequency) = self.frequency_hz else { return f.write_str(UNKNOWN) };
        write!(f, "{} Hz{}, damping ", ThreeDigits(frequency.value), Of(frequency))?;
        let Some(Number { value, interval }) = self.damping_ratio else {
            return f.write_str(UNKNOWN);
        };
        let percent = |part: f64| ThreeDigits(100.0 * part);
        write!(f, "{} %", percent(value))?;
        match interval {
            Some([low, high]) => write!(f, " ({} to {} %)", percent(low), percent(high)),
            None => f.write_str(NO_INTERVAL),
        }
    }
}

/// For example `joint_1 2.31 MNm/rad (±1.3 %)`.
impl fmt::Display for Drive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ", self.joint)?;
        match self.stiffness {
            Some(own) => {
                let unit = if self.dof < 3 { "N/m" } else { "Nm/rad" };
                write!(f, "{}{}", InUnit { value: own.value, unit }, Of(own))
            }
            None => f.write_str(UNKNOWN),
        }
    }
}

impl fmt::Display for Part<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tool(Answer { softest, stiffest, .. }) => {
                write!(f, "softest {softest}")?;
                along(f, softest)?;
                write!(f, ", stiffest {stiffest}")?;
                along(f, stiffest)?;
                f.write_str("; static")
            }
            Self::Mode(mode) => mode.fmt(f),
            Self::Drives(drives) => {
                for (index, drive) in drives.iter().enumerate() {
                    if index > 0 {
                        f.write_str(", ")?;
                    }
                    drive.fmt(f)?;
                }
                Ok(())
            }
        }
    }
}

/// The direction of a stiffness that is determined.
fn along(f: &mut fmt::Formatter<'_>, own: &ToolStiffness) -> fmt::Result {
    match (own.stiffness, own.direction) {
        (Some(_), Some(direction)) => {
            f.write_str(" along")?;
            // Zero has no sign.
            let shown = |own: f64| if own.abs() < 0.005 { 0.0 } else { own };
            direction.into_iter().try_for_each(|own| write!(f, " {:.2}", shown(own)))
        }
        _ => Ok(()),
    }
}

/// For example `at the pose of record 3: 0.10 -0.50 0.95; directions in the axes of the TCP`.
impl fmt::Display for Place<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let newest = if self.0.record.is_some() { ", the newest" } else { "" };
        write!(f, "{}{newest}:", At(self.0))?;
        self.0.pose.iter().try_for_each(|angle| write!(f, " {angle:.2}"))?;
        f.write_str("; directions in the axes of the TCP")
    }
}

/// The record or test whose pose it is.
struct At<'a>(&'a Answer);

impl fmt::Display for At<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.record {
            Some(record) => write!(f, "at the pose of record {record}"),
            None => f.write_str("at the pose of the last static test"),
        }
    }
}

/// The interval of a number, in brackets.
struct Of(Number);

impl fmt::Display for Of {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Number { value, interval } = self.0;
        match interval {
            Some(interval) => write!(f, " ({})", Within { value, interval }),
            None => f.write_str(NO_INTERVAL),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;
    use std::vec::Vec;

    use super::*;
    use crate::text::clipped;

    fn number(value: f64, half: f64) -> Option<Number> {
        Some(Number { value, interval: Some([value * (1.0 - half), value * (1.0 + half)]) })
    }

    fn answer() -> Answer {
        let drive = |joint: &str, dof, stiffness| Drive { joint: clipped(joint), dof, stiffness };
        Answer {
            pose: [0.1, -0.5, 0.95].into_iter().collect(),
            record: Some(3),
            softest: ToolStiffness {
                stiffness: number(3.81e5, 0.02),
                direction: Some([0.71, -0.004, -0.7]),
            },
            stiffest: ToolStiffness { stiffness: number(2.61e8, 0.011), direction: None },
            lowest_mode: LowestMode {
                frequency_hz: number(6.33, 0.002),
                damping_ratio: number(0.011, 0.03),
            },
            drives: [
                drive("joint_1", 5, number(2.31e6, 0.013)),
                drive("joint_2", 2, number(2.0e8, 0.15)),
                drive("joint_3", 5, None),
            ]
            .into_iter()
            .collect(),
        }
    }

    fn parts(answer: &Answer) -> [std::string::String; 3] {
        answer.parts().map(|(_, part)| part.to_string())
    }

    #[test]
    fn an_answer_is_a_line_and_its_parts_are_lines() {
        let answer = answer();
        assert_eq!(
            answer.to_string(),
            "tool 0.381 (±2.0 %) to 261 N/µm (±1.1 %), lowest mode 6.33 Hz (±0.2 %), damping 1.10 % (1.07 to 1.13 %), at the pose of record 3"
        );
        assert_eq!(
            parts(&answer),
            [
                "softest 0.381 N/µm (±2.0 %) along 0.71 0.00 -0.70, stiffest 261 N/µm (±1.1 %); static",
                "6.33 Hz (±0.2 %), damping 1.10 % (1.07 to 1.13 %)",
                "joint_1 2.31 MNm/rad (±1.3 %), joint_2 200 MN/m (±15 %), joint_3 not determined",
            ]
        );
        assert_eq!(
            answer.place().to_string(),
            "at the pose of record 3, the newest: 0.10 -0.50 0.95; directions in the axes of the TCP"
        );
    }

    #[test]
    fn no_number_stands_for_what_is_not_determined() {
        let mut answer = answer();
        answer.stiffest.stiffness = None;
        answer.lowest_mode.damping_ratio = None;
        assert_eq!(
            answer.to_string(),
            "tool softest 0.381 N/µm (±2.0 %), stiffest not determined, lowest mode 6.33 Hz (±0.2 %), damping not determined, at the pose of record 3"
        );
        answer.softest = ToolStiffness { stiffness: None, direction: Some([1.0, 0.0, 0.0]) };
        answer.lowest_mode.frequency_hz = None;
        answer.drives.iter_mut().for_each(|drive| drive.stiffness = None);
        assert_eq!(
            answer.to_string(),
            "tool stiffness not determined, lowest mode not determined, at the pose of record 3"
        );
        let digits: Vec<char> =
            parts(&answer)[..2].concat().chars().filter(char::is_ascii_digit).collect();
        assert!(digits.is_empty(), "{:?}", parts(&answer));
    }

    #[test]
    fn a_fit_that_allows_no_interval_states_none() {
        let mut answer = answer();
        for own in [&mut answer.softest, &mut answer.stiffest] {
            own.stiffness.as_mut().unwrap().interval = None;
        }
        answer.lowest_mode.damping_ratio.as_mut().unwrap().interval = None;
        assert_eq!(
            answer.to_string(),
            "tool 0.381 (no interval) to 261 N/µm (no interval), lowest mode 6.33 Hz (±0.2 %), damping 1.10 % (no interval), at the pose of record 3"
        );
    }
}
