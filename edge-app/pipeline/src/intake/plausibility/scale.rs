//! Checks whether force and acceleration agree with the masses of the model, for any stiffnesses and dampings within their
//! bounds.
//!
//! Robots are drawn from the bounds. The measured force gives each of them an acceleration, whose energy in the band is
//! compared with the measured one. A wrong unit changes the ratio by its size. A robot within the bounds does not, since its
//! masses are given.

use std::collections::VecDeque;

use fearless_simd::Level;
use flexid_core::loss::spectral;
use flexid_core::loss::target::Target;
use flexid_core::parameters::{Bounds, Bushings};
use flexid_wire::warning::{Warning, WrongUnit};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::{Experiment, MAX_EXPERIMENTS};

/// Number of robots that are drawn beside the four in the corners of the bounds.
const DRAWN: usize = 28;
/// Ratio to the smallest acceleration of any drawn robot below which the measured acceleration is too small. The acceleration
/// of the true robot is no smaller, apart from a few per cent by the gains of the sensors and by the limited number of draws.
/// Noise only adds to it. The nearest wrong unit, g, makes it a tenth.
const TOO_SMALL: f64 = 0.5;
/// Ratio to the largest acceleration of any drawn robot above which the measured acceleration is too large: halfway to the
/// nearest wrong unit of this kind, kN or mm/s² (1000). A ratio between may be caused by noise, which the fit weighs.
const TOO_LARGE: f64 = 31.6;
/// Ratio below which g is no longer likely: halfway from 1/9.81 to 1/1000.
const NOT_G: f64 = 0.0101;

/// Ratios of the measured acceleration to the nearest acceleration of any drawn robot, for the newest records. A ratio is 1 if
/// the measured acceleration lies between the smallest and the largest.
#[derive(Clone, Debug)]
pub(crate) struct Scale {
    robots: Vec<Bushings>,
    level: Level,
    ratios: VecDeque<f64>,
}

impl Scale {
    pub(crate) fn new(bounds: &Bounds, joints: usize, level: Level) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        let mut uniform = || (rng.next_u32() >> 8) as f32 / (1 << 24) as f32;
        // Joint by joint, six stiffnesses, then six dampings.
        let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
        let corners = corners
            .map(|[stiffness, damping]| [[stiffness; 6], [damping; 6]].concat().repeat(joints));
        let drawn = (0..DRAWN).map(|_| (0..12 * joints).map(|_| uniform()).collect());
        let robots = corners.into_iter().chain(drawn);
        // `bushings` fails only for a number of joints that a checked model cannot have.
        let robots = robots.filter_map(|fractions: Vec<f32>| bounds.bushings(&fractions).ok());
        let robots = robots.collect();
        Self { robots, level, ratios: VecDeque::new() }
    }

    /// Returns the ratio of a record. `target` is the chain at its pose.
    pub(crate) fn ratio(&self, target: &Target, experiment: &Experiment) -> f64 {
        let energies = spectral::energies(target, experiment, &self.robots, self.level);
        let measured = f64::from(energies.measured);
        let [least, most] = energies.modelled.map(f64::from);
        (measured / measured.clamp(least, most)).sqrt()
    }

    /// Adds the ratio of a record.
    pub(crate) fn note(&mut self, ratio: f64) {
        if self.ratios.len() == MAX_EXPERIMENTS {
            self.ratios.pop_front();
        }
        self.ratios.push_back(ratio);
    }

    /// Returns a warning about the units or the masses, if the median ratio of the records is implausible.
    pub(crate) fn warning(&self) -> Option<Warning> {
        let mut sorted: Vec<f64> = self.ratios.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).and_then(|median| disproportion(*median))
    }
}

/// Returns the warning for a median ratio that no robot within the bounds explains.
fn disproportion(ratio: f64) -> Option<Warning> {
    let suspect = if ratio < NOT_G {
        WrongUnit::ForceInMilli
    } else if ratio < TOO_SMALL {
        WrongUnit::AccelerationInG
    } else if ratio > TOO_LARGE {
        WrongUnit::ForceInKiloOrAccelerationInMilli
    } else {
        return None;
    };
    Some(Warning::Disproportion { ratio, suspect })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(ratios: &[f64]) -> Option<String> {
        let bounds = Bounds::new([1e7, 2e8], [1e6, 1e8], [1e3, 1e5], [1e2, 5e4]).unwrap();
        let mut scale = Scale::new(&bounds, 3, Level::new());
        scale.ratios.extend(ratios);
        scale.warning().map(|warning| warning.to_string())
    }

    #[test]
    fn the_unit_that_is_likely_is_asked_for() {
        assert_eq!(
            [line(&[]), line(&[1.0, 0.1, 1.0]), line(&[4.0]), line(&[0.6])],
            [const { None }; 4]
        );
        let g = line(&[0.1, 0.1, 1.0]).unwrap();
        assert!(
            g.starts_with("the acceleration is 1.0e-1 times what") && g.contains("in g?"),
            "{g}"
        );
        assert!(line(&[900.0]).unwrap().contains("in kN, or the acceleration in mm/s^2?"));
        assert!(line(&[0.001]).unwrap().contains("is the force in mN?"));
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
