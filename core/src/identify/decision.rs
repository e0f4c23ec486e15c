//! Decisions after a refinement has ended.
//!
//! Both functions are pure: their result depends on the minimum and on the searches that remain, and they change nothing.

use super::Acceptance;
use super::minimum::{Minimum, structure_is_beyond_noise};

/// Visits after which the best minimum is accepted where the noise could hide a wrong basin. Chosen: two robots of 1200 reach a wrong basin twice
/// in a row.
pub(super) const TIMES_CONSISTENT: u32 = 2;
/// Visits after which it is accepted where its residuals are larger than the noise explains, or where in the perfect model they have more
/// structure. Chosen: of drawn six-joint arms one in eight reaches a wrong basin twice in a row.
pub(super) const TIMES_SUSPECT: u32 = 4;
/// Continuations of a refinement that has used up its steps short of the minimum, where noise explains the residuals; and of the last fit to a
/// plant, whatever explains them, also where the movement of the robot has changed. Chosen: a minimum that is not reached after five times the
/// steps counts as it stands.
pub(super) const MAX_PROLONGATIONS: u32 = 4;
/// Searches that one change of the records may cost. Chosen: it bounds the time; then the best minimum is settled on, with its doubts.
const MAX_STARTS: u32 = 8;

/// The state of the search beside a minimum.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Circumstances {
    /// The fit rests on records, and not on static tests alone.
    pub(super) has_records: bool,
    /// The kept records have been fitted without the retired ones.
    pub(super) tried_alone: bool,
    /// Kept and retired records agree in the best minimum so far.
    pub(super) best_agrees: bool,
    /// There is a best minimum so far.
    pub(super) has_best: bool,
    /// The best minimum so far is clearly better.
    pub(super) is_outdone: bool,
    /// The data leave some stiffness undetermined.
    pub(super) leaves_stiffness_undetermined: bool,
    /// Number of continuations of the refinement.
    pub(super) prolongations: u32,
}

/// The searches since the records changed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Searches {
    /// Number of searches, those in the perfect model included.
    pub(super) starts: u32,
    /// Implausible imperfections have explained the records.
    pub(super) is_explained_implausibly: bool,
    /// The model has the imperfections of the plant.
    pub(super) is_corrected: bool,
}

/// Next action for the minimum where a refinement has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OfFound {
    /// Settle on it.
    Settle(Acceptance),
    /// Settle on it once its branches have been refined.
    Conclude(Acceptance),
    /// Fit the kept records without the retired ones.
    TryAlone,
    /// Continue the refinement.
    Prolong,
    /// Compare it with the best minimum so far, if need be after its branches have been refined.
    Compare { branch: bool },
}

/// Next action for the best minimum of the searches so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OfBest {
    /// Settle on it once its branches have been refined.
    Conclude(Acceptance),
    /// Fit the kept records without the retired ones.
    TryAlone,
    /// Refine its branches if it is near; then search again, or settle on it where the budget of searches is spent.
    GoOn { branch: bool, search: bool },
}

/// Decides what to do with the minimum where a refinement has ended.
pub(super) fn of_found(found: &Minimum, circumstances: &Circumstances) -> OfFound {
    let Circumstances { has_records, tried_alone, best_agrees, has_best, .. } = *circumstances;
    if tried_alone {
        if found.contradicted && found.times >= TIMES_CONSISTENT {
            return OfFound::Settle(Acceptance::ModelSuspect);
        }
    } else if found.is_reached() && found.contradicted && !best_agrees {
        return OfFound::TryAlone;
    }
    if found.is_reached() && (!found.is_tested() || found.noise_is_too_loud()) {
        return OfFound::Settle(Acceptance::Unsettled);
    }
    let stopped_short = found.is_explained() && !found.is_reached();
    if stopped_short && circumstances.prolongations < MAX_PROLONGATIONS {
        return OfFound::Prolong;
    }
    let doubtful =
        has_records && found.is_doubtful() && circumstances.leaves_stiffness_undetermined;
    if found.is_beyond_doubt() && !doubtful && !circumstances.is_outdone {
        return OfFound::Conclude(Acceptance::Consistent);
    }
    // Static tests alone are linear in the compliances, but for gravity: another search would end there, too.
    if !has_records {
        let reached = found.is_reached();
        let acceptance = if reached { Acceptance::ModelSuspect } else { Acceptance::Unsettled };
        return OfFound::Settle(acceptance);
    }
    OfFound::Compare { branch: stopped_short && !has_best }
}

