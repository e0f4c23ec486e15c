//! Whether force and acceleration go with the masses of the model, whatever its stiffnesses and dampings within their bounds.
//!
//! The acceleration that the measured force makes of robots drawn from the bounds, as energy in the band, against the measured
//! one. A unit that is wrong changes the ratio by its size; a robot within the bounds does not, since its masses are given.

use std::collections::VecDeque;

use fearless_simd::Level;
use flexid_core::loss::spectral;
use flexid_core::parameters::{Bounds, Bushings};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::pipeline::{Experiment, MAX_EXPERIMENTS};

/// Robots that are drawn beside the four in the corners of the bounds.
const DRAWN: usize = 28;
/// The acceleration is too small below this part of the least that any of the robots has. The robot's own is no less than that,
/// but for a few per cent of the sensors' gains and what the draws leave open, and noise only adds to it; g, the nearest wrong unit,
/// makes it a tenth.
const TOO_SMALL: f64 = 0.5;
/// It is too large above this many times that: halfway to the nearest wrong unit of such a kind, kN or mm/s² (1000). What lies
/// between may be noise, which the fit weighs.
const TOO_LARGE: f64 = 31.6;
/// From here down it is no longer g that is likely: halfway from 1/9.81 to 1/1000.
const NOT_G: f64 = 0.0101;

/// Ratios of the measured acceleration to the nearest that any of the robots has, of the newest records; 1 between the least and
/// the most.
#[derive(Clone, Debug)]
pub(in crate::pipeline) struct Scale {
    robots: Vec<Bushings>,
    level: Level,
    ratios: VecDeque<f64>,
}

impl Scale {
    pub(in crate::pipeline) fn new(bounds: &Bounds, joints: usize, level: Level) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        let mut uniform = || (rng.next_u32() >> 8) as f32 / (1 << 24) as f32;
        // Joint by joint, six stiffnesses, then six dampings.
        let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
        let corners = corners
            .map(|[stiffness, damping]| [[stiffness; 6], [damping; 6]].concat().repeat(joints));
        let drawn = (0..DRAWN).map(|_| (0..12 * joints).map(|_| uniform()).collect());
        let robots = corners.into_iter().chain(drawn);
        // A checked model has as many joints as there may be.
        let robots = robots.filter_map(|fractions: Vec<f32>| bounds.bushings(&fractions).ok());
        let robots = robots.collect();
        Self { robots, level, ratios: VecDeque::new() }
    }

    /// Takes a record into account.
    pub(in crate::pipeline) fn note(&mut self, experiment: &Experiment) {
        let mut model = [f64::INFINITY, 0.0];
        let mut measured = 0.0;
        for robot in &self.robots {
            let energies = spectral::energies(experiment, robot, self.level);
            measured = f64::from(energies.measured);
            let modelled = f64::from(energies.modelled);
            model = [model[0].min(modelled), model[1].max(modelled)];
        }
        if self.ratios.len() == MAX_EXPERIMENTS {
            self.ratios.pop_front();
        }
        self.ratios.push_back((measured / measured.clamp(model[0], model[1])).sqrt());
    }

    /// What is wrong with the units, or the masses, if most of the records say so.
    pub(in crate::pipeline) fn warning(&self) -> Option<String> {
        let mut sorted: Vec<f64> = self.ratios.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).and_then(|median| Self::line(*median))
    }

    /// Of a ratio that no robot within the bounds explains.
    pub(in crate::pipeline) fn line(median: f64) -> Option<String> {
        let unit = if median < NOT_G {
            "is the force in mN?"
        } else if median < TOO_SMALL {
            "is the acceleration in g?"
        } else if median > TOO_LARGE {
            "is the force in kN, or the acceleration in mm/s^2?"
        } else {
            return None;
        };
        Some(format!(
            "the acceleration is {median:.1e} times what the force makes of the model's masses within [bounds]: {unit} give \
             units in [bus] dbc; or mend masses or [bounds]"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(ratios: &[f64]) -> Option<String> {
        let bounds = Bounds::new([1e7, 2e8], [1e6, 1e8], [1e3, 1e5], [1e2, 5e4]).unwrap();
        let mut scale = Scale::new(&bounds, 3, Level::new());
        scale.ratios.extend(ratios);
        scale.warning()
    }

    #[test]
    fn the_unit_that_is_likely_is_asked_for() {
        assert_eq!(
            [told(&[]), told(&[1.0, 0.1, 1.0]), told(&[4.0]), told(&[0.6])],
            [const { None }; 4]
        );
        let g = told(&[0.1, 0.1, 1.0]).unwrap();
        assert!(
            g.starts_with("the acceleration is 1.0e-1 times what") && g.contains("in g?"),
            "{g}"
        );
        assert!(told(&[900.0]).unwrap().contains("in kN, or the acceleration in mm/s^2?"));
        assert!(told(&[0.001]).unwrap().contains("is the force in mN?"));
    }

    #[test]
    fn the_robots_reach_every_corner_of_the_bounds() {
        let bounds = Bounds::new([1e7, 2e8], [1e6, 1e8], [1e3, 1e5], [1e2, 5e4]).unwrap();
        let scale = Scale::new(&bounds, 2, Level::new());
        assert_eq!(scale.robots.len(), DRAWN + 4);
        for (robot, stiffness, damping) in
            [(0, 1e7, 1e3), (1, 1e7, 1e5), (2, 2e8, 1e3), (3, 2e8, 1e5)]
        {
            for bushing in &scale.robots[robot] {
                assert!((bushing.stiffness[0] / stiffness - 1.0).abs() < 1e-6);
                assert!((bushing.damping[2] / damping - 1.0).abs() < 1e-6);
            }
        }
    }
}
