//! What is off on the robot beside its joints: errors that were fitted with them.

use maud::{Markup, html};

use super::missing;
use super::parameters::{class, words};
use crate::document::Document;

pub(super) fn section(document: &Document) -> Markup {
    let Some(confidence) = &document.confidence else {
        return html! { section #imperfections { h2 { "Imperfections" } (missing("confidence")) } };
    };
    html! {
        section #imperfections {
            h2 { "Imperfections" }
            @if confidence.nuisances.is_empty() {
                p { "None was sought, or none shows: sensors, tool and masses are taken as they are stated." }
            } @else {
                p {
                    "Errors of sensors, tool, masses and joint angles that were fitted with the joints, with 95\u{a0}% intervals: first what is \
                     more than twice as large as its accuracy, then what the records narrow down. A gain or mass of 1 is as stated."
                }
                table.narrow {
                    tbody {
                        @for own in &confidence.nuisances {
                            tr {
                                td.left { (own) }
                                td class={ "left " (class(own.verdict)) } { (words(own.verdict)) }
                            }
                        }
                    }
                }
            }
        }
    }
}
