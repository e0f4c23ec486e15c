//! A divided record on an imperfect plant is as many records as it has parts, if no imperfection is of a single record.

use std::boxed::Box;

use super::super::Refinement;
use super::super::objective::Objective as _;
use super::super::tests::divided::{PARTS, along, apart, divided_and_alone};
use super::super::tests::{BINS, SAMPLES, bounds, bushings, chain, measurement, problem};
use super::tests::on_large_stack;
use super::*;
use crate::refine::Outcome;
use crate::sought::Sought;
use crate::spectrum::Experiment;
use crate::stream::Record;

/// The order of the sums differs: 1e-9 is a thousand times the rounding of the elimination of a seam.
#[test]
fn a_divided_record_is_the_sum_of_its_parts() {
    on_large_stack(compare_with_the_sum_of_parts);
}

fn compare_with_the_sum_of_parts() {
    let (chain, bounds) = (chain(), bounds());
    let measurement = crate::spectrum::Measurement { gravity: [0.0, 0.0, -9.81], ..measurement() };
    let sought = Sought::parameters_of(&chain);
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let accuracies =
        Accuracies { record_delay: 0.0, record_stiffness: 0.0, ..Accuracies::typical() };
    let (divided, alone) = divided_and_alone(&measurement);
    let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
    let mut plant = Box::new(Plant::new(&accuracies, &chain));
    let mut evaluate = |experiments: &[Experiment<BINS>]| {
        refinement.restart_plant(&mut plant, experiments.len(), false);
        let count = plant.imperfections.all.len();
        plant.point.imperfections[..count].fill(0.3);
        let (_, mut objective, _, point) =
            refinement.minimisation(&problem, experiments, &mut plant);
        let cost = objective.cost(point);
        let mut normal = Box::new(Normal::new());
        objective.linearise(point, &mut normal).unwrap();
        (cost, normal, count)
    };
    let (cost, normal, count) = evaluate(core::slice::from_ref(&*divided));
    let (sum, of_parts, of_alone) = evaluate(&alone);
    assert!(count > 20 && count == of_alone && alone.len() == PARTS, "{count} {of_alone}");
    assert!((cost / sum - 1.0).abs() < 1e-9, "{cost}, not {sum}");
    let apart = apart(&normal, &of_parts);
    assert!(apart < 1e-9, "{apart}");
    assert!(evaluate(&alone[..1]).0 < 0.5 * cost, "a part is less than the whole");
}

/// The delay of the joint angles is one more imperfection where the robot feeds, and none where it stands in each record.
#[test]
fn a_robot_that_stands_has_no_delay_of_its_angles() {
    on_large_stack(|| {
        let (divided, alone) = divided_and_alone(&measurement());
        let refinement = Box::new(Refinement::new(&Sought::parameters_of(&chain()), &bushings()));
        let mut plant = Box::new(Plant::new(&Accuracies::typical(), &chain()));
        let mut has_delay = |experiments: &[Experiment<BINS>]| {
            refinement.restart_plant_to(&mut plant, experiments);
            plant.imperfections.all.iter().any(|(own, _)| *own == Imperfection::JointDelay)
        };
        assert!(has_delay(core::slice::from_ref(&*divided)));
        assert!(!has_delay(&alone));
    });
}

