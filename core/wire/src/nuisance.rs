//! Errors of sensors and of the model, beside the parameters.

use heapless::String;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::accuracy::Accuracy;
use crate::text::Label;
use crate::verdict::{MAX_JOINTS, Verdict};

/// Largest number of nuisances: a delay, three gains of each of two sensors, three misalignment angles, and a mass per joint.
pub const MAX_NUISANCES: usize = 10 + MAX_JOINTS;

/// Name of a unit: at most 8 bytes of UTF-8, empty for a factor.
pub type Unit = String<8>;
/// Lower and upper end of a 95 % interval.
pub type Interval = [f64; 2];

/// Error of a sensor, or of the model of the masses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Nuisance {
    /// Name of the nuisance.
    pub name: Label,
    /// The entry of `[accuracy]` that speaks of it; `None` of one that `[calibration]` seeks.
    pub entry: Option<Accuracy>,
    /// The entry in the unit `unit`, one standard deviation; relative of a factor. `None` also where the accuracy only follows from the entry.
    pub accuracy: Option<f64>,
    /// Unit, for example `rad` or `m/N`. Empty for a factor and for a part.
    pub unit: Unit,
    /// Value in the unit `unit`.
    pub value: f64,
    /// Standard deviation in the unit `unit`; `None` if the fit gives no finite number.
    pub std: Option<f64>,
    /// 95 % interval in the unit `unit`; `None` if the residuals allow no interval for any joint's parameter.
    pub interval: Option<Interval>,
    /// How much the data add to the prior: identified if they leave 5 % or less of the prior's standard deviation, weak if
    /// they leave 30 % or less.
    pub verdict: Verdict,
}
