//! Directions of the unknowns that the data determine badly: which unknowns trade off against each other.

use core::ops::Range;

use heapless::Vec;

use super::WEAK;
use super::rank::{RANK, determined_of};
use crate::MAX_UNKNOWNS;
use crate::linear::jacobi::Eigen;
use crate::linear::normal::Normal;

/// Most directions that are reported. Chosen: those with the largest deviations.
pub const MAX_DIRECTIONS: usize = 8;
/// Most unknowns that a direction names. Chosen: those with the largest components.
const MAX_SHARES: usize = 6;
/// Least component of an unknown that a direction names, as a part of the largest. Chosen: a smaller one has less than 1 % of the largest one's
/// square.
const NAMED: f32 = 0.1;

/// A combination of unknowns that the data determine badly: an eigenvector of the information matrix, and the standard deviation
/// along it.
///
/// The undetermined directions are a space. They are chosen so that each has an unknown that no other of them has, rather than at
/// right angles to each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    /// Standard deviation along it, of unit length, in the unit of the unknowns: of a logarithm; infinite where the
    /// data do not determine it at all.
    pub deviation: f64,
    /// The unknowns that take part most, by index, with their component (the unit length is that of all components,
    /// named or not), largest first, the first one positive.
    pub shares: Vec<(u8, f32), MAX_SHARES>,
}

impl Direction {
    /// Along `vector`, of any length.
    fn new(deviation: f64, vector: &[f32]) -> Self {
        let length = libm::sqrtf(vector.iter().map(|x| x * x).sum());
        let mut shares = Vec::new();
        for (i, component) in (0..).zip(vector) {
            let share = (i, component / length);
            insert(&mut shares, share, |a, b| a.1.abs() > b.1.abs());
        }
        let largest = shares.first().map_or(0.0, |share| share.1);
        shares.retain_mut(|(_, share)| {
            let named = share.abs() >= NAMED * largest.abs();
            *share *= largest.signum();
            named
        });
        Self { deviation, shares }
    }

    /// The larger deviation goes first. Of two undetermined directions a combination does: that a single unknown is undetermined
    /// also shows in its variance.
    fn before(&self, other: &Self) -> bool {
        let combined = |direction: &Self| direction.shares.len() > 1;
        self.deviation > other.deviation
            || self.deviation == other.deviation && combined(self) && !combined(other)
    }
}

/// Directions whose deviation exceeds [`WEAK`], the largest first, from an information matrix from which no unknown has been
/// eliminated. Single undetermined unknowns are left out if they are not `asked` for.
pub(crate) fn weak_directions<const L: usize>(
    information: &Normal<L>,
    asked: impl Fn(usize) -> bool,
) -> Vec<Direction, MAX_DIRECTIONS> {
    let determined = determined_of(information);
    let entry = |i: usize, j: usize| {
        if determined[i] && determined[j] { information.row(i)[j] } else { 0.0 }
    };
    let mut eigen = Eigen::of(information.unknowns(), entry);
    let mut directions = Vec::new();
    let mut undetermined = 0;
    for k in 0..information.unknowns() {
        let (value, vector) = (eigen.value(k), eigen.vector(k));
        // The information along the direction if the unknowns were not correlated: the size of the terms that cancel.
        let alone: f64 = (0..).zip(vector).map(|(i, &x)| f64::from(x * x) * entry(i, i)).sum();
        if value > RANK * alone {
            let deviation = 1.0 / libm::sqrt(value);
            if deviation > WEAK {
                insert(&mut directions, Direction::new(deviation, vector), Direction::before);
            }
        } else {
            eigen.vectors.swap(undetermined, k);
            undetermined += 1;
        }
    }
    let null_space = &mut eigen.vectors[..undetermined];
    simplify(null_space);
    for vector in null_space {
        let direction = Direction::new(f64::INFINITY, vector);
        if matches!(direction.shares[..], [(unknown, _)] if !asked(usize::from(unknown))) {
            continue;
        }
        insert(&mut directions, direction, Direction::before);
    }
    directions
}

