//! Residuals between model and measurement: what they mean, and what to do.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Size and structure of the residuals between model and measurement, and what objects to them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Residuals {
    /// χ² per degree of freedom, as in [`Fit::consistency`](crate::report::Fit::consistency).
    pub consistency: f64,
    /// Significance of the structure of the residuals along the band, in standard deviations: about N(0, 1) if noise explains it. It grows
    /// with bins and records.
    pub whiteness: f64,
    /// Size of that structure: how much the mean square of the residuals, smoothed to a sixteenth of the band, varies along the band, as a
    /// root mean square in their mean over the band, without what noise adds. It is that of one record or axis that surely has more than
    /// all of them. 0.1 makes intervals that rest on a part of the band 5 % too narrow.
    pub structure: f64,
    /// The residuals are larger than noise explains.
    pub size_objects: bool,
    /// The residuals have structure that noise hardly ever makes, however little. Without it the size of the structure says nothing.
    pub whiteness_objects: bool,
    /// The residuals have structure that noise does not explain and that matters.
    pub structure_objects: bool,
    /// Meaning of size and structure.
    pub meaning: Meaning,
}

/// Meaning of the size and the structure of residuals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Meaning {
    /// Noise explains the residuals of the records.
    Noise,
    /// There are no records, and noise explains the residuals of the static tests.
    StaticNoise,
    /// There are no records, and the static tests do not fit.
    StaticMisfit,
    /// The residuals are smaller than the noise: it is taken for louder than it is.
    LoudNoise,
    /// The static tests alone object.
    StaticTests,
    /// The minimum may be a wrong one.
    WrongMinimum,
    /// The model is wrong.
    WrongModel,
    /// The sensors have more noise in the cut than at rest.
    NoisierCut,
    /// The model is wrong by a little, or the noise is coloured.
    SmallError,
}

/// Objection of the residuals, with the numbers that it rests on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Objection {
    /// There are no records, and the static tests fit badly.
    StaticMisfit {
        /// χ² per degree of freedom.
        consistency: f64,
    },
    /// The noise is taken for louder than it is.
    LoudNoise {
        /// χ² per degree of freedom.
        consistency: f64,
    },
    /// The residuals are those of a minimum that may be a wrong one.
    WrongMinimum {
        /// χ² per degree of freedom.
        consistency: f64,
        /// Structure, as [`Residuals::structure`], if there is any.
        structure: Option<f64>,
    },
    /// The model is wrong.
    WrongModel {
        /// χ² per degree of freedom.
        consistency: f64,
    },
    /// The model is wrong by a little.
    SlightlyWrongModel {
        /// χ² per degree of freedom.
        consistency: f64,
    },
    /// The sensors have more noise in the cut than at rest.
    NoisierCut {
        /// χ² per degree of freedom.
        consistency: f64,
    },
    /// The residuals are small, but not random.
    Structure {
        /// Structure, as [`Residuals::structure`].
        structure: f64,
    },
    /// The residuals are no response to the force, so that no linear model explains them.
    Distortion {
        /// χ² per degree of freedom.
        consistency: f64,
        /// The part of them that no smooth response to the force explains.
        part: f64,
    },
}

impl fmt::Display for Residuals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = Size(self.consistency);
        let structure = Structure(Some(self.structure).filter(|_| self.whiteness_objects));
        let meaning = match self.meaning {
            Meaning::Noise => return write!(f, "noise explains them ({})", Both(size, structure)),
            Meaning::StaticNoise => {
                return write!(f, "noise explains those of the static tests ({size})");
            }
            Meaning::StaticMisfit => {
                return write!(f, "{size} objects: the static tests do not fit");
            }
            Meaning::LoudNoise => {
                return write!(f, "{size} objects: the noise is taken for louder than it is");
            }
            Meaning::StaticTests => {
                return write!(f, "static tests object ({})", Both(size, structure));
            }
            Meaning::WrongMinimum => "the minimum may be a wrong one",
            Meaning::WrongModel => "the model is wrong",
            Meaning::NoisierCut => "more noise than at rest",
            Meaning::SmallError => "a small error of the model, or coloured noise",
        };
        match (self.size_objects, self.structure_objects) {
            (true, false) => write!(f, "{size} objects, {structure} does not: {meaning}"),
            (false, true) => write!(f, "{structure} objects, {size} does not: {meaning}"),
            _ => write!(f, "{size} and {structure} object: {meaning}"),
        }
    }
}

struct Size(f64);

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "χ²/dof {:.2}", self.0)
    }
}

/// Size of the structure, if there is any.
struct Structure(Option<f64>);

impl fmt::Display for Structure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(structure) => write!(f, "structure {:.0} %", 100.0 * structure),
            None => f.write_str("structure"),
        }
    }
}

/// The size, and the structure if there is any.
struct Both<S>(S, Structure);

impl<S: fmt::Display> fmt::Display for Both<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(size, structure) = self;
        match structure {
            Structure(None) => size.fmt(f),
            Structure(Some(_)) => write!(f, "{size}, {structure}"),
        }
    }
}

impl fmt::Display for Objection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StaticMisfit { consistency } => write!(
                f,
                "static tests fit badly (χ²/dof {consistency:.1}): check poses, loads, signs and standard \
                 deviations in [static] file, and [bounds]"
            ),
            Self::LoudNoise { consistency } => write!(
                f,
                "the noise is taken for louder than it is (χ²/dof {consistency:.2}): no quiet stretch in the records: \
                 let each begin 1 s before the cut"
            ),
            Self::WrongMinimum { consistency, structure } => write!(
                f,
                "residuals of that minimum object ({}): if other records do not \
                 help, check masses, TCP, [mounting], gravity, axes and units of the signals",
                Both(format_args!("χ²/dof {consistency:.1}"), Structure(*structure))
            ),
            Self::WrongModel { consistency } => write!(
                f,
                "the model is wrong (χ²/dof {consistency:.0}): check masses, TCP, [mounting], joint angles, axes and \
                 units of the signals, then gravity, delay, gains"
            ),
            Self::SlightlyWrongModel { consistency } => write!(
                f,
                "the model is wrong by a little (χ²/dof {consistency:.1}): state in [accuracy] what may be further off; or \
                 check masses, gravity, TCP, [mounting]"
            ),
            Self::NoisierCut { consistency } => write!(
                f,
                "residuals are larger than the noise, but random (χ²/dof {consistency:.1}): the sensors are \
                 noisier in the cut than at rest"
            ),
            Self::Distortion { consistency, part } => write!(
                f,
                "no linear model explains the residuals (χ²/dof {consistency:.1}, {:.0} % no response to the force): look for friction, \
                 backlash, clipping, clocks that wander, shocks",
                100.0 * part
            ),
            Self::Structure { structure } => write!(
                f,
                "residuals are small, but not random ({}): state in [accuracy] what may be further off; \
                 or check gravity, filters, [mounting]",
                Structure(Some(*structure))
            ),
        }
    }
}
