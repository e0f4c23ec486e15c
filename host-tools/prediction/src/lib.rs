//! What a robot that was identified does in any pose: modes, receptance, compliance and deflection, each with its interval.
//!
//! | file         | what                                                                          |
//! | ------------ | ----------------------------------------------------------------------------- |
//! | `document`   | a result file of `flexid identify --json`, checked                            |
//! | `robot`      | the robot that was found, and the covariance of all that is uncertain in it   |
//! | `dynamics`   | its dynamic stiffness at a pose, and the derivatives                          |
//! | `assembly`   | the matrices of a linearised chain                                            |
//! | `estimate`   | a predicted number with its standard deviation                                |
//! | `receptance` | displacement at the tool for a force there, along the band                    |
//! | `modes`      | natural frequencies, damping ratios and shapes                                |
//! | `statics`    | compliance and deflection                                                     |
//!
//! An interval follows from the covariance C of the fit and the gradient g of what is predicted, `σ² = gᵀ C g` (the delta method; Casella
//! and Berger, _Statistical Inference_, 2002, section 5.5). Stiffnesses enter with the imperfections of the plant that were found with
//! them: a mass that is 2 % too high makes all stiffnesses too high, and hardly moves what is predicted.

mod assembly;
pub mod document;
mod dynamics;
mod estimate;
pub mod modes;
pub mod receptance;
mod robot;
pub mod statics;

pub use dynamics::Dynamics;
pub use estimate::{Estimate, PositiveEstimate, TWO_SIDED};
pub use robot::{Robot, RobotError};
