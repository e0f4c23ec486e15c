//! Warnings about a report.

mod line;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::axes::WrongAxes;
use crate::explanation::Deviation;
use crate::implausible::{Implausible, Signals};
use crate::misfits::Misfit;
use crate::rate::{RateUsed, WrongRate};
use crate::residuals::Objection;
use crate::state::State;
use crate::text::Label;
use crate::trouble::Trouble;
use crate::unused::Unused;

/// Largest number of parameters that a warning names.
pub const MAX_ON_BOUNDS: usize = 7;

/// Largest number of lines of noise that a warning names.
pub const MAX_LINES: usize = 6;

/// A warning about a report, with what it names and counts. Its [`Display`](core::fmt::Display) is one line for people.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Warning {
    /// The acceleration does not agree with the force and the masses, whatever the stiffnesses within their bounds.
    Disproportion {
        /// Acceleration, as a multiple of the nearest acceleration that the force makes of the masses.
        ratio: f64,
        /// Likely cause.
        suspect: WrongUnit,
    },
    /// Readings are implausible.
    Implausible(Implausible),
    /// The numbers may be those of a wrong minimum.
    UnsureMinimum(UnsureCause),
    /// There are no records, and too few static tests to be tested.
    FewStaticTests,
    /// There are no records, and the fit to the static tests does not settle.
    UnsettledStaticTests,
    /// Parameters lie on an end of `[bounds]`.
    OnStatedBounds {
        /// The parameters.
        parameters: OnBounds,
        /// The mend.
        advice: BoundsAdvice,
    },
    /// The residuals are not those of noise.
    Objection(Objection),
    /// A parameter that `[parameters]` fixes or ties may be wrong.
    ImposedParameters,
    /// The static tests contradict the fit.
    StaticTestsOff {
        /// Size of their residuals, in their standard deviations.
        deviations: f64,
    },
    /// Parameters lie on an end of the range that follows from the masses.
    OnMassBounds(OnBounds),
    /// Older and newer records do not fit one robot.
    RecordsContradict,
    /// Older records were forgotten, since they contradict the newer ones.
    RobotChanged {
        /// Number of older records.
        forgotten: u64,
    },
    /// The bus or a recording has a trouble.
    Trouble(Trouble),
    /// The recordings have further troubles.
    MoreTroubles {
        /// Number of further troubles.
        troubles: u64,
    },
    /// The numbers do not rest on some records.
    Unused(Unused),
    /// Records came again. They are left out.
    Repeated {
        /// Number of records that came again.
        records: u64,
        /// Number of the first of them among all records, from 1.
        again: u64,
        /// Number of the record that this one repeats.
        original: u64,
    },
    /// Records came at another rate than the configured one.
    WrongRate {
        /// Number of records.
        records: u64,
        /// Configured and measured rate.
        rate: WrongRate,
        /// Rate that the records have.
        used: RateUsed,
    },
    /// Readings lie at the limit of their signal.
    AtLimit(Signals),
    /// Older records made room, and their information is lost.
    MadeRoom {
        /// Number of records.
        records: u64,
        /// Number of poses that no other record has.
        poses: u64,
    },
    /// Records were left out, since they are shorter than others of the same pose.
    TooShort {
        /// Number of records.
        records: u64,
    },
    /// Frames have another length than in the DBC file.
    WrongLength {
        /// Number of all such frames.
        frames: u64,
        /// Most frequent kind of them.
        worst: Misfit,
    },
    /// Frames are of another kind than in the DBC file.
    Misfit(Misfit),
    /// The bus has reported errors.
    BusErrors {
        /// Number of errors.
        errors: u64,
    },
    /// There is no record, although records were asked for.
    NoRecord(State),
    /// A static test does not go with the others: noise alone hardly puts any of them as far out.
    StaticOutlier {
        /// Line in the file of static tests, from 1.
        line: u64,
        /// Distance from the prediction by all else, by the scatter of the others, in standard deviations.
        deviations: f64,
        /// Largest probability that noise alone puts any of the tests as far out.
        chance: f64,
    },
    /// Lines of noise were subtracted from the acceleration: hum, spindle, bearings.
    Lines {
        /// The strongest lines, by frequency.
        lines: Vec<Line, MAX_LINES>,
        /// Number of weaker lines.
        more: u32,
    },
    /// The records contradict an accuracy very strongly.
    Contradicted {
        /// The largest deviation of its kind.
        deviation: Deviation,
        /// By how many times its accuracy the kind is off.
        times: f64,
        /// Number of other kinds that explain the records as well in its place.
        rivals: u8,
    },
    /// The axes of a sensor are swapped, or have the wrong sign.
    WrongAxes(WrongAxes),
    /// The acceleration has more noise in the cut than at rest. The fit allows for it.
    LouderCut {
        /// Axis of the accelerometer that has most, 0 to 2.
        axis: u8,
        /// Lower end of the band that has most, Hz.
        from_hz: f64,
        /// Upper end, Hz.
        to_hz: f64,
        /// Root mean square of the noise there, over that at rest.
        times: f64,
        /// Number of records that have more noise in the cut somewhere.
        records: u32,
    },
    /// The residuals are not those of noise, and `[accuracy]` takes as perfect what it does not state.
    AssumedPerfect,
}

/// A steady oscillation of the accelerometer that no force causes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Line {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Largest amplitude along an axis in any record, m/s².
    pub amplitude: f64,
    /// Number of records that have it.
    pub records: u32,
}

/// Wrong unit that explains a ratio of acceleration and force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum WrongUnit {
    /// The force is in mN.
    ForceInMilli,
    /// The acceleration is in g.
    AccelerationInG,
    /// The force is in kN, or the acceleration in mm/s².
    ForceInKiloOrAccelerationInMilli,
}

/// Reason why a minimum may be a wrong one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum UnsureCause {
    /// The reason is not known, or the [`Objection`] of the residuals gives it.
    Other,
    /// The poses do not determine some combinations of parameters.
    FewPoses {
        /// Number of combinations.
        directions: u8,
        /// True if there may be more of them.
        or_more: bool,
    },
    /// The records hardly stand clear of the noise.
    Noise {
        /// Median of the surface similarity parameters.
        ssp: f64,
    },
}

/// Parameters on an end of their range.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct OnBounds {
    /// First parameters, in the order of the joints.
    pub first: Vec<OnBound, MAX_ON_BOUNDS>,
    /// Number of further parameters.
    pub more: u32,
}

/// A parameter on an end of its range.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct OnBound {
    /// Name of the parameter.
    pub parameter: Label,
    /// End of the range.
    pub end: End,
}

/// End of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// Lower end.
    Lower,
    /// Upper end.
    Upper,
}

/// The mend if parameters lie on an end of `[bounds]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum BoundsAdvice {
    /// Widen the bounds.
    Widen,
    /// Add static tests, or widen the bounds.
    AddTests,
    /// Run again without `[bounds]`, before anything else.
    Remove,
}

/// Puts the first parameters in `first`, and counts the others.
impl FromIterator<OnBound> for OnBounds {
    fn from_iter<I: IntoIterator<Item = OnBound>>(parameters: I) -> Self {
        let mut all = Self { first: Vec::new(), more: 0 };
        for parameter in parameters {
            if all.first.push(parameter).is_err() {
                all.more += 1;
            }
        }
        all
    }
}
