//! Conclusions from a robot that was identified: whether two fits agree, joint offsets, and stability lobes, each with its interval.
//!
//! | file           | what                                                        |
//! | -------------- | ----------------------------------------------------------- |
//! | `document`     | a result file of `flexid identify --json`, checked          |
//! | `compensation` | joint offsets that take a deflection back                   |
//! | `milling`      | the force of a cutter per displacement of the tool          |
//! | `lobes`        | the depth of cut at which the tool chatters, by spindle speed |
//! | `comparison`   | whether two fits of a robot agree                           |
//! | `history`      | what changed over many                                      |
//! | `fleet`        | robots of one type as a population                          |
//!
//! Modes, receptance and compliance of the robot are those of [`flexid_pipeline::dynamics`].

pub mod comparison;
pub mod compensation;
pub mod document;
mod findings;
pub mod fleet;
pub mod history;
mod holm;
pub mod lobes;
pub mod milling;
pub mod parameter;
mod reference;

pub use flexid_pipeline::dynamics::{
    Dynamics, Estimate, PositiveEstimate, Robot, RobotError, TWO_SIDED, modes, receptance, statics,
};
