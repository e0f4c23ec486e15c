//! What a robot that was identified does in any pose: modes, receptance, compliance and deflection, each with its interval.
//!
//! | file               | what                                                                        |
//! | ------------------ | --------------------------------------------------------------------------- |
//! | `document`         | a result file of `flexid identify --json`, checked                          |
//! | `robot`            | the robot that was found, and the covariance of all that is uncertain in it |
//! | `dynamics`         | its dynamic stiffness at a pose, and the derivatives                        |
//! | `per_imperfection` | those by an imperfection                                                    |
//! | `assembly`         | the matrices of a linearised chain                                          |
//! | `bushings`         | the impedances of the bushings, the first of them on the ground             |
//! | `estimate`         | a predicted number with its standard deviation                              |
//! | `receptance`       | displacement at the tool for a force there, along the band                  |
//! | `modes`            | natural frequencies, damping ratios and shapes                              |
//! | `starts`           | where the search for the modes begins                                       |
//! | `statics`          | compliance and deflection                                                   |
//! | `compensation`     | joint offsets that take a deflection back                                   |
//! | `milling`          | the force of a cutter per displacement of the tool                          |
//! | `lobes`            | the depth of cut at which the tool chatters, by spindle speed               |
//! | `comparison`       | whether two fits of a robot agree                                           |
//!
//! An interval follows from the covariance C of the fit and the gradient g of what is predicted, `σ² = gᵀ C g` (the delta method; Casella
//! and Berger, _Statistical Inference_, 2002, section 5.5). Stiffnesses enter with the imperfections of the plant that were found with
//! them: a mass that is 2 % too high makes all stiffnesses too high, and hardly moves what is predicted.

mod assembly;
mod bushings;
pub mod comparison;
pub mod compensation;
pub mod document;
mod dynamics;
mod estimate;
pub mod lobes;
pub mod milling;
pub mod modes;
mod per_imperfection;
pub mod receptance;
mod robot;
mod starts;
pub mod statics;

pub use dynamics::Dynamics;
pub use estimate::{Estimate, PositiveEstimate, TWO_SIDED};
pub use robot::{Robot, RobotError};
