//! A map as a picture: a coloured cell for each pose, hatched where its interval is wide.

use anyhow::Result;
use flexid_prediction::Robot;
use plotters::prelude::*;

use super::{Cell, Map, UNCERTAIN};
use crate::picture::{self, Canvas, Chart, Drawn, INK, Key, tick};

/// Colours from the least to the largest value: viridis (Smith and van der Walt, 2015), which grows lighter evenly.
const COLOURS: [[f64; 3]; 5] = [
    [68.0, 1.0, 84.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [253.0, 231.0, 37.0],
];
/// Colour of a pose without a value.
const NONE: RGBColor = RGBColor(220, 220, 220);
/// Width of the scale with its labels, pixels.
const SCALE: u32 = 130;
/// Colour of the strokes across a cell whose interval is wide.
const HATCH: RGBAColor = RGBAColor(255, 255, 255, 0.8);
/// Size of a picture of places, pixels.
const SQUARE: (u32, u32) = (960, 860);
const AXES: [&str; 3] = ["x", "y", "z"];
/// The axis of the base that points upwards.
const HEIGHT: usize = 2;

/// The picture, with a doubt about the fit in its title. Its plane is that of the angles, or of `positions` of the tool: two axes of the
/// base, 0 to 2, with equal scales.
///
/// # Errors
/// None for numbers that are finite.
pub(crate) fn svg(
    map: &Map,
    robot: &Robot,
    positions: Option<[usize; 2]>,
    doubt: Option<&str>,
) -> Result<String> {
    let (name, unit, scale) = map.quantity.shown();
    let values = || map.cells.iter().filter_map(|cell| Some(scale * cell.value?.value));
    let [least, most] =
        [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)];
    let [least, most] = if least < most { [least, most] } else { [least - 0.5, least + 0.5] };
    let [least, most] = if least.is_finite() { [least, most] } else { [0.0, 1.0] };
    let outlines: Vec<[(f64, f64); 4]> =
        (0..map.cells.len()).map(|index| outline(map, robot, positions, index)).collect();
    let names = match positions {
        None => [0, 1].map(|which| format!("{}, {}", map.over.names[which], map.over.units[which])),
        Some(axes) => axes.map(|axis| format!("{} of the tool in the base, m", AXES[axis])),
    };
    let robot_name = &robot.model().name;
    let title = format!(
        "{robot_name}: {name}, {unit}, over {} and {}",
        map.over.names[0], map.over.names[1]
    );
    let wide = format!("95 % interval wider than ±{:.0} %", 100.0 * UNCERTAIN);
    let mut keys = Vec::new();
    if map.cells.iter().any(|cell| cell.value.is_some() && cell.is_uncertain) {
        keys.push(Key::hatch(HATCH, colour(0.5), &wide));
    }
    if map.cells.iter().any(|cell| cell.value.is_none()) {
        keys.push(Key::area(NONE.mix(1.0), "no value"));
    }
    if positions.is_some_and(|axes| axes.contains(&HEIGHT)) {
        keys.push(Key::line(INK, "height of the base, z = 0"));
    }
    let range = |of: fn(&(f64, f64)) -> f64| {
        let all = outlines.iter().flatten().map(of);
        let [low, high] =
            [all.clone().fold(f64::INFINITY, f64::min), all.fold(f64::NEG_INFINITY, f64::max)];
        low..high.max(low + 1e-9)
    };
    let ranges = [range(|own| own.0), range(|own| own.1)];
    let size = if positions.is_some() { SQUARE } else { picture::SIZE };
    picture::svg(&title, doubt.unwrap_or_default(), &keys, size, |canvas| {
        let width = canvas.dim_in_pixel().0.saturating_sub(SCALE);
        let (body, side) = canvas.split_horizontally(width);
        let [x, y] = match positions {
            None => ranges.clone(),
            Some(_) => picture::equally_scaled(&body, ranges.clone()),
        };
        let mut chart =
            picture::axes(&body, (names[0].as_str(), x.clone()), (names[1].as_str(), y.clone()))?;
        let colour = |cell: &Cell| match cell.value {
            None => NONE,
            Some(own) => colour((scale * own.value - least) / (most - least)),
        };
        for (cell, outline) in map.cells.iter().zip(&outlines) {
            let colour = colour(cell);
            chart.draw_series([Polygon::new(outline.to_vec(), colour.filled())])?;
            // Without it the ground shines through between two cells.
            let closed: Vec<_> = outline.iter().chain(outline.first()).copied().collect();
            chart.draw_series([PathElement::new(closed, colour)])?;
        }
        hatch(&mut chart, map, &outlines)?;
        if let Some(axes) = positions {
            let level = match axes.map(|axis| axis == HEIGHT) {
                [false, false] => None,
                [true, false] => Some([(0.0, y.start), (0.0, y.end)]),
                [_, true] => Some([(x.start, 0.0), (x.end, 0.0)]),
            };
            let strokes =
                level.into_iter().map(|line| PathElement::new(line.to_vec(), INK.stroke_width(2)));
            chart.draw_series(strokes)?;
        }
        legend(&side, [least, most], unit)
    })
}

