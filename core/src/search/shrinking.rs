//! Bound shrinking (paper, section 3.3): the distance from the centre within which an iteration samples.
//!
//! The paper names three methods and defines none of them. Here all three start at the same radius. The adaptive methods end
//! at the last radius of the schedule if half of their iterations do not improve the centre.

use crate::parameters::MAX_PARAMETERS;

/// Rule for the radius of the hypersphere. Radii are in units of the bound ranges: in 36 dimensions a sphere of radius 1
/// moves a single parameter by a sixth of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shrinking {
    /// The radius shrinks by a constant factor per iteration, from the first radius to the last.
    Scheduled {
        /// Radius of the first iteration.
        first: f32,
        /// Radius after the last iteration.
        last: f32,
    },
    /// All parameters have one radius, which shrinks after each iteration that has not improved the centre.
    Global {
        /// Radius of the first iteration.
        first: f32,
        /// Radius after the last iteration if half of the iterations fail.
        last: f32,
    },
    /// Each parameter has its own radius. It shrinks after each iteration that has not improved the centre, or that has
    /// improved it with less than a typical step of this parameter.
    Local {
        /// Radius of the first iteration.
        first: f32,
        /// Like [`Shrinking::Global`], if also half of the steps that improve the centre are typical.
        last: f32,
    },
}

/// Radii of a search: half axes of an ellipsoid.
#[derive(Clone, Debug)]
pub(super) struct Radii {
    shrinking: Shrinking,
    iterations: u32,
    radii: [f32; MAX_PARAMETERS],
}

impl Radii {
    /// Radii at the start of a search of `iterations` iterations.
    pub(super) fn new(shrinking: Shrinking, iterations: u32) -> Self {
        let (Shrinking::Scheduled { first, .. }
        | Shrinking::Global { first, .. }
        | Shrinking::Local { first, .. }) = shrinking;
        Self { shrinking, iterations, radii: [first; MAX_PARAMETERS] }
    }

    /// Half axis along each parameter, in units of the bound ranges.
    pub(super) fn get(&self) -> &[f32; MAX_PARAMETERS] {
        &self.radii
    }

    /// Shrinks the radii after `iteration` iterations. The last one moved the centre by `step` (one entry per parameter);
    /// `bettered` states whether it improved the centre.
    pub(super) fn shrink(&mut self, iteration: u32, bettered: bool, step: &[f32]) {
        let portion = |iterations: f32| iterations / self.iterations as f32;
        match self.shrinking {
            Shrinking::Scheduled { first, last } => {
                let radius = first * libm::powf(last / first, portion(iteration as f32));
                self.radii = [radius; MAX_PARAMETERS];
            }
            Shrinking::Global { .. } if bettered => {}
            Shrinking::Global { first, last } => {
                // If half of the iterations fail, the radius shrinks in every second iteration.
                let factor = libm::powf(last / first, portion(2.0));
                self.radii.iter_mut().for_each(|radius| *radius *= factor);
            }
            Shrinking::Local { first, last } => {
                // The radius shrinks in the half of the iterations that fail, and in half of the others: in three of four.
                let factor = libm::powf(last / first, portion(4.0 / 3.0));
                let typical = typical_step(step.len());
                for (radius, step) in self.radii.iter_mut().zip(step) {
                    if !bettered || step.abs() < typical * *radius {
                        *radius *= factor;
                    }
                }
            }
        }
    }
}

/// Median step of one coordinate in a unit ball of `dimensions` dimensions: 0.67 standard deviations.
fn typical_step(dimensions: usize) -> f32 {
    0.674_49 / libm::sqrtf(dimensions as f32 + 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: f32 = 1.0;
    const LAST: f32 = 0.01;

    #[test]
    fn the_schedule_ends_at_the_last_radius() {
        let mut radii = Radii::new(Shrinking::Scheduled { first: FIRST, last: LAST }, 50);
        radii.shrink(25, false, &[0.0; 4]);
        assert!((radii.get()[0] - 0.1).abs() < 1e-6);
        radii.shrink(50, true, &[0.0; 4]);
        assert!((radii.get()[3] - LAST).abs() < 1e-7);
    }

    #[test]
    fn the_global_radius_shrinks_by_failures_alone() {
        let mut radii = Radii::new(Shrinking::Global { first: FIRST, last: LAST }, 50);
        for iteration in 1..=50 {
            radii.shrink(iteration, iteration % 2 == 0, &[0.0; 4]);
        }
        assert!((radii.get()[0] - LAST).abs() < 1e-6, "{}", radii.get()[0]);
    }

    #[test]
    fn a_local_radius_shrinks_where_the_centre_hardly_moved() {
        let mut radii = Radii::new(Shrinking::Local { first: FIRST, last: LAST }, 50);
        radii.shrink(1, true, &[0.0, 0.9, 0.1, -0.9]);
        let [still, moved, crept, back, ..] = *radii.get();
        assert!(still < 1.0 && crept < 1.0 && moved == 1.0 && back == 1.0);
        radii.shrink(2, false, &[0.0; 4]);
        assert!(radii.get()[1] < 1.0);
    }

    #[test]
    fn a_local_radius_ends_like_the_global_one() {
        let mut radii = Radii::new(Shrinking::Local { first: FIRST, last: LAST }, 60);
        for iteration in 1..=60 {
            let step = if iteration % 4 == 0 { 2.0 } else { 0.0 };
            radii.shrink(iteration, iteration % 2 == 0, &[step; 4]);
        }
        assert!((radii.get()[0] - LAST).abs() < 1e-6, "{}", radii.get()[0]);
    }
}
