//! Fig. 4 and the rivals' figure: parameter deviation in the course of the optimization.

use maud::{Markup, html};
use plotters::prelude::*;

use super::super::{COMBINATIONS, MethodRow, Tables, method, rows_and_own, words};
use super::{Canvas, Chart, Drawn, RGBColor, axes, colour, legend, range, svg};
use crate::tables::CurvePoint;

const HEIGHT: u32 = 1250;

/// One line of a figure, with its points at the places `x` on the x axis.
struct Line<'a> {
    name: &'a str,
    colour: RGBColor,
    x: Vec<f64>,
    curve: &'a [CurvePoint],
    paper: Option<f64>,
}

/// Fig. 4.
pub(in super::super) fn combinations(tables: &Tables) -> Markup {
    let rows = rows_and_own(tables, &COMBINATIONS);
    let lines = lines(tables, &rows, |curve| (0..curve.len()).map(|i| i as f64).collect());
    let caption = html! {
        strong { "Fig. 4. " }
        "Course of the optimization when using the different method combinations: mean over the robots, band of ± one \
         standard deviation. Diamonds at the right edge: the paper's figures after 500 iterations."
        @if let Some(overtaking) = overtaking(tables) { " " (overtaking) }
    };
    figure(&lines, "iteration", "Parameter deviation against iteration", caption)
}

/// The sentence on the paper's remark about the course.
fn overtaking(tables: &Tables) -> Option<String> {
    let [gsa, jacobian] = ["gsa", "jacobian"].map(|key| Some(&method(tables, key)?.curve));
    let (gsa, jacobian) = (gsa?, jacobian?);
    let pairs = gsa.iter().zip(jacobian);
    let here = match pairs.clone().rposition(|(gsa, jacobian)| gsa.mean < jacobian.mean) {
        Some(last) if last + 1 == pairs.len() => "it is not below it at the end".to_owned(),
        Some(last) => format!("from iteration {} on", last + 1),
        None => "from the start".to_owned(),
    };
    Some(format!(
        "In the paper the mean of the Jacobian is below that of GSA after 320 iterations, here {here}."
    ))
}

/// The figure of the rivals beside the baseline.
pub(in super::super) fn rivals(tables: &Tables, rows: &[&MethodRow]) -> Markup {
    // A generation is not an iteration, but all methods spend the same evaluations.
    let budget = tables.run.evaluations as f64;
    let lines = lines(tables, rows, |curve| {
        let steps = curve.len().saturating_sub(1).max(1) as f64;
        (0..curve.len()).map(|i| i as f64 * budget / steps).collect()
    });
    let caption = html! {
        strong { "Fig. 6. " }
        "Course of the other optimizers against the evaluations spent: mean over the robots, band of ± one standard deviation."
    };
    figure(&lines, "evaluations of the model", "Parameter deviation against evaluations", caption)
}

fn lines<'a>(
    tables: &Tables,
    rows: &[&'a MethodRow],
    x: impl Fn(&[CurvePoint]) -> Vec<f64>,
) -> Vec<Line<'a>> {
    let with_curve = rows.iter().filter(|row| !row.curve.is_empty());
    with_curve
        .map(|row| Line {
            name: words::short(&row.name),
            colour: colour(tables, &row.key),
            x: x(&row.curve),
            curve: &row.curve,
            paper: row.paper_deviation.filter(|x| x.is_finite()),
        })
        .collect()
}

fn figure(lines: &[Line<'_>], x_label: &str, label: &str, caption: Markup) -> Markup {
    if lines.is_empty() {
        return html! {};
    }
    let entries: Vec<_> = lines.iter().map(|line| (line.name, line.colour)).collect();
    let names = entries.iter().map(|entry| entry.0).collect::<Vec<_>>().join(", ");
    let paper = lines.iter().any(|line| line.paper.is_some());
    html! {
        figure {
            (legend(&entries, html! { @if paper { li { span.mark { "◆" } "the paper" } } }))
            (svg(HEIGHT, &format!("{label}, of {names}"), |canvas| draw(canvas, lines, x_label)))
            figcaption { (caption) }
        }
    }
}

fn draw(canvas: &Canvas<'_>, lines: &[Line<'_>], x_label: &str) -> Drawn {
    let end = lines.iter().filter_map(|line| line.x.last().copied()).fold(1.0, f64::max);
    let marks = end * 1.02;
    let seen = lines.iter().flat_map(|line| {
        let curve = line.curve.iter().flat_map(|p| [p.mean - p.spread, p.mean + p.spread]);
        curve.chain(line.paper)
    });
    let y = range(seen.map(|x| 100.0 * x));
    let y = y.start.max(0.0)..y.end;
    let mut chart =
        axes(canvas, (x_label, 0.0..end * 1.04), ("parameter deviation / %", y.clone()))?;
    for line in lines {
        band(&mut chart, line, y.start)?;
    }
    for line in lines {
        let means = finite(line).map(|(x, point)| (x, 100.0 * point.mean));
        chart.draw_series(LineSeries::new(means, line.colour.stroke_width(6)))?;
    }
    for line in lines {
        let mark = line.paper.map(|paper| {
            let diamond = [(0, -18), (18, 0), (0, 18), (-18, 0)];
            EmptyElement::at((marks, 100.0 * paper))
                + Polygon::new(diamond.to_vec(), line.colour.filled())
        });
        chart.draw_series(mark)?;
    }
    Ok(())
}

/// Draws the mean plus and minus one standard deviation, not below `floor`, since no deviation is below zero.
fn band(chart: &mut Chart<'_, '_>, line: &Line<'_>, floor: f64) -> Drawn {
    let edge = |sign: f64| {
        finite(line).map(move |(x, point)| {
            let spread = if point.spread.is_finite() { point.spread } else { 0.0 };
            (x, (100.0 * (point.mean + sign * spread)).max(floor))
        })
    };
    let mut outline: Vec<_> = edge(1.0).collect();
    let mut lower: Vec<_> = edge(-1.0).collect();
    lower.reverse();
    outline.append(&mut lower);
    chart.draw_series([Polygon::new(outline, line.colour.mix(0.13))])?;
    Ok(())
}

fn finite<'a>(line: &'a Line<'a>) -> impl Iterator<Item = (f64, &'a CurvePoint)> {
    line.x.iter().copied().zip(line.curve).filter(|(_, point)| point.mean.is_finite())
}
