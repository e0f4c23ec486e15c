//! The quadratic against dense least squares over imperfections and unknowns together.

use std::boxed::Box;
use std::vec::Vec;

use nalgebra::{DMatrix, DVector};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};

use super::super::super::tests::{bounds, bushings, chain, measurement, problem};
use super::super::diagnosis::Explanation;
use super::*;
use crate::imperfection::Accuracies;
use crate::sought::Sought;

const ROWS: usize = 200;
const INFLATION: f64 = 1.7;
/// Kind of the masses, and of the places of the accelerometer.
const MASSES: usize = 14;
const PLACES: usize = 13;
/// An unknown that lies on a bound.
const ON_BOUND: usize = 3;

/// Rows of a linearised fit that has ended at the imperfections `p`, in their stated accuracies.
struct Rows {
    /// Imperfections, then unknowns.
    jacobian: DMatrix<f64>,
    residual: DVector<f64>,
    p: DVector<f64>,
    kinds: Vec<usize>,
}

fn sought() -> Sought {
    Sought::new(2).unwrap()
}

fn on_large_stack(run: impl FnOnce() + Send + 'static) {
    std::thread::Builder::new().stack_size(16 << 20).spawn(run).unwrap().join().unwrap();
}

/// A plant whose fit has ended at these rows, masses restated. Some compliances of the ground are zero.
fn plant(random: &mut Xoshiro256PlusPlus) -> (Box<Plant>, Rows) {
    let mut uniform = || random.next_u32() as f64 / u32::MAX as f64 * 2.0 - 1.0;
    let mut plant = Box::new(Plant::new(&Accuracies::typical(), &chain()));
    let mut soft = bushings();
    soft[0].stiffness[ON_BOUND] = 1e5;
    plant.point.coordinates = sought().coordinates(&soft);
    let kinds: Vec<usize> = plant.imperfections.all.iter().map(|(it, _)| it.kind()).collect();
    let count = kinds.len();
    let all = plant.imperfections.all.iter();
    for (value, (imperfection, _)) in plant.point.imperfections.iter_mut().zip(all) {
        *value = match imperfection {
            Imperfection::Mass(_) => 8.0 * uniform() + 20.0,
            Imperfection::Ground(_) => uniform().max(0.0),
            it if it.is_positive() => uniform().abs(),
            _ => uniform(),
        };
    }
    assert!(plant.point.imperfections[..count].contains(&0.0));
    let p = plant.point.imperfections[..count].to_vec();
    assert!(plant.restate_accuracies());
    let total = count + sought().unknowns();
    let jacobian = DMatrix::from_fn(ROWS, total, |_, _| 3.0 * uniform());
    let residual = DVector::from_fn(ROWS, |_, _| 2.0 * uniform());
    let normal = &mut plant.minimiser.normal;
    normal.reset(total);
    for row in 0..ROWS {
        let terms: Vec<(usize, f64)> = (0..total)
            .map(|column| {
                let factor = plant.imperfections.all.get(column);
                let scale = factor.map_or(1.0, |(it, _)| plant.restated.factor(*it));
                (column, jacobian[(row, column)] * scale)
            })
            .collect();
        normal.add_sparse(&terms, residual[row]);
    }
    for (index, value) in plant.point.imperfections[..count].iter().enumerate() {
        normal.add_prior(index, *value);
    }
    (plant, Rows { jacobian, residual, p: DVector::from_vec(p), kinds })
}

impl Rows {
    /// Imperfections and unknowns where data and priors are least, the Hessian there, and the least. Each imperfection has a prior of this
    /// variance, or is zero.
    fn least(&self, square: impl Fn(usize) -> Option<f64>) -> (DVector<f64>, DMatrix<f64>, f64) {
        let (count, total) = (self.kinds.len(), self.jacobian.ncols());
        let mut origin = DVector::zeros(total);
        origin.rows_mut(0, count).copy_from(&self.p);
        // The residual at imperfections of zero.
        let r = (&self.residual - &self.jacobian * &origin) / INFLATION.sqrt();
        let mut j = &self.jacobian / INFLATION.sqrt();
        let mut prior = DMatrix::zeros(total, total);
        for index in 0..total {
            let of_unknown = if index == count + ON_BOUND { None } else { Some(1e6) };
            let square = self.kinds.get(index).map_or(of_unknown, |kind| square(*kind));
            // A compliance of the ground that is zero stays there.
            let square = square.filter(|_| index >= count || self.p[index] != 0.0);
            prior[(index, index)] = 1.0 / square.unwrap_or(1.0);
            if square.is_none() {
                j.column_mut(index).fill(0.0);
            }
        }
        let hessian = j.transpose() * &j + &prior;
        let solution = -hessian.clone().cholesky().unwrap().solve(&(j.transpose() * &r));
        let left = (&r + &j * &solution).norm_squared()
            + (solution.transpose() * &prior * &solution)[(0, 0)];
        (solution, hessian, left)
    }
}