/// Gauss-Jordan elimination of a basis, so that each of its vectors has an unknown for itself.
fn simplify(basis: &mut [[f32; MAX_UNKNOWNS]]) {
    for next in 0..basis.len() {
        // The unknown that takes most part in the vectors that are left, and the vector it takes most part in.
        let part = |i: usize| basis[next..].iter().map(|vector| vector[i] * vector[i]).sum();
        let unknown = largest(0..MAX_UNKNOWNS, part);
        let row = largest(next..basis.len(), |row| basis[row][unknown].abs());
        basis.swap(next, row);
        let pivot = basis[next].map(|x| x / basis[next][unknown]);
        for vector in basis.iter_mut() {
            let factor = vector[unknown];
            for (x, pivot) in vector.iter_mut().zip(&pivot) {
                *x -= factor * pivot;
            }
        }
        basis[next] = pivot;
    }
}

/// Index of the largest; the first of equals.
fn largest(mut range: Range<usize>, size: impl Fn(usize) -> f32) -> usize {
    let first = range.next().unwrap_or_default();
    range.fold(first, |best, i| if size(i) > size(best) { i } else { best })
}

/// Inserts an item where it belongs into a sorted list of the first few; those that it pushes off the end are lost.
fn insert<T, const N: usize>(list: &mut Vec<T, N>, item: T, before: impl Fn(&T, &T) -> bool) {
    let place = list.iter().position(|other| before(&item, other)).unwrap_or(list.len());
    if place == N {
        return;
    }
    if list.is_full() {
        list.pop();
    }
    // There is room now.
    let _ = list.insert(place, item);
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::super::testing::{information, jacobian};
    use super::*;

    fn weak(matrix: &DMatrix<f64>) -> Vec<Direction, MAX_DIRECTIONS> {
        weak_directions(&information(matrix), |_| true)
    }

    /// Returns whether the direction consists of these shares, up to its sign.
    fn consists_of(direction: &Direction, shares: &[(u8, f32)]) -> bool {
        let share = |i: u8| direction.shares.iter().find(|share| share.0 == i).map(|share| share.1);
        let sign = shares.first().and_then(|first| share(first.0)).map_or(0.0, f32::signum);
        let close = |x: f32, y: f32| (sign * x - y).abs() < 1e-5;
        direction.shares.len() == shares.len()
            && shares.iter().all(|&(i, expected)| share(i).is_some_and(|x| close(x, expected)))
    }

    const HALF: f32 = core::f32::consts::FRAC_1_SQRT_2;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

        /// Known eigenvectors, repeated eigenvalues among them: the weak ones, weakest first, and no other.
        #[test]
        fn are_the_eigenvectors_of_large_deviation(entries in vec(-1.0_f64..1.0, 9 * 9)) {
            let basis = DMatrix::from_row_slice(9, 9, &entries).qr().q();
            let deviations = [40.0, 3.0, 0.5, 0.5, 0.31, 0.29, 0.1, 0.01, 1e-3_f64];
            let values = DVector::from_iterator(9, deviations.iter().map(|x| x.powi(-2)));
            let directions = weak(&(&basis * DMatrix::from_diagonal(&values) * basis.transpose()));
            prop_assert_eq!(directions.len(), 5);
            for (k, direction) in directions.iter().enumerate() {
                prop_assert!((direction.deviation / deviations[k] - 1.0).abs() < 1e-6);
                prop_assert!(direction.shares.is_sorted_by(|a, b| a.1.abs() >= b.1.abs()));
                prop_assert!(direction.shares[0].1 > 0.0);
                if [2, 3].contains(&k) {
                    continue;
                }
                let column = basis.column(k);
                let sign = column[usize::from(direction.shares[0].0)].signum();
                for &(i, share) in &direction.shares {
                    prop_assert!((f64::from(share) - sign * column[usize::from(i)]).abs() < 1e-5);
                }
            }
        }

        /// Whatever the other columns and their sizes: x0 trades with x3, x1 with x5 and x6, x4 has no column.
        #[test]
        fn what_trades_off_is_found(
            entries in vec(-1.0_f64..1.0, 24 * 8),
            magnitudes in vec(1.0_f64..4.0, 8),
        ) {
            let mut jacobian = jacobian(8, &entries, &magnitudes);
            jacobian.set_column(3, &jacobian.column(0).into_owned());
            let both = -2.0 * jacobian.column(5) + 2.0 * jacobian.column(6);
            jacobian.set_column(1, &both);
            jacobian.column_mut(4).fill(0.0);
            let directions = weak(&(jacobian.transpose() * &jacobian));
            prop_assert_eq!(directions.len(), 3);
            for direction in &directions {
                prop_assert_eq!(direction.deviation, f64::INFINITY);
            }
            let third = 1.0 / 3.0;
            let found = |shares: &[(u8, f32)]| directions[..2].iter().any(|direction| consists_of(direction, shares));
            prop_assert!(found(&[(0, HALF), (3, -HALF)]), "{:?}", directions);
            prop_assert!(found(&[(1, third), (5, 2.0 * third), (6, -2.0 * third)]), "{:?}", directions);
            prop_assert!(consists_of(&directions[2], &[(4, 1.0)]), "{:?}", directions);
        }
    }

    #[test]
    fn equal_columns_trade_off() {
        let matrix = DMatrix::from_row_slice(3, 3, &[4e4, 4e4, 2e4, 4e4, 4e4, 2e4, 2e4, 2e4, 5e4]);
        let directions = weak(&matrix);
        assert_eq!(directions.len(), 1, "{directions:?}");
        assert_eq!(directions[0].deviation, f64::INFINITY);
        assert!(consists_of(&directions[0], &[(0, HALF), (1, -HALF)]), "{directions:?}");
        // Not quite equal: determined, to 1/√(4e-2).
        let mut apart = DMatrix::from_diagonal_element(3, 3, 4e-2) + matrix;
        apart[(2, 2)] += 1.0;
        let directions = weak(&apart);
        assert_eq!(directions.len(), 1, "{directions:?}");
        assert!((directions[0].deviation / 5.0 - 1.0).abs() < 1e-9, "{directions:?}");
        assert!(consists_of(&directions[0], &[(0, HALF), (1, -HALF)]), "{directions:?}");
    }

    /// Nothing is determined of x0 to x9, x10 trades with x11: that goes first.
    #[test]
    fn who_trades_off_is_not_crowded_out() {
        let mut matrix = DMatrix::zeros(12, 12);
        matrix.view_mut((10, 10), (2, 2)).fill(1e3);
        let directions = weak(&matrix);
        assert!(directions.is_full());
        assert!(consists_of(&directions[0], &[(10, HALF), (11, -HALF)]), "{directions:?}");
        for (i, direction) in (0..).zip(&directions[1..]) {
            assert_eq!(direction.deviation, f64::INFINITY);
            assert_eq!(direction.shares[..], [(i, 1.0)]);
        }
    }

    /// Ten unknowns that nobody asks for do not fill the list; the weak one and the one that is asked for are in it.
    #[test]
    fn unknowns_that_are_not_asked_for_take_no_room() {
        let mut matrix = DMatrix::zeros(12, 12);
        matrix[(10, 10)] = 1.0;
        let directions = weak_directions(&information(&matrix), |unknown| unknown >= 10);
        let named: std::vec::Vec<u8> =
            directions.iter().map(|direction| direction.shares[0].0).collect();
        assert_eq!(named, [11, 10]);
    }

    #[test]
    fn nothing_is_determined_without_information() {
        for broken in [0.0, f64::NAN, f64::INFINITY] {
            let directions = weak(&DMatrix::from_element(3, 3, broken));
            assert_eq!(directions.len(), 3);
            for (i, direction) in (0..).zip(&directions) {
                assert_eq!(direction.deviation, f64::INFINITY);
                assert_eq!(direction.shares[..], [(i, 1.0)]);
            }
        }
        assert!(weak(&DMatrix::zeros(0, 0)).is_empty());
        assert!(weak(&DMatrix::from_diagonal_element(3, 3, 12.0)).is_empty());
    }
}
