//! The weights of one bin: what makes its residual white.
//!
//! The residual of a bin carries the noise of the accelerometer and, through the accelerance H_a, that of the
//! force sensor: its covariance is `σ_a² + H_a σ_f² H_aᴴ`. Without the second no interval is honest.

use crate::linear::gram::WIDEST;
use crate::receptance::Complex;
use crate::receptance::lanes::Lanes;

/// Inverse Cholesky factor of half a bin's noise covariance (half: real and imaginary part each have unit variance
/// then), row by row below the diagonal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Whitening {
    diagonal: [f64; 3],
    /// Entries (1,0), (2,0), (2,1).
    below: [Complex<f64>; 3],
}

impl Whitening {
    /// Whitening by the mean squares of the noise per axis and the accelerance `[reading][force]`.
    pub(super) fn new(
        acceleration_noise: &[f64; 3],
        force_noise: &[f64; 3],
        accelerance: &[[Complex<f64>; 3]; 3],
    ) -> Self {
        let covariance = |i: usize, j: usize| {
            let mut sum = Complex { re: 0.0, im: 0.0 };
            for axis in 0..3 {
                let (a, b) = (accelerance[i][axis], accelerance[j][axis]);
                sum = sum + (a * b.conjugate()).scale(0.5 * force_noise[axis]);
            }
            if i == j {
                sum.re += 0.5 * acceleration_noise[i];
            }
            sum
        };
        let floor = |pivot: f64| libm::sqrt(pivot.max(f64::MIN_POSITIVE));
        // Cholesky, then the inverse of the factor, both by hand for 3×3.
        let l00 = floor(covariance(0, 0).re);
        let l10 = covariance(1, 0).scale(1.0 / l00);
        let l11 = floor(covariance(1, 1).re - l10.square());
        let l20 = covariance(2, 0).scale(1.0 / l00);
        let l21 = (covariance(2, 1) - l20 * l10.conjugate()).scale(1.0 / l11);
        let l22 = floor(covariance(2, 2).re - l20.square() - l21.square());
        let (w00, w11, w22) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
        let w10 = l10.scale(-w00 * w11);
        let w21 = l21.scale(-w11 * w22);
        let w20 = (l20.scale(w00) + l21 * w10).scale(-w22);
        Self { diagonal: [w00, w11, w22], below: [w10, w20, w21] }
    }

    /// Returns the most likely excess of the force over the measured one: `Σ_F Hᴴ C⁻¹ r`, from the noise that has been given to
    /// [`Whitening::new`] and the residual's real and imaginary parts.
    pub(super) fn force_error(
        &self,
        force_noise: &[f64; 3],
        accelerance: &[[Complex<f64>; 3]; 3],
        residual: &[[f64; 2]; 3],
    ) -> [Complex<f64>; 3] {
        let [w10, w20, w21] = self.below;
        let [x, y, z] = self.diagonal;
        // White, and back by the adjoint: the inverse of half the covariance.
        let white = self.white(residual);
        let weighed = [
            white[0].scale(x).add_mul(w10.conjugate(), white[1]).add_mul(w20.conjugate(), white[2]),
            white[1].scale(y).add_mul(w21.conjugate(), white[2]),
            white[2].scale(z),
        ];
        core::array::from_fn(|push| {
            let mut sum = Complex { re: 0.0, im: 0.0 };
            for axis in 0..3 {
                sum = sum.add_mul(accelerance[axis][push].conjugate(), weighed[axis]);
            }
            sum.scale(0.5 * force_noise[push])
        })
    }

    /// The whitened residual. Each part of it has unit variance if it is noise.
    #[inline(always)]
    pub(super) fn white(&self, residual: &[[f64; 2]; 3]) -> [Complex<f64>; 3] {
        let [r0, r1, r2] = residual.map(|[re, im]| Complex { re, im });
        let [w10, w20, w21] = self.below;
        let [x, y, z] = self.diagonal;
        [r0.scale(x), r1.scale(y).add_mul(w10, r0), r2.scale(z).add_mul(w20, r0).add_mul(w21, r1)]
    }

    /// Whitens real rows in place: `rows` holds real and imaginary part of the three axes in turn.
    #[inline(always)]
    pub(super) fn apply<const W: usize>(&self, rows: &mut [[f64; W]; 6], width: usize) {
        let [w10, w20, w21] = self.below;
        let [x, y, z] = self.diagonal;
        let [r0, i0, r1, i1, r2, i2] = rows;
        for c in 0..width {
            let (a, b) = ((r0[c], i0[c]), (r1[c], i1[c]));
            r2[c] = z * r2[c] + w20.re * a.0 - w20.im * a.1 + w21.re * b.0 - w21.im * b.1;
            i2[c] = z * i2[c] + w20.re * a.1 + w20.im * a.0 + w21.re * b.1 + w21.im * b.0;
            r1[c] = y * b.0 + w10.re * a.0 - w10.im * a.1;
            i1[c] = y * b.1 + w10.re * a.1 + w10.im * a.0;
            r0[c] = x * a.0;
            i0[c] = x * a.1;
        }
    }
}