/// Decides what to do with the best minimum after searches. Where implausible imperfections have explained the records, plausible ones may: as
/// long as there are searches left, one that noise does not explain is not believed.
///
/// In a model with imperfections the right minimum may leave some structure: where the spindle passes a resonance, the arm answers with second
/// harmonics, and a linear model has none. Twice suffices then. Of the drawn six-joint plants with structure up to [`structure_is_beyond_noise`]
/// none was wrong that had been reached twice; wrong minima had a structure of 2 %, or of 31 % and more.
pub(super) fn of_best(best: &Minimum, searches: Searches) -> OfBest {
    let Searches { starts, is_explained_implausibly, is_corrected } = searches;
    let structured = structure_is_beyond_noise(&best.judged().structure);
    let (enough, acceptance) = match (best.is_consistent(), best.structure_objects()) {
        (true, false) => (TIMES_CONSISTENT, Acceptance::Consistent),
        (true, true) if !structured && is_corrected => (TIMES_CONSISTENT, Acceptance::Consistent),
        (true, true) if !structured => (TIMES_SUSPECT, Acceptance::Consistent),
        _ if best.is_noisier_than_at_rest() => (TIMES_CONSISTENT, Acceptance::Consistent),
        _ => (TIMES_SUSPECT, Acceptance::ModelSuspect),
    };
    if best.times >= TIMES_CONSISTENT && best.contradicted {
        return OfBest::TryAlone;
    }
    let is_doubted =
        is_explained_implausibly && acceptance == Acceptance::ModelSuspect && starts < MAX_STARTS;
    if best.is_reached() && best.times >= enough && !best.has_rival && !is_doubted {
        return OfBest::Conclude(acceptance);
    }
    OfBest::GoOn { branch: best.is_near(), search: starts < MAX_STARTS }
}

#[cfg(test)]
mod tests {
    use super::super::minimum::tests::{minimum, of_size};
    use super::*;
    use Acceptance::{Consistent, ModelSuspect, Unsettled};

