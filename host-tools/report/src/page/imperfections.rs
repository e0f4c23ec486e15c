//! What is off on the robot beside its joints: errors that were fitted with them.

use flexid_wire::confidence::{MAX_NUISANCES, Nuisance};
use flexid_wire::report::Acceptance;
use maud::{Markup, html};

use super::missing;
use super::parameters::class;
use crate::document::Document;
use crate::imperfection::{accuracy, judgement, may_be_as_stated, words};

pub(super) fn section(document: &Document) -> Markup {
    let Some(confidence) = &document.further.confidence else {
        return html! { section #imperfections { h2 { "Imperfections" } (missing("confidence")) } };
    };
    let is_as_stated = |own: &&Nuisance| own.entry.is_some() && may_be_as_stated(own);
    let (as_stated, off): (Vec<_>, Vec<_>) = confidence.nuisances.iter().partition(is_as_stated);
    html! {
        section #imperfections {
            h2 { "Imperfections" }
            @if confidence.nuisances.is_empty() {
                p { "None was sought, or none shows: robot, sensors and ground are taken as they are stated." }
            } @else {
                p {
                    "Errors of sensors, tool, masses, joint angles, elastic centres, drives, hysteresis, ground and hoses that were fitted with \
                     the joints, with 95\u{a0}% intervals, beside the accuracy that is stated in [accuracy] or taken as typical (one standard \
                     deviation). First stands what [calibration] seeks, which has no accuracy. Then comes what is more than twice as large as \
                     its accuracy, and last what the records narrow down. Gains, masses, inertias, stiffnesses of records and the mass of the \
                     base are factors, of which 1 is as stated."
                }
                @if document.found.fit.acceptance == Acceptance::Unsettled {
                    p { "The searches do not agree on one result: the errors hold only if this minimum is the right one." }
                }
                @if !off.is_empty() {
                    table.narrow {
                        thead {
                            tr {
                                th.left { "Error and its interval" }
                                th.left { "Its accuracy" }
                                th.left { "What the records say" }
                            }
                        }
                        tbody {
                            @for own in &off {
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
                @if !as_stated.is_empty() {
                    p {
                        "Compatible with zero, or a factor with 1 (" (as_stated.len()) "): "
                        (as_stated.iter().map(|own| words(own)).collect::<Vec<_>>().join("; ")) "."
                    }
                }
                @if confidence.nuisances.len() == MAX_NUISANCES {
                    p { "Only these are listed; the fit allows for the others, too." }
                }
            }
        }
    }
}
