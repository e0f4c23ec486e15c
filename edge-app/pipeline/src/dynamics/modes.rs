//! Natural frequencies, damping ratios and mode shapes.
//!
//! A mode is a solution of `Z(λ) φ = 0`. With springs and dampers that do not depend on the frequency it is an eigenvalue problem, whose
//! solutions are where the inverse iteration of the whole one begins (Güttel and Tisseur, "The nonlinear eigenvalue problem", Acta
//! Numerica 26, 2017, section 4.3):
//!
//! ```text
//! λ ← λ − φᵀ Z(λ) φ / φᵀ Z'(λ) φ        x = Z(λ)⁻¹ Z'(λ) φ        φ ← x/|x|
//! f = |λ|/2π                ζ = −Re λ/|λ|    ∂λ = −φᵀ ∂Z φ / φᵀ Z'(λ) φ
//! ```

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;

use super::assembly::Matrices;
use super::at_pose::Dynamics;
use super::estimate::PositiveEstimate;
use super::place::Place;
use super::starts::{Solution, aligned};

/// Most iterations. Chosen: the convergence is cubic, and takes three to six.
const ITERATIONS: usize = 40;
/// How far beyond the highest frequency a start may lie, as a factor.
const BEYOND: f64 = 1.2;
/// Change of λ, relative, at which an iteration has converged.
const CONVERGED: f64 = 1e-12;
/// Distance of two λ, relative, that are the same mode.
const SAME: f64 = 1e-6;
/// Such a change of Newton's method for the determinant, whose result the inverse iteration refines. Chosen: below [`SAME`].
const BESIDE: f64 = 1e-8;
/// Part of |λ| by which a derivative along the imaginary axis differs.
const STEP: f64 = 1e-5;

/// A mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mode {
    /// Natural frequency, Hz.
    pub frequency_hz: PositiveEstimate,
    /// Damping ratio.
    pub damping_ratio: PositiveEstimate,
    /// Part of the strain energy in each degree of freedom of each joint, base first, `tx ty tz rx ry rz`. The sum is 1.
    pub energy: Vec<[f64; 6]>,
    /// Motion of the tool along its axes: translation and rotation, real and imaginary part, scaled to unit modal mass, 1/√kg and
    /// rad/(m √kg).
    pub tool: [[f64; 2]; 6],
}

