//! Motion of a robot that was found, in any pose: modes, receptance, compliance and deflection, each with its interval.
//!
//! | file               | what                                                                        |
//! | ------------------ | --------------------------------------------------------------------------- |
//! | `robot`            | the robot that was found, and the covariance of all that is uncertain in it |
//! | `at_pose`          | its dynamic stiffness at a pose, and the derivatives                        |
//! | `place`            | where that is evaluated                                                     |
//! | `per_imperfection` | those by an imperfection                                                    |
//! | `assembly`         | the matrices of a linearised chain                                          |
//! | `bushings`         | the impedances of the bushings, the first of them on the ground             |
//! | `estimate`         | a predicted number with its standard deviation                              |
//! | `receptance`       | displacement at the tool for a force there, along the band                  |
//! | `modes`            | natural frequencies, damping ratios and shapes                              |
//! | `starts`           | where the search for the modes begins                                       |
//! | `statics`          | compliance, stiffness and deflection                                        |
//!
//! An interval follows from the covariance C of the fit and the gradient g of what is predicted, `σ² = gᵀ C g` (the delta method; Casella
//! and Berger, _Statistical Inference_, 2002, section 5.5). Stiffnesses enter with the imperfections of the plant that were found with
//! them: a mass that is 2 % too high makes all stiffnesses too high, and hardly moves what is predicted.

mod assembly;
mod at_pose;
mod bushings;
mod estimate;
#[cfg(test)]
mod fixture;
pub mod modes;
mod per_imperfection;
mod place;
pub mod receptance;
mod robot;
mod starts;
pub mod statics;

pub use at_pose::{Dynamics, Response};
pub use estimate::{Estimate, PositiveEstimate, TWO_SIDED, root};
pub use place::Place;
pub use robot::{OF_JOINT, Robot, RobotError};
