//! Records that a fit to all others predicts.

use maud::{Markup, html};

use super::format::{agreement, pose};
use super::{AXES, folded_section, missing};
use crate::document::Document;

const TITLE: &str = "Held-out records";

pub(super) fn section(document: &Document) -> Markup {
    let Some(confidence) = &document.further.confidence else {
        return folded_section("held-out", TITLE, &missing("confidence"));
    };
    let contents = html! {
            @if confidence.held_out.is_empty() {
                p { "None: a single record cannot be predicted by others." }
            } @else {
                table.narrow {
                    caption {
                        "Each record as a fit to all others predicts it. FRAC, the frequency response assurance criterion, compares shapes; "
                        "VAF, the variance accounted for, compares sizes too. Both are 100\u{a0}% for an exact prediction."
                    }
                    thead {
                        tr { th {} th.group colspan="3" { "FRAC" } th.group colspan="3" { "VAF" } }
                        tr {
                            th.left { "pose / rad (m)" }
                            @for _ in 0..2 { @for axis in AXES { th { (axis) } } }
                        }
                    }
                    tbody {
                        @for own in &confidence.held_out {
                            tr {
                                td.left { (pose(&own.pose)) }
                                @for value in own.frac.iter().chain(&own.vaf) { td { (agreement(*value)) } }
                            }
                        }
                    }
                }
                p.note {
                    "The prediction is that of the model without imperfections. With few records, or large imperfections, both are too low."
                }
            }
    };
    folded_section("held-out", TITLE, &contents)
}
