//! A result file of `flexid identify --json`, checked.

use std::path::Path;

use flexid_core::parameters::Bushing;
use flexid_core::verdict::FOREIGN;
use flexid_pipeline::input::{self, BadInput};
use flexid_pipeline::robot::FoundRobot;
use flexid_pipeline::shared::Shared;
use flexid_wire::report::{Fit, JointReport};
use flexid_wire::text::{Name, clipped};
use serde::Deserialize;

use flexid_pipeline::dynamics::Robot;

pub use flexid_pipeline::document::SCHEMA;

/// Tells whether a fit is so far from its records that no interval of a parameter holds.
pub fn is_far(fit: &Fit) -> bool {
    fit.consistency > FOREIGN
}

/// Command that writes a result file.
pub const COMMAND: &str = "flexid identify --json";

/// A result, checked.
#[derive(Debug)]
pub struct Found {
    /// Parameters of each joint, base first, with standard deviations and verdicts.
    pub joints: Vec<JointReport>,
    /// Quality of the fit.
    pub fit: Fit,
    /// Warnings, a line each.
    pub warnings: Vec<String>,
    /// The robot and its covariance.
    pub robot: Robot,
    /// What it shares with other findings of the robot. `None` of static tests alone, and of older programs.
    pub shared: Option<Shared>,
    /// Date of its first record, ISO 8601, UTC. `None` if the clock of its log shows no date.
    pub date: Option<String>,
    /// SHA-256 of each log that it comes from, in hexadecimal digits, as far as they are known.
    pub logs: Vec<String>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object with the entries of a result")]
struct Version {
    #[serde(default = "first")]
    schema: u32,
}

#[derive(Deserialize)]
#[serde(expecting = "an object with the entries of a result")]
struct Document {
    joints: Vec<JointReport>,
    fit: Fit,
    #[serde(default)]
    warnings: Vec<String>,
    robot: Option<FoundRobot>,
    shared: Option<Shared>,
    #[serde(default)]
    origin: Origin,
}

#[derive(Default, Deserialize)]
struct Origin {
    date: Option<String>,
    #[serde(default)]
    logs: Vec<Log>,
}

#[derive(Deserialize)]
struct Log {
    sha256: Option<String>,
}

/// Version of the files that do not state theirs.
fn first() -> u32 {
    1
}

impl Found {
    /// Reads and checks a result file.
    ///
    /// # Errors
    /// The file cannot be read, is no result, or is not one of a robot. The error is one line that names file, place and mend.
    pub fn load(file: &Path) -> Result<Self, BadInput> {
        Self::parse(file, &input::read(file)?)
    }

    /// Reads and checks the `text` of a result file.
    ///
    /// # Errors
    /// Those of [`Found::load`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, BadInput> {
        let bad = |message: String| BadInput::new(file, message);
        let Version { schema } = input::parse_json(file, text, COMMAND)?;
        if schema == 0 {
            return Err(bad(format!(
                "schema must be 1 to {SCHEMA}: run `flexid identify --json` again"
            )));
        }
        if schema > SCHEMA {
            return Err(bad(format!(
                "is of schema {schema}, this flexid reads 1 to {SCHEMA}: install the newer flexid"
            )));
        }
        let Document { joints, fit, warnings, robot, shared, origin } =
            input::parse_json(file, text, COMMAND)?;
        let Some(robot) = robot else {
            return Err(bad(
                "has no robot, as results of the daemon and of older programs: run `flexid identify --json` on a recording".into(),
            ));
        };
        // The names of a report are clipped.
        let names = robot.model.joints.iter().map(|joint| -> Name { clipped(&joint.name) });
        if !names.eq(joints.iter().map(|joint| joint.name.clone())) {
            return Err(bad("joints and robot.model are of different robots: run `flexid identify --json` again".into()));
        }
        let bushings = joints
            .iter()
            .map(|joint| Bushing { stiffness: joint.stiffness, damping: joint.damping })
            .collect();
        let robot = Robot::new(robot, bushings).map_err(|error| bad(format!("robot: {error}")))?;
        if let Some(fault) = shared.as_ref().and_then(|shared| shared.fault(robot.chain())) {
            return Err(bad(format!("shared: {fault}: run `flexid identify --json` again")));
        }
        let logs = origin.logs.into_iter().filter_map(|log| log.sha256).collect();
        Ok(Self { joints, fit, warnings, robot, shared, date: origin.date, logs })
    }
}
