//! Interface of a minimisation: the domain of its points, and the sum of squares.

use fearless_simd::Level;

use super::proposal::{Room, Step};
use crate::linear::normal::Normal;
use crate::sought::MAX_UNKNOWNS;

/// Points among which a minimum is sought, and the steps between them, of at most `N` unknowns.
pub(crate) trait Domain<const N: usize = MAX_UNKNOWNS> {
    /// A point.
    type Point: Copy;

    /// Instruction set.
    fn level(&self) -> Level;

    /// How far a step from `point` may go.
    fn room(&self, point: &Self::Point) -> Room<N>;

    /// The point to which a step from `point` leads. It may be bent, but its derivative at zero is the identity.
    fn advance(&self, point: &Self::Point, step: &Step<N>) -> Self::Point;
}

/// A sum of squares of residuals, which depends on a point. `L` is the length of its [normal equations](Normal).
pub(crate) trait Objective<Point, const L: usize> {
    /// Why the residuals have no derivatives at a point.
    type Error;

    /// Sum of squares at `point`; infinite where there is none.
    fn cost(&mut self, point: &Point) -> f64;

    /// Normal equations of a step from `point`, where [`Objective::cost`] was evaluated last.
    ///
    /// # Errors
    ///
    /// There are no derivatives at `point`, where the cost then is infinite.
    fn linearise(&mut self, point: &Point, normal: &mut Normal<L>) -> Result<(), Self::Error>;
}
