//! Progress of the work on the unsettled records.

use flexid_core::identify::{Phase, Progress};

/// Part of a round that its search takes. The refinement takes the other half.
const SEARCH: f32 = 0.5;

/// The work on unsettled records: rounds of a search and a refinement until the identifier settles. The first round has no
/// search if the refinement continues from an estimate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Work {
    /// Number of all searches that had begun when the first round began.
    first: Option<u32>,
    rounds: u32,
    fraction: f32,
}

impl Work {
    /// Notes a step, and returns the part of the work that is done, 0 to 1:
    ///
    /// ```text
    /// 1 − 2^−(rounds done)
    /// ```
    ///
    /// The number of rounds is not known before the last has ended. The part never falls: a refinement that begins anew in the
    /// same round is unexpected work.
    pub(super) fn advance(&mut self, progress: &Progress) -> f32 {
        let first = *self.first.get_or_insert(progress.effort.starts);
        self.rounds = progress.effort.starts.saturating_sub(first);
        let round = self.rounds as f32;
        let fraction = match progress.phase {
            Phase::Waiting => 0.0,
            Phase::Searching => after(round + SEARCH * progress.fraction),
            Phase::Refining => after(round + SEARCH + (1.0 - SEARCH) * progress.fraction),
            Phase::Settled => 1.0,
        };
        self.fraction = self.fraction.max(fraction);
        self.fraction
    }

    /// Returns the number of rounds that are done.
    pub(super) fn rounds(&self) -> u32 {
        self.rounds
    }

    /// Returns the part of the work that is done, 0 to 1.
    pub(super) fn fraction(&self) -> f32 {
        self.fraction
    }
}

fn after(rounds: f32) -> f32 {
    1.0 - (-rounds).exp2()
}

#[cfg(test)]
mod tests {
    use flexid_core::identify::Effort;

    use super::*;

    fn step(phase: Phase, starts: u32, fraction: f32) -> Progress {
        Progress {
            phase,
            fraction,
            effort: Effort { starts, ..Effort::default() },
            search_loss: 1.0,
            objective: 1.0,
        }
    }

    #[test]
    fn it_never_falls_and_ends_at_one() {
        use Phase::{Refining, Searching, Settled};
        let steps = [
            (step(Searching, 4, 0.0), 0.0),
            (step(Searching, 4, 1.0), 0.292_893),
            (step(Refining, 4, 0.0), 0.292_893),
            (step(Refining, 4, 1.0), 0.5),
            // Retired records are left out, and the refinement is begun anew.
            (step(Refining, 4, 0.1), 0.5),
            (step(Searching, 5, 0.0), 0.5),
            (step(Refining, 5, 1.0), 0.75),
            (step(Settled, 5, 1.0), 1.0),
        ];
        let mut work = Work::default();
        for (step, fraction) in steps {
            assert!((work.advance(&step) - fraction).abs() < 1e-6, "{step:?}: {work:?}");
        }
        assert_eq!(work.fraction(), 1.0);
    }
}
