//! Warnings as lines for people.

use core::fmt;

use super::{BoundsAdvice, End, Line, OnBound, OnBounds, UnsureCause, Warning, WrongUnit};
use crate::explanation::Remedy;
use crate::implausible::enumerate;
use crate::words::{Count, Enumeration};

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Disproportion { ratio, suspect } => write!(
                f,
                "the acceleration is {ratio:.1e} times what the force makes of the model's masses within [bounds]: \
                 {suspect} give units in [bus] dbc; or mend masses or [bounds]"
            ),
            Self::Implausible(readings) => readings.fmt(f),
            Self::UnsureMinimum(cause) => write!(
                f,
                "the search is not sure of the minimum: the numbers may be those of a wrong one{cause}"
            ),
            Self::FewStaticTests => f.write_str(
                "static tests alone are too few to be tested: add tests, or records",
            ),
            Self::UnsettledStaticTests => f.write_str(
                "the fit to the static tests comes to no end: check their poses, loads and signs, and [bounds]",
            ),
            Self::OnStatedBounds { parameters, advice } => {
                write!(f, "on an end of [bounds]: {parameters}: {advice}")
            }
            Self::Objection(objection) => objection.fmt(f),
            Self::ImposedParameters => {
                f.write_str("what [parameters] fixes or ties may not be so: see without it")
            }
            Self::StaticTestsOff { deviations } => write!(
                f,
                "static tests are off by {deviations:.1} of their standard deviations: \
                 check poses, loads and signs in [static] file"
            ),
            Self::OnMassBounds(parameters) => write!(
                f,
                "not observable beyond the bounds that follow from the masses: {parameters}"
            ),
            Self::RecordsContradict => f.write_str(
                "older records and the newer ones do not fit one robot: it or its tool has changed, or the model is wrong",
            ),
            Self::RobotChanged { forgotten } => write!(
                f,
                "{} forgotten, which newer ones contradict: the robot or its tool has changed, or they are of few poses",
                Count(*forgotten, "older record")
            ),
            Self::Trouble(trouble) => trouble.fmt(f),
            Self::MoreTroubles { troubles } => {
                write!(f, "the recordings have {}", Count(*troubles, "further trouble"))
            }
            Self::Unused(records) => records.fmt(f),
            Self::Repeated { records: 1, again, original } => {
                write!(f, "record {again} is record {original} again: left out")
            }
            Self::Repeated { records, again, original } => write!(
                f,
                "{records} records came again and are left out: record {again} is record {original}, and so on"
            ),
            Self::WrongRate { records, rate, used } => {
                write!(f, "{}: {rate}, {used}", Count(*records, "record"))
            }
            Self::AtLimit(signals) => write!(
                f,
                "at the limit: {}: widen the range of the sensor or the signal",
                enumerate(signals)
            ),
            Self::MadeRoom { records, poses } => {
                Count(*records, "older record").fmt(f)?;
                if *poses > 0 {
                    write!(f, " (and {})", Count(*poses, "pose"))?;
                }
                f.write_str(
                    " lost to make room: their information is kept only where noise explains the residuals",
                )
            }
            Self::TooShort { records } => write!(
                f,
                "{} left out: at the same pose there are longer ones",
                Count(*records, "short record")
            ),
            Self::WrongLength { frames, worst } => write!(
                f,
                "{} of another length than [bus] dbc says: {worst}",
                Count(*frames, "frame")
            ),
            Self::Misfit(misfit) => misfit.fmt(f),
            Self::BusErrors { errors } => {
                write!(f, "the bus reported {}", Count(*errors, "error"))
            }
            Self::NoRecord(state) => write!(f, "no record: {state}"),
            Self::StaticOutlier { line, deviations, chance } => write!(
                f,
                "line {line} of [static] file does not go with the others ({deviations:.1} standard deviations, by chance \
                 {chance:.0e}): check its pose, load, axes, sign and unit"
            ),
            Self::Lines { lines, more } => write!(
                f,
                "lines that no force causes are taken out of the acceleration: {}: hum, spindle or bearings",
                Enumeration { named: lines, more: (*more).into() }
            ),
            Self::WrongAxes(axes) => axes.fmt(f),
            Self::AssumedPerfect => f.write_str(
                "[accuracy] takes as perfect what it does not state, and noise does not explain the residuals: leave assume = \"perfect\" out, \
                 unless the robot is simulated as modelled",
            ),
            Self::LouderCut { axis, from_hz, to_hz, times, records } => write!(
                f,
                "the cut has up to {times:.1} times the noise of the rest (acceleration {}, {from_hz:.0} to {to_hz:.0} Hz, {}): \
                 the intervals allow for it",
                ["x", "y", "z"].get(usize::from(*axis)).unwrap_or(&"?"),
                Count((*records).into(), "record")
            ),
            Self::Contradicted { deviation, times, rivals } => {
                deviation.fmt(f)?;
                if *rivals > 0 {
                    let others = Count((*rivals).into(), "other explanation");
                    write!(f, " (or one of {others})")?;
                }
                write!(f, " is {times:.1} times {}: {}", deviation.stated(), Remedy(deviation.entry))
            }
        }
    }
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frequency_hz, amplitude, records } = self;
        write!(
            f,
            "{frequency_hz:.2} Hz ({amplitude:.2e} m/s², {})",
            Count((*records).into(), "record")
        )
    }
}

impl fmt::Display for WrongUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ForceInMilli => "is the force in mN?",
            Self::AccelerationInG => "is the acceleration in g?",
            Self::ForceInKiloOrAccelerationInMilli => {
                "is the force in kN, or the acceleration in mm/s^2?"
            }
        })
    }
}

impl fmt::Display for UnsureCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Other => Ok(()),
            Self::FewPoses { directions, or_more } => {
                let least = if *or_more { "at least " } else { "" };
                let directions = Count((*directions).into(), "combination");
                write!(
                    f,
                    "; these cuts hardly determine {least}{directions} of parameters: mill in regions far from these"
                )
            }
            Self::Noise { ssp } => {
                write!(f, "; records hardly stand clear of the noise (SSP {ssp:.2}): cut harder")
            }
        }
    }
}

impl fmt::Display for OnBounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Enumeration { named: &self.first, more: self.more.into() }.fmt(f)
    }
}

impl fmt::Display for OnBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = match self.end {
            End::Lower => "lower",
            End::Upper => "upper",
        };
        write!(f, "{} ({end})", self.parameter)
    }
}

impl fmt::Display for BoundsAdvice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Widen => "widen them",
            Self::AddTests => "add tests, or widen them",
            Self::Remove => "before anything else, run again without [bounds]",
        })
    }
}