/// Without noise in the seams no unknown is better known. A whole record stays as it is. The noise is a tenth of what the record states, so that each
/// unknown is known by more than noise.
#[test]
fn noise_in_seams_is_no_information() {
    on_large_stack(|| {
        let (chain, bounds, measurement) = (chain(), bounds(), measurement());
        let sought = Sought::parameters_of(&chain);
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let (mut divided, _) = divided_and_alone(&measurement);
        let noise = divided.force_noise.iter_mut().chain(&mut divided.acceleration_noise);
        noise.flatten().for_each(|mean_square| *mean_square *= 0.01);
        let whole = Record { path: heapless::Vec::new(), ..along(PARTS) };
        let mut whole = Experiment::new(&chain, &measurement, &whole, &mut [0.0; SAMPLES]).unwrap();
        let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
        let mut plant = Box::new(Plant::new(&Accuracies::typical(), &chain));
        let mut wider = |experiment: &mut Experiment<BINS>| {
            let own = core::slice::from_mut(experiment);
            refinement.restart_at(&sought.coordinates(&bushings()));
            refinement.restart_plant_to(&mut plant, own);
            while refinement.step_plant(&problem, own, &mut plant) == Outcome::Improving {}
            let (mut fit, _) = refinement.fit_plant(&problem, own, &mut plant).unwrap();
            let before = fit.clone();
            let stopped = refinement.leave_noise_out(&problem, own, &mut plant, &mut fit, || false);
            let is_divided = own.iter().any(|record| !record.is_whole());
            assert_eq!(stopped.is_none(), is_divided);
            refinement.leave_noise_out(&problem, own, &mut plant, &mut fit, || true).unwrap();
            let ratio = |i| fit.covariance.deviation(i) / before.covariance.deviation(i);
            let ratios = (0..sought.unknowns()).map(ratio);
            ratios.fold([f64::INFINITY, 0.0_f64], |[least, most], it| [least.min(it), most.max(it)])
        };
        assert_eq!(wider(&mut whole), [1.0, 1.0]);
        let [least, most] = wider(&mut divided);
        assert!(least > 0.999 && most > 1.001, "{least} to {most}");
    });
}

/// A fit that begins at the end of a descent gives a divided record its movement when a level ends, and a whole record none.
#[test]
fn a_level_that_ends_gives_the_movement_of_the_plant() {
    on_large_stack(|| {
        let (chain, bounds, measurement) = (chain(), bounds(), measurement());
        let sought = Sought::parameters_of(&chain);
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let (mut divided, _) = divided_and_alone(&measurement);
        let whole = Record { path: heapless::Vec::new(), ..along(PARTS) };
        let mut whole = Experiment::new(&chain, &measurement, &whole, &mut [0.0; SAMPLES]).unwrap();
        let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
        let mut plant = Box::new(Plant::new(&Accuracies::typical(), &chain));
        let mut moves = |experiments: &mut [Experiment<BINS>]| {
            let before = experiments[0].movement.order.re.clone();
            refinement.restart_plant_from_descent(&mut plant, experiments);
            while !plant.is_on_last_level() {
                refinement.step_plant(&problem, experiments, &mut plant);
            }
            experiments[0].movement.order.re != before
        };
        assert!(moves(core::slice::from_mut(&mut *divided)));
        assert!(!moves(core::slice::from_mut(&mut whole)));
    });
}

/// The delay of a record is that of all its parts: a divided record has one. Of a single record it would be the common delay, so that there is
/// another one, which is not late.
#[test]
fn the_parts_of_a_record_share_its_delay() {
    on_large_stack(compare_with_a_delay_of_each_part);
}

fn compare_with_a_delay_of_each_part() {
    let (chain, bounds, measurement) = (chain(), bounds(), measurement());
    let sought = Sought::parameters_of(&chain);
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let accuracies = Accuracies { record_delay: 1e-3, ..Accuracies::default() };
    let (divided, alone) = divided_and_alone(&measurement);
    let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
    let mut plant = Box::new(Plant::new(&accuracies, &chain));
    // Each record that is late costs its own prior, 1.
    let mut evaluate = |experiments: &[Experiment<BINS>], late: usize| {
        refinement.restart_plant(&mut plant, experiments.len(), false);
        assert_eq!(plant.imperfections.all.len(), experiments.len());
        plant.point.imperfections[..late].fill(1.0);
        let (_, mut objective, _, point) =
            refinement.minimisation(&problem, experiments, &mut plant);
        objective.cost(point) - late as f64
    };
    let records = std::vec![(*divided).clone(); 2];
    let parts = [&alone[..], &alone[..]].concat();
    let (whole, in_parts) = (evaluate(&records, 1), evaluate(&parts, PARTS));
    assert!((whole / in_parts - 1.0).abs() < 1e-9, "{whole}, not {in_parts}");
    let first = evaluate(&parts, 1);
    assert!((first / whole - 1.0).abs() > 1e-3, "the delay of one part is not that of all");
}
