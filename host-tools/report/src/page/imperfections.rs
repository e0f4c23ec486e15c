//! What is off on the robot beside its joints: errors that were fitted with them.

use flexid_wire::report::Acceptance;
use maud::{Markup, html};

use super::missing;
use super::parameters::class;
use crate::document::Document;
use crate::imperfection::{judgement, words};

pub(super) fn section(document: &Document) -> Markup {
    let Some(confidence) = &document.further.confidence else {
        return html! { section #imperfections { h2 { "Imperfections" } (missing("confidence")) } };
    };
    html! {
        section #imperfections {
            h2 { "Imperfections" }
            @if confidence.nuisances.is_empty() {
                p { "None was sought, or none shows: robot, sensors and ground are taken as they are stated." }
            } @else {
                p {
                    "Errors of sensors, tool, masses, joint angles, elastic centres, drives, hysteresis, ground and hoses that were fitted with \
                     the joints, with 95\u{a0}% intervals. First stands what [calibration] seeks, which has no accuracy. Then comes what is \
                     more than twice as large as its accuracy, and last what the records narrow down. Gains, masses, inertias, stiffnesses \
                     of records and the mass of the base are factors, of which 1 is as stated."
                }
                @if document.found.fit.acceptance == Acceptance::Unsettled {
                    p { "The searches do not agree on one result: the errors hold only if this minimum is the right one." }
                }
                table.narrow {
                    thead {
                        tr {
                            th.left { "Error and its interval" }
                            th.left { "How well the records determine it" }
                        }
                    }
                    tbody {
                        @for own in &confidence.nuisances {
                            tr {
                                td.left { (words(own)) }
                                td class={ "left " (class(own.verdict)) } { (judgement(own)) }
                            }
                        }
                    }
                }
            }
        }
    }
}