impl Dynamics<'_> {
    /// The modes whose natural frequency is at most `highest_hz`, in ascending order. A mode that damping has made aperiodic is
    /// left out. Of modes whose λ are equal to a millionth, as of a symmetric robot, one is listed.
    pub fn modes(&self, highest_hz: f64) -> Vec<Mode> {
        let solutions = self.solutions(highest_hz).into_iter();
        solutions.map(|(lambda, shape)| self.mode(lambda, &shape)).collect()
    }

    /// The first of [`Dynamics::modes`].
    pub fn lowest_mode(&self, highest_hz: f64) -> Option<Mode> {
        let (lambda, shape) = self.solutions(highest_hz).into_iter().next()?;
        Some(self.mode(lambda, &shape))
    }

    /// λ and φ of the modes, the lowest first.
    fn solutions(&self, highest_hz: f64) -> Vec<Solution> {
        let mut found: Vec<Solution> = Vec::new();
        for (start, shape) in self.starts(BEYOND * TAU * highest_hz) {
            let is_new = |own: &Solution| found.iter().all(|other| !is_same(other.0, own.0));
            // If two starts lead to one mode, the second seeks another beside those that are found.
            let solution = self.mode_near(start, shape).filter(is_new).or_else(|| {
                let lambda = self.eigenvalue_beside(start, &found)?;
                let shape = aligned(self.stiffness(Place::At(lambda)))?;
                self.mode_near(lambda, shape).filter(is_new)
            });
            found.extend(solution);
        }
        found.retain(|(lambda, _)| lambda.im > 0.0 && lambda.norm() <= TAU * highest_hz);
        found.sort_by(|(a, _), (b, _)| a.norm().total_cmp(&b.norm()));
        found
    }

    /// λ near this one where `det Z` is zero, beside those that are found: Newton's method for `det Z` over the product of `λ − λₖ`
    /// (Maehly, 1954). `None` if it does not converge.
    ///
    /// ```text
    /// λ ← λ − 1/(tr Z⁻¹ Z' − Σₖ 1/(λ − λₖ))
    /// ```
    fn eigenvalue_beside(
        &self,
        mut lambda: Complex<f64>,
        found: &[Solution],
    ) -> Option<Complex<f64>> {
        for _ in 0..ITERATIONS {
            let solved = self.stiffness(Place::At(lambda)).lu().solve(&self.slope(lambda))?;
            let others: Complex<f64> = found.iter().map(|(own, _)| (lambda - own).inv()).sum();
            let step = (solved.trace() - others).inv();
            lambda -= step;
            if !lambda.norm().is_finite() {
                return None;
            }
            if step.norm() <= BESIDE * lambda.norm() {
                return Some(lambda);
            }
        }
        None
    }

    /// λ and φ of the mode near these. `None` if the iteration does not converge.
    fn mode_near(
        &self,
        mut lambda: Complex<f64>,
        mut shape: DVector<Complex<f64>>,
    ) -> Option<Solution> {
        for _ in 0..ITERATIONS {
            let (z, slope) = (self.stiffness(Place::At(lambda)), self.slope(lambda));
            let step = shape.dot(&(z * &shape)) / shape.dot(&(&slope * &shape));
            lambda -= step;
            if !lambda.norm().is_finite() {
                return None;
            }
            if step.norm() <= CONVERGED * lambda.norm() {
                return Some((lambda, shape));
            }
            // At the solution itself Z has no inverse.
            let solved = self.stiffness(Place::At(lambda)).lu().solve(&(slope * &shape));
            if let Some(solved) = solved {
                let norm = solved.norm();
                if norm.is_finite() && norm > 0.0 {
                    shape = solved.unscale(norm);
                }
            }
        }
        None
    }

    /// `Z'(λ)`.
    fn slope(&self, lambda: Complex<f64>) -> DMatrix<Complex<f64>> {
        let by = Complex::new(0.0, STEP * lambda.norm());
        let [above, below] = [lambda + by, lambda - by].map(|at| self.bushings(Place::At(at)));
        let change = above.matrix() - below.matrix();
        let Matrices { mass, damping, .. } = self.matrices();
        let of_bushings = change / (2.0 * by);
        mass.map(|entry| 2.0 * lambda * entry) + damping.map(Complex::from) + of_bushings
    }

    fn mode(&self, lambda: Complex<f64>, shape: &DVector<Complex<f64>>) -> Mode {
        let size = lambda.norm();
        let slope = shape.dot(&(self.slope(lambda) * shape));
        let column = DMatrix::from_column_slice(shape.len(), 1, shape.as_slice());
        let per = self.per_coordinate(Place::At(lambda), &column);
        // ∂ ln λ: its real part is that of ln |λ|. With λ = |λ| (−ζ + i √(1 − ζ²)), ∂ζ = √(1 − ζ²) times its imaginary part.
        let relative: Vec<Complex<f64>> =
            per.iter().map(|own| -own[(0, 0)] / slope / lambda).collect();
        let std = |part: fn(&Complex<f64>) -> f64| {
            let gradient = DVector::from_iterator(relative.len(), relative.iter().map(part));
            self.robot().std_of(&gradient)
        };
        let ratio = -lambda.re / size;
        let ratio_std = (1.0 - ratio * ratio).max(0.0).sqrt() * std(|own| own.im);
        let bushings = self.bushings(Place::At(lambda));
        let elongations = bushings.elongations(&column);
        let energies: Vec<f64> = elongations
            .iter()
            .zip(&bushings.springs)
            .map(|(own, spring)| own.norm_sqr() * spring.re)
            .collect();
        let total: f64 = energies.iter().sum();
        let (of_joints, _) = energies.as_chunks::<6>();
        // Unit modal mass: φᵀ Z'(λ) φ = 2 λ.
        let scale = (2.0 * lambda / slope).sqrt();
        let tool = self.matrices().tip.map(Complex::from).transpose() * shape;
        Mode {
            frequency_hz: PositiveEstimate::new(size / TAU, std(|own| own.re)),
            damping_ratio: PositiveEstimate::new(ratio, ratio_std / ratio),
            energy: of_joints.iter().map(|own| own.map(|energy| energy / total)).collect(),
            tool: std::array::from_fn(|axis| {
                let own = tool[axis] * scale;
                [own.re, own.im]
            }),
        }
    }
}

