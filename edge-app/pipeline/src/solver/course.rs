//! The course of the work: where each refinement stood after its steps.

use flexid_core::identify::{Phase, Progress};

/// Most points that are kept. Chosen: more than a chart shows; a daemon runs for years.
const MOST: usize = 2048;

/// The point at which a refinement stood after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoursePoint {
    /// Number of steps of all searches and refinements before.
    pub step: u64,
    /// Number of searches begun.
    pub starts: u32,
    /// Number of records that the step fits.
    pub records: u64,
    /// Sum of squares of the whitened residuals and priors per real residual: about 1 where noise alone is left.
    pub misfit: f64,
}

/// Points of the work, of which all, or every second, fourth, ... is kept.
#[derive(Clone, Debug)]
pub(super) struct Course {
    points: Vec<CoursePoint>,
    /// One of so many points is kept.
    every: u64,
    came: u64,
}

impl Course {
    pub(super) fn new() -> Self {
        Self { points: Vec::new(), every: 1, came: 0 }
    }

    /// Notes where a refinement of `records` stands, which have so many real residuals. Other phases leave no point.
    pub(super) fn note(&mut self, progress: &Progress, records: u64, residuals: usize) {
        if progress.phase != Phase::Refining || !progress.objective.is_finite() || residuals == 0 {
            return;
        }
        self.came += 1;
        if !(self.came - 1).is_multiple_of(self.every) {
            return;
        }
        let effort = progress.effort;
        self.points.push(CoursePoint {
            step: effort.search_evaluations + effort.refine_iterations,
            starts: effort.starts,
            records,
            misfit: progress.objective / residuals as f64,
        });
        if self.points.len() >= MOST {
            let mut index = 0;
            self.points.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.every *= 2;
        }
    }

    pub(super) fn points(&self) -> &[CoursePoint] {
        &self.points
    }
}

#[cfg(test)]
mod tests {
    use flexid_core::identify::Effort;

    use super::*;

    fn progress(phase: Phase, refine_iterations: u64, objective: f64) -> Progress {
        let effort = Effort { refine_iterations, ..Effort::default() };
        Progress { phase, fraction: 0.0, effort, search_loss: 1.0, objective }
    }

    #[test]
    fn refinements_leave_points_and_searches_none() {
        let mut course = Course::new();
        course.note(&progress(Phase::Searching, 1, 8.0), 1, 4);
        course.note(&progress(Phase::Refining, 2, f64::NAN), 1, 4);
        course.note(&progress(Phase::Refining, 3, 8.0), 1, 4);
        assert_eq!(course.points(), [CoursePoint { step: 3, starts: 0, records: 1, misfit: 2.0 }]);
    }

    /// Whatever comes, at most 2048 points stay, equally far apart.
    #[test]
    fn memory_is_bounded() {
        let mut course = Course::new();
        for step in 0..50_000 {
            course.note(&progress(Phase::Refining, step, 1.0), 1, 1);
        }
        let points = course.points();
        assert!((MOST / 2..MOST).contains(&points.len()), "{}", points.len());
        assert_eq!(points[0].step, 0);
        assert!(points.windows(2).all(|pair| pair[1].step - pair[0].step == 32), "{:?}", points[1]);
    }
}
