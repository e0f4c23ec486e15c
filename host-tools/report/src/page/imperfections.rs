//! Errors of the robot beside its joints, which were fitted with them.

use flexid_wire::confidence::{MAX_NUISANCES, Nuisance};
use flexid_wire::report::Acceptance;
use maud::{Markup, html};

use super::format::count;
use super::parameters::class;
use super::{folded, missing};
use crate::document::Document;
use crate::imperfection::{Standing, accuracy, judgement, standing, words};

pub(super) fn section(document: &Document) -> Markup {
    let Some(confidence) = &document.further.confidence else {
        return html! { section #imperfections { h2 { "Imperfections" } (missing("confidence")) } };
    };
    let is_shown = |own: &&Nuisance| own.entry.is_none() || standing(own) == Standing::Contradicted;
    let (shown, others): (Vec<_>, Vec<_>) = confidence.nuisances.iter().partition(is_shown);
    let (unknown, expected): (Vec<_>, Vec<_>) =
        others.into_iter().partition(|own| standing(own) == Standing::Unknown);
    html! {
        section #imperfections {
            h2 { "Imperfections" }
            @if confidence.nuisances.is_empty() {
                p { "None was sought, or none shows: robot, sensors and ground are taken as they are stated." }
            } @else {
                p {
                    "Errors of sensors, tool, masses, joint angles, elastic centres, drives, hysteresis, ground and hoses were fitted with the \
                     joints. Those that " code { "[calibration]" } " seeks, and those that the records contradict by more than twice their accuracy, \
                     stand first. Those as expected ask for nothing. Without an interval it is not known how far an error is off."
                    @if confidence.nuisances.len() == MAX_NUISANCES { " Only these are listed; the fit allows for others, too." }
                }
                @if document.found.fit.acceptance == Acceptance::Unsettled {
                    p { "The searches do not agree on one result: the errors hold only if this minimum is the right one." }
                }
                @if !shown.is_empty() {
                    (table(&shown))
                } @else if unknown.is_empty() {
                    p { "No accuracy is contradicted." }
                }
                @if !unknown.is_empty() {
                    (folded(&format!("{} not known: the fit allows no interval", count(unknown.len(), "error")), &listed(&unknown)))
                }
                @if !expected.is_empty() {
                    (folded(&format!("{} as expected", count(expected.len(), "error")), &listed(&expected)))
                }
            }
        }
    }
}

/// Errors that no record contradicts.
fn listed(errors: &[&Nuisance]) -> Markup {
    html! {
        p {
            "With 95\u{a0}% intervals where there are any, beside the accuracy that is stated in [accuracy] or taken as typical (one standard \
             deviation). Gains, masses, stiffnesses of records and the mass of the base are factors, of which 1 is as stated."
        }
        (table(errors))
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
