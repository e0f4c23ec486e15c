//! Minima of functions that are known: Rosenbrock's within bounds, and a quadratic.

use fearless_simd::Level;

use super::*;
use crate::linear::packed::packed;
use crate::refine::proposal::Room;
use crate::sought::MAX_UNKNOWNS;

/// Length of the normal equations of two unknowns.
const L: usize = packed(3);
/// Standard deviation of the residuals of [`Rosenbrock`].
const NOISE: f64 = 1e-3;

/// Points of the plane, within bounds of each coordinate.
struct Rectangle([[f64; 2]; 2]);

impl Domain for Rectangle {
    type Point = [f64; 2];

    fn level(&self) -> Level {
        Level::new()
    }

    fn room(&self, point: &[f64; 2]) -> Room {
        let mut room = [[0.0; 2]; MAX_UNKNOWNS];
        for (room, (bounds, value)) in room.iter_mut().zip(self.0.iter().zip(point)) {
            *room = bounds.map(|bound| bound - value);
        }
        room
    }

    fn advance(&self, point: &[f64; 2], step: &Step) -> [f64; 2] {
        [point[0] + step[0], point[1] + step[1]]
    }
}

/// `(10 (y − x²))² + (1 − x)²`, over the variance of the noise (Rosenbrock, "An automatic method for finding the greatest or least
/// value of a function", Computer Journal 3, 1960).
struct Rosenbrock;

impl Objective<[f64; 2], L> for Rosenbrock {
    type Error = ();

    fn cost(&mut self, [x, y]: &[f64; 2]) -> f64 {
        let [a, b] = [10.0 * (y - x * x), 1.0 - x];
        (a * a + b * b) / (NOISE * NOISE)
    }

    fn linearise(&mut self, [x, y]: &[f64; 2], normal: &mut Normal<L>) -> Result<(), ()> {
        normal.reset(2);
        let mut rows = [[0.0; 3]; 6];
        // Minus the derivatives of a residual, then the residual.
        rows[0] = [20.0 * x, -10.0, 10.0 * (y - x * x)].map(|entry| entry / NOISE);
        rows[1] = [1.0, 0.0, 1.0 - x].map(|entry| entry / NOISE);
        normal.add(&rows);
        Ok(())
    }
}

/// The minimum of Rosenbrock's function inside the bounds; at the bound of x the best y is x², at that of y the derivative by x
/// is `−400 x (y − x²) − 2 (1 − x)`.
#[test]
fn rosenbrocks_minimum_is_found_within_bounds() {
    const WIDE: [f64; 2] = [-3.0, 3.0];
    for (start, bounds, expected) in [
        ([-1.2, 1.0], [WIDE, WIDE], [1.0, 1.0]),
        ([2.5, -2.0], [WIDE, WIDE], [1.0, 1.0]),
        ([-1.2, 1.0], [[-3.0, 0.5], WIDE], [0.5, 0.25]),
        ([-1.2, 1.0], [[-3.0, -0.5], WIDE], [-0.5, 0.25]),
        ([2.5, 0.0], [[1.5, 3.0], WIDE], [1.5, 2.25]),
        ([2.5, 0.0], [[1.5, 3.0], [-3.0, 2.0]], [1.5, 2.0]),
    ] {
        let domain = Rectangle(bounds);
        let mut minimiser = LevenbergMarquardt::<L>::new(Limits::OF_REFINEMENT);
        let mut point = start;
        let mut cost = Rosenbrock.cost(&point);
        let outcome = loop {
            let outcome = minimiser.step(&domain, &mut Rosenbrock, &mut point).unwrap();
            let reached = Rosenbrock.cost(&point);
            assert!(reached <= cost, "{start:?}: {reached} after {cost}");
            cost = reached;
            for (value, [lower, upper]) in point.iter().zip(bounds) {
                assert!((lower - 1e-12..=upper + 1e-12).contains(value), "{point:?}");
            }
            if outcome != Outcome::Improving {
                break outcome;
            }
        };
        assert_eq!(outcome, Outcome::Converged, "{start:?} {point:?}");
        let off = (0..2).map(|i| (point[i] - expected[i]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-4, "{start:?}: {point:?} instead of {expected:?}");
    }
}

/// A quadratic whose normal equations are given.
struct Quadratic {
    normal: Normal<L>,
}

impl Objective<[f64; 2], L> for Quadratic {
    type Error = ();

    fn cost(&mut self, _: &[f64; 2]) -> f64 {
        self.normal.sum_of_squares()
    }

    fn linearise(&mut self, _: &[f64; 2], normal: &mut Normal<L>) -> Result<(), ()> {
        normal.clone_from(&self.normal);
        Ok(())
    }
}

/// Two unknowns that the data hardly separate: a damped step along their difference gains next to nothing, and yet a
/// quarter of a standard deviation is left to the minimum.
#[test]
fn a_damped_step_that_gains_nothing_is_no_end() {
    let domain = Rectangle([[-10.0, 10.0]; 2]);
    let outcome = |way: f64, refused: bool| {
        let mut normal = Normal::new();
        normal.reset(2);
        // N = [[1e8, 1e8 - 1], [1e8 - 1, 1e8]], and g = N x with x along the difference.
        for (i, j, entry) in
            [(0, 0, 1e8), (1, 0, 1e8 - 1.0), (1, 1, 1e8), (2, 0, way), (2, 1, -way)]
        {
            *normal.entry(i, j) = entry;
        }
        let mut point = [0.0; 2];
        let mut minimiser =
            LevenbergMarquardt { refused, ..LevenbergMarquardt::new(Limits::OF_REFINEMENT) };
        let first = minimiser.damping;
        let (_, damped) = propose(domain.level(), &normal, &domain.room(&point), first.value());
        assert!(damped < Limits::OF_REFINEMENT.negligible, "{damped}");
        let outcome = minimiser.step(&domain, &mut Quadratic { normal }, &mut point).unwrap();
        let left = minimiser.remaining(&domain, &point).gain;
        assert!((left - 2.0 * way * way).abs() < 1e-6, "{left}");
        (outcome, minimiser.damping.value() / first.value())
    };
    assert_eq!(outcome(0.18, false), (Outcome::Improving, 0.1));
    // Steps that go further have been tried, and were no good.
    assert_eq!(outcome(0.18, true).0, Outcome::Exhausted);
    assert_eq!(outcome(0.006, false).0, Outcome::Converged);
    assert_eq!(outcome(0.006, true).0, Outcome::Converged);
}
