//! The robot of the scenario, simulated in time with core's [equation of motion](flexid_core::motion), and its
//! sensors' frames.
//!
//! | module         | holds                                                        |
//! | -------------- | ------------------------------------------------------------ |
//! | [`scenario`]   | the scenario file, and robots and poses drawn at random      |
//! | [`plausible`]  | robots whose joints are like those of robots that mill       |
//! | [`force`]      | the milling cutter                                           |
//! | [`course`]     | the joints while the tool mills along a path                 |
//! | [`experiment`] | one cut: force, displacement and acceleration at the samples |
//! | [`linear`]     | the displacement of the linearised robot in a cut            |
//! | [`plant`]      | what a real plant has beside the model                       |
//! | [`transmission`] | noise, counters, and the frames on the bus                 |
//! | [`simulator`]  | the simulator, which does one experiment after the other     |
//! | [`candump`]    | frames into a log                                            |
//! | [`bus`]        | frames onto a CAN interface                                  |
//! | [`interface`]  | whether a CAN interface is a virtual one                     |
//! | [`true_robot`] | the robot that moves, as the model of a result describes it  |
//! | [`truth`]      | the file of the robot and the cuts that were simulated       |
//! | [`coverage`]   | the intervals of a finding that hold the truth               |
//! | [`validation`] | the errors of an identified robot                            |
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate self as flexid_simulation;

pub mod bus;
pub mod candump;
pub mod course;
pub mod coverage;
pub mod experiment;
pub mod force;
pub mod interface;
pub mod linear;
pub mod plant;
pub mod plausible;
#[cfg(test)]
mod reference;
pub mod scenario;
pub mod shipped;
pub mod simulator;
pub mod transmission;
pub mod true_robot;
pub mod truth;
pub mod validation;
