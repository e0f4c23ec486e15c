//! Axes of a sensor that are not those of the configuration.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// An axis of a sensor, with its sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SignedAxis {
    /// Number of the configured axis, 0 to 2.
    pub axis: u8,
    /// True if the sign is wrong.
    pub negative: bool,
}

/// With the configured axes the robot gives off energy, and with others it does not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct WrongAxes {
    /// Share of the power over the band that is negative: that the robot gives off.
    pub share: f64,
    /// The true axes of the force sensor's x, y, z, if its axes are wrong; `None` if the records do not say.
    pub force: Option<[SignedAxis; 3]>,
    /// The true axes of the accelerometer's x, y, z.
    pub acceleration: Option<[SignedAxis; 3]>,
}

impl fmt::Display for SignedAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = ["x", "y", "z"].get(usize::from(self.axis)).unwrap_or(&"?");
        write!(f, "{}{name}", if self.negative { "-" } else { "" })
    }
}

/// For example `the robot gives off energy (9 % of the power), but not if the force's x, y, z are its signals x, z, y: correct …`.
impl fmt::Display for WrongAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { share, force, acceleration } = self;
        write!(f, "the robot gives off energy ({:.0} % of the power), ", 100.0 * share)?;
        if force.is_none() && acceleration.is_none() {
            f.write_str("as if axes of force or acceleration were swapped or reversed")?;
        }
        let sensors = [("force", force), ("acceleration", acceleration)];
        let sensors = sensors.into_iter().filter_map(|(name, axes)| Some((name, axes.as_ref()?)));
        for (index, (name, [x, y, z])) in sensors.enumerate() {
            let or = if index > 0 { ", or " } else { "but not if " };
            write!(f, "{or}the {name}'s x, y, z are its signals {x}, {y}, {z}")?;
        }
        f.write_str(": correct order or signs in [signals] or [bus] dbc")
    }
}
