//! Correlations between the unknowns, and directions that the records do not determine.

use flexid_wire::confidence::Correlations;
use flexid_wire::directions::named;
use maud::{Markup, html};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::format::{number, percent};
use super::{folded_section, missing};
use crate::charts::{Colour, Mark, SOFT, WIDTH, legend, svg};
use crate::directions::distinct;
use crate::document::{Document, WeakDirection};

const TITLE: &str = "Correlations and weak directions";
/// Least correlation that is drawn and listed, per cent.
const DRAWN: u8 = 30;
const LISTED: u8 = 80;
/// Most pairs that are listed.
const MOST_PAIRS: usize = 12;
/// Side of the picture, pixels: room for a name beside each row, within these limits. Room for the names beside it and below.
const ROW: u32 = 40;
const SIDES: [u32; 2] = [700, 1900];
const NAMES: u32 = 470;
/// Room for half of the first name above, pixels.
const ABOVE: u32 = 16;
/// Height of the letters, pixels, at most, and as a part of a row.
const FONT: f64 = 30.0;
const OF_ROW: f64 = 0.9;

pub(super) fn section(document: &Document) -> Markup {
    let Some(confidence) = &document.further.confidence else {
        return folded_section("correlations", TITLE, &missing("confidence"));
    };
    let correlations = &shown(document, &confidence.correlations);
    let mut pairs: Vec<_> =
        correlations.pairs().filter(|(.., own)| own.unsigned_abs() >= LISTED).collect();
    pairs.sort_by_key(|(.., own)| -i16::from(*own).abs());
    let contents = html! {
            p {
                "Unknowns that are correlated trade off: the data fix a combination of them better than each alone. A weak direction is a \
                 combination that the data hardly fix. Other poses separate them."
            }
            h3 { "Weak directions" }
            @if confidence.weak_directions.is_empty() {
                p { "None: the data determine every combination of the unknowns." }
            } @else {
                ul {
                    @for direction in distinct(&confidence.weak_directions, names) {
                        li {
                            (direction.text) ". Components: "
                            @for (index, share) in direction.shares.iter().enumerate() {
                                @if index > 0 { ", " }
                                (share.name) " " (number(share.weight))
                            }
                            "."
                        }
                    }
                }
            }
            h3 { "Correlations" }
            @if pairs.is_empty() {
                p { "No two unknowns are correlated by " (LISTED) "\u{a0}% or more." }
            } @else {
                table.narrow {
                    caption {
                        strong { "Strongest pairs" } ", from " (LISTED) "\u{a0}% on"
                        @if pairs.len() > MOST_PAIRS { "; " (pairs.len() - MOST_PAIRS) " further pairs are in the file" }
                    }
                    thead { tr { th.left { "unknown" } th.left { "and" } th { "correlation" } } }
                    tbody {
                        @for (row, column, own) in pairs.iter().take(MOST_PAIRS) {
                            tr {
                                td.left { (correlations.unknowns[*column]) }
                                td.left { (correlations.unknowns[*row]) }
                                td { (percent(f64::from(*own) / 100.0)) }
                            }
                        }
                    }
                }
            }
            @if correlations.unknowns.len() > 1 {
                (legend(&[
                    ("above 0", Colour::Orange, Mark::Area),
                    ("below 0", Colour::Blue, Mark::Area),
                ]))
                figure {
                    (picture(correlations))
                    figcaption {
                        "Correlations of " (DRAWN) "\u{a0}% and more between all " (correlations.unknowns.len()) " unknowns; the stronger, the \
                         fuller the colour. Rows and columns have the same names: the column of an unknown stands below its own row."
                    }
                }
            }
    };
    folded_section("correlations", TITLE, &contents)
}

/// The correlations of all unknowns, of static tests those of the stiffnesses alone.
fn shown(document: &Document, all: &Correlations) -> Correlations {
    let is_shown =
        |index: usize| !(document.is_static() && all.unknowns[index].ends_with(" damping"));
    let unknowns = all.unknowns.iter().enumerate().filter(|(index, _)| is_shown(*index));
    let pairs = all.pairs().filter(|(row, column, _)| is_shown(*row) && is_shown(*column));
    Correlations {
        unknowns: unknowns.map(|(_, name)| name.clone()).collect(),
        percent: pairs.map(|(.., percent)| percent).collect(),
    }
}

/// The unknowns that the line of a direction names.
fn names(direction: &WeakDirection) -> impl Iterator<Item = &str> {
    named(direction.shares.iter().map(|own| (own.name.as_str(), own.weight as f32)))
}

/// The lower triangle, with the names of the unknowns beside it.
fn picture(correlations: &Correlations) -> Markup {
    let unknowns = correlations.unknowns.len();
    let [least, most] = SIDES;
    let side = (unknowns as u32 * ROW).clamp(least, most);
    let cell = f64::from(side) / unknowns as f64;
    let font = FONT.min(OF_ROW * cell);
    svg(side + ABOVE + NAMES, "Correlations between the unknowns", |canvas| {
        let canvas = canvas.clone().shrink((0, ABOVE), (WIDTH, side + NAMES));
        let place = |index: usize| (index as f64 * cell).round() as i32;
        let left = NAMES as i32 + (WIDTH as i32 - NAMES as i32 - side as i32) / 2;
        let right = Pos::new(HPos::Right, VPos::Center);
        let beside = TextStyle::from(("sans-serif", font).into_font()).pos(right);
        let below = beside.transform(FontTransform::Rotate270);
        for index in 0..unknowns {
            let (from, to) = (place(index), place(index + 1));
            let own = [(left + from, from), (left + to, to)];
            canvas.draw(&Rectangle::new(own, SOFT.mix(0.45).filled()))?;
            let (name, middle) = (&correlations.unknowns[index], (from + to) / 2);
            canvas.draw_text(name, &beside, (left - 14, middle))?;
            canvas.draw_text(name, &below, (left + middle, side as i32 + 14))?;
        }
        for (row, column, own) in
            correlations.pairs().filter(|(.., own)| own.unsigned_abs() >= DRAWN)
        {
            let corners =
                [(left + place(column), place(row)), (left + place(column + 1), place(row + 1))];
            let colour = if own > 0 { Colour::Orange } else { Colour::Blue };
            let strength = f64::from(own.unsigned_abs()) / 100.0;
            canvas.draw(&Rectangle::new(corners, colour.rgb().mix(strength).filled()))?;
        }
        let outline = [(left, 0), (left, side as i32 - 1), (left + side as i32, side as i32 - 1)];
        canvas.draw(&PathElement::new(outline, SOFT.stroke_width(2)))?;
        Ok(())
    })
}
