//! Pictures as SVG: a canvas, axes, and the file's format by its name.

use std::error::Error;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use flexid_console::exit::BadArgument;
use flexid_console::output::{self, Output};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

/// Size of a picture, pixels.
pub(crate) const SIZE: (u32, u32) = (960, 600);
/// Height of the title and of each line below it, pixels.
const LINE: u32 = 26;
const FONT: (&str, u32) = ("sans-serif", 16);

pub(crate) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(crate) type Drawn<T = ()> = Result<T, Box<dyn Error>>;

/// Colours that everyone can distinguish (Okabe and Ito).
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(crate) const ORANGE: RGBColor = RGBColor(213, 94, 0);
pub(crate) const INK: RGBColor = RGBColor(40, 40, 40);

/// The content of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Numbers, comma-separated.
    Csv,
    /// A picture.
    Svg,
}

impl Format {
    /// The format of a file's name.
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

/// The files that are going to be written from the result `found`, each with its format.
///
/// # Errors
/// A name ends otherwise, two files are the same, or a file cannot be written.
pub(crate) fn outputs(found: &Path, files: &[PathBuf]) -> Result<Vec<(Format, Output)>> {
    output::keeps([found], files.iter().map(PathBuf::as_path))?;
    files.iter().map(|file| Ok((Format::of(file)?, Output::create(file)?))).collect()
}

/// The meaning of a mark in a picture.
pub(crate) struct Key<'a> {
    mark: Mark,
    words: &'a str,
}

enum Mark {
    Line(RGBColor),
    Area(RGBAColor),
    /// Strokes of this colour over an area.
    Hatch(RGBAColor, RGBColor),
}

impl<'a> Key<'a> {
    pub(crate) fn line(colour: RGBColor, words: &'a str) -> Self {
        Self { mark: Mark::Line(colour), words }
    }

    pub(crate) fn area(colour: RGBAColor, words: &'a str) -> Self {
        Self { mark: Mark::Area(colour), words }
    }

    pub(crate) fn hatch(stroke: RGBAColor, area: RGBColor, words: &'a str) -> Self {
        Self { mark: Mark::Hatch(stroke, area), words }
    }

    /// Draws the mark and its words from `x` on, and gives the end of the words.
    fn draw(&self, line: &Canvas<'_>, x: i32, style: &TextStyle<'_>) -> Drawn<i32> {
        // The middle of the words' height, and the size of a mark.
        let (middle, width, half) = (9, 24, 7);
        let [corner, end] = [(x, middle - half), (x + width, middle + half)];
        match self.mark {
            Mark::Line(colour) => {
                let stroke = vec![(x, middle), (x + width, middle)];
                line.draw(&PathElement::new(stroke, colour.stroke_width(3)))?;
            }
            Mark::Area(colour) => line.draw(&Rectangle::new([corner, end], colour.filled()))?,
            Mark::Hatch(stroke, area) => {
                line.draw(&Rectangle::new([corner, end], area.filled()))?;
                for from in [x, x + width / 3, x + 2 * width / 3] {
                    let strokes = vec![(from, middle + half), (from + width / 3, middle - half)];
                    line.draw(&PathElement::new(strokes, stroke))?;
                }
            }
        }
        line.draw(&Text::new(self.words.to_owned(), (x + width + 8, 0), style.clone()))?;
        let (words, _) = line.estimate_text_size(self.words, style)?;
        Ok(x + width + 8 + words as i32)
    }
}

/// The text of a picture: the lines of the title, those of a doubt about what is shown, the keys in a line, and what is drawn.
///
/// # Errors
/// None for numbers that are finite.
pub(crate) fn svg(
    title: &str,
    doubt: &str,
    keys: &[Key<'_>],
    size: (u32, u32),
    draw: impl FnOnce(&Canvas<'_>) -> Drawn,
) -> Result<String> {
    let mut text = String::new();
    {
        let canvas = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let drawn = || -> Drawn {
            canvas.fill(&WHITE)?;
            let style = TextStyle::from(FONT.into_font()).color(&INK);
            let canvas = canvas.margin(12, 12, 16, 16);
            let mut body = canvas.clone();
            let title = title.lines().map(|line| (line, &INK));
            for (words, colour) in title.chain(doubt.lines().map(|line| (line, &ORANGE))) {
                let (line, rest) = body.split_vertically(LINE);
                line.draw(&Text::new(words.to_owned(), (0, 0), style.color(colour)))?;
                body = rest;
            }
            if !keys.is_empty() {
                let (line, rest) = body.split_vertically(LINE);
                let mut x = 0;
                for key in keys {
                    x = key.draw(&line, x, &style)? + 24;
                }
                body = rest;
            }
            draw(&body)?;
            Ok(canvas.present()?)
        };
        drawn().map_err(|error| anyhow!("the picture cannot be drawn: {error}"))?;
    }
    Ok(text)
}

/// Sizes of the labels of the axes, and of the margins above and on the right, pixels.
const LABELS: [u32; 2] = [72, 52];
const MARGINS: [u32; 2] = [16, 8];

/// Widens one of the ranges about its middle, so that both axes of an area have the same scale.
pub(crate) fn equally_scaled(area: &Canvas<'_>, ranges: [Range<f64>; 2]) -> [Range<f64>; 2] {
    let (width, height) = area.dim_in_pixel();
    let pixels = [0, 1].map(|axis| {
        let outside = LABELS[axis] + MARGINS[axis];
        f64::from([width, height][axis].saturating_sub(outside).max(1))
    });
    let per_pixel = |axis: usize| (ranges[axis].end - ranges[axis].start) / pixels[axis];
    let scale = per_pixel(0).max(per_pixel(1));
    [0, 1].map(|axis| {
        let middle = 0.5 * (ranges[axis].start + ranges[axis].end);
        let half = 0.5 * scale * pixels[axis];
        middle - half..middle + half
    })
}

/// Axes with a light grid, below what is drawn later.
pub(crate) fn axes<'a, 'b>(
    area: &'a Canvas<'b>,
    x: (&str, Range<f64>),
    y: (&str, Range<f64>),
) -> Drawn<Chart<'a, 'b>> {
    let mut chart = ChartBuilder::on(area)
        .margin_right(MARGINS[0])
        .margin_top(MARGINS[1])
        .x_label_area_size(LABELS[1])
        .y_label_area_size(LABELS[0])
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
