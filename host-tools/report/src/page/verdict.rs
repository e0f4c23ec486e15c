//! The verdict: how much is identified, whether to trust it, and the next steps.

use flexid_prediction::document::is_far;
use flexid_wire::report::{Acceptance, JointReport, Verdict};
use flexid_wire::residuals::Meaning;
use maud::{Markup, html};
use serde_json::Value;

use super::format::{agreement, count, marked, number, percent};
use super::{DOFS, folded, missing};
use crate::document::{Confidence, Document, Explanation};
use crate::friction;
use crate::imperfection::sum_if_minor;

/// FRAC below which a record that was held out is named. Chosen: the prediction then has another shape.
const POOR_FRAC: f64 = 0.9;
/// Kinds of warnings that say that the readings themselves are wrong: as long as they are, no other number means anything.
const OF_READINGS: [&str; 4] = ["wrong_axes", "disproportion", "implausible", "static_outlier"];
/// Share of an octave's bins with force, below which the octave is named: that of `flexid check`.
const HARDLY_EXCITED: f64 = 0.5;
/// Begins a warning of the model.
const MODEL: &str = "model: ";

pub(super) fn section(document: &Document) -> Markup {
    let (class, headline) = headline(document);
    html! {
        section #verdict {
            h1 class=(class) { (headline) }
            @if let Some(reservations) = reservations(document) { p { (reservations) } }
            (identified(document))
            div.columns {
                div {
                    h3 { "Can I trust it?" }
                    ul {
                        @for line in trust(document) { li { (line) } }
                    }
                }
                div {
                    h3 { "What to do next" }
                    ol {
                        @for line in next_steps(document) { li { (line) } }
                    }
                }
            }
            @let warnings = warnings(document);
            @if !warnings.is_empty() {
                h3 { (count(warnings.len(), "warning")) }
                ul.warnings {
                    @for warning in &warnings { li { (marked(warning)) } }
                }
            }
            @if document.is_static() {
                p {
                    "The result rests on static tests alone. They show no damping and no mode, so that this page has neither; for these, mill with \
                     the same configuration and a " code { "[bus]" } "."
                }
            }
            @let absent = document.missing();
            @if !absent.is_empty() {
                p.missing {
                    "Parts of this page are left out, because the file has no entry "
                    @for (index, entry) in absent.iter().enumerate() {
                        @if index > 0 { ", " }
                        code { (entry) }
                    }
                    "."
                }
            }
        }
    }
}

/// The robot, and what the result rests on.
pub(super) fn robot(document: &Document) -> String {
    let robot = &document.found.robot;
    let joints = count(robot.model().joints.len(), "joint");
    let data = if document.is_static() {
        "static tests alone".to_owned()
    } else {
        let records = count(document.found.fit.records as usize, "record");
        let [lower, upper] = robot.band_hz().map(number);
        format!("{records}, {lower} to {upper}\u{a0}Hz")
    };
    format!(
        "robot {}, {joints}, {data}, tool centre point '{}'",
        robot.model().name,
        robot.model().tcp.name
    )
}

/// Warnings of the fit, then those of the model.
fn warnings(document: &Document) -> Vec<String> {
    let of_model = document.further.model_warnings.iter().map(|own| format!("{MODEL}{own}"));
    document.found.warnings.iter().cloned().chain(of_model).collect()
}

/// The class of the headline, and its words.
fn headline(document: &Document) -> (&'static str, String) {
    let data = if document.is_static() { "static tests" } else { "records" };
    let (class, words) = match document.found.fit.acceptance {
        Acceptance::Consistent if of(document, Some(Verdict::Identified)) == 0 => {
            ("caution", format!("The fit explains the {data}, and no number is known well."))
        }
        Acceptance::Consistent if warnings(document).is_empty() => {
            ("good", format!("The fit explains the {data}."))
        }
        Acceptance::Consistent => {
            ("good", format!("The fit explains the {data}, with reservations."))
        }
        Acceptance::ModelSuspect => ("bad", format!("The model does not explain the {data}.")),
        Acceptance::Unsettled => {
            ("caution", "The fit is not settled: do not use these numbers yet.".to_owned())
        }
    };
    (class, words)
}

/// Names the warnings of a fit that explains the data.
fn reservations(document: &Document) -> Option<String> {
    let warnings = warnings(document);
    let is_good = document.found.fit.acceptance == Acceptance::Consistent;
    let heads = warnings.iter().map(|own| {
        let (prefix, own) = own.split_at(if own.starts_with(MODEL) { MODEL.len() } else { 0 });
        format!("{prefix}{}", own.split([':', ';']).next().unwrap_or(own).replace('`', ""))
    });
    let heads: Vec<String> = heads.collect();
    (is_good && !heads.is_empty()).then(|| format!("Reservations: {}.", heads.join("; ")))
}