/// Values, deviations, unknowns and evidence of a kind with a prior of its own, the masses restated; and its share where all else is
/// perfect.
#[test]
fn the_quadratic_equals_dense_least_squares() {
    on_large_stack(|| {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
        let measurement = measurement();
        let (chain, bounds, sought) = (chain(), bounds(), sought());
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let (mut plant, rows) = plant(&mut random);
        let count = rows.kinds.len();
        let mut quadratic = plant.quadratic(&problem, INFLATION);

        let has = |imperfection: Imperfection| rows.kinds.contains(&imperfection.kind());
        assert!(has(Imperfection::BaseMass));
        assert!(!quadratic.kinds().any(|kind| kind == Imperfection::BaseMass.kind()));

        let mut squares = [1.0; KINDS];
        squares[MASSES] = 30.0;
        let with =
            |own: f64| move |kind: usize| Some(if kind == PLACES { own } else { squares[kind] });
        let block = quadratic.block(PLACES, &squares);
        let own = block.values(4.0);
        let (solution, hessian, _) = rows.least(with(4.0));
        let inverse = hessian.clone().try_inverse().unwrap();
        let members: Vec<usize> = quadratic.members(PLACES).collect();
        assert_eq!(members.len(), 3);
        for (place, &index) in members.iter().enumerate() {
            assert!((own.values[place] - solution[index]).abs() < 1e-8);
            assert!((own.deviations[place] - inverse[(index, index)].sqrt()).abs() < 1e-8);
        }
        let unknowns = quadratic.unknowns(PLACES, &own.values);
        for unknown in 0..sought.unknowns() {
            assert!((unknowns[unknown] - solution[count + unknown]).abs() < 1e-6, "{unknown}");
        }
        assert_eq!(unknowns[ON_BOUND], 0.0);

        // −2 ln of the density of the data: what is left, the determinant of the Hessian, and that of the priors.
        let logarithm = |matrix: DMatrix<f64>| {
            2.0 * matrix.cholesky().unwrap().l().diagonal().map(f64::ln).sum()
        };
        let (_, hessian_stated, left_stated) = rows.least(with(1.0));
        let restatement = block.restatement();
        let (_, hessian_restated, left_restated) = rows.least(with(restatement.square));
        let gain = left_stated + logarithm(hessian_stated)
            - left_restated
            - logarithm(hessian_restated)
            - 3.0 * restatement.square.ln();
        assert!((gain - restatement.gain).abs() < 1e-6, "{gain} {}", restatement.gain);

        let perfect = rows.least(|_| None).2;
        let alone = rows.least(|kind| (kind == PLACES).then_some(1e12)).2;
        let found = quadratic.alone(PLACES).gain_without_prior();
        assert!((perfect - alone - found).abs() < 1e-5 * found, "{} {found}", perfect - alone);
        let at_end = rows.residual.norm_squared() / INFLATION;
        assert!((quadratic.misfit() - (perfect - at_end)).abs() < 1e-5 * perfect);
    });
}

/// The masses are contradicted; each kind that is takes the accuracy that its explanation gives, and all others that which is stated.
#[test]
fn adopted_explanations_replace_restated_accuracies() {
    on_large_stack(|| {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
        let measurement = measurement();
        let (chain, bounds, sought) = (chain(), bounds(), sought());
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let (mut plant, _) = plant(&mut random);
        let before = plant.found();
        assert!(!plant.adopt_explanations(&problem, INFLATION), "the plant does not adopt");

        plant.adopt(true);
        let explanations = plant.explain(&problem, INFLATION, &mut |_| {});
        let masses = explanations.iter().find(|one| one.largest.imperfection.kind() == MASSES);
        assert!(masses.unwrap().times > 5.0 && masses.unwrap().is_contradicted());
        assert!(plant.adopt_explanations(&problem, INFLATION));
        for (before, after) in before.iter().zip(plant.found()) {
            assert!((before.value - after.value).abs() <= 1e-12 * before.value.abs());
            assert!((before.prior - after.prior).abs() <= 1e-12 * before.prior);
            let imperfection = after.imperfection;
            let same = |one: &&Explanation| one.largest.imperfection.kind() == imperfection.kind();
            let times = explanations.iter().find(same).map_or(1.0, |one| one.times);
            assert!((plant.restated.factor(imperfection) - times).abs() < 1e-12, "{after:?}");
        }
        let scaled = plant.imperfections.all.iter().zip(&before);
        for ((imperfection, deviation), before) in scaled {
            let expected = before.prior * plant.restated.factor(*imperfection);
            assert!((deviation - expected).abs() < 1e-12 * expected);
        }
    });
}
