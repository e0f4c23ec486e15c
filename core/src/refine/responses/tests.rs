//! The sums and what follows from them, against a dense matrix of all columns; the assembly, against that of the rows.

use fearless_simd::Level;
use nalgebra::{Complex, DMatrix};
use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

use super::products::Column;
use super::*;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::refine::batch::Bins;
use crate::refine::equations::{Assembly, Equations};
use crate::refine::modelled;
use crate::refine::record::{ByResponses, has_plain_columns};
use crate::refine::seam::{MAX_SEAM, ORDERS, Seam};
use crate::refine::sizes::{COLUMNS, RecordNormal};
use crate::refine::tests::{BINS, SAMPLES, bounds, bushings, chain, measurement, problem, record};
use crate::sought::{Coordinate, MAX_UNKNOWNS, Sought};
use crate::spectrum::{Experiment, Measurement};

const LENGTH: usize = packed(MAX_SEAM + MAX_UNKNOWNS + 1);

fn bin(random: &mut Xoshiro256PlusPlus, number: usize) -> Bin {
    let mut bin = Bin::ZERO;
    let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
    bin.loads.as_flattened_mut().as_flattened_mut().fill_with(&mut uniform);
    bin.elongations.as_flattened_mut().fill_with(&mut uniform);
    bin.others.as_flattened_mut().as_flattened_mut().fill_with(&mut uniform);
    bin.omega = 2.0 + 0.1 * number as f64;
    bin
}