    type Change = (&'static str, fn(&mut Minimum));

    /// Of a minimum of two thousand residuals, which noise explains, that is reached and stands clear of the noise, but for its change.
    #[test]
    fn a_found_minimum() {
        let records = Circumstances { has_records: true, ..Circumstances::default() };
        let undetermined = Circumstances { leaves_stiffness_undetermined: true, ..records };
        let spent = Circumstances { prolongations: 4, ..records };
        let changes: [Change; 7] = [
            ("explained", |_| {}),
            ("large", |found| found.fit.sum_of_squares = 4000.0),
            ("doubtful", |found| {
                (found.fit.sum_of_squares, found.fit.structure.significance) = (2050.0, 3.9)
            }),
            ("contradicted", |found| found.contradicted = true),
            ("contradicted twice", |found| (found.contradicted, found.times) = (true, 2)),
            ("loud", |found| found.fit.sum_of_squares = 500.0),
            ("untested", |found| {
                (found.fit.degrees_of_freedom, found.fit.sum_of_squares) = (0.0, 0.0)
            }),
        ];
        let cases = [
            ("explained", records, OfFound::Conclude(Consistent)),
            ("explained", Circumstances { is_outdone: true, ..records }, compare(false)),
            ("large", records, compare(false)),
            ("large", Circumstances::default(), OfFound::Settle(ModelSuspect)),
            ("doubtful", records, OfFound::Conclude(Consistent)),
            ("doubtful", undetermined, compare(false)),
            ("contradicted", records, OfFound::TryAlone),
            ("contradicted", Circumstances { best_agrees: true, ..records }, compare(false)),
            ("contradicted", Circumstances { tried_alone: true, ..records }, compare(false)),
            (
                "contradicted twice",
                Circumstances { tried_alone: true, ..records },
                OfFound::Settle(ModelSuspect),
            ),
            ("loud", records, OfFound::Settle(Unsettled)),
            ("untested", records, OfFound::Settle(Unsettled)),
        ];
        for (change, circumstances, expected) in cases {
            let mut found = minimum(2000.0, 0.0);
            found.fit.ssp = [0.01; 2];
            changes.iter().find(|(name, _)| *name == change).unwrap().1(&mut found);
            assert_eq!(of_found(&found, &circumstances), expected, "{change} {circumstances:?}");
        }
        let mut short = minimum(2000.0, 2.0);
        short.fit.ssp = [0.01; 2];
        for (circumstances, expected) in [
            (records, OfFound::Prolong),
            (spent, compare(true)),
            (Circumstances { has_best: true, ..spent }, compare(false)),
            (Circumstances { has_records: false, ..spent }, OfFound::Settle(Unsettled)),
        ] {
            assert_eq!(of_found(&short, &circumstances), expected, "{circumstances:?}");
        }
    }

    fn compare(branch: bool) -> OfFound {
        OfFound::Compare { branch }
    }

    /// By size and structure of the residuals, by how often the minimum has been reached, and by what is left of the budget.
    #[test]
    fn the_best_minimum() {
        let go_on = |branch, search| OfBest::GoOn { branch, search };
        for (sum_of_squares, structure, times, starts, expected) in [
            (2000.0, 0.0, 1, 1, go_on(true, true)),
            (2000.0, 0.0, 2, 2, OfBest::Conclude(Consistent)),
            (2000.0, 0.05, 2, 2, OfBest::Conclude(Consistent)),
            (2000.0, 0.12, 3, 3, go_on(true, true)),
            (2000.0, 0.12, 4, 4, OfBest::Conclude(Consistent)),
            (2000.0, 0.22, 4, 4, OfBest::Conclude(ModelSuspect)),
            // Random, but larger than the noise at rest.
            (4000.0, 0.0, 1, 1, go_on(true, true)),
            (4000.0, 0.0, 2, 2, OfBest::Conclude(Consistent)),
            (4000.0, 0.12, 3, 3, go_on(true, true)),
            (4000.0, 0.12, 4, 4, OfBest::Conclude(ModelSuspect)),
            // The part that is not random is 0.7 of the noise, or less than a tenth.
            (16000.0, 0.09, 3, 3, go_on(true, true)),
            (16000.0, 0.09, 4, 4, OfBest::Conclude(ModelSuspect)),
            (16000.0, 0.01, 2, 2, OfBest::Conclude(Consistent)),
            (22000.0, 0.0, 4, 4, OfBest::Conclude(ModelSuspect)),
            (2e5, 0.0, 3, 8, go_on(false, false)),
        ] {
            let mut best = minimum(sum_of_squares, 0.0);
            (best.times, best.fit.structure) = (times, of_size(structure));
            let searches = perfect(starts);
            let decision = of_best(&best, searches);
            assert_eq!(decision, expected, "{sum_of_squares} {structure} {times}");
            let of_explained_implausibly = match decision {
                OfBest::Conclude(ModelSuspect) => go_on(best.is_near(), true),
                other => other,
            };
            let implausible = Searches { is_explained_implausibly: true, ..searches };
            assert_eq!(of_best(&best, implausible), of_explained_implausibly);
            let of_last = of_best(&best, perfect(MAX_STARTS));
            assert_eq!(of_best(&best, Searches { starts: MAX_STARTS, ..implausible }), of_last);
            best.has_rival = true;
            assert!(matches!(of_best(&best, searches), OfBest::GoOn { .. }));
            best.contradicted = true;
            assert_eq!(of_best(&best, searches) == OfBest::TryAlone, times >= 2);
        }
        let mut short = minimum(2000.0, 2.0);
        short.times = 2;
        assert_eq!(of_best(&short, perfect(2)), go_on(true, true));
    }

    /// After so many searches in the perfect model.
    fn perfect(starts: u32) -> Searches {
        Searches { starts, is_explained_implausibly: false, is_corrected: false }
    }

    /// Of two thousand residuals. Twice suffices.
    #[test]
    fn imperfections_leave_some_structure() {
        for (sum_of_squares, structure, remaining, is_accepted) in [
            (2000.0, 0.20, 0.0, true),
            (2000.0, 0.22, 0.0, false),
            (4000.0, 0.20, 0.0, false),
            (2000.0, 0.20, 2.0, false),
        ] {
            let mut best = minimum(sum_of_squares, remaining);
            (best.times, best.fit.structure) = (2, of_size(structure));
            let searches = Searches { is_corrected: true, ..perfect(2) };
            let concludes = of_best(&best, searches) == OfBest::Conclude(Consistent);
            assert_eq!(concludes, is_accepted, "{sum_of_squares} {structure} {remaining}");
            best.times = 1;
            assert!(matches!(of_best(&best, searches), OfBest::GoOn { .. }));
            (best.times, best.has_rival) = (2, true);
            assert!(matches!(of_best(&best, searches), OfBest::GoOn { .. }));
        }
    }
}
