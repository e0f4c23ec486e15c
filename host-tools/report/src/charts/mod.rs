//! Charts as inline SVG.
//!
//! | file    | what                                                             |
//! | ------- | ---------------------------------------------------------------- |
//! | `scale` | the range of an axis, linear or logarithmic, and its ticks       |
//! | `panel` | curves, bands and dots between two axes                          |
//! | `spectra` | a record beside the model, a panel for each axis                 |
//!
//! A chart library draws with fixed colours. The style sheet replaces those of `INK` and the `Colour`s by those of the page, light or
//! dark.

pub(crate) mod panel;
pub mod scale;
pub mod spectra;

use std::error::Error;

use maud::{Markup, PreEscaped, html};
use plotters::coord::Shift;
use plotters::prelude::*;

/// Width of a canvas, pixels. The backend draws in whole pixels only, so that it must be wide.
pub(crate) const WIDTH: u32 = 2400;

/// The colour that the style sheet replaces by that of the text.
pub(crate) const INK: RGBColor = BLACK;
/// Grid lines and bounds.
pub(crate) const SOFT: RGBColor = RGBColor(128, 128, 128);

pub(crate) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Drawn<T = ()> = Result<T, Box<dyn Error>>;

/// Colours after Okabe and Ito, which everyone can distinguish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colour {
    /// The model, what is weak, and what is above zero.
    Orange,
    /// Measured values.
    Blue,
    /// Identified values.
    Green,
    /// Residuals.
    Red,
    /// Noise, and what is not observable. The style sheet dashes its lines.
    Grey,
}

impl Colour {
    pub(crate) fn rgb(self) -> RGBColor {
        match self {
            Self::Orange => RGBColor(213, 124, 0),
            Self::Blue => RGBColor(0, 114, 178),
            Self::Green => RGBColor(0, 138, 103),
            Self::Red => RGBColor(196, 60, 40),
            Self::Grey => RGBColor(127, 127, 127),
        }
    }

    /// Its class in the style sheet.
    pub(crate) fn class(self) -> &'static str {
        match self {
            Self::Orange => "orange",
            Self::Blue => "blue",
            Self::Green => "green",
            Self::Red => "red",
            Self::Grey => "grey",
        }
    }
}

/// Inline SVG of this height; `label` describes it for readers who cannot see it.
pub(crate) fn svg(height: u32, label: &str, draw: impl FnOnce(&Canvas<'_>) -> Drawn) -> Markup {
    svg_of((WIDTH, height), label, draw)
}

/// Inline SVG of this width and height, pixels.
pub(crate) fn svg_of(
    size: (u32, u32),
    label: &str,
    draw: impl FnOnce(&Canvas<'_>) -> Drawn,
) -> Markup {
    let mut text = String::new();
    let drawn = {
        let canvas = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw(&canvas).and_then(|()| Ok(canvas.present()?))
    };
    html! {
        @match drawn {
            Ok(()) => div role="img" aria-label=(label) { (PreEscaped(slim(&text))) },
            Err(error) => p { "Not drawn: " (error) "." },
        }
    }
}

/// The SVG without what says nothing: attributes with their initial values, and what the style sheet gives.
fn slim(svg: &str) -> String {
    svg.replace(" opacity=\"1\"", "")
        .replace(" stroke=\"none\" stroke-width=\"1\"", "")
        .replace(" font-family=\"sans-serif\"", "")
        .replace(" xmlns=\"http://www.w3.org/2000/svg\"", "")
        .replace(" \"/>", "\"/>")
}

/// A legend of names beside their colours: a line, or a box for what is an area.
pub(crate) fn legend(entries: &[(&str, Colour, Mark)]) -> Markup {
    html! {
        ul.legend {
            @for (name, colour, mark) in entries {
                li { span class={ (mark.class()) " " (colour.class()) } {} (name) }
            }
        }
    }
}

/// How a legend shows an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mark {
    Line,
    Dashed,
    Area,
    Dot,
}

impl Mark {
    fn class(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Dashed => "dashed",
            Self::Area => "area",
            Self::Dot => "dot",
        }
    }
}
