//! Robots of one type as a population, and the robots that lie outside it.
//!
//! ```text
//! ln θ(i) = y(i) + A(i) ν + e(i)        e(i) ~ N(0, S(i))        ν ~ N(0, 1), the same in all robots
//! ln θ(i) ~ N(μ, T)                     T diagonal
//! ```
//!
//! ν are the errors of the model that all robots of a type share: masses, their places and spreads, elastic centres. They are estimated once, as in
//! [`history`](crate::history). What is not known of them is in the spread, and in each interval. Gains, delays and mounting are each robot's own
//! and stand in S. Where one set of sensors goes from robot to robot, intervals are too wide rather than too narrow.
//!
//! T is diagonal: a full one has more entries (36 × 37 / 2 for three joints) than a fleet of some ten robots can determine, and each parameter is
//! judged by itself. The others predict what a robot's finding says with the variance `V = S + τ² + var μ̂`, of which τ² and var μ̂ are estimates, and a t
//! distribution. Its freedoms are those of V (Satterthwaite), and no more than those of the others' scatter, one fewer than they are. Holm's method shares the
//! level among all robots and parameters. A robot that is outside leaves the population in that parameter, and all are judged again, until none is found.
//!
//! The next robot lies within `μ̂ ± t √(τ² + var μ̂)`, with two freedoms fewer than robots (J. P. T. Higgins, S. G. Thompson and D. J. Spiegelhalter,
//! "A re-evaluation of random-effects meta-analysis", Journal of the Royal Statistical Society A 172, 2009).
//!
//! | file         | what                                          |
//! | ------------ | --------------------------------------------- |
//! | `population` | mean and spread of one parameter              |
//! | `judging`    | each robot by the others                      |
//! | `reading`    | the fleet of result files                     |

mod judging;
mod population;
mod reading;

pub use judging::{Judged, Member, OTHERS, Population, Shown, populations};
pub use reading::{Fleet, Parameter, fleet};
