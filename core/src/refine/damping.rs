//! Damping of the steps, relative to the information of each unknown.
//!
//! The gain of a step is compared with the gain that the normal equations predict, as in a trust region (Nocedal and Wright,
//! _Numerical Optimization_, 2006, section 4.1). At a large damping λ the length of a step is proportional to `1/λ`: four times λ is
//! a quarter of the radius.
//!
//! Along the floor of a narrow, curved valley a damping that falls by ten is rejected in every second step (Transtrum and Sethna,
//! "Improvements to the Levenberg-Marquardt algorithm for nonlinear least-squares minimization", arXiv:1201.5885, 2012). A bracketed
//! damping stays between the last one that was rejected and the last one that was kept.

/// First damping (Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM 11, 1963).
const FIRST: f64 = 1e-2;
/// Factor between the dampings of subsequent steps, up or down (Marquardt, 1963: ν).
const UP: f64 = 10.0;
/// Inverse of [`UP`].
const DOWN: f64 = 0.1;
/// Part of the predicted gain above which the prediction is good, and the damping falls (Nocedal and Wright, algorithm 4.1).
const GOOD: f64 = 0.75;
/// Part of the predicted gain up to which the prediction is poor, and the damping rises (as above).
const POOR: f64 = 0.25;
/// Factor by which the damping rises after a poor prediction (as above: the radius falls to a quarter).
const POOR_UP: f64 = 4.0;
/// Factor by which the lower end of a bracket falls after a step that was kept. Chosen: in a narrow valley of a fit to a plant the same
/// number of steps then gains twice as much as without a bracket.
const FORGETTING: f64 = 0.5;

/// Damping λ of the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Damping {
    value: f64,
    /// Least damping after a step that was kept.
    least: f64,
    bracket: Option<Bracket>,
}

/// Ends of a bracket, 0 where no step has set them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bracket {
    /// Lower end: the damping of the last step that was rejected, halved by each step that was kept since.
    rejected: f64,
    /// Damping of the last step that was kept.
    kept: f64,
}

impl Damping {
    /// Damping of the first step.
    pub(crate) const fn first(least: f64) -> Self {
        Self { value: FIRST, least, bracket: None }
    }

    /// Damping of the first step, bracketed.
    pub(crate) const fn bracketed(least: f64) -> Self {
        Self { value: FIRST, least, bracket: Some(Bracket { rejected: 0.0, kept: 0.0 }) }
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
        let mut next = factor * self.value;
        if let Some(Bracket { rejected, kept }) = &mut self.bracket {
            // A step that was kept disproves a lower end above it.
            *rejected = rejected.min(self.value);
            if *rejected < self.value && next <= *rejected {
                next = libm::sqrt(self.value * *rejected);
            }
            *kept = self.value;
            *rejected *= FORGETTING;
        }
        self.value = next.max(self.least);
    }

    /// Rises after a step that was rejected.
    pub(crate) fn rise(&mut self) {
        let mut next = UP * self.value;
        if let Some(Bracket { rejected, kept }) = &mut self.bracket {
            *rejected = self.value;
            if *kept > self.value {
                next = next.min(*kept);
            }
        }
        self.value = next;
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

    /// 1e-2 and 1e-3 are kept, 1e-4 is rejected: the next ones lie between the last two, and then go below 1e-4 again.
    #[test]
    fn a_bracketed_damping_stays_between_the_rejected_and_the_kept_one() {
        let mut damping = Damping::bracketed(1e-9);
        let near = |damping: &Damping, expected: f64| {
            assert!((damping.value() / expected - 1.0).abs() < 1e-12, "{damping:?} {expected}");
        };
        (0..2).for_each(|_| damping.follow(1.0));
        damping.rise();
        near(&damping, 1e-3);
        damping.follow(1.0);
        // √(1e-3 · 1e-4)
        near(&damping, libm::sqrt(1e-7));
        damping.rise();
        near(&damping, 1e-3);
        // Each is the geometric mean of the one before and the lower end, √(1e-7) at first, then a half of that, a quarter, an eighth.
        for expected in [5.623_413e-4, 2.981_845e-4, 1.535_368e-4, 7.790_427e-5] {
            damping.follow(1.0);
            assert!((damping.value() / expected - 1.0).abs() < 1e-5, "{damping:?} {expected}");
        }
    }

    /// 1e-2 is rejected, 1e-1 is kept, a step at 1e-3 goes further and is kept: the damping falls on.
    #[test]
    fn a_step_that_is_kept_below_the_bracket_opens_it() {
        let mut damping = Damping::bracketed(1e-9);
        damping.rise();
        damping.follow(1.0);
        damping.fall();
        let kept = damping.value();
        damping.follow(1.0);
        assert!((damping.value() / (0.1 * kept) - 1.0).abs() < 1e-12, "{damping:?}");
    }
}
