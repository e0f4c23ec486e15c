//! Against dense matrices.

use super::*;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// `D N⁻¹ D` and `D N⁻¹ g` of dense matrices; the least sum of squares stays.
    #[test]
    fn discounts_as_dense_matrices_do(values in proptest::collection::vec(-1.0_f64..1.0, 6 * 4 * 10), part in 0.0..1.5_f64) {
        const UNKNOWNS: usize = 9;
        let mut normal = Normal::<{ packed(UNKNOWNS + 1) }>::new();
        normal.reset(UNKNOWNS);
        let (mut noise, mut factor) = (normal.clone(), normal.clone());
        let all = DMatrix::from_row_slice(24, UNKNOWNS + 1, &values);
        let (rows, right) = (all.columns(0, UNKNOWNS), all.column(UNKNOWNS));
        let k = rows.rows(0, 12).transpose() * rows.rows(0, 12) * part;
        let (n, g) = (rows.transpose() * rows, rows.transpose() * right);
        for i in 0..UNKNOWNS {
            for j in 0..=i {
                (*normal.entry(i, j), *noise.entry(i, j)) = (n[(i, j)], k[(i, j)]);
            }
            *normal.entry(UNKNOWNS, i) = g[i];
        }
        *normal.entry(UNKNOWNS, UNKNOWNS) = right.norm_squared();
        let inverse = n.clone().try_inverse();
        prop_assume!(inverse.as_ref().is_some_and(|it| it.norm() < 1e4));
        let inverse = inverse.unwrap();
        normal.discount(Level::baseline(), &noise, &mut factor, &mut [0.0; UNKNOWNS]);
        let d = &n - &k;
        let (expected, slope) = (&d * &inverse * &d, &d * &inverse * &g);
        for i in 0..UNKNOWNS {
            for j in 0..=i {
                prop_assert!((normal.row(i)[j] - expected[(i, j)]).abs() < 1e-8);
            }
            prop_assert!((normal.right()[i] - slope[i]).abs() < 1e-8);
        }
        prop_assert_eq!(normal.sum_of_squares(), right.norm_squared());
    }

    /// The projection, the solution and the remaining sum of squares equal those of a least-squares solution by SVD.
    #[test]
    fn projects_out_like_least_squares(values in proptest::collection::vec(-1.0_f64..1.0, 6 * 4 * 10)) {
        const UNKNOWNS: usize = 9;
        let mut normal = Normal::<{ packed(UNKNOWNS + 1) }>::new();
        normal.reset(UNKNOWNS);
        let all = DMatrix::from_row_slice(24, UNKNOWNS + 1, &values);
        for block in 0..4 {
            let rows: [[f64; UNKNOWNS + 1]; 6] = core::array::from_fn(|r| core::array::from_fn(|c| all[(6 * block + r, c)]));
            normal.add(&rows);
        }
        let (a, b) = (all.columns(0, UNKNOWNS).into_owned(), DVector::from(all.column(UNKNOWNS)));
        let expected = a.clone().svd(true, true).solve(&b, 1e-12).map_err(TestCaseError::fail)?;
        let residual = (&a * &expected - b).norm_squared();
        // The elimination takes two steps: the first four unknowns are projected out, then the rest.
        normal.eliminate(4);
        let mut rest = Normal::<{ packed(UNKNOWNS - 4 + 1) }>::new();
        rest.reset(UNKNOWNS - 4);
        rest.add_complement(&normal, 4);
        rest.eliminate(UNKNOWNS - 4);
        let mut solution = [0.0; UNKNOWNS - 4];
        rest.substitute(UNKNOWNS - 4, &mut solution);
        for (ours, expected) in solution.iter().zip(expected.iter().skip(4)) {
            prop_assert!((ours - expected).abs() < 1e-6 * (1.0 + expected.abs()));
        }
        prop_assert!((rest.sum_of_squares() - residual).abs() < 1e-8);
    }

    /// Equations in other unknowns are those of the rows in other unknowns, about another origin.
    #[test]
    fn equations_are_mapped_as_their_rows_are(
        values in proptest::collection::vec(-1.0_f64..1.0, 6 * 4), step in prop::array::uniform3(-1.0_f64..1.0), by in prop::array::uniform4(-2.0_f64..2.0),
    ) {
        // x₀ = a y₂, x₁ = b y₀ + c y₂, and x₂ = d y₁.
        let [a, b, c, d] = by;
        let jacobian: [Derivatives; 3] =
            [[(2, a)].into_iter().collect(), [(0, b), (2, c)].into_iter().collect(), [(1, d)].into_iter().collect()];
        let rows: [[f64; 4]; 6] = core::array::from_fn(|r| core::array::from_fn(|c| values[4 * r + c]));
        let mut own = Normal::<{ packed(4) }>::new();
        own.reset(3);
        own.add(&rows);
        let mapped = rows.map(|row| {
            let mut mapped = [0.0; 4];
            for (own, derivatives) in row.iter().zip(&jacobian) {
                derivatives.iter().for_each(|(other, by)| mapped[*other] += own * by);
            }
            mapped[3] = row[3] - row.iter().zip(&step).map(|(own, step)| own * step).sum::<f64>();
            mapped
        });
        let [mut expected, mut found] = [(); 2].map(|()| Normal::<{ packed(4) }>::new());
        expected.reset(3);
        expected.add(&mapped);
        found.reset(3);
        found.add_mapped(&own, &step, &jacobian);
        for (found, expected) in found.entries().iter().zip(expected.entries()) {
            prop_assert!((found - expected).abs() < 1e-12 * (1.0 + expected.abs()) + 1e-12, "{} {}", found, expected);
        }
    }

    /// The covariance of an unknown that may differ is larger by the variance of the difference, and the minimum stays where it was.
    #[test]
    fn a_loosened_unknown_has_a_larger_variance(values in proptest::collection::vec(-1.0_f64..1.0, 6 * 4), k in 0..3_usize, variance in 0.01..3.0_f64) {
        let rows: [[f64; 4]; 6] = core::array::from_fn(|r| core::array::from_fn(|c| values[4 * r + c]));
        let mut normal = Normal::<{ packed(4) }>::new();
        normal.reset(3);
        normal.add(&rows);
        let dense = |normal: &Normal<{ packed(4) }>| DMatrix::from_fn(3, 3, |i, j| normal.row(i.max(j))[i.min(j)]);
        let right = |normal: &Normal<{ packed(4) }>| DVector::from_column_slice(&normal.right()[..3]);
        let Some(mut expected) = dense(&normal).try_inverse() else { return Ok(()) };
        prop_assume!(expected.norm() < 1e6);
        let minimum = &expected * right(&normal);
        expected[(k, k)] += variance;
        let least = normal.sum_of_squares() - normal.gain(minimum.as_slice());
        normal.loosen(k, variance);
        let Some(found) = dense(&normal).try_inverse() else { return Ok(()) };
        prop_assert!((found - &expected).norm() < 1e-6 * expected.norm());
        let moved = &expected * right(&normal);
        prop_assert!((moved - &minimum).norm() < 1e-6 * (1.0 + minimum.norm()));
        let left = normal.sum_of_squares() - normal.gain(minimum.as_slice());
        prop_assert!((left - least).abs() < 1e-6 * (1.0 + least.abs()));
    }

    /// An unknown that is eliminated by itself leaves the others what it leaves them as the first of all.
    #[test]
    fn an_unknown_in_the_midst_is_eliminated_as_the_first(values in proptest::collection::vec(-1.0_f64..1.0, 6 * 5), k in 0..4_usize) {
        const UNKNOWNS: usize = 4;
        const LENGTH: usize = packed(UNKNOWNS + 1);
        let rows: [[f64; UNKNOWNS + 1]; 6] = core::array::from_fn(|r| core::array::from_fn(|c| values[5 * r + c]));
        let others: std::vec::Vec<usize> = (0..=UNKNOWNS).filter(|i| *i != k).collect();
        let mut normal = Normal::<LENGTH>::new();
        normal.reset(UNKNOWNS);
        normal.add(&rows);
        normal.eliminate_one(k);
        let moved = rows.map(|row| {
            let mut moved = [row[k]; UNKNOWNS + 1];
            moved.iter_mut().skip(1).zip(&others).for_each(|(target, i)| *target = row[*i]);
            moved
        });
        let mut first = Normal::<LENGTH>::new();
        first.reset(UNKNOWNS);
        first.add(&moved);
        first.eliminate(1);
        for (i, own) in others.iter().enumerate() {
            for (j, other) in others[..=i].iter().enumerate() {
                let [found, expected] = [normal.row(*own)[*other], first.row(1 + i)[1 + j]];
                prop_assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{} {}", found, expected);
            }
        }
        prop_assert!(normal.row(k).iter().all(|own| *own == 0.0));
    }

    /// The least value is that of a least-squares solution by SVD for the unknowns that are free.
    #[test]
    fn free_unknowns_go_where_the_quadratic_form_is_least(
        values in proptest::collection::vec(-1.0_f64..1.0, 12 * 5), step in prop::array::uniform5(-1.0_f64..1.0), free in 0..32_usize,
    ) {
        const UNKNOWNS: usize = 5;
        let mut normal = Normal::<{ packed(UNKNOWNS + 1) }>::new();
        normal.reset(UNKNOWNS);
        let a = DMatrix::from_row_slice(12, UNKNOWNS, &values);
        for block in 0..2 {
            let rows: [[f64; UNKNOWNS + 1]; 6] =
                core::array::from_fn(|r| core::array::from_fn(|c| if c < UNKNOWNS { a[(6 * block + r, c)] } else { 1.0 }));
            normal.add(&rows);
        }
        let is_free = |unknown: usize| free >> unknown & 1 == 1;
        let part = |unknown: usize| if is_free(unknown) { 0.0 } else { step[unknown] };
        let fixed = &a * DVector::from_fn(UNKNOWNS, |unknown, _| part(unknown));
        // The columns of unknowns that are not free are zero.
        let free = DMatrix::from_fn(12, UNKNOWNS, |i, unknown| if is_free(unknown) { a[(i, unknown)] } else { 0.0 });
        let x = free.clone().svd(true, true).solve(&-&fixed, 1e-12).map_err(TestCaseError::fail)?;
        let expected = (free * x + fixed).norm_squared();
        let least = normal.least_quadratic(&step, is_free);
        prop_assert!((least - expected).abs() < 1e-9 * (1.0 + expected), "{} {}", least, expected);
    }
}
