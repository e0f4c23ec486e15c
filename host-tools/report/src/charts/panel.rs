//! Curves, bands and dots between two axes.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::scale::Scale;
use super::{Canvas, Colour, Drawn, INK, SOFT};

/// Height of the letters, pixels.
const FONT: f64 = 34.0;
/// Room for the labels of an axis, pixels.
const LEFT: u32 = 150;
const BELOW: u32 = 62;
/// Room for a title, for half of a number at the end of an axis, and beside it, pixels.
const TITLE: u32 = 50;
const HALF_LINE: u32 = 18;
const RIGHT: u32 = 48;
/// Room for the description of an axis, pixels.
const DESCRIPTION: u32 = 44;

/// The content of a panel.
#[derive(Clone, Debug)]
pub(crate) struct Panel {
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    /// Above the right end.
    pub(crate) title: String,
    pub(crate) labels: Labels,
    pub(crate) bands: Vec<Band>,
    pub(crate) curves: Vec<Curve>,
}

/// Which axes are labelled: their numbers and a description. Without a description an axis has no numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Labels {
    pub(crate) x: Option<String>,
    pub(crate) y: Option<String>,
}

/// An area between two curves.
#[derive(Clone, Debug)]
pub(crate) struct Band {
    pub(crate) colour: Colour,
    /// x, lower and upper y.
    pub(crate) points: Vec<(f64, [f64; 2])>,
}

/// A curve.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub(crate) colour: Colour,
    pub(crate) width: u32,
    /// x and y. A curve is broken where y is `None`.
    pub(crate) points: Vec<(f64, Option<f64>)>,
}

impl Curve {
    /// Dots alone.
    pub(crate) fn dots(
        colour: Colour,
        width: u32,
        points: impl Iterator<Item = (f64, f64)>,
    ) -> Self {
        let points = points.flat_map(|(x, y)| [(x, Some(y)), (x, None)]).collect();
        Self { colour, width, points }
    }
}

impl Panel {
    /// Draws the panel on the whole canvas. Panels of the same labels have their axes at the same places.
    pub(crate) fn draw(&self, canvas: &Canvas<'_>) -> Drawn {
        let Self { x, y, labels, .. } = self;
        let size = |label: &Option<String>, room: u32| match label {
            Some(text) if text.is_empty() => room,
            Some(_) => room + DESCRIPTION,
            None => 0,
        };
        let mut chart = ChartBuilder::on(canvas)
            .margin(8)
            .margin_top(if self.title.is_empty() { HALF_LINE } else { TITLE })
            .margin_bottom(if labels.x.is_none() { HALF_LINE } else { 0 })
            .margin_right(RIGHT)
            .x_label_area_size(size(&labels.x, BELOW))
            .y_label_area_size(size(&labels.y, LEFT))
            .build_cartesian_2d(x.clone(), y.clone())?;
        chart
            .configure_mesh()
            .x_desc(labels.x.clone().unwrap_or_default())
            .y_desc(labels.y.clone().unwrap_or_default())
            .max_light_lines(0)
            .bold_line_style(SOFT.mix(0.25).stroke_width(2))
            .axis_style(SOFT.stroke_width(2))
            .label_style(("sans-serif", FONT))
            .axis_desc_style(("sans-serif", FONT))
            .set_all_tick_mark_size(8)
            .draw()?;
        for band in &self.bands {
            let placed = |(at, ends): &(f64, [f64; 2])| {
                Some((x.place(*at)?, [y.end_place(ends[0])?, y.end_place(ends[1])?]))
            };
            let points: Vec<(f64, [f64; 2])> = band.points.iter().filter_map(placed).collect();
            let above = points.iter().map(|(at, [_, upper])| (*at, *upper));
            let below = points.iter().rev().map(|(at, [lower, _])| (*at, *lower));
            let outline: Vec<(f64, f64)> = above.chain(below).collect();
            if outline.len() > 2 {
                chart.draw_series([Polygon::new(outline, band.colour.rgb().mix(0.3))])?;
            }
        }
        for curve in &self.curves {
            let style = curve.colour.rgb().stroke_width(curve.width);
            for piece in pieces(&curve.points, x, y) {
                match piece.as_slice() {
                    // A point alone would be a line without length.
                    [point] => {
                        chart.draw_series([Circle::new(*point, curve.width, style.filled())])?;
                    }
                    _ => {
                        chart.draw_series([PathElement::new(piece, style)])?;
                    }
                }
            }
        }
        if !self.title.is_empty() {
            let style = TextStyle::from(("sans-serif", FONT).into_font())
                .color(&INK)
                .pos(Pos::new(HPos::Right, VPos::Top));
            let (width, _) = canvas.dim_in_pixel();
            canvas.draw_text(&self.title, &style, ((width - RIGHT) as i32, 8))?;
        }
        Ok(())
    }
}

/// The stretches of a curve without a gap, where they are drawn.
fn pieces(points: &[(f64, Option<f64>)], x: &Scale, y: &Scale) -> Vec<Vec<(f64, f64)>> {
    let placed: Vec<Option<(f64, f64)>> =
        points.iter().map(|(at, own)| Some((x.place(*at)?, y.place((*own)?)?))).collect();
    let pieces = placed.split(Option::is_none).filter(|piece| !piece.is_empty());
    pieces.map(|piece| piece.iter().flatten().copied().collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_breaks_a_curve() {
        let scale = Scale::round([0.0, 10.0]);
        let points = [
            (0.0, Some(1.0)),
            (1.0, Some(2.0)),
            (2.0, None),
            (3.0, Some(f64::NAN)),
            (4.0, Some(4.0)),
        ];
        let pieces = pieces(&points, &scale, &scale);
        assert_eq!(pieces, [vec![(0.0, 1.0), (1.0, 2.0)], vec![(4.0, 4.0)]]);
    }
}
