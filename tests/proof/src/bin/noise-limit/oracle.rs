//! The Bayesian Cramér-Rao bound: what an oracle would report that knows the priors of all imperfections, and where the optimum lies.
//!
//! ```text
//! Σ = (N + P)⁻¹, of the parameters + Σ v vᵀ
//! ```
//!
//! N is the information of the records about the parameters and the imperfections (`bound`, `imperfect`), at the true robot and a
//! perfect plant. P is the precision of the priors: 1 of each imperfection in its standard deviation, and `12/w²` of a logarithm uniform
//! over a width w. The compliance c of a link in series with a bushing is in no record: with `k ← k/(1 + k c)` and
//! `d ← d/(1 + k c)²`, it adds `v = −k σ_c (1, 2)` on `(ln k, ln d)`. (Van Trees, _Detection, Estimation, and Modulation Theory_ I,
//! 1968, section 2.4.)

use anyhow::Result;
use flexid_core::chain::JointKind;
use flexid_core::imperfection::{Accuracies, Imperfection, possible};
use flexid_core::parameters::Bushing;
use flexid_simulation::experiment::Cut;
use nalgebra::DMatrix;

use crate::bound::{Column, Milled, covariance};
use crate::imperfect::column;
use crate::linear::motion;
use crate::records::SAMPLES;
use crate::study::Study;

/// Standard deviations of the logarithms of the parameters of a robot, from its records of these cuts.
pub(crate) fn deviations(
    study: &Study,
    bushings: &[Bushing],
    cuts: &[Cut],
    accuracies: &Accuracies,
) -> Result<Vec<f64>> {
    let chain = &study.chain;
    let parameters = 12 * bushings.len();
    let joints: Vec<JointKind> = chain.joints().iter().map(|joint| joint.kind).collect();
    let stated = |own: Imperfection| (own, own.accuracy(accuracies));
    let imperfections: Vec<_> = possible(&joints, cuts.len()).map(stated).collect();
    let unknowns = parameters + imperfections.len();
    let mut information = DMatrix::from_diagonal_element(unknowns, unknowns, 1.0);
    for (joint, ranges) in study.scenario.bounds.joints[..bushings.len()].iter().enumerate() {
        let ranges = ranges.stiffness.iter().chain(&ranges.damping);
        for (place, [lower, upper]) in ranges.enumerate() {
            let index = 12 * joint + place;
            information[(index, index)] = 12.0 / (upper / lower).ln().powi(2);
        }
    }
    for (number, cut) in cuts.iter().enumerate() {
        let motion = motion(chain, bushings, cut);
        let milled = Milled { study, chain, bushings, cut, motion: &motion };
        let columns =
            imperfections.iter().map(|&(one, deviation)| column(&milled, number, one, deviation));
        let columns = columns.collect::<Result<Vec<Column>>>()?;
        information += milled.information(0..SAMPLES, &columns)?;
    }
    let covariance = covariance(&information)?;
    let structure = |index: usize| {
        let (bushing, dof) = (&bushings[index / 12], index % 6);
        let Accuracies { structure_translation, structure_rotation, .. } = accuracies;
        let compliance = match (index / 12, dof < 3) {
            (0, _) => 0.0,
            (_, true) => *structure_translation,
            (_, false) => *structure_rotation,
        };
        let relative = bushing.stiffness[dof] * compliance;
        if index % 12 < 6 { relative } else { 2.0 * relative }
    };
    let deviation = |index| (covariance[(index, index)] + structure(index).powi(2)).sqrt();
    Ok((0..parameters).map(deviation).collect())
}

#[cfg(test)]
mod tests {
    use flexid_simulation::plant::Plant;

    use super::*;
    use crate::STACK;
    use crate::figure::median;
    use crate::plants::{found, records};

    /// If the plant has no misfit, the fit to the plant knows as much as the oracle. Its derivatives are others.
    #[test]
    fn is_what_the_fit_reports_of_a_perfect_plant() {
        let compare = || {
            let study = Study::load().unwrap();
            // Ground of concrete: that of typical accuracies leaves some dampings of the first joint open.
            let [ground_translation, ground_rotation] = [1e-10, 2e-10];
            let accuracies =
                Accuracies { ground_translation, ground_rotation, ..Accuracies::typical() };
            let cuts = study.cuts().swap_remove(1);
            let records = records(&study, &cuts, &Plant::default(), &study.robot(1), 1).unwrap();
            let (truth, found) = found(&study, &records, &accuracies, 1).unwrap();
            let oracle = deviations(&study, &truth, &cuts, &accuracies).unwrap();
            let identified = (0..oracle.len()).filter(|&index| found.identifies(index));
            identified.map(|index| found.deviations[index] / oracle[index]).collect::<Vec<_>>()
        };
        let thread = std::thread::Builder::new().stack_size(STACK).spawn(compare);
        let ratios = thread.unwrap().join().unwrap();
        assert!(ratios.len() > 30, "{ratios:?}");
        println!("{ratios:.2?}");
        // A parameter that is one standard deviation off has the deviations of another robot.
        assert!((0.97..1.03).contains(&median(ratios.clone())), "{ratios:?}");
        assert!(ratios.iter().all(|ratio| (0.8..1.25).contains(ratio)), "{ratios:?}");
    }
}
