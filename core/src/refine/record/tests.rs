use nalgebra::Vector3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

use super::super::tests::{
    BINS, SAMPLES, bounds, bushings, chain_of, measurement, problem, record,
};
use super::*;
use crate::spectrum::Experiment;
use crate::stream::Record;

/// Largest value of an unknown of the seam that noise may cause, in standard deviations of its prior.
const MOST: f64 = 4.0;

/// Standard deviation of the readings of [`record`], which are uniform, m/s².
const ACCELERATION_NOISE: f32 = 0.577;

/// Six joints: of the 78 unknowns of the seam many hardly differ in the band. Of a reading of noise alone each stays as small as its prior says, by which one
/// standard deviation adds as much to the reading as the whole reading is.
#[test]
fn no_unknown_of_the_seam_is_much_larger_than_the_reading() {
    let axes = [Vector3::z_axis(), Vector3::y_axis(), Vector3::y_axis()];
    let axes = axes.into_iter().chain([Vector3::x_axis(), Vector3::y_axis(), Vector3::x_axis()]);
    let joints: std::vec::Vec<_> = [0.9, 0.8, 0.7, 0.4, 0.3, 0.2].into_iter().zip(axes).collect();
    let (chain, measurement, bounds) = (chain_of(&joints), measurement(), bounds());
    let sought = Sought::parameters_of(&chain);
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let bushings = [bushings()[0]; 6].into_iter().collect();
    let coordinates = sought.coordinates(&bushings);
    let mut workspace = std::boxed::Box::new(Workspace::new());
    for seed in 0..8 {
        let pose = [0.4, -0.3, 0.6, 0.2, -0.5, 0.1].into_iter().collect();
        let record = Record {
            pose,
            acceleration_noise: [ACCELERATION_NOISE; 3],
            ..record(&mut Xoshiro256PlusPlus::seed_from_u64(seed))
        };
        let experiment =
            Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]).unwrap();
        let model = modelled::perfect(&problem, &coordinates, experiment.site()).unwrap();
        let only = experiment.parts().next().unwrap();
        let (seam, _) = workspace.fit_seam(&problem, &model, Bins::of(&experiment, &only));
        workspace.run(&problem, &model, Bins::of(&experiment, &only), Equations::Seam);
        let values = seam.to_solution(joints.len());
        for (unknown, value) in values.into_iter().enumerate().take(problem.seam_unknowns()) {
            let mut alone = [0.0; MAX_SEAM];
            alone[unknown] = value;
            let added = workspace.record.quadratic(&alone);
            let whole = Bins::of(&experiment, &only).square();
            assert!(
                added < MOST * MOST * whole,
                "seed {seed}, unknown {unknown}: {}",
                added / whole
            );
        }
    }
}
