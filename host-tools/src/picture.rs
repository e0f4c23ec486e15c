//! Pictures as SVG: a canvas, axes, and the file's format by its name.

use std::error::Error;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::exit::BadArgument;
use crate::output::Output;

/// Size of a picture, pixels.
const SIZE: (u32, u32) = (960, 600);
const FONT: (&str, u32) = ("sans-serif", 16);

pub(crate) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(crate) type Drawn<T = ()> = Result<T, Box<dyn Error>>;

/// Colours that everyone can distinguish (Okabe and Ito).
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const INK: RGBColor = RGBColor(40, 40, 40);

/// What a file shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Numbers, comma-separated.
    Csv,
    /// A picture.
    Svg,
}

impl Format {
    /// That of a file's name.
    ///
    /// # Errors
    /// The name ends otherwise.
    fn of(file: &Path) -> Result<Self, BadArgument> {
        match file.extension().and_then(|end| end.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("svg") => Ok(Self::Svg),
            _ => {
                let file = file.display();
                Err(BadArgument(format!("{file}: is written as .csv or .svg: name such a file")))
            }
        }
    }
}

/// The files that are going to be written, each with its format.
///
/// # Errors
/// A name ends otherwise, or a file cannot be written.
pub(crate) fn outputs(files: &[PathBuf]) -> Result<Vec<(Format, Output)>> {
    files.iter().map(|file| Ok((Format::of(file)?, Output::create(file)?))).collect()
}

/// The text of a picture.
///
/// # Errors
/// None for numbers that are finite.
pub(crate) fn svg(title: &str, draw: impl FnOnce(&Canvas<'_>) -> Drawn) -> Result<String> {
    let mut text = String::new();
    {
        let canvas = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        let drawn = || -> Drawn {
            canvas.fill(&WHITE)?;
            let style = TextStyle::from(FONT.into_font()).color(&INK);
            let canvas = canvas.margin(12, 12, 16, 16);
            let (head, body) = canvas.split_vertically(28);
            head.draw(&Text::new(title.to_owned(), (0, 0), style))?;
            draw(&body)?;
            Ok(canvas.present()?)
        };
        drawn().map_err(|error| anyhow!("the picture cannot be drawn: {error}"))?;
    }
    Ok(text)
}

/// Axes with a light grid, below what is drawn later.
pub(crate) fn axes<'a, 'b>(
    area: &'a Canvas<'b>,
    x: (&str, Range<f64>),
    y: (&str, Range<f64>),
) -> Drawn<Chart<'a, 'b>> {
    let mut chart = ChartBuilder::on(area)
        .margin_right(16)
        .margin_top(8)
        .x_label_area_size(52)
        .y_label_area_size(72)
        .build_cartesian_2d(x.1, y.1)?;
    chart
        .configure_mesh()
        .x_desc(x.0)
        .y_desc(y.0)
        .x_labels(9)
        .y_labels(9)
        .max_light_lines(0)
        .bold_line_style(INK.mix(0.12))
        .axis_style(INK)
        .label_style(FONT.into_font().color(&INK))
        .axis_desc_style(FONT.into_font().color(&INK))
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .draw()?;
    Ok(chart)
}

/// A tick, without the rounding of its multiple of a step.
pub(crate) fn tick(x: &f64) -> String {
    let rounded = (x * 1e9).round() / 1e9 + 0.0;
    rounded.to_string().replace('-', "\u{2212}")
}