/// Corners of a cell, one after the other around it.
fn outline(
    map: &Map,
    robot: &Robot,
    positions: Option<[usize; 2]>,
    index: usize,
) -> [(f64, f64); 4] {
    let over = &map.over;
    let half = [0, 1]
        .map(|which| (over.ranges[which][1] - over.ranges[which][0]) / (2 * over.points) as f64);
    let pose = &map.cells[index].pose;
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|corner| {
        let angles = [0, 1].map(|which| pose[over.joints[which]] + corner[which] * half[which]);
        match positions {
            None => angles.into(),
            Some(axes) => {
                let place = robot.chain().tool(&over.pose(pose, angles)).translation.vector;
                (place[axes[0]], place[axes[1]])
            }
        }
    })
}

/// Strokes across the cells whose interval is wide: between the middles of neighbouring sides, and along a diagonal.
fn hatch(chart: &mut Chart<'_, '_>, map: &Map, outlines: &[[(f64, f64); 4]]) -> Drawn {
    let between = |a: (f64, f64), b: (f64, f64)| ((a.0 + b.0) / 2.0, (a.1 + b.1) / 2.0);
    let uncertain = map.cells.iter().zip(outlines).filter(|(cell, _)| cell.is_uncertain);
    chart.draw_series(uncertain.flat_map(|(_, [a, b, c, d])| {
        let strokes =
            [[between(*a, *b), between(*b, *c)], [*a, *c], [between(*a, *d), between(*d, *c)]];
        strokes.map(|stroke| PathElement::new(stroke.to_vec(), HATCH))
    }))?;
    Ok(())
}

/// The scale of the colours, with its unit above.
fn legend(side: &Canvas<'_>, [least, most]: [f64; 2], unit: &str) -> Drawn {
    let (_, height) = side.dim_in_pixel();
    let (top, bottom) = (34, height as i32 - 52);
    let steps = 64;
    let at = |part: f64| bottom - ((bottom - top) as f64 * part).round() as i32;
    for step in 0..steps {
        let [low, high] = [step, step + 1].map(|step| f64::from(step) / f64::from(steps));
        let colour = colour((low + high) / 2.0);
        side.draw(&Rectangle::new([(8, at(high)), (28, at(low))], colour.filled()))?;
    }
    let style = ("sans-serif", 16).into_font().color(&INK);
    side.draw(&Text::new(unit.to_owned(), (8, 4), style.clone()))?;
    for step in 0..=4 {
        let part = f64::from(step) / 4.0;
        let value = least + (most - least) * part;
        // Four digits that count.
        let digits = (3 - value.abs().max(1e-12).log10().floor() as i32).clamp(0, 12) as usize;
        let rounded: f64 = format!("{value:.digits$}").parse()?;
        side.draw(&Text::new(tick(&rounded), (36, at(part) - 8), style.clone()))?;
    }
    Ok(())
}

/// Colour of a part from 0 to 1 of the range.
fn colour(part: f64) -> RGBColor {
    let place = part.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let first = (place.floor() as usize).min(COLOURS.len() - 2);
    let within = place - first as f64;
    let [r, g, b] = [0, 1, 2].map(|own| {
        (COLOURS[first][own] * (1.0 - within) + COLOURS[first + 1][own] * within).round() as u8
    });
    RGBColor(r, g, b)
}
