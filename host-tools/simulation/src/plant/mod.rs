//! A real plant beside its model: errors of sensors, clocks, geometry, masses and joints.
//!
//! A plant file (TOML) names what is off; what it leaves out is perfect. Each entry gives its unit in its name or its
//! documentation, and a typical size with its source. The robot moves in time under all of them at once.
//!
//! | module         | holds                                                              |
//! | -------------- | ------------------------------------------------------------------ |
//! | [`robot`]      | geometry and masses that differ from the model; further bushings   |
//! | [`chain`]      | the chain that moves, at the pose of a cut                         |
//! | [`elements`]   | the laws of these loads, and their past                            |
//! | [`joints`]     | loads of joints that no linear bushing has                         |
//! | [`ripple`]     | errors of gears that repeat with the turns of their motors         |
//! | [`motion`]     | a cut by such a robot                                              |
//! | [`sensors`]    | errors of a sensor, from the motion to the reading                 |
//! | [`filter`]     | linear filters of a sensor, applied to a spectrum                  |
//! | [`clock`]      | the instants at which a sensor samples                             |
//! | [`interpolation`] | a signal at these instants                                      |
//! | [`noise`]      | disturbances of a sensor: coloured noise, hum, lines, spikes       |

pub mod chain;
pub mod clock;
pub mod elements;
pub mod filter;
mod imperfections;
pub mod interpolation;
pub mod joints;
pub mod motion;
pub mod noise;
mod range;
pub mod ripple;
pub mod robot;
pub mod sensors;

use std::path::Path;

use flexid_core::MAX_JOINTS;
use flexid_core::parameters::Bushing;
use flexid_pipeline::input::{self, BadInput};
use flexid_pipeline::model::Model;
use serde::Deserialize;

pub use joints::Joints;
pub use ripple::Ripple;
pub use robot::{Bending, Hose, Pedestal, Robot, Tool};
pub use sensors::Sensor;

/// All that is off. The default is a perfect plant.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Plant {
    /// Errors of the force sensor.
    pub force_sensor: Sensor,
    /// Errors of the accelerometer.
    pub accelerometer: Sensor,
    /// Errors of the whole tool, both sensors included.
    pub tool: Tool,
    /// Errors of the model's geometry and masses.
    pub robot: Robot,
    /// A bushing between the ground and the base.
    pub pedestal: Option<Pedestal>,
    /// A link that bends.
    pub bending: Option<Bending>,
    /// A hose or cable from the ground to the tool.
    pub hose: Option<Hose>,
    /// Loads of the joints that are not linear springs and dampers.
    pub joints: Joints,
    /// Errors of gears that repeat with the turns of their motors.
    pub ripple: Vec<Ripple>,
}

impl Plant {
    /// Reads and checks the plant `file` of the robot `model`.
    ///
    /// # Errors
    /// The file is wrong. The error is one line that names the file, the place, and the right input.
    pub fn load(file: &Path, model: &Model) -> Result<Self, BadInput> {
        Self::parse(file, &input::read(file)?, model)
    }

    /// Reads and checks the text of the plant `file`.
    ///
    /// # Errors
    /// The errors of [`Plant::load`].
    pub fn parse(file: &Path, text: &str, model: &Model) -> Result<Self, BadInput> {
        let plant: Self = input::parse_toml(file, text)?;
        plant.check(model).map_err(|error| BadInput::new(file, error))?;
        Ok(plant)
    }

    /// Checks that a robot with these bushings can have this plant.
    ///
    /// # Errors
    /// The error is one line that names the place and the right input.
    pub fn check_bushings(&self, bushings: &[Bushing]) -> Result<(), String> {
        self.joints.check_bushings(bushings)
    }

    /// Checks that the plant can follow a path, if its robot `feeds`.
    ///
    /// # Errors
    /// As [`Plant::check_bushings`].
    pub fn check_path(&self, feeds: bool) -> Result<(), String> {
        let creeps = self.robot.feed_rad_per_s.iter().any(|rate| *rate != 0.0);
        for (is_there, place) in
            [(creeps, "[robot] feed_rad_per_s"), (self.hose.is_some(), "[hose]")]
        {
            if feeds && is_there {
                return Err(format!(
                    "{place} is that of a robot that stands: remove it, or path_mm of the experiments"
                ));
            }
        }
        Ok(())
    }

    /// The least part of a stiffness of these bushings that hysteresis leaves at rest. A robot in which it is negative gives way.
    pub fn stiffness_at_rest(&self, bushings: &[Bushing]) -> f64 {
        self.joints.stiffness_at_rest(bushings)
    }

    fn check(&self, model: &Model) -> Result<(), String> {
        self.force_sensor.check("force_sensor")?;
        self.accelerometer.check("accelerometer")?;
        if self.force_sensor.offset_m != [0.0; 3] {
            return Err(
                "[force_sensor] offset_m: a force has no place on a rigid tool: remove it".into()
            );
        }
        self.tool.check()?;
        self.robot.check(model)?;
        self.joints.check()?;
        self.ripple.iter().try_for_each(|ripple| ripple.check(model))?;
        let further = [self.pedestal.is_some(), self.bending.is_some()];
        let bushings = model.joints.len() + further.into_iter().filter(|one| *one).count();
        if bushings > MAX_JOINTS {
            return Err(format!(
                "[pedestal] and [bending] make {bushings} bushings: at most {MAX_JOINTS}: leave one out"
            ));
        }
        for part in
            [self.pedestal.as_ref().map(Pedestal::check), self.hose.as_ref().map(Hose::check)]
        {
            part.unwrap_or(Ok(()))?;
        }
        self.bending.as_ref().map_or(Ok(()), |bending| bending.check(model))
    }
}

#[cfg(test)]
mod tests;
