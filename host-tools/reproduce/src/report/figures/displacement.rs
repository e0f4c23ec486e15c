//! Fig. 5: displacement of the reference and of the fitted models.

use std::iter;
use std::ops::Range;

use maud::{Markup, html};
use plotters::prelude::*;

use super::super::{Tables, name};
use super::{Canvas, Drawn, INK, axes, colour, legend, range, svg};
use crate::tables::DisplacementIllustration;

const HEIGHT: u32 = 1800;
/// Number of columns. More columns cannot be seen.
const COLUMNS: usize = 1100;
/// Share of the record that the lower panel shows.
const ZOOM: f64 = 0.06;
const MICROMETRES: f64 = 1e6;

struct Line {
    colour: RGBColor,
    width: u32,
    /// Instants, s, and displacements, µm.
    points: Vec<(f64, f64)>,
}

pub(in super::super) fn figure(tables: &Tables) -> Markup {
    let shown = &tables.displacement;
    if shown.time_s.is_empty() {
        return html! {};
    }
    let models = shown.models_m.iter().map(|(key, _)| (name(tables, key), colour(tables, key)));
    let entries: Vec<_> = iter::once(("reference", INK)).chain(models).collect();
    let label = format!("Displacement of the reference and of fitted models: {}", shown.title);
    html! {
        figure {
            (legend(&entries, html! {}))
            (svg(HEIGHT, &label, |canvas| draw(canvas, tables)))
            figcaption {
                strong { "Fig. 5. " }
                "TCP displacement of the fitted models compared to that of the reference, in an experiment that was not \
                 identified from: " (shown.title) ". Above, the whole record: the reference, and in colour how far the \
                 models are from it. Below, the stretch around its peak: reference and models."
            }
        }
    }
}

fn draw(canvas: &Canvas<'_>, tables: &Tables) -> Drawn {
    let DisplacementIllustration { time_s, reference_m, models_m, .. } = &tables.displacement;
    let line = |colour, width, displacement_m: &[f64], shown: Range<usize>| {
        let points = time_s.iter().zip(displacement_m).take(shown.end).skip(shown.start);
        let finite = points.filter(|(t, x)| t.is_finite() && x.is_finite());
        let points: Vec<_> = finite.map(|(&t, &x)| (t, MICROMETRES * x)).collect();
        Line { colour, width, points: thinned(points) }
    };
    let models = |shown: Range<usize>, of: fn(&f64, &f64) -> f64| {
        models_m.iter().map(move |(key, displacement)| {
            let values: Vec<_> =
                displacement.iter().zip(reference_m).map(|(x, r)| of(x, r)).collect();
            line(colour(tables, key), 4, &values, shown.clone())
        })
    };
    let whole = 0..time_s.len();
    let peak = around_peak(reference_m, time_s.len());
    let (above, below) = canvas.split_vertically(50.percent_height());
    let reference = iter::once(line(INK, 2, reference_m, whole.clone()));
    panel(&above, &reference.chain(models(whole, |x, r| x - r)).collect::<Vec<_>>())?;
    let reference = iter::once(line(INK, 8, reference_m, peak.clone()));
    panel(&below, &reference.chain(models(peak, |x, _| *x)).collect::<Vec<_>>())
}

fn panel(canvas: &Canvas<'_>, lines: &[Line]) -> Drawn {
    let points = || lines.iter().flat_map(|line| &line.points);
    let y = range(points().map(|point| point.1));
    let start = points().map(|point| point.0).fold(f64::INFINITY, f64::min);
    let end = points().map(|point| point.0).fold(f64::NEG_INFINITY, f64::max);
    let x = if start < end { start..end } else { 0.0..1.0 };
    let mut chart = axes(canvas, ("time / s", x), ("displacement / µm", y))?;
    for Line { colour, width, points } in lines {
        let style = colour.mix(if *colour == INK { 0.55 } else { 0.9 }).stroke_width(*width);
        chart.draw_series(LineSeries::new(points.iter().copied(), style))?;
    }
    Ok(())
}

/// The stretch around the largest displacement.
fn around_peak(displacement: &[f64], instants: usize) -> Range<usize> {
    let length = ((ZOOM * instants as f64) as usize).max(2).min(instants);
    let peak = displacement
        .iter()
        .enumerate()
        .filter(|(_, x)| x.is_finite())
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        .map_or(0, |(i, _)| i);
    let start = peak.saturating_sub(length / 2).min(instants - length);
    start..start + length
}

/// The lowest and highest point of every column that can be seen, in the order of time.
fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= 2 * COLUMNS {
        return points;
    }
    let column = points.len().div_ceil(COLUMNS);
    points
        .chunks(column)
        .flat_map(|chunk| {
            let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
            let mut ends: Vec<_> = chunk
                .iter()
                .min_by(by_value)
                .into_iter()
                .chain(chunk.iter().max_by(by_value))
                .collect();
            ends.sort_by(|a, b| a.0.total_cmp(&b.0));
            ends
        })
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_peaks() {
        let points =
            (0..50_000).map(|i| (i as f64, if i == 31_234 { 9.0 } else { (i as f64).sin() }));
        let thin = thinned(points.collect());
        assert!(thin.len() <= 2 * COLUMNS);
        assert!(thin.contains(&(31_234.0, 9.0)));
        assert!(thin.is_sorted_by(|a, b| a.0 <= b.0));
    }

    #[test]
    fn the_stretch_holds_the_peak() {
        for peak in [0, 500, 999] {
            let mut displacement = vec![0.0; 1000];
            displacement[peak] = -1.0;
            let stretch = around_peak(&displacement, 1000);
            assert!(stretch.contains(&peak) && stretch.end <= 1000, "{stretch:?}");
        }
    }
}
