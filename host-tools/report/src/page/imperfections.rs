//! What is off on the robot beside its joints: errors that were fitted with them.

use flexid_wire::confidence::{MAX_NUISANCES, Nuisance};
use flexid_wire::report::Acceptance;
use maud::{Markup, html};

use super::format::count;
use super::parameters::class;
use super::{folded, missing};
use crate::document::Document;
use crate::imperfection::{accuracy, is_contradicted, judgement, words};

pub(super) fn section(document: &Document) -> Markup {
    let Some(confidence) = &document.further.confidence else {
        return html! { section #imperfections { h2 { "Imperfections" } (missing("confidence")) } };
    };
    let is_shown = |own: &&Nuisance| own.entry.is_none() || is_contradicted(own);
    let (shown, expected): (Vec<_>, Vec<_>) = confidence.nuisances.iter().partition(is_shown);
    html! {
        section #imperfections {
            h2 { "Imperfections" }
            @if confidence.nuisances.is_empty() {
                p { "None was sought, or none shows: robot, sensors and ground are taken as they are stated." }
            } @else {
                p {
                    "Errors of sensors, tool, masses, joint angles, elastic centres, drives, hysteresis, ground and hoses were fitted with the \
                     joints. Those that " code { "[calibration]" } " seeks, and those that the records contradict by more than twice their accuracy, \
                     stand here; the others are as expected, and ask for nothing."
                }
                @if document.found.fit.acceptance == Acceptance::Unsettled {
                    p { "The searches do not agree on one result: the errors hold only if this minimum is the right one." }
                }
                @if shown.is_empty() {
                    p { "No accuracy is contradicted." }
                } @else {
                    (table(&shown))
                }
                @if !expected.is_empty() {
                    (folded(&format!("{} as expected", count(expected.len(), "error")), &others(&expected, confidence.nuisances.len() == MAX_NUISANCES)))
                }
            }
        }
    }
}

/// Errors that are within their accuracies, or not known to be beyond.
fn others(expected: &[&Nuisance], is_full: bool) -> Markup {
    html! {
        p {
            "With 95\u{a0}% intervals, beside the accuracy that is stated in [accuracy] or taken as typical (one standard deviation). Gains, masses, \
             inertias, stiffnesses of records and the mass of the base are factors, of which 1 is as stated."
            @if is_full { " Only these are listed; the fit allows for others, too." }
        }
        (table(expected))
    }
}

fn table(errors: &[&Nuisance]) -> Markup {
    html! {
        table.narrow {
            thead {
                tr {
                    th.left { "error and its interval" }
                    th.left { "its accuracy" }
                    th.left { "what the records say" }
                }
            }
            tbody {
                @for own in errors {
                    tr {
                        td.left { (words(own)) }
                        td.left { (accuracy(own).unwrap_or_default()) }
                        @if own.entry.is_some() {
                            td.left { (judgement(own)) }
                        } @else {
                            td class={ "left " (class(own.verdict)) } { (judgement(own)) }
                        }
                    }
                }
            }
        }
    }
}
