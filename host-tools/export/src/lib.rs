//! An identified robot as a model for other programs.
//!
//! | module       | holds                                                                     |
//! | ------------ | ------------------------------------------------------------------------- |
//! | [`mod@format`] | the formats and their names                                               |
//! | [`mod@error`] | why a robot cannot be exported                                            |
//! | `robot`, `body` | a robot as it is exported; one of its links, with the bushing that carries it |
//! | `assembly`   | the robot at its pose: frames, links, bushings, elongations at rest       |
//! | `imperfect`  | the robot with the imperfections that the fit has found, and its ground |
//! | `remark`     | comments on parameters that the data do not determine                     |
//! | `text`       | numbers and names as text                                                 |
//! | `step`       | a step of time that resolves the fastest mode                             |
//! | `mjcf`       | MuJoCo's XML                                                              |
//! | `simscape`   | a MATLAB script for Simscape Multibody                                    |
//! | `drake`      | a Python script for Drake                                                 |
//! | `table`      | a table of the parameters                                                 |
//!
//! Each joint has its drive, which is locked at the pose, and its bushing. The bushing has six coordinates in their kinematic
//! order: slides along the axes x, y and z of the joint frame, then turns about x, the new y and the new z. Each coordinate has
//! a linear spring, which is relaxed at 0, and a linear damper.
#![forbid(unsafe_code)]

mod assembly;
mod body;
mod drake;
pub mod error;
pub mod format;
mod imperfect;
mod mjcf;
mod remark;
mod robot;
mod simscape;
mod step;
mod table;
mod text;

use assembly::Assembly;
pub use error::ExportError;
pub use format::Format;
pub use imperfect::bushings;
pub use robot::Robot;

/// Returns the robot in this format, as the content of a file.
///
/// A parameter whose verdict is not `identified` has a comment that says so, or its verdict in the table.
///
/// # Errors
/// The error says which part of the robot is wrong, or which two parts contradict each other.
pub fn export(robot: &Robot, format: Format) -> Result<String, ExportError> {
    let assembly = Assembly::new(robot)?;
    match format {
        Format::Mjcf => mjcf::write(&assembly),
        Format::Simscape => Ok(simscape::write(&assembly)),
        Format::Drake => Ok(drake::write(&assembly)),
        Format::Csv => table::write(&assembly),
    }
}
