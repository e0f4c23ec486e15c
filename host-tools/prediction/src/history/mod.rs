//! What changed in a robot, over findings of separate records.
//!
//! ```text
//! ln θ(i) = y(i) + A(i) ν + e(i)        e(i) ~ N(0, S(i))        ν ~ N(0, 1), the same in all findings
//! Δ = Σ cᵢ ln θ(i),  Σ cᵢ = 0           var Δ = Σ cᵢ² S(i) + gᵀ (1 + Σ Λ(i))⁻¹ g        g = Σ cᵢ A(i)
//! ```
//!
//! ν are the errors that findings share: gains, mounting, masses. Those that act alike in all findings have g = 0 and cancel in a change
//! (random effects that are common to all; Gelman and others, _Bayesian Data Analysis_, 2013, section 14.8). Findings of files that do not
//! state what they share are taken as independent; their intervals are too wide rather than too narrow. Where findings scatter by more
//! than they state, intervals are wider by as much.
//!
//! | file        | what                                                             |
//! | ----------- | ---------------------------------------------------------------- |
//! | `series`    | one parameter through the findings: means, steps, lines          |
//! | `detection` | when a parameter changed                                         |
//! | `course`    | how it changed: by steps, or along a line                        |
//! | `reading`   | that of result files                                             |

mod course;
mod detection;
mod reading;
mod series;

pub use course::{Course, Line, Point, Step};
pub use reading::{History, Parameter, history};

pub use crate::findings::{Epoch, Posterior};

/// How each of so many parameters went over these findings, at these times, in any unit, ascending. `level` is the chance of a false change
/// of any parameter in the robot's life.
pub fn courses(epochs: &[Epoch], times: &[f64], level: f64) -> Vec<Option<Course>> {
    let Some(first) = epochs.first() else { return Vec::new() };
    let (parameters, errors) = first.slopes.shape();
    let detected = detection::detect(epochs, parameters, errors, level);
    let each = detected.series.iter().zip(&detected.alarms);
    each.map(|(series, alarms)| Course::new(series, alarms, times, &detected.pool)).collect()
}
