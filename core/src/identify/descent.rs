//! A descent, and what is tried where its end does not explain the records: a shorter one, and then each stiffness in turn is made
//! soft.
//!
//! A bushing that resonates below the band shows the apparent compliance `1/(k − mω²)` of the mass that it carries, which is
//! negative. From a stiffer one a descent comes nearest to it with no compliance at all, at the upper bound, and the resonance
//! that lies between is a barrier.

use super::start::{middle, with_stiffness};
use crate::continuation::Continuation;
use crate::parameters::Bounds;
use crate::refine::{ParameterNormal, Problem};
use crate::spectrum::Experiment;
use crate::unknowns::{Coordinate, Coordinates, Sought};

/// Misfit up to which a descent has found a basin that is worth a refinement: noise alone leaves a half, and hardly more by
/// chance, since the residuals are thousands.
const FITS: f64 = 0.6;
/// How far above its lower bound a softened stiffness lies, by logarithms: at the default bounds its bushing resonates at 3 Hz,
/// below nearly all of the band.
const SOFT: f64 = 1.0;
/// A softened stiffness is descended from if the cost is at most this many times that of the best end: right ones raised it to
/// 0.9 to 5.4 times, nearly all others to hundreds.
const WORTH_A_DESCENT: f64 = 10.0;
/// Its end is better if the misfit falls to less than this part: that of right ones fell to 0.07 to 0.77, of wrong ones to 0.97.
const BETTER: f64 = 0.9;
/// So many softened stiffnesses are descended from in one start: those near the tip, which come first, lead to a better end.
const MAX_SOFTENED: u32 = 8;

/// The descents of one start.
#[derive(Clone, Debug)]
pub(super) struct Descent {
    present: Continuation,
    /// What the present one is.
    trial: Trial,
    /// It has begun.
    begun: bool,
    /// Stiffnesses are softened even if the end fits.
    thorough: bool,
    best: Option<End>,
    /// A refinement has begun at the best end. Begun there once more it would end in the same minimum, which says nothing.
    refined: bool,
    /// The unknown whose stiffness was softened last with a better end; where no other is better, the round ends there.
    kept: Option<usize>,
    /// Softened stiffnesses that are still descended from.
    left: u32,
}

/// How a descent begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Trial {
    /// At the lowest frequencies.
    Long,
    /// Without the lowest frequencies.
    Short,
    /// On the whole band, the stiffness of this unknown softened.
    Softened(usize),
}

/// Where a descent has ended.
#[derive(Clone, Copy, Debug)]
struct End {
    coordinates: Coordinates,
    misfit: f64,
    /// On the whole band, while the band widens.
    cost: f64,
}

impl Descent {
    /// From the lowest frequencies upward.
    pub(super) fn new(start: Coordinates) -> Self {
        Self::of(Trial::Long, Continuation::new(start))
    }

    /// Without the lowest frequencies, so that it depends on the start; stiffnesses are softened even if its end fits.
    pub(super) fn shorter(start: Coordinates) -> Self {
        Self { thorough: true, ..Self::of(Trial::Short, Continuation::shorter(start)) }
    }

    fn of(trial: Trial, present: Continuation) -> Self {
        Self {
            present,
            trial,
            begun: true,
            thorough: false,
            best: None,
            refined: false,
            kept: None,
            left: MAX_SOFTENED,
        }
    }

    /// Goes on from the best end with stiffnesses softened, although it fits: a refinement from there has failed.
    pub(super) fn go_on_thoroughly(&mut self) {
        self.thorough = true;
        self.left = MAX_SOFTENED;
    }

    /// Takes notice of changed records: begins again, from the best end if there is one.
    pub(super) fn renew(&mut self) {
        let from = self.best.map_or(*self.present.coordinates(), |best| best.coordinates);
        *self = Self { thorough: self.thorough, ..Self::new(from) };
    }

    /// How much of what goes on is done, 0 to 1.
    pub(super) fn fraction(&self) -> f32 {
        self.present.fraction()
    }

