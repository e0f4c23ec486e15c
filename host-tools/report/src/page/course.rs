//! The course of the search.

use flexid_wire::report::FoundBy;
use maud::{Markup, html};

use super::format::{count, number};
use super::{folded_section, missing};
use crate::charts::panel::{Curve, Labels, Panel};
use crate::charts::scale::Scale;
use crate::charts::{Colour, svg};
use crate::document::Document;
use crate::evidence::Step;

const HEIGHT: u32 = 620;

pub(super) fn section(document: &Document) -> Markup {
    let fit = &document.found.fit;
    let how = match fit.found_by {
        FoundBy::Refinement => "the refinement alone",
        FoundBy::Descent => "a descent from low to high frequencies",
        FoundBy::RandomSearch => "a random search",
        FoundBy::Branch => "a branch of another minimum",
    };
    let contents = html! {
            p {
                "Found by " (how) ": " (count(fit.starts as usize, "start")) ", of which " (fit.random_searches) " random; "
                (fit.search_evaluations) " search steps, " (fit.refine_iterations) " refinement steps; branches of minima that were tried: "
                (fit.branches) ". SSP " (number(fit.ssp)) ", worst " (number(fit.ssp_max)) "; χ²/dof " (number(fit.consistency)) "."
            }
            p.note {
                "SSP, the surface similarity parameter, is 0 where model and measurement agree, and 2 where they are opposite."
            }
            @match &document.further.course {
                None => (missing("course")),
                Some(course) if course.is_empty() => p { "No refinement of records." },
                Some(course) => figure {
                    (chart(course))
                    figcaption {
                        "Where the refinements stood after each step: sum of squares of the residuals per residual, in units of the noise. It is \
                         near 1 where noise alone is left. A jump upward is a new start, a new record, or a rival that was tried; the \
                         imperfections are fitted afterwards."
                    }
                },
            }
    };
    folded_section("course", "Course of the search", &contents)
}

fn chart(course: &[Step]) -> Markup {
    let ends = |of: fn(f64, f64) -> f64, first: f64| {
        course.iter().map(|own| own.step as f64).fold(first, of)
    };
    let x = Scale::round([ends(f64::min, f64::INFINITY), ends(f64::max, 0.0)]);
    let y = Scale::decades(course.iter().map(|own| own.misfit));
    // Where another start or record begins, the curve is broken.
    let mut points: Vec<(f64, Option<f64>)> = Vec::new();
    for pair in course.windows(2) {
        let [own, next] = pair else { continue };
        points.push((own.step as f64, Some(own.misfit)));
        if (own.starts, own.records) != (next.starts, next.records) {
            points.push((own.step as f64, None));
        }
    }
    points.extend(course.last().map(|own| (own.step as f64, Some(own.misfit))));
    svg(HEIGHT, "Course of the search", |canvas| {
        Panel {
            x,
            y,
            title: String::new(),
            labels: Labels {
                x: Some("steps of searches and refinements".to_owned()),
                y: Some("misfit".to_owned()),
            },
            bands: Vec::new(),
            curves: vec![Curve { colour: Colour::Blue, width: 4, points }],
        }
        .draw(canvas)
    })
}
