use std::boxed::Box;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

use super::super::super::modelled;
use super::super::tests::{POSE, noisy, on_large_stack};
use super::*;
use crate::imperfection::Accuracies;
use crate::parameters::Bushings;
use crate::refine::Outcome;
use crate::refine::tests::{BINS, SAMPLES, bounds, bushings, chain, measurement, problem, record};
use crate::spectrum::Site;

/// A record of the robot has retired. Newer ones are of the same robot, or of one with a stiffness that is 5 % less, where noise is 0.3 % of a reading.
#[test]
fn retired_records_contradict_those_of_another_robot() {
    on_large_stack(|| {
        let measurement = measurement();
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::parameters_of(&chain);
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut softer = bushings();
        softer[1].stiffness[4] *= 0.95;
        let mut cut = |bushings: &Bushings| {
            [POSE, [-0.5, 0.6]].map(|pose| {
                let record = record(&mut random);
                let made =
                    Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
                let mut made = made.unwrap();
                made.path[0].pose = pose.into_iter().collect();
                made.pose.clone_from(&made.path[0].pose);
                let coordinates = sought.coordinates(bushings);
                let model = modelled::perfect(&problem, &coordinates, Site::tcp(&pose)).unwrap();
                noisy(made, &model, &mut random)
            })
        };
        let [mut first, mut second, mut other] =
            [bushings(), bushings(), softer].map(|own| cut(&own));
        let accuracies = Accuracies { delay: 1e-6, ..Accuracies::default() };
        let mut plant = Box::new(Plant::new(&accuracies, &chain));
        let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
        let contradicts =
            |refinement: &mut Refinement, plant: &mut Plant, cut: &mut [Experiment<BINS>; 2]| {
                refinement.restart_plant(plant, 2, false);
                while refinement.step_plant(&problem, cut, plant) == Outcome::Improving {}
                refinement.fit_plant(&problem, cut, plant).unwrap();
                plant.contradicts_retired(&problem, 1.0)
            };
        assert!(!contradicts(&mut refinement, &mut plant, &mut first));
        refinement.retire_on_plant(&problem, &first[0], 0, &mut plant).unwrap();
        assert!(!contradicts(&mut refinement, &mut plant, &mut second));
        assert!(contradicts(&mut refinement, &mut plant, &mut other));
        refinement.follow_retired(&mut plant);
        assert_eq!(refinement.forget_retired(&sought, &mut plant), 1);
        assert_eq!(plant.retired(), 0);
        assert!(!contradicts(&mut refinement, &mut plant, &mut other));
    });
}