    /// Tries one step; the best end, once there is nothing more to try. Where that has been refined already, it begins anew
    /// from a `next` start. `room` stays untouched between the steps.
    pub(super) fn step<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        room: &mut ParameterNormal,
        next: impl FnOnce() -> Coordinates,
    ) -> Option<Coordinates> {
        let end = self.advance(problem, experiments, room)?;
        if self.refined {
            *self = Self::shorter(next());
            return None;
        }
        self.refined = true;
        Some(end)
    }

    fn advance<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        room: &mut ParameterNormal,
    ) -> Option<Coordinates> {
        if let Some(best) = self.best.filter(|_| !self.begun) {
            self.begun = true;
            let cost = self.present.begin_with(problem, experiments, room);
            if cost > WORTH_A_DESCENT * best.cost {
                return self.soften(problem, best);
            }
            self.left -= 1;
            return None;
        }
        self.present.step(problem, experiments, room);
        if !self.present.finished() {
            return None;
        }
        let (misfit, cost) = (self.present.misfit(), self.present.cost());
        let end = End { coordinates: *self.present.coordinates(), misfit, cost };
        let best = match self.best {
            Some(best) if end.misfit >= BETTER * best.misfit => best,
            _ => {
                if let Trial::Softened(unknown) = self.trial {
                    self.kept = Some(unknown);
                }
                self.refined = false;
                end
            }
        };
        self.best = Some(best);
        if best.misfit <= FITS && !self.thorough {
            return Some(best.coordinates);
        }
        if self.trial == Trial::Long && !self.thorough {
            self.trial = Trial::Short;
            self.present = Continuation::shorter(middle(problem.bounds, problem.sought));
            return None;
        }
        self.soften(problem, best)
    }

    /// Goes on from the best end with the next stiffness softened, from the tip inward: the wrist's resonances show least.
    fn soften(&mut self, problem: &Problem<'_>, best: End) -> Option<Coordinates> {
        let Problem { sought, bounds, .. } = *problem;
        let from = match self.trial {
            Trial::Softened(unknown) => unknown,
            Trial::Long | Trial::Short => sought.unknowns(),
        };
        let (inward, again) = match self.kept {
            None => (0..from, 0..0),
            Some(kept) if kept < from => (kept + 1..from, 0..0),
            Some(kept) => (0..from, kept + 1..sought.unknowns()),
        };
        let next = inward.rev().chain(again.rev()).find_map(|unknown| {
            Some((unknown, softened(sought, bounds, &best.coordinates, unknown)?))
        });
        let Some((unknown, soft)) = next.filter(|_| self.left > 0) else {
            return Some(best.coordinates);
        };
        self.trial = Trial::Softened(unknown);
        self.present = Continuation::on_the_whole_band(soft);
        self.begun = false;
        None
    }
}

/// The same bushings, the stiffness of one unknown soft; `None` if it is no stiffness, or soft already.
fn softened(
    sought: &Sought,
    bounds: &Bounds,
    from: &Coordinates,
    unknown: usize,
) -> Option<Coordinates> {
    let Coordinate::Stiffness { .. } = sought.coordinate(unknown)? else { return None };
    let [value, lower, _] = sought.ranges(from, bounds)[unknown];
    let soft = lower + SOFT;
    (soft < value).then(|| with_stiffness(sought, bounds, from, unknown, soft))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::DOF;
    use crate::identify::start::tests::{two_joints, within_the_bounds};

    proptest! {
        /// The stiffness becomes e times its lower bound. What is softer already, and a damping, is not softened.
        #[test]
        fn one_bushing_becomes_soft(
            bushing in 0..12_usize, places in prop::array::uniform24(0.0..1.0_f64),
        ) {
            let (sought, bounds) = two_joints();
            let (lower, _) = bounds.logarithms(2);
            let from = within_the_bounds(&places);
            let k = 2 * DOF * (bushing / DOF) + bushing % DOF;
            prop_assert!(softened(&sought, &bounds, &from, k + DOF).is_none());
            let soft = softened(&sought, &bounds, &from, k);
            prop_assert_eq!(soft.is_some(), from[k] > lower[k] + 1.0);
            prop_assert!(soft.is_none_or(|soft| (soft[k] - lower[k] - 1.0).abs() < 1e-9));
        }
    }
}