/// The weights of as many bins as there are lanes.
pub(super) struct WhiteningOfLanes<V> {
    diagonal: [V; 3],
    below: [Complex<V>; 3],
}

impl<V: Lanes<Scalar = f64>> WhiteningOfLanes<V> {
    #[inline(always)]
    pub(super) fn new(like: V, weights: &[Whitening; WIDEST]) -> Self {
        let gather = |value: &dyn Fn(&Whitening) -> f64| {
            let mut lanes = [0.0; WIDEST];
            for (lane, weights) in lanes.iter_mut().zip(weights) {
                *lane = value(weights);
            }
            like.load(&lanes)
        };
        Self {
            diagonal: core::array::from_fn(|axis| gather(&|weights| weights.diagonal[axis])),
            below: core::array::from_fn(|entry| Complex {
                re: gather(&|weights| weights.below[entry].re),
                im: gather(&|weights| weights.below[entry].im),
            }),
        }
    }

    /// Whitens a residual, as [`Whitening::white`].
    #[inline(always)]
    pub(super) fn white(&self, [r0, r1, r2]: [Complex<V>; 3]) -> [Complex<V>; 3] {
        let [w10, w20, w21] = self.below;
        let [x, y, z] = self.diagonal;
        [r0.scale(x), r1.scale(y).add_mul(w10, r0), r2.scale(z).add_mul(w20, r0).add_mul(w21, r1)]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Complex as Dense, Matrix3};
    use proptest::prelude::*;

    use super::*;

    fn dense(value: Complex<f64>) -> Dense<f64> {
        Dense::new(value.re, value.im)
    }

    proptest! {
        /// `Wᴴ W` is the inverse of half the covariance, whose rows and columns of axes that are not measured are left out.
        #[test]
        fn equals_the_inverse_covariance_of_what_is_measured(
            parts in prop::array::uniform18(-1.0..1.0_f64),
            acceleration in prop::array::uniform3(0.01..2.0_f64),
            force in prop::array::uniform3(0.0..2.0_f64),
            measured in prop::array::uniform3(any::<bool>()),
        ) {
            let accelerance: [[Complex<f64>; 3]; 3] = core::array::from_fn(|i| {
                core::array::from_fn(|j| Complex { re: parts[6 * i + 2 * j], im: parts[6 * i + 2 * j + 1] })
            });
            let noise = core::array::from_fn(|axis| if measured[axis] { acceleration[axis] } else { f64::INFINITY });
            let whitening = Whitening::new(&noise, &force, &accelerance);
            let columns = [0, 1, 2].map(|axis| {
                let mut unit = [[0.0; 2]; 3];
                unit[axis][0] = 1.0;
                whitening.white(&unit).map(dense)
            });
            let white = Matrix3::from_fn(|row, column| columns[column][row]);
            let h = Matrix3::from_fn(|i, j| dense(accelerance[i][j]));
            let diagonal = |values: [f64; 3]| Matrix3::from_diagonal(&values.map(Dense::from).into());
            let mut covariance = (diagonal(acceleration) + h * diagonal(force) * h.adjoint()) * Dense::from(0.5);
            for axis in (0..3).filter(|axis| !measured[*axis]) {
                covariance.row_mut(axis).fill(Dense::from(0.0));
                covariance.column_mut(axis).fill(Dense::from(0.0));
                covariance[(axis, axis)] = Dense::from(1.0);
            }
            let mut expected = covariance.try_inverse().unwrap();
            for axis in (0..3).filter(|axis| !measured[*axis]) {
                expected[(axis, axis)] = Dense::from(0.0);
            }
            let gap = (white.adjoint() * white - expected).norm();
            prop_assert!(gap < 1e-9 * (1.0 + expected.norm()), "{gap:e}");
            let residual = [[0.3, -0.1], [0.2, 0.5], [-0.4, 0.1]];
            let error = whitening.force_error(&force, &accelerance, &residual);
            let r = nalgebra::Vector3::from_fn(|axis, _| Dense::new(residual[axis][0], residual[axis][1]));
            let most_likely = diagonal(force) * h.adjoint() * expected * r * Dense::from(0.5);
            for axis in 0..3 {
                prop_assert!((dense(error[axis]) - most_likely[axis]).norm() < 1e-9 * (1.0 + most_likely.norm()));
            }
        }
    }
}
