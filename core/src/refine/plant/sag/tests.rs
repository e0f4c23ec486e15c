//! The derivatives through the sag, against differences of readings at sags that follow from other bushings and imperfections.

use proptest::array::{uniform3, uniform6};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::super::super::tests::{bounds, bushings, chain, problem};
use super::super::tests::{PASSING, Three, evaluated, inside, measurement, plant, reading};
use super::*;
use crate::imperfection::{self, Accuracies};
use crate::receptance::Complex;
use crate::sought::{MAX_UNKNOWNS, Sought};

const COLUMNS: usize = MAX_IMPERFECTIONS + MAX_UNKNOWNS;

fn size(all: &Three) -> f64 {
    all.iter().map(|a| libm::hypot(a.re, a.im)).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(2), ..ProptestConfig::with_cases(24) })]

    /// Of bushings that sag by up to 2e-2, as far as their sag counts. What gravity adds to the stiffness, and how one sag changes the load of another, is left out.
    #[test]
    fn derivatives_through_the_sag_equal_differences(
        places in proptest::array::uniform4(uniform3(-0.5_f64..0.5)),
        omega in 40.0_f64..800.0,
        raw in uniform6(-100.0_f64..100.0),
        away in -2.0_f64..2.0,
        load in -30.0_f64..30.0,
    ) {
        let measurement = measurement(&places, 0.0, [0.3, -0.5, -9.8]);
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let raw: Three = core::array::from_fn(|axis| Complex { re: raw[axis], im: raw[3 + axis] });
        let s = Complex { re: 0.0, im: omega };
        let seam = [[Complex { re: load, im: -0.3 * load }; DOF]; MAX_JOINTS];
        let mut soft = bushings();
        soft.iter_mut().flat_map(|own| &mut own.stiffness).for_each(|stiffness| *stiffness *= 0.1);

        let mut plant = plant();
        plant.imperfections.all = imperfection::all(&Accuracies::typical(), &chain.kinds(), 2);
        let all = plant.imperfections.all.clone();
        plant.point.coordinates = sought.coordinates(&soft);
        let standing = inside(&all, away);
        plant.point.imperfections = standing;
        let model = plant.imperfections.prepare(&problem, &plant.point, PASSING, 0).unwrap();
        let (response, batch) = evaluated(&model, s, &raw, &seam);
        let mut columns = || {
            let mut rows = [[[0.0; COLUMNS]; 6]];
            plant.imperfections.columns().write(&mut rows, (0, &sought), &response, &model, &batch, &seam);
            plant.imperfections.sags.clear();
            rows[0]
        };
        let [with, without] = [columns(), columns()];
        let ours = |column: usize| -> Three {
            let through = |row: usize| with[row][column] - without[row][column];
            core::array::from_fn(|axis| Complex { re: through(2 * axis), im: through(2 * axis + 1) })
        };

        let imperfect = |larger: Option<(usize, f64)>| {
            let values = all.iter().enumerate().map(|(index, &(imperfection, deviation))| {
                let more = larger.filter(|(own, _)| *own == index).map_or(0.0, |(_, by)| by);
                (imperfection, (standing[index] + more) * deviation)
            });
            Imperfect::new(&problem, &plant.point.coordinates, values, PASSING, 0)
        };
        let of = |imperfect: &Imperfect, linear: &LinearChain, bushings: &Bushings| {
            reading(&imperfect.model(linear, bushings).unwrap(), s, &raw, &seam)
        };
        let at_rest = |imperfect: &Imperfect, bushings: &Bushings| imperfect.linearise(&problem, bushings).unwrap();
        let by = 1e-3;
        let difference = |[plus, minus]: [Three; 2]| -> Three {
            core::array::from_fn(|axis| (plus[axis] - minus[axis]).scale(0.5 / by))
        };
        let held = at_rest(&imperfect(None), &soft).elongations();
        let mut numeric: std::vec::Vec<(usize, Three)> = std::vec::Vec::new();
        for index in 0..all.len() {
            let [plus, minus] = [by, -by].map(|by| {
                let moved = imperfect(Some((index, by)));
                [at_rest(&moved, &soft), moved.linearise_at(&problem, &held)].map(|linear| of(&moved, &linear, &soft))
            });
            let through = |[sagged, held]: [Three; 2]| core::array::from_fn(|axis| sagged[axis] - held[axis]);
            numeric.push((index, difference([through(plus), through(minus)])));
        }
        for unknown in (0..sought.unknowns()).filter(|unknown| unknown % (2 * DOF) < DOF) {
            let (joint, dof) = (unknown / (2 * DOF), unknown % DOF);
            if held[joint][dof].abs() < LEAST {
                continue;
            }
            let [plus, minus] = [by, -by].map(|by| {
                let mut bushings = soft.clone();
                bushings[joint].stiffness[dof] *= libm::exp(by);
                of(&imperfect(None), &at_rest(&imperfect(None), &bushings), &bushings)
            });
            // The derivative that holds the sag.
            let own = response.derivatives(&model.terms, joint, dof);
            let whole = difference([plus, minus]);
            numeric.push((all.len() + unknown, core::array::from_fn(|axis| whole[axis] - own[axis][0])));
        }
        let largest = numeric.iter().map(|(_, own)| size(own)).fold(0.0, f64::max);
        for (column, numeric) in numeric {
            let ours = ours(column);
            let gap: Three = core::array::from_fn(|axis| ours[axis] - numeric[axis]);
            let allowed = 0.05 * size(&numeric) + 0.01 * largest;
            prop_assert!(size(&gap) <= allowed, "{column}: {ours:?} of {numeric:?}");
        }
    }
}
