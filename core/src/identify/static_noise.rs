//! The standard deviation of displacements that state none.

use rand_core::Rng;

use super::{Effort, Identifier, Phase};
use crate::spectrum::Experiment;
use crate::statics::{DIAL_GAUGE, RESOLVED, StaticTest};
use crate::verdict::fisher_exceeds;

/// Most fits. Chosen: where no displacement states its noise the first is enough, but for bounds and priors.
const ROUNDS: usize = 20;
/// Relative change of the deviation at which it has settled. Chosen: a tenth of its own error for fifty readings.
const SETTLED: f64 = 0.01;
/// Least redundancy of the displacements. Chosen: one degree of freedom; below, none is left to estimate by.
const LEAST_REDUNDANCY: f64 = 1.0;
/// Largest estimated deviation, in the displacements' root mean square, but at least that of a dial gauge. Chosen: a dozen residuals and more
/// that are half of the displacements then object to the model.
const UNEXPLAINED: f64 = 0.25;
/// Standard deviations within which 95 % of a normal distribution lie.
const WITHIN: f64 = 1.959_964;
/// Halvings of an interval of 100 that leave less than rounding.
const HALVINGS: u32 = 60;

impl<R: Rng> Identifier<R> {
    /// Estimates the standard deviation that all displacements have which state none, and gives it to them. Call it after
    /// [`Identifier::add_statics`] and [`Identifier::seek`], before the first record; `B` is the number of bins of its experiments.
    /// Returns the deviation in m. `None` if all state theirs, or if the residuals are too few to tell: then [`DIAL_GAUGE`] is assumed.
    ///
    /// A fit to the static tests alone leaves the residuals r, in standard deviations σ, and the hat values h. Over the readings that
    /// state none (Förstner, "Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten", 1979),
    ///
    /// ```text
    /// σ² ← σ² Σ r² / Σ (1 − h)
    /// ```
    ///
    /// until it stays. It is at most a quarter of the displacements' root mean square: residuals of half of them object to the model, as
    /// where all displacements have the wrong sign. Of a deviation that ν = Σ (1 − h) readings give, an interval of 95 % has `t_ν` standard
    /// deviations, Student's t, in place of 1.96. The fit takes the deviation as so much larger, within the same limit.
    pub fn estimate_static_deviation<const B: usize>(&mut self) -> Option<f64> {
        let mut deviation = None;
        if self.statics.iter().any(has_unstated) {
            let (mut present, mut wider) = (DIAL_GAUGE, 1.0);
            for _ in 0..ROUNDS {
                self.set_unstated(present);
                let Some([next, redundancy]) = self.deviation_by_residuals::<B>(present) else {
                    (present, wider) = (DIAL_GAUGE, 1.0);
                    deviation = None;
                    break;
                };
                deviation = Some(next);
                wider = widening(redundancy);
                let change = next / present - 1.0;
                present = next;
                if change.abs() < SETTLED {
                    break;
                }
            }
            self.set_unstated((wider * present).min(self.largest_unstated()));
            self.phase = Phase::Waiting;
            self.estimate = None;
            self.effort = Effort::default();
        }
        deviation
    }

    /// The deviation that follows from the residuals of a fit at the `present` one, and their redundancy.
    fn deviation_by_residuals<const B: usize>(&mut self, present: f64) -> Option<[f64; 2]> {
        let none: &mut [Experiment<B>] = &mut [];
        self.renew(none);
        while !matches!(self.step(none), Phase::Settled | Phase::Waiting) {}
        let left_out = &self.estimate.as_ref()?.static_tests;
        let (mut squares, mut redundancy) = (0.0, 0.0);
        for (test, left_out) in self.statics.iter().zip(left_out) {
            for (axis, _) in test.readings().filter(|(_, reading)| !reading.is_stated) {
                squares += left_out.residual[axis].map_or(0.0, |r| r * r);
                redundancy += left_out.redundancy[axis];
            }
        }
        let deviation = present * libm::sqrt(squares / redundancy);
        (redundancy >= LEAST_REDUNDANCY)
            .then(|| [deviation.min(self.largest_unstated()).max(RESOLVED), redundancy])
    }

    /// Largest deviation of the displacements that state none, m.
    fn largest_unstated(&self) -> f64 {
        let readings = self.statics.iter().flat_map(StaticTest::readings);
        let unstated = readings.filter(|(_, reading)| !reading.is_stated);
        let (count, squares) = unstated.fold((0.0, 0.0), |(count, squares), (_, reading)| {
            (count + 1.0, squares + reading.value * reading.value)
        });
        (UNEXPLAINED * libm::sqrt(squares / f64::max(count, 1.0))).max(DIAL_GAUGE)
    }

    fn set_unstated(&mut self, deviation: f64) {
        let readings = self.statics.iter_mut().flat_map(|test| &mut test.displacement).flatten();
        for reading in readings.filter(|reading| !reading.is_stated) {
            reading.deviation = deviation;
        }
    }
}

/// `t_ν / 1.96`: the square of Student's t is Fisher's F of 1 and ν degrees of freedom.
fn widening(freedom: f64) -> f64 {
    let (mut lower, mut upper) = (1.0, 100.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (lower + upper);
        let t = WITHIN * middle;
        let side = if fisher_exceeds(t * t, 1.0, freedom) > 0.05 { &mut lower } else { &mut upper };
        *side = middle;
    }
    upper
}

fn has_unstated(test: &StaticTest) -> bool {
    test.readings().any(|(_, reading)| !reading.is_stated)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of Student's t, 95 % on both sides.
    #[test]
    fn intervals_are_as_wide_as_those_of_student() {
        for (freedom, t) in [(1.0, 12.706), (2.0, 4.303), (5.0, 2.571), (30.0, 2.042)] {
            let own = WITHIN * widening(freedom);
            assert!((own - t).abs() < 1e-3, "{freedom}: {own} for {t}");
        }
    }
}