/// The verdicts on the stiffnesses and dampings of a joint: static tests have no say in dampings.
fn verdicts<'a>(
    document: &Document,
    joint: &'a JointReport,
) -> impl Iterator<Item = (&'a [Verdict; 6], &'static str)> + use<'a> {
    let all = [(&joint.stiffness_verdict, "stiffness"), (&joint.damping_verdict, "damping")];
    all.into_iter().take(if document.is_static() { 1 } else { 2 })
}

/// Number of parameters with this verdict, or of all.
fn of(document: &Document, wanted: Option<Verdict>) -> usize {
    let joints = document.found.joints.iter();
    let all = joints.flat_map(|joint| verdicts(document, joint)).flat_map(|(own, _)| own);
    all.filter(|verdict| wanted.is_none_or(|wanted| **verdict == wanted)).count()
}

/// How many parameters are identified, and which are not.
fn identified(document: &Document) -> Markup {
    let meanings = [
        (Verdict::Weak, "weak", "a standard deviation of 5 to 30 %, or a doubtful fit"),
        (
            Verdict::NotObservable,
            "not observable",
            "the data do not tell: the number is no estimate",
        ),
        (Verdict::Fixed, "fixed", "given, not sought"),
    ];
    let others = meanings
        .map(|(verdict, name, meaning)| (of(document, Some(verdict)), verdict, name, meaning));
    let others = others.iter().filter(|(number, ..)| *number > 0);
    let mut line = format!(
        "{} of {} {} identified, with a standard deviation of up to 5 %",
        of(document, Some(Verdict::Identified)),
        of(document, None),
        if document.is_static() { "stiffnesses" } else { "parameters" },
    );
    for (number, _, name, _) in others.clone() {
        line += &format!("; {number} {name}");
    }
    let contents = html! {
        table.narrow {
            @for (_, verdict, name, meaning) in others.clone() {
                tr {
                    th scope="row" class=(super::parameters::class(*verdict)) { (name) }
                    td.left { (meaning) br; (names(document, *verdict)) }
                }
            }
        }
    };
    html! {
        @if others.count() == 0 { p { (line) "." } } @else { (folded(&line, &contents)) }
    }
}

/// The parameters with this verdict, joint by joint.
fn names(document: &Document, wanted: Verdict) -> String {
    let of = |verdicts: &[Verdict; 6]| -> Vec<&str> {
        DOFS.into_iter()
            .zip(verdicts)
            .filter(|(_, own)| **own == wanted)
            .map(|(dof, _)| dof)
            .collect()
    };
    let mut all = Vec::new();
    for joint in &document.found.joints {
        for (verdicts, kind) in verdicts(document, joint) {
            let dofs = of(verdicts);
            match dofs.len() {
                0 => {}
                6 => all.push(format!("{} {kind}: all", joint.name)),
                _ => all.push(format!("{} {kind}: {}", joint.name, dofs.join(" "))),
            }
        }
    }
    all.join("; ")
}

