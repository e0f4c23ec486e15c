//! Error of the parts of a record by their movement, by a model.
//!
//! A part is fitted at the pose in its middle. With the readings A₀ and A₁ that the model has under the same force and seam at the poses where the part
//! starts and ends, and every pose in between as likely, the mean square of the error is
//!
//! ```text
//! |A₁ − A₀|² / 12
//! ```

use heapless::Vec;

use super::batch::Bins;
use super::{Plant, Problem, Refinement};
use crate::MAX_JOINTS;
use crate::sought::Coordinates;
use crate::spectrum::{Experiment, Part, Site, Spectrum};

impl Refinement {
    /// Mean square of the error in each bin of a divided record of this number, per axis, (m/s)², by the model at some coordinates, or where a plant
    /// stands, if there is one. `None` where gravity leaves the robot no equilibrium.
    pub(crate) fn movement<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        plant: Option<&Plant>,
        experiment: &Experiment<B>,
        record: usize,
    ) -> Option<[Vec<f32, B>; 3]> {
        let mut movement = [const { Vec::new() }; 3];
        for part in experiment.parts() {
            let middle = self.model_of(problem, coordinates, plant, &part, record).ok()?;
            let (seam, _) = self.workspace.fit_seam(problem, &middle, Bins::of(experiment, &part));
            let mut left = [Spectrum::<B>::EMPTY, Spectrum::EMPTY];
            for (side, left) in [-0.5, 0.5].into_iter().zip(&mut left) {
                let pose = part.site.pose.iter().zip(part.site.rates);
                let pose = pose.map(|(q, rate)| q + side * rate * experiment.length());
                let pose: Vec<f64, MAX_JOINTS> = pose.collect();
                let end = Part { site: Site { pose: &pose, ..part.site }, ..part.clone() };
                let model = self.model_of(problem, coordinates, plant, &end, record).ok()?;
                let bins = Bins::of(experiment, &part);
                self.workspace.each_left_by(problem, &model, &seam, bins, &mut |bin| {
                    for (axis, [re, im]) in bin.left().iter().enumerate() {
                        // There is room: the experiment has as many bins.
                        let _ = left.re[axis].push(*re as f32);
                        let _ = left.im[axis].push(*im as f32);
                    }
                });
            }
            let [start, end] = &left;
            for (axis, movement) in movement.iter_mut().enumerate() {
                movement.extend((0..part.bins.len()).map(|bin| {
                    let change = [
                        end.re[axis][bin] - start.re[axis][bin],
                        end.im[axis][bin] - start.im[axis][bin],
                    ];
                    (change[0] * change[0] + change[1] * change[1]) / 12.0
                }));
            }
        }
        Some(movement)
    }
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;

    use super::super::tests::divided::{PARTS, along};
    use super::super::tests::{BINS, SAMPLES, bounds, bushings, chain, measurement, problem};
    use super::super::{Refinement, modelled};
    use super::*;
    use crate::receptance::{Complex, Response};
    use crate::sought::Sought;

    /// A model at rest explains the readings in the middle exactly. The seam is then zero, and the error is that of the response to the force: those at the
    /// ends come from the recursion alone.
    #[test]
    fn it_is_the_difference_of_the_responses_at_both_ends() {
        let (chain, bounds, measurement) = (chain(), bounds(), measurement());
        let sought = Sought::new(2).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let mut record = along(PARTS);
        // One pose for all: that of the record.
        let pose = record.pose.clone();
        record.path.iter_mut().for_each(|stage| stage.pose = pose.clone());
        let experiment =
            Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
        let mut experiment = experiment.unwrap();
        let travel: Vec<f64, MAX_JOINTS> = [0.02, -0.03].into_iter().collect();
        let rates = travel.iter().map(|change| change / experiment.length()).collect();
        experiment.rates.iter_mut().for_each(|own| own.clone_from(&rates));
        let coordinates = sought.coordinates(&bushings());
        let at = |experiment: &Experiment<BINS>, side: f64, bin: usize| {
            let pose = [0, 1].map(|joint| pose[joint] + side * travel[joint]);
            let site = Site { pose: &pose, ..experiment.site() };
            let model = modelled::perfect(&problem, &coordinates, site).unwrap();
            let mut response = Response::new(0.0);
            let force = core::array::from_fn(|axis| Complex {
                re: f64::from(experiment.force.re[axis][bin]),
                im: f64::from(experiment.force.im[axis][bin]),
            });
            let s = Complex { re: 0.0, im: experiment.omega(bin) };
            response.evaluate(&model.terms, s, &force, None);
            response.observed
        };
        for bin in 0..experiment.bins() {
            let read = at(&experiment, 0.0, bin);
            for (axis, read) in read.iter().enumerate() {
                experiment.acceleration.re[axis][bin] = read.re as f32;
                experiment.acceleration.im[axis][bin] = read.im as f32;
            }
        }
        let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
        let found = refinement.movement(&problem, &coordinates, None, &experiment, 0).unwrap();
        for bin in 0..experiment.bins() {
            let [start, end] = [-0.5, 0.5].map(|side| at(&experiment, side, bin));
            let all = |axis: usize| (end[axis] - start[axis]).square() / 12.0;
            let size = all(0) + all(1) + all(2);
            for axis in 0..3 {
                let error = (f64::from(found[axis][bin]) - all(axis)).abs();
                assert!(error < 1e-3 * size, "bin {bin}, axis {axis}: {error} of {size}");
            }
        }
    }
}
