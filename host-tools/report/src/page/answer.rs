//! The answer in numbers: stiffness of the tool, lowest mode and its damping, stiffness of the drives, each with its interval.

use flexid_pipeline::names::STIFFNESS_UNITS;
use flexid_wire::answer::{Answer, Drive, Number};
use maud::{Markup, html};

use super::format::{minus, number, pose, uncertainty};
use super::missing;
use crate::document::Document;
use crate::imperfection;

/// Words that stand in place of a number that says nothing.
const OPEN: &str = "not determined";

pub(super) fn section(document: &Document) -> Markup {
    html! {
        section #answer {
            @match &document.further.answer {
                Some(answer) => (numbers(answer)),
                None => (missing("answer")),
            }
        }
    }
}

fn numbers(own: &Answer) -> Markup {
    let stiffness = |own: Number| (format!("{}\u{a0}N/µm", number(1e-6 * own.value)), own);
    let frequency = |own: Number| (format!("{}\u{a0}Hz", number(own.value)), own);
    let ratio = |own: Number| (format!("{}\u{a0}%", number(100.0 * own.value)), own);
    let mode = &own.lowest_mode;
    html! {
        dl.answer {
            (card("Tool, softest direction", own.softest.stiffness.map(stiffness), along(own.softest.direction)))
            (card("Tool, stiffest direction", own.stiffest.stiffness.map(stiffness), along(own.stiffest.direction)))
            (card("Lowest mode", mode.frequency_hz.map(frequency), None))
            (card("Damping of that mode", mode.damping_ratio.map(ratio), None))
        }
        dl.answer.drives {
            @for own in &own.drives { (card(&format!("Drive of {}", own.joint), drive(own), None)) }
        }
        p.note {
            "At the pose "
            @match own.record {
                Some(record) => { "of record " (record) ", the newest" },
                None => { "of the last static test" },
            }
            ", " (pose(&own.pose)) " rad (m). The tool's stiffness is static. Directions are along the axes of the tool centre point, intervals hold with 95\u{a0}%."
        }
    }
}

/// A number with its interval and direction.
fn card(name: &str, shown: Option<(String, Number)>, along: Option<String>) -> Markup {
    html! {
        div {
            dt { (name) }
            @match shown {
                None => { dd.open { (OPEN) } },
                Some((words, own)) => {
                    dd {
                        strong { (words) } " "
                        @match own.interval {
                            Some(ends) => { span { (uncertainty(own.value, ends)) } },
                            None => { span { "no interval" } },
                        }
                    }
                    @if let Some(along) = along { dd.along { (along) } }
                },
            }
        }
    }
}

fn drive(own: &Drive) -> Option<(String, Number)> {
    let unit = STIFFNESS_UNITS[usize::from(own.dof)];
    own.stiffness.map(|own| (imperfection::number(own.value, unit), own))
}

/// For example `along (0.71, 0.02, −0.70)`.
fn along(direction: Option<[f64; 3]>) -> Option<String> {
    let [x, y, z] = direction?.map(|own| minus(&format!("{own:.2}")));
    Some(format!("along ({x}, {y}, {z})"))
}