fn trust(document: &Document) -> Vec<Markup> {
    let fit = &document.found.fit;
    let meaning = document.further.confidence.as_ref().and_then(|own| own.residuals.meaning);
    let mut lines = vec![match (fit.acceptance, document.is_static()) {
        (Acceptance::Consistent, false) => match meaning {
            Some(Meaning::SmallError) => html! {
                "Yes, within the intervals: what the model leaves of the records is small, but not random. The intervals allow for an error \
                 that differs from band to band."
            },
            Some(Meaning::NoisierCut) => html! {
                "Yes, within the intervals: what the model leaves of the records is more than the noise at rest, and the intervals allow for \
                 that."
            },
            _ => html! {
                "Yes, within the intervals: what the model leaves of the records is what noise leaves."
            },
        },
        (Acceptance::Consistent, true) => html! {
            "Yes, within the intervals: what the model leaves of the displacements is what noise leaves."
        },
        (Acceptance::ModelSuspect, false) => html! {
            "Not as it is: several searches agree on these numbers, and what they leave of the records is more than noise. Something in \
             the model or the sensors is other than stated."
        },
        (Acceptance::ModelSuspect, true) => html! {
            "Not as it is: what the model leaves of the displacements is more than noise. A test is wrong, or the robot gives way where the \
             model does not."
        },
        (Acceptance::Unsettled, false) => html! {
            "No: the searches do not agree on one result, or the records are too few to test it."
        },
        (Acceptance::Unsettled, true) => html! {
            "No: the fit does not settle, or the tests are too few to test it."
        },
    }];
    let Some(confidence) = &document.further.confidence else {
        lines.push(missing("confidence"));
        return lines;
    };
    let seeks_none =
        document.found.robot.found().imperfections.is_empty() && confidence.nuisances.is_empty();
    if seeks_none && fit.acceptance == Acceptance::Consistent && !document.is_static() {
        lines.push(html! {
            "But only if robot, sensors and ground are exactly as they are stated: the fit seeks no errors of theirs, and no interval allows for \
             them, as with " code { "assume = \"perfect\"" } " in " code { "[accuracy]" } "."
        });
    }
    lines.push(html! { "Residuals: " (confidence.residuals.text) "." });
    let has_intervals = || {
        let all = confidence.joints.iter();
        all.flat_map(|own| own.stiffness_interval.iter().chain(&own.damping_interval))
            .any(Option::is_some)
    };
    if let Some(times) = confidence.robust_widening.filter(|_| has_intervals()) {
        lines.push(html! {
            "The intervals are robust: no narrower than the numbers scatter between bands of the records. That makes them "
            (format!("{times:.1}")) " times as wide as accuracies and √(χ²/dof) make them (root mean square)."
        });
    }
    for line in &confidence.left_over {
        lines.push(html! { "Left over: " (marked(&line.text)) "." });
    }
    lines.extend(caveat(document, confidence));
    for Explanation { text, alike, alternatives, remedy, .. } in shown(confidence) {
        lines.push(html! {
            "Explained: " (text)
            @for also in alike.iter().chain(alternatives) { "; " (also) }
            @if remedy.is_none() { "; nothing to do" }
            "."
        });
    }
    let all = confidence.held_out.iter().flat_map(|own| own.frac);
    let worst = all.fold(None, |worst: Option<f64>, own| Some(worst.map_or(own, |it| it.min(own))));
    if let Some(worst) = worst {
        lines.push(html! {
            "Records that were held out are predicted by a fit to the others with a FRAC (frequency response assurance criterion, 100\u{a0}% \
             for the same shape) of at least " (agreement(worst))
            @if worst < POOR_FRAC { ": the worst has another shape than predicted" }
            "."
        });
    }
    lines
}

/// The line above the explanations, if they may not be the cause.
fn caveat(document: &Document, confidence: &Confidence) -> Option<Markup> {
    shown(confidence).next()?;
    if is_not_linear(document) {
        return Some(
            html! { "No linear model explains what is left: what follows may be an effect of that." },
        );
    }
    if document.found.fit.acceptance == Acceptance::Unsettled {
        return Some(html! { "If this minimum is the right one, then the following is off." });
    }
    if document.found.fit.acceptance != Acceptance::ModelSuspect {
        return None;
    }
    // A file may state no share.
    let contradicted =
        confidence.explanations.iter().filter(|own| own.remedy.is_some() && own.share > 0.0);
    let share = sum_if_minor(contradicted.map(|own| own.share))?;
    Some(html! {
        "What follows explains in all " (percent(share)) " of the misfit: most of it has another cause, of which this may be an effect."
    })
}

/// Returns whether a warning says that no linear model explains what is left.
fn is_not_linear(document: &Document) -> bool {
    let kinds = &document.further.warning_kinds;
    let objections = kinds.iter().filter_map(|kind| kind.get("objection"));
    objections.into_iter().any(|objection| objection.get("distortion").is_some())
}

/// The explanations that are shown.
fn shown(confidence: &Confidence) -> impl Iterator<Item = &Explanation> {
    let all = confidence.explanations.iter();
    all.filter(|own| {
        own.deviation.is_none_or(|size| size.is_shown(own.share, own.remedy.is_some()))
    })
}

