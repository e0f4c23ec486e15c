//! Fig. 3: the search over two parameters, one panel per iteration.

use maud::{Markup, html};
use plotters::prelude::*;

use super::{Canvas, Chart, Drawn, FONT, INK, WIDTH, axes, css, svg};
use crate::tables::{SearchIllustration, SearchIteration};

/// Number of shades of the loss. Each covers an equal share of the area.
const SHADES: usize = 16;
const LOWEST: [f64; 3] = [58.0, 64.0, 76.0];
const HIGHEST: [f64; 3] = [206.0, 211.0, 219.0];

const SAMPLES: RGBColor = RGBColor(240, 150, 30);
const CIRCLE: RGBColor = RGBColor(86, 180, 233);
const TRUTH: RGBColor = RGBColor(255, 110, 90);
/// Largest number of panels. More would be too small.
const PANELS: usize = 6;
/// Width that a panel needs besides its square, as `axes` lays it out.
const BESIDE: u32 = 250;
/// Height that a panel needs besides its square, as `axes` lays it out.
const ABOVE_AND_BELOW: u32 = 280;

pub(in super::super) fn figure(search: &SearchIllustration) -> Markup {
    let panels = search.iterations.len().min(PANELS);
    if panels == 0 {
        return html! {};
    }
    let columns = if panels == 4 { 2 } else { panels.clamp(2, 3) };
    let rows = panels.div_ceil(columns);
    let panel = (WIDTH / columns as u32).saturating_sub(BESIDE) + ABOVE_AND_BELOW;
    let label = format!("Random search over {} and {}", search.axes[0], search.axes[1]);
    html! {
        figure {
            ul.legend {
                li { (mark("▲", SAMPLES)) "samples" }
                li { (mark("○", INK)) "best sample (white)" }
                li { (mark("○", CIRCLE)) "circle they were drawn from; dashed: the next" }
                li { (mark("✕", TRUTH)) "truth" }
            }
            (svg(panel * rows as u32, &label, |canvas| {
                for (i, area) in canvas.split_evenly((rows, columns)).iter().take(panels).enumerate() {
                    draw(area, search, i)?;
                }
                Ok(())
            }))
            figcaption {
                strong { "Fig. 3. " }
                "Simple 2D random search algorithm with annealing, all other parameters known. The circle moves to the best \
                 sample and shrinks. Background: the loss, darker is lower, every shade over an equal share of the area."
            }
        }
    }
}

fn mark(symbol: &str, colour: RGBColor) -> Markup {
    html! { span.mark style={ "color:" (css(colour)) } { (symbol) } }
}

fn draw(area: &Canvas<'_>, search: &SearchIllustration, i: usize) -> Drawn {
    let SearchIteration { iteration, centre, radius, samples, best } = &search.iterations[i];
    let area = area.margin(40, 0, 0, 0).titled(&format!("iteration {iteration}"), FONT)?;
    let mut chart = axes(&area, (&search.axes[0], 0.0..1.0), (&search.axes[1], 0.0..1.0))?;
    background(&mut chart, &search.loss)?;
    circle(&mut chart, *centre, *radius, 1)?;
    let next = search.iterations.get(i + 1).filter(|next| next.iteration == iteration + 1);
    if let Some(next) = next {
        circle(&mut chart, next.centre, next.radius, 2)?;
    }
    let samples = samples.iter().filter(|sample| inside(**sample));
    chart.draw_series(samples.map(|&[x, y]| TriangleMarker::new((x, y), 13, SAMPLES.filled())))?;
    let best = Some(*best).filter(|best| inside(*best));
    chart.draw_series(best.map(|[x, y]| Circle::new((x, y), 24, WHITE.stroke_width(6))))?;
    let truth = Some(search.truth).filter(|truth| inside(*truth));
    chart.draw_series(truth.map(|[x, y]| Cross::new((x, y), 18, TRUTH.stroke_width(7))))?;
    Ok(())
}

/// Draws the loss in shades. Neighbours of one shade in a row are one rectangle.
fn background(chart: &mut Chart<'_, '_>, loss: &[Vec<f64>]) -> Drawn {
    let mut sorted: Vec<f64> = loss.iter().flatten().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let shade = |loss: f64| {
        let below = sorted.partition_point(|x| *x < loss);
        (below * SHADES / sorted.len().max(1)).min(SHADES - 1)
    };
    let height = 1.0 / loss.len().max(1) as f64;
    for (i, row) in loss.iter().enumerate() {
        let width = 1.0 / row.len().max(1) as f64;
        let mut start = 0;
        for run in row.chunk_by(|a, b| shade(*a) == shade(*b)) {
            let (left, right) = (start as f64 * width, (start + run.len()) as f64 * width);
            let corners = [(left, i as f64 * height), (right, (i + 1) as f64 * height)];
            chart.draw_series([Rectangle::new(corners, grey(shade(run[0])).filled())])?;
            start += run.len();
        }
    }
    Ok(())
}

fn grey(shade: usize) -> RGBColor {
    let t = shade as f64 / (SHADES - 1) as f64;
    let [r, g, b] = [0, 1, 2].map(|i| (LOWEST[i] + t * (HIGHEST[i] - LOWEST[i])).round() as u8);
    RGBColor(r, g, b)
}

/// Draws the part of the circle that lies in the bounds; of every `every` strokes it draws the first.
fn circle(chart: &mut Chart<'_, '_>, centre: [f64; 2], radius: f64, every: usize) -> Drawn {
    const STROKES: usize = 60;
    const POINTS: usize = 4;
    let point = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / (STROKES * POINTS) as f64;
        [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
    };
    let on: Vec<_> =
        (0..=STROKES * POINTS).map(|i| (point(i), (i / POINTS).is_multiple_of(every))).collect();
    let strokes = on.split(|(point, drawn)| !drawn || !inside(*point));
    let paths = strokes.filter(|stroke| stroke.len() > 1).map(|stroke| {
        let points: Vec<_> = stroke.iter().map(|([x, y], _)| (*x, *y)).collect();
        PathElement::new(points, CIRCLE.stroke_width(6))
    });
    chart.draw_series(paths)?;
    Ok(())
}

fn inside(point: [f64; 2]) -> bool {
    point.iter().all(|x| (0.0..=1.0).contains(x))
}
