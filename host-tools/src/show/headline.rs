//! The headline: the verdict on the fit, or that there is none.

use flexid_pipeline::report::Summary;
use flexid_pipeline::text::count;
use flexid_wire::answer::Answer;
use flexid_wire::messages::{Phase, Progress};
use flexid_wire::report::{Acceptance, Verdict};

use crate::show::view::{View, has_identified};

/// How good or bad something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tone {
    /// Neither good nor bad.
    Neutral,
    /// Nothing to look at: nothing is said, and nothing is wrong.
    Faint,
    /// Nothing objects.
    Good,
    /// It must be read before the numbers are used.
    Caution,
    /// The numbers must not be used, or none can come.
    Bad,
}

/// The verdict on the fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Headline {
    pub(crate) tone: Tone,
    /// The robot as a whole in one line, or what is known of it so far.
    pub(crate) answer: Option<String>,
    /// The verdict.
    pub(crate) words: String,
    /// Size of the residuals.
    pub(crate) fit: Option<String>,
    /// Number of records, and of parameters with each verdict.
    pub(crate) verdicts: Option<String>,
}

impl Headline {
    /// The headline of the latest messages.
    pub(crate) fn of(view: &View) -> Self {
        let Some(finding) = &view.finding else {
            let dead = view.dead_bus().is_some();
            let (tone, words) = match dead {
                true => (Tone::Bad, "no result, and no frames can come"),
                false => (Tone::Neutral, "no result yet"),
            };
            let words = words.to_owned();
            return Self { tone, answer: None, words, fit: None, verdicts: None };
        };
        let report = &finding.report;
        let tone = match report.fit.acceptance {
            Acceptance::Consistent if report.joints.iter().any(has_identified) => Tone::Good,
            Acceptance::Consistent | Acceptance::Unsettled => Tone::Caution,
            Acceptance::ModelSuspect => Tone::Bad,
        };
        let summary = Summary(report).to_string();
        let mut lines = summary.lines();
        // Frames and costs are left out.
        let first = lines.next().and_then(|line| line.split(';').next()).unwrap_or_default();
        let (words, size) = first.split_once(": ").unwrap_or((first, ""));
        let records = count(report.fit.records, "record");
        Self {
            tone,
            answer: finding.answer.as_ref().map(|answer| match report.fit.acceptance {
                Acceptance::Unsettled => so_far(answer, view.progress.as_ref()),
                _ => answer.to_string(),
            }),
            words: words.to_owned(),
            fit: Some(size.to_owned()),
            verdicts: lines.next().map(|verdicts| format!("{records}: {verdicts}")),
        }
    }

    /// The verdict, and the numbers of the verdicts on the parameters.
    pub(crate) fn line(&self) -> String {
        let Self { words, verdicts, .. } = self;
        verdicts.iter().fold(words.clone(), |line, verdicts| format!("{line}, {verdicts}"))
    }
}

/// An answer that is not settled, and the share of the work that is done while it goes on.
fn so_far(answer: &Answer, progress: Option<&Progress>) -> String {
    let at_work = |own: &&Progress| matches!(own.phase, Phase::Searching | Phase::Refining);
    let share = progress
        .filter(at_work)
        .map(|own| format!(" ({:.0} % of the work is done)", 100.0 * own.fraction));
    format!("so far: {answer}; not settled yet{}", share.unwrap_or_default())
}

/// The tone of a parameter's verdict.
pub(crate) fn tone(verdict: Verdict) -> Tone {
    match verdict {
        Verdict::Identified => Tone::Good,
        Verdict::Weak => Tone::Caution,
        // These cuts do not show it. Nothing is wrong with it.
        Verdict::NotObservable => Tone::Faint,
        Verdict::Fixed => Tone::Neutral,
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::messages::BusState;

    use super::*;
    use crate::show::page::tests::view;

    #[test]
    fn what_cuts_do_not_show_alarms_nobody() {
        assert_eq!(tone(Verdict::NotObservable), Tone::Faint);
    }

    #[test]
    fn the_tone_follows_the_fit_and_its_parameters() {
        let mut view = view(3, &[]);
        let headline = |acceptance, verdict, view: &mut View| {
            let report = &mut view.finding.as_mut().unwrap().report;
            report.fit.acceptance = acceptance;
            for joint in &mut report.joints {
                joint.stiffness_verdict = [verdict; 6];
            }
            Headline::of(view)
        };
        for (acceptance, verdict, tone, words) in [
            (Acceptance::Consistent, Verdict::Identified, Tone::Good, "consistent"),
            (Acceptance::Consistent, Verdict::Weak, Tone::Caution, "consistent"),
            (Acceptance::Unsettled, Verdict::Identified, Tone::Caution, "not settled"),
            (Acceptance::ModelSuspect, Verdict::Identified, Tone::Bad, "MODEL SUSPECT"),
        ] {
            let headline = headline(acceptance, verdict, &mut view);
            assert_eq!((headline.tone, headline.words.as_str()), (tone, words));
            let fit = "χ²/dof 1.000, SSP 1.0e-3 (worst 2.0e-2)";
            assert_eq!(headline.fit.as_deref(), Some(fit));
            let answer = headline.answer.as_deref().unwrap();
            let rest = ", at the pose of record 3; not settled yet (40 % of the work is done)";
            let is_unsettled = acceptance == Acceptance::Unsettled;
            assert_eq!(answer.starts_with("so far: tool 0.381"), is_unsettled, "{answer}");
            assert_eq!(answer.ends_with(rest), is_unsettled, "{answer}");
        }
        view.finding = None;
        assert_eq!(Headline::of(&view).line(), "no result yet");
        view.bus.as_mut().unwrap().state = BusState::BusOff;
        assert_eq!(Headline::of(&view).tone, Tone::Bad);
    }
}
