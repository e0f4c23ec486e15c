//! A quantity over two joints of the robot.

mod picture;
mod table;

use anyhow::Result;
use flexid_prediction::{PositiveEstimate, Robot};
use rayon::prelude::*;
use serde::Serialize;

pub(crate) use picture::svg;
pub(crate) use table::text;

/// Half of a 95 % interval, in parts of the value, from which on a place is flagged as uncertain. Chosen: the limit above which a parameter
/// is no longer identified is 5 % for one standard deviation, a tenth for two.
const UNCERTAIN: f64 = 0.1;

/// The quantity that is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Quantity {
    /// Static compliance of the tool along the softest direction, m/N.
    Compliance,
    /// Lowest natural frequency, Hz.
    Frequency,
    /// Distance that the tool moves under this force along its axes, N; m.
    Deflection([f64; 3]),
}

impl Quantity {
    /// Name with the unit in which it is shown, and what its SI unit is multiplied by.
    pub(crate) fn shown(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::Compliance => ("compliance, softest direction", "µm/N", 1e6),
            Self::Frequency => ("lowest natural frequency", "Hz", 1.0),
            Self::Deflection(_) => ("deflection", "µm", 1e6),
        }
    }

    /// Name of its column.
    fn column(self) -> &'static str {
        match self {
            Self::Compliance => "compliance_m_per_n",
            Self::Frequency => "frequency_hz",
            Self::Deflection(_) => "deflection_m",
        }
    }

    /// Its value in a pose; `None` where the robot does not stand, or has no mode up to twice the band.
    fn at(self, robot: &Robot, pose: &[f64]) -> Option<PositiveEstimate> {
        let dynamics = robot.at(pose).ok()?;
        match self {
            Self::Compliance => Some(dynamics.softest(&dynamics.compliance()?)),
            Self::Frequency => {
                let [_, upper] = robot.band_hz();
                dynamics.lowest_mode(2.0 * upper).map(|mode| mode.frequency_hz)
            }
            Self::Deflection(force) => Some(dynamics.moved_by(&dynamics.compliance()?, force)),
        }
    }
}

/// The joints over which a map is made.
#[derive(Clone, Debug)]
pub(crate) struct Over {
    /// Places of the joints in a pose, the one along the horizontal axis first.
    pub(crate) joints: [usize; 2],
    /// Their names.
    pub(crate) names: [String; 2],
    /// Units of their angles: rad, or m.
    pub(crate) units: [&'static str; 2],
    /// Their least and largest angle, rad (m).
    pub(crate) ranges: [[f64; 2]; 2],
    /// Number of angles of each.
    pub(crate) points: usize,
}

/// A quantity over two joints.
#[derive(Clone, Debug)]
pub(crate) struct Map {
    pub(crate) quantity: Quantity,
    pub(crate) over: Over,
    /// Row by row; the angle of the first joint changes within a row.
    pub(crate) cells: Vec<Cell>,
}

/// A pose of the map.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Cell {
    /// Joint angles, base first, rad (m).
    pub(crate) pose: Vec<f64>,
    /// Place of the tool along the axes of the base, m.
    pub(crate) tool: [f64; 3],
    /// The quantity, in its SI unit. `None` where the robot does not stand, or has no mode up to twice the band.
    pub(crate) value: Option<PositiveEstimate>,
    /// True if its interval is wide, or it has no value.
    pub(crate) is_uncertain: bool,
}

impl Over {
    /// Angles of a joint of the two: in the middles of as many equal parts of its range.
    fn angle(&self, which: usize, index: usize) -> f64 {
        let [least, most] = self.ranges[which];
        least + (most - least) * (index as f64 + 0.5) / self.points as f64
    }

    /// Pose beside `pose` with these angles of the two joints.
    fn pose(&self, pose: &[f64], angles: [f64; 2]) -> Vec<f64> {
        let mut own = pose.to_vec();
        for (joint, angle) in self.joints.iter().zip(angles) {
            own[*joint] = angle;
        }
        own
    }
}

impl Map {
    /// Other joints stay as in `pose`. It calls `done` once for each pose.
    pub(crate) fn new(
        robot: &Robot,
        quantity: Quantity,
        over: Over,
        pose: &[f64],
        done: impl Fn() + Sync,
    ) -> Self {
        let cell = |index: usize| {
            let place = [index % over.points, index / over.points];
            let pose = over.pose(pose, [0, 1].map(|which| over.angle(which, place[which])));
            let value = quantity.at(robot, &pose);
            let is_uncertain = value.is_none_or(|own| {
                let [low, high] = own.interval;
                let is_narrow = high - low <= 2.0 * UNCERTAIN * own.value;
                !is_narrow
            });
            let tool = robot.chain().tool(&pose).translation.vector.into();
            done();
            Cell { pose, tool, value, is_uncertain }
        };
        let cells = (0..over.points * over.points).into_par_iter().map(cell).collect();
        Self { quantity, over, cells }
    }

    /// A line for each pose.
    ///
    /// # Errors
    /// None.
    pub(crate) fn csv(&self) -> Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let joints = self.cells.first().map_or(0, |cell| cell.pose.len());
        let mut header: Vec<String> = (1..=joints).map(|joint| format!("q{joint}")).collect();
        header.extend(
            ["x", "y", "z", self.quantity.column(), "low", "high", "uncertain", "determined"]
                .map(str::to_owned),
        );
        writer.write_record(&header)?;
        for Cell { pose, tool, value, is_uncertain } in &self.cells {
            let mut line: Vec<String> = pose.iter().chain(tool).map(f64::to_string).collect();
            match value {
                None => line.extend((0..3).map(|_| String::new())),
                Some(PositiveEstimate { value, interval: [low, high], .. }) => {
                    line.extend([value, low, high].map(|number| format!("{number:.9e}")));
                }
            }
            line.push(u8::from(*is_uncertain).to_string());
            line.push(u8::from(value.is_some_and(|own| own.determined)).to_string());
            writer.write_record(&line)?;
        }
        Ok(String::from_utf8(writer.into_inner()?)?)
    }
}