/// Each column of the normal equations in all bins, the residual in the last, by the table of the [module](super).
fn dense(
    bins: &[Bin],
    joints: usize,
    orders: usize,
    unknowns: usize,
    columns: impl Fn(usize) -> Columns,
) -> DMatrix<Complex<f64>> {
    let seam = 2 * DOF * joints + 3 * orders;
    let mut dense = DMatrix::zeros(3 * bins.len(), seam + unknowns + 1);
    let lowest = bins[0].omega;
    for (number, bin) in bins.iter().enumerate() {
        let s = Complex::new(0.0, bin.omega);
        for axis in 0..3 {
            let row = 3 * number + axis;
            for load in 0..DOF * joints {
                let [re, im] = bin.loads[axis].map(|part| part[load]);
                let z = Complex::new(re, im);
                let q = Complex::new(bin.elongations[0][load], bin.elongations[1][load]);
                let own = columns(load);
                dense[(row, own.impulse)] += z;
                dense[(row, own.step)] += z / s;
                for (column, by) in [(own.stiffness, q), (own.damping, s * q)] {
                    if let Some((column, factor)) = column {
                        dense[(row, column)] += z * by * factor;
                    }
                }
            }
            for order in 0..orders {
                let by = [Complex::new(1.0, 0.0), s / lowest, Complex::new(lowest, 0.0) / s][order];
                for jump in 0..3 {
                    let [re, im] = bin.others[jump][axis];
                    dense[(row, 2 * DOF * joints + 3 * order + jump)] = Complex::new(re, im) * by;
                }
            }
            let [re, im] = bin.others[OTHERS - 1][axis];
            dense[(row, seam + unknowns)] = Complex::new(re, im);
        }
    }
    dense
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    /// Of all parameters, of none, of some that are fixed, and of some that are tied to others.
    #[test]
    fn products_are_those_of_all_columns(
        seed in 0_u64..1000, joints in 1..=MAX_JOINTS, orders in 2..=ORDERS, count in 1..12_usize, kind in 0..4_usize,
    ) {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let bins: std::vec::Vec<Bin> = (0..count).map(|number| bin(&mut random, number)).collect();
        let has_unknowns = kind > 0;
        let loads = DOF * joints;
        let behind = 2 * loads + 3 * orders;
        let unknowns = if has_unknowns { 2 * loads } else { 0 };
        let columns = |load: usize| {
            let impulse = 2 * DOF * (load / DOF) + load % DOF;
            let unknown = |index: usize, factor: f64| -> Column {
                match kind {
                    0 => None,
                    2 if index.is_multiple_of(5) => None,
                    3 => Some((behind + index / 3, factor)),
                    _ => Some((behind + index, factor)),
                }
            };
            Columns {
                impulse,
                step: impulse + DOF,
                stiffness: unknown(2 * load, -1.5 - load as f64),
                damping: unknown(2 * load + 1, -0.3),
            }
        };
        let dense = dense(&bins, joints, orders, unknowns, columns);
        let expected = (dense.adjoint() * &dense).map(|product| product.re);
        for level in [Level::baseline(), Level::new()] {
            let mut sums = std::boxed::Box::new(Sums::new());
            sums.reset(joints, 3 * orders, has_unknowns, bins[0].omega);
            for part in bins.chunks(8) {
                sums.add(level, part);
            }
            let mut normal = std::boxed::Box::new(Normal::<LENGTH>::new());
            normal.reset(behind + unknowns);
            sums.write(&mut normal, columns);
            for i in 0..=behind + unknowns {
                for j in 0..=i {
                    let (own, expected) = (*normal.entry(i, j), expected[(i, j)]);
                    let size = (1.0 + dense.column(i).norm()) * (1.0 + dense.column(j).norm());
                    prop_assert!((own - expected).abs() < 1e-12 * size, "{i} {j}: {own} for {expected}");
                }
            }
        }
    }

    /// Also of some of the bins, of the seam alone, and where gravity tilts the reading.
    #[test]
    fn the_equations_are_those_of_the_rows(
        seed in 0_u64..1000, every in 1..3_usize, gravity in prop_oneof![Just(0.0), Just(-9.8)], kind in 0..3_usize,
    ) {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (chain, bounds) = (chain(), bounds());
        let measurement = Measurement { gravity: [0.0, 0.0, gravity], ..measurement() };
        let record = record(&mut random);
        let experiment = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]).unwrap();
        let mut sought = Sought::new(2).unwrap();
        let stiffness = |dof| Coordinate::Stiffness { joint: 0, dof };
        sought.tie(stiffness(1), stiffness(0)).unwrap();
        sought.fix(Coordinate::Damping { joint: 1, dof: 2 }, 8e3).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let coordinates = sought.coordinates(&bushings());
        let only = experiment.parts().next().unwrap();
        let model = modelled::perfect(&problem, &coordinates, experiment.site()).unwrap();
        prop_assert!(has_plain_columns(&model.terms, &sought));
        let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
        let mut seam = Seam::ZERO;
        seam.impulse[0][1] = uniform();
        seam.step[1][2] = 10.0 * uniform();
        seam.jumps[0][2] = uniform();
        let equations = [Equations::Seam, Equations::All(&seam), Equations::Planned(&seam)][kind];
        let [mut rows, mut responses] = [(); 2].map(|()| std::boxed::Box::new(RecordNormal::new()));
        let assembly = |normal| Assembly::<COLUMNS, _> {
            model: &model,
            record: Bins::thinned(&experiment, &only, every),
            equations,
            sought: &sought,
            columns: crate::refine::plant::columns::Columns::NONE,
            normal,
            level: problem.level,
        };
        let by_rows = assembly(&mut rows).run();
        let mut sums = std::boxed::Box::new(Sums::new());
        let by_responses = ByResponses { assembly: assembly(&mut responses), sums: &mut sums }.run();
        prop_assert_eq!(rows.unknowns(), responses.unknowns());
        prop_assert_eq!(by_rows.agreement(), by_responses.agreement());
        let size = rows.unknowns() + 1;
        let roots: std::vec::Vec<f64> = (0..size).map(|i| rows.entry(i, i).sqrt()).collect();
        for i in 0..size {
            for j in 0..=i {
                let (own, expected) = (*responses.entry(i, j), *rows.entry(i, j));
                prop_assert!((own - expected).abs() <= 1e-10 * roots[i] * roots[j], "{i} {j}: {own} for {expected}");
            }
        }
    }
}