/// The gravest first: readings that are wrong, then errors that the records name, then what the fit lacks.
fn next_steps(document: &Document) -> Vec<Markup> {
    let mut lines = Vec::new();
    for (warning, kind) in document.found.warnings.iter().zip(&document.further.warning_kinds) {
        if OF_READINGS.iter().any(|own| kind.get(own).is_some()) {
            lines.push(html! { (marked(&capital(warning))) "." });
        }
    }
    if document.is_static() {
        lines.extend(static_steps(document));
        return lines;
    }
    let is_taken_as_perfect = |own: &Value| own.as_str() == Some("assumed_perfect");
    if document.further.warning_kinds.iter().any(is_taken_as_perfect) {
        lines.push(html! {
            "Leave " code { "assume = \"perfect\"" } " out of " code { "[accuracy]" } ", unless the robot is simulated as modelled: it \
             takes as perfect what is not stated, and noise does not explain the residuals. Then identify again: typical errors are \
             fitted with the joints, and what is named below may be an effect of them."
        });
    }
    if is_not_linear(document) {
        lines.push(html! {
            "Look for friction, backlash, clipping and a clock that wanders: no linear model explains what is left. Cut harder, so that the \
             joints slip"
            @let robot = &document.found.robot;
            @let records = document.further.records.as_deref().unwrap_or_default();
            @if let Some(loads) = friction::loads(records, robot) {
                ": the largest force of these records was " (loads) "; " (friction::TYPICAL)
            }
            ". What is named below may be an effect of these."
        });
    }
    if let Some(confidence) = &document.further.confidence {
        for remedy in shown(confidence).filter_map(|own| own.remedy.as_ref()) {
            lines.push(html! { (marked(&capital(remedy))) "." });
        }
    }
    match document.found.fit.acceptance {
        Acceptance::Unsettled if !lines.is_empty() => {}
        Acceptance::Unsettled => {
            if is_far(&document.found.fit) {
                lines.push(html! {
                    "Check masses, TCP, sensor mounting, axes and units: what the best minimum leaves is far from noise. "
                    code { "flexid check" } " looks for the usual mistakes."
                });
            }
            lines.push(html! {
                "Record further poses, each from a second before the cut, and identify from all logs together."
            });
        }
        Acceptance::ModelSuspect if lines.is_empty() => lines.push(html! {
            "Check masses, TCP, sensor mounting, axes and units: " code { "flexid check" } " looks for the usual mistakes."
        }),
        _ => {}
    }
    for (band, share) in hardly_excited(document) {
        lines.push(html! {
            "Cut so that the force reaches " (super::format::number(band[0])) " to " (super::format::number(band[1]))
            "\u{a0}Hz: no record has force in more than " (percent(share)) " of that octave."
        });
    }
    let weak = document.further.confidence.as_ref().map_or(0, |own| own.weak_directions.len());
    let open = of(document, Some(Verdict::Weak)) + of(document, Some(Verdict::NotObservable));
    let is_consistent = document.found.fit.acceptance == Acceptance::Consistent;
    if open > 0 || weak > 0 {
        lines.push(html! {
            "Measure poses that separate what is weak or not observable: " code { "flexid plan" }
            @if is_consistent {
                " proposes them."
            } @else {
                " proposes some without " code { "--from" } "; from this result it does so once a fit is consistent."
            }
        });
    }
    if is_consistent {
        lines.push(html! {
            "Use the result: " code { "flexid predict" } " gives modes and deflection in any pose, " code { "flexid export" }
            " writes models for simulation."
        });
    }
    lines
}

/// The next steps where there are static tests and no records.
fn static_steps(document: &Document) -> Vec<Markup> {
    let mut lines = Vec::new();
    let acceptance = document.found.fit.acceptance;
    if acceptance != Acceptance::Consistent {
        lines.push(html! {
            "Check poses, loads, signs and units of the static tests: the lines " code { "static" } " of " code { "flexid identify" }
            " name those that are farthest from what the others predict."
        });
    }
    if acceptance == Acceptance::ModelSuspect {
        lines.push(html! {
            "With " code { "drive_only" } " the drives take up the compliance of all else: leave it out, or free what may give way."
        });
    }
    let open = of(document, Some(Verdict::Weak)) + of(document, Some(Verdict::NotObservable));
    if open > 0 || acceptance == Acceptance::Unsettled {
        lines.push(html! {
            "Add static tests: other poses, each under two loads in different directions, with torques about the joints that are weak or not \
             observable."
        });
    }
    if acceptance == Acceptance::Consistent {
        lines.push(html! {
            "Use the result: " code { "flexid predict --pose … --force …" } " gives stiffness and deflection in any pose, "
            code { "flexid compensate" } " takes the deflection back."
        });
    }
    lines
}

/// Octaves in which no record has force in half of the bins, with the largest share.
fn hardly_excited(document: &Document) -> Vec<([f64; 2], f64)> {
    let records = document.further.records.as_deref().unwrap_or_default();
    let Some(first) = records.first() else { return Vec::new() };
    let best = |index: usize| {
        let shares = records.iter().filter_map(|own| own.octaves.get(index)).map(|own| own.clear);
        shares.fold(0.0, f64::max)
    };
    let all = first.octaves.iter().enumerate().map(|(index, own)| (own.band_hz, best(index)));
    all.filter(|(_, share)| *share < HARDLY_EXCITED).collect()
}

/// A text that begins with a capital letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
