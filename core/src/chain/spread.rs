//! The spread of a link's mass about its centre, and errors of it.
//!
//! The second moment S of the mass and the inertia I determine each other, and I is that of a body if S is positive:
//!
//! ```text
//! S = ½ tr I − I          I = tr S − S          S = C Cᵀ          S' = C e^P Cᵀ
//! ```
//!
//! Any symmetric P leaves S positive. It is an error in units of the spread itself, whatever the axes: its size `√(Σ P_ij²)` is a distance
//! between the two (Lee, Wensing and Park, "Geometric robot dynamic identification", IEEE Transactions on Robotics 36, 2020).

use nalgebra::Matrix3;

/// Number of entries of P: three along the axes, then xy, xz and yz.
pub(crate) const SPREADS: usize = 6;
/// Axes of the entries beside the diagonal.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Returns the inertia whose second moment differs by `value` in this entry of P. Those beside the diagonal have `value/√2` on each side, so that each
/// entry has the same size.
///
/// # Panics
/// If there is no such entry.
pub(crate) fn spread_by(inertia: &Matrix3<f64>, entry: usize, value: f64) -> Matrix3<f64> {
    let c = root(&(Matrix3::from_diagonal_element(0.5 * inertia.trace()) - inertia));
    let product = |i: usize, j: usize| c.column(i) * c.column(j).transpose();
    let change = if entry < 3 {
        product(entry, entry) * libm::expm1(value)
    } else {
        let [i, j] = PAIRS[entry - 3];
        let half = value * core::f64::consts::FRAC_1_SQRT_2;
        (product(i, i) + product(j, j)) * (libm::cosh(half) - 1.0)
            + (product(i, j) + product(j, i)) * libm::sinh(half)
    };
    inertia + Matrix3::from_diagonal_element(change.trace()) - change
}

/// Lower triangle whose product with its transpose this is. Where a file has rounded the moments of a flat body, so that this is not quite positive, no
/// diagonal entry of the product is larger than its own.
fn root(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let mut c = Matrix3::zeros();
    for j in 0..3 {
        let dot = |c: &Matrix3<f64>, i: usize| (0..j).map(|k| c[(i, k)] * c[(j, k)]).sum::<f64>();
        let pivot = libm::sqrt((matrix[(j, j)] - dot(&c, j)).max(0.0));
        c[(j, j)] = pivot;
        for i in j + 1..3 {
            let used: f64 = (0..j).map(|k| c[(i, k)] * c[(i, k)]).sum();
            let most = libm::sqrt((matrix[(i, i)] - used).max(0.0));
            let entry = (matrix[(i, j)] - dot(&c, i)) / pivot;
            c[(i, j)] = if pivot > 0.0 { entry.clamp(-most, most) } else { 0.0 };
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};
    use proptest::prelude::*;

    use super::*;

    /// Returns the inertia of point masses about the origin.
    fn inertia(points: &[f64; 12]) -> Matrix3<f64> {
        let points = points.as_chunks::<3>().0.iter().map(|own| Vector3::from(*own));
        points.map(|at| Matrix3::identity() * at.norm_squared() - at * at.transpose()).sum()
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// A flat body whose moments are rounded moves by no more than its error.
        #[test]
        fn a_rounded_body_moves_by_its_error(
            moments in prop::array::uniform2(0.01..1.0_f64), excess in 0.0..0.05_f64, turn in prop::array::uniform3(-3.0..3.0_f64),
            entry in 0..SPREADS, value in -0.5..0.5_f64,
        ) {
            let [x, y] = moments;
            let turn = Rotation3::new(turn.into());
            let moments = Matrix3::from_diagonal(&Vector3::new(x, y, (x + y) * (1.0 + excess)));
            let before = turn * moments * turn.inverse();
            let change = (spread_by(&before, entry, value) - before).trace();
            let most = libm::expm1(value.abs()) * (1.0 + 2.0 * excess) * before.trace();
            prop_assert!(change.abs() <= most, "{} {}", change, most);
        }

        /// Any error leaves the inertia that of a body; none leaves it as it is.
        #[test]
        fn a_body_stays_a_body(
            points in prop::array::uniform12(-1.0..1.0_f64), entry in 0..SPREADS, value in -1.5..1.5_f64,
        ) {
            let before = inertia(&points);
            let after = spread_by(&before, entry, value);
            prop_assert_eq!(spread_by(&before, entry, 0.0), before);
            let second = |own: &Matrix3<f64>| Matrix3::from_diagonal_element(0.5 * own.trace()) - own;
            prop_assert!(second(&after).symmetric_eigenvalues().min() > -1e-12);
            let ratio = second(&after).determinant() / second(&before).determinant();
            let expected = if entry < 3 { libm::exp(value) } else { 1.0 };
            prop_assert!((ratio / expected - 1.0).abs() < 1e-6, "{} {}", ratio, expected);
            if entry < 3 {
                let back = spread_by(&after, entry, -value);
                prop_assert!((back - before).amax() < 1e-9 * before.amax());
            }
        }
    }

    /// The same error of all three axes is a factor.
    #[test]
    fn a_factor_is_an_error_along_all_axes() {
        let before = inertia(&[0.3, -0.2, 0.5, -0.4, 0.1, 0.2, 0.7, 0.6, -0.3, 0.1, -0.8, 0.2]);
        let after = (0..3).fold(before, |own, axis| spread_by(&own, axis, 0.3));
        assert!((after - before * libm::exp(0.3)).amax() < 1e-12);
    }
}
