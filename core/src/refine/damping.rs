//! Damping of the steps, relative to the information of each unknown.
//!
//! The gain of a step is compared with the gain that the normal equations predict, as in a trust region (Nocedal and Wright,
//! _Numerical Optimization_, 2006, section 4.1). At a large damping λ the length of a step is proportional to `1/λ`: four times λ is
//! a quarter of the radius.

/// First damping (Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM 11, 1963).
const FIRST: f64 = 1e-2;
/// Factor between the dampings of subsequent steps, up or down (Marquardt, 1963: ν).
const UP: f64 = 10.0;
/// Its inverse.
const DOWN: f64 = 0.1;
/// Part of the predicted gain above which the prediction is good, and the damping falls (Nocedal and Wright, algorithm 4.1).
const GOOD: f64 = 0.75;
/// Part of the predicted gain up to which the prediction is poor, and the damping rises (as above).
const POOR: f64 = 0.25;
/// Factor by which the damping rises after a poor prediction (as above: the radius falls to a quarter).
const POOR_UP: f64 = 4.0;

/// Damping λ of the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Damping {
    value: f64,
    /// Least damping after a step that was kept.
    least: f64,
}

impl Damping {
    /// Damping of the first step.
    pub(crate) const fn first(least: f64) -> Self {
        Self { value: FIRST, least }
    }

    /// λ.
    pub(crate) fn value(&self) -> f64 {
        self.value
    }

    /// Follows a step that was kept, by its gain over the predicted gain.
    pub(crate) fn follow(&mut self, ratio: f64) {
        let factor = if ratio > GOOD {
            DOWN
        } else if ratio > POOR {
            1.0
        } else {
            POOR_UP
        };
        self.value = (factor * self.value).max(self.least);
    }

    /// Rises after a step that was rejected.
    pub(crate) fn rise(&mut self) {
        self.value *= UP;
    }

    /// Falls for a step that goes further.
    pub(crate) fn fall(&mut self) {
        self.value *= DOWN;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_damping_follows_the_gain() {
        for (ratio, expected) in
            [(1.0, 1e-3), (0.76, 1e-3), (0.74, 1e-2), (0.26, 1e-2), (0.24, 4e-2)]
        {
            let mut damping = Damping::first(1e-4);
            damping.follow(ratio);
            assert!((damping.value() / expected - 1.0).abs() < 1e-12, "{ratio}: {damping:?}");
        }
        let mut damping = Damping::first(1e-4);
        (0..5).for_each(|_| damping.follow(1.0));
        assert_eq!(damping.value(), 1e-4);
    }
}