/// Returns whether two λ are of the same mode.
fn is_same(a: Complex<f64>, b: Complex<f64>) -> bool {
    (a - b).norm() <= SAME * b.norm()
}

#[cfg(test)]
mod tests {
    use flexid_core::receptance;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::super::bushings;
    use super::super::fixture::{found, robot};
    use super::*;

    /// Corners of a rectangle of λ that holds modes, rad/s. Its lower side is above those that are nearly aperiodic.
    const REAL: [f64; 2] = [-80.0, 20.0];
    const IMAGINARY: [f64; 2] = [TAU * 3.0, TAU * 90.0];
    /// Natural frequency up to which modes are sought: that of the farthest corner.
    const HIGHEST_HZ: f64 = 91.0;
    /// Points on each of its sides.
    const POINTS: usize = 1000;

    /// Zeros of `det Z det(I + G z)/Π gᵢ` in the rectangle: the turns of its argument along the border. G are the compliances g of the ground
    /// with its base, turned to the axes of the first joint. Without the last two factors there are poles, where the base moves between ground
    /// and a link at rest.
    fn zeros(at: &Dynamics<'_>) -> f64 {
        let [[left, right], [low, high]] = [REAL, IMAGINARY];
        let corners = [(left, low), (right, low), (right, high), (left, high), (left, low)];
        let corners = corners.map(|(re, im)| Complex::new(re, im));
        let scale: DVector<f64> =
            at.stiffness(at.at_rest()).diagonal().map(|own| own.norm().sqrt().recip());
        let border = corners.windows(2).flat_map(|side| {
            (0..POINTS).map(|point| side[0] + (side[1] - side[0]) * (point as f64 / POINTS as f64))
        });
        let values: Vec<Complex<f64>> = border
            .map(|s| {
                let z = at.stiffness(Place::At(s));
                let n = z.nrows();
                let scaled = DMatrix::from_fn(n, n, |i, j| z[(i, j)] * scale[i] * scale[j]);
                scaled.determinant() * of_ground(at, s)
            })
            .collect();
        let next = values.iter().cycle().skip(1);
        values.iter().zip(next).map(|(own, next)| (next / own).arg()).sum::<f64>() / TAU
    }

    /// `det(I + G z)/Π gᵢ`, apart from a positive factor.
    fn of_ground(at: &Dynamics<'_>, s: Complex<f64>) -> Complex<f64> {
        let mechanics = at.mechanics();
        let of_core = |own: receptance::Complex<f64>| Complex::new(own.re, own.im);
        let Some(ground) = mechanics.ground(receptance::Complex { re: s.re, im: s.im }) else {
            return 1.0.into();
        };
        let bushings = at.bushings(Place::At(s));
        let z = (bushings.springs + bushings.dampers).fixed_rows::<6>(0).into_owned();
        let part = bushings::part(mechanics, Place::At(s), &z).unwrap();
        let units = ground.map(|own| of_core(own).inv() * 1e-9);
        units.into_iter().product::<Complex<f64>>() / part.determinant()
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(24) })]

        /// Cauchy's argument principle.
        #[test]
        fn no_mode_is_missing(
            factors in prop::collection::vec(0.5..2.0, 72),
            pose in prop::collection::vec(-1.0..1.0, 6),
            hysteresis in 0.0..0.6,
            servo in 0.0..0.1,
            ground in prop_oneof![Just(0.0), 1e-10..3e-8],
        ) {
            let robot = robot(found(hysteresis, servo, ground), &factors);
            let at = robot.at(&pose).unwrap();
            let inside = |lambda: Complex<f64>| {
                let within = |value: f64, [low, high]: [f64; 2]| low < value && value < high;
                within(lambda.re, REAL) && within(lambda.im, IMAGINARY)
            };
            let found = at.solutions(HIGHEST_HZ).iter().filter(|(lambda, _)| inside(*lambda)).count();
            let zeros = zeros(&at);
            prop_assert!((zeros - found as f64).abs() < 1e-6, "{found} of {zeros}");
            prop_assert!(found >= 4);
        }
    }
}
