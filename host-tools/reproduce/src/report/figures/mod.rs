//! Figs. 3 to 6, and what they share: a canvas that becomes inline SVG, axes, colours, a legend.

pub(super) mod course;
pub(super) mod displacement;
pub(super) mod search;

use std::error::Error;
use std::ops::Range;

use maud::{Markup, PreEscaped, html};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::{ADAPTIONS, COMBINATIONS, Tables, format};

/// Width of a canvas, pixels, which the page shows at 60 rem. The backend draws in whole pixels only, so that it must
/// be wide.
const WIDTH: u32 = 2400;
const FONT: (&str, u32) = ("sans-serif", 42);

/// The colour that the style sheet replaces by that of the text, light or dark.
const INK: RGBColor = BLACK;
const GRID: RGBColor = RGBColor(128, 128, 128);

/// Colours after Okabe and Ito, which everyone can distinguish: first the method combinations, then all others.
const PALETTE: [RGBColor; 8] = [
    RGBColor(213, 94, 0),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(31, 119, 200),
    RGBColor(86, 180, 233),
    RGBColor(128, 128, 128),
    RGBColor(132, 96, 190),
    RGBColor(204, 121, 167),
];

type Canvas<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn<T = ()> = Result<T, Box<dyn Error>>;

/// Colour of a method, the same in every figure.
fn colour(tables: &Tables, key: &str) -> RGBColor {
    let combination = COMBINATIONS.iter().position(|known| *known == key);
    let others = || {
        let known = |key: &str| COMBINATIONS.contains(&key) || ADAPTIONS.contains(&key);
        let mut others = tables.methods.iter().filter(|row| !known(&row.key));
        let place = others.position(|row| row.key == key).unwrap_or(0);
        COMBINATIONS.len() + place % (PALETTE.len() - COMBINATIONS.len())
    };
    PALETTE[combination.unwrap_or_else(others)]
}

/// Inline SVG of this height; `label` describes it for readers who cannot see it.
fn svg(height: u32, label: &str, draw: impl FnOnce(&Canvas<'_>) -> Drawn) -> Markup {
    let mut text = String::new();
    let drawn = {
        let canvas = SVGBackend::with_string(&mut text, (WIDTH, height)).into_drawing_area();
        draw(&canvas).and_then(|()| Ok(canvas.present()?))
    };
    html! {
        @match drawn {
            Ok(()) => div role="img" aria-label=(label) { (PreEscaped(text)) },
            Err(error) => p { "Not drawn: " (error) "." },
        }
    }
}

/// Axes with a light grid. They are drawn at once, so that later drawings lie above them.
fn axes<'a, 'b>(
    area: &'a Canvas<'b>,
    x: (&str, Range<f64>),
    y: (&str, Range<f64>),
) -> Drawn<Chart<'a, 'b>> {
    let mut chart = ChartBuilder::on(area)
        .margin(20)
        .margin_right(50)
        .x_label_area_size(140)
        .y_label_area_size(180)
        .build_cartesian_2d(x.1, y.1)?;
    chart
        .configure_mesh()
        .x_desc(x.0)
        .y_desc(y.0)
        .x_labels(10)
        .y_labels(7)
        .max_light_lines(0)
        .bold_line_style(GRID.mix(0.25).stroke_width(2))
        .axis_style(INK.stroke_width(2))
        .label_style(FONT)
        .axis_desc_style(FONT)
        .set_all_tick_mark_size(12)
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .draw()?;
    Ok(chart)
}

fn tick(x: &f64) -> String {
    // Ticks are multiples of a step, with rounding errors.
    let rounded = (x * 1e6).round() / 1e6 + 0.0;
    if rounded >= 1e4 {
        format::count(rounded as u64)
    } else {
        rounded.to_string().replace('-', "\u{2212}")
    }
}

/// Range from the least to the largest value, with some room. It starts at zero if that is not far.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        return 0.0..1.0;
    }
    let room = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1e-9) };
    let from_zero = low >= 0.0 && low < 0.5 * high;
    (if from_zero { 0.0 } else { low - room })..high + room
}

/// A legend of names beside their colours.
fn legend(entries: &[(&str, RGBColor)], more: Markup) -> Markup {
    html! {
        ul.legend {
            @for (name, colour) in entries {
                li { span style={ "background:" (css(*colour)) } {} (name) }
            }
            (more)
        }
    }
}

/// A colour for the style sheet.
fn css(colour: RGBColor) -> String {
    match colour {
        INK => "currentColor".to_owned(),
        RGBColor(r, g, b) => format!("#{r:02x}{g:02x}{b:02x}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_have_width() {
        for values in [vec![], vec![0.0], vec![3.0, 3.0], vec![f64::NAN, -2.0], vec![1.0, 9.0]] {
            let range = range(values.iter().copied());
            assert!(range.start < range.end, "{values:?}: {range:?}");
            assert!(
                values.iter().all(|x| x.is_nan() || range.contains(x)),
                "{values:?}: {range:?}"
            );
        }
    }

    #[test]
    fn ticks_are_short() {
        assert_eq!(tick(&0.300_000_000_000_000_04), "0.3");
        assert_eq!(tick(&-15.0), "−15");
        assert_eq!(tick(&-0.0), "0");
        assert_eq!(tick(&10_000.0), "10\u{202f}000");
    }
}
