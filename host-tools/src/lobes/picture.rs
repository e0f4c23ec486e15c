//! The lobes as a picture: the limit over the spindle speed, with its band of 95 %.

use anyhow::Result;
use flexid_prediction::milling::Cutter;
use plotters::prelude::*;

use super::{Diagram, Speed};
use crate::picture::{self, BLUE, GREEN, INK, Key};

/// Top of the picture, in limits of the worst of its speeds, at most. Chosen: there the worst is three pixels high.
const TOP: f64 = 150.0;

/// Robot, cutter and pose: two lines.
pub(crate) fn title(diagram: &Diagram, robot: &str, cutter: &Cutter) -> String {
    let Cutter { teeth, tangential, radial_ratio, engagement } = cutter;
    let [entry, exit] = engagement.map(f64::to_degrees);
    let pose: Vec<String> = diagram.pose.iter().map(|angle| format!("{angle:.3}")).collect();
    let pose = pose.join(", ");
    let tangential = tangential / 1e6;
    format!(
        "{robot}: depth of cut at which chatter begins, in pose [{pose}]\n\
         cutter: {teeth} teeth, kt {tangential} N/mm², kr {radial_ratio}, in the cut from {entry:.0}° to {exit:.0}°"
    )
}

/// The picture, up to a depth of `top_mm`, with the lines of a doubt below its title.
///
/// # Errors
/// None for numbers that are finite.
pub(crate) fn svg(
    diagram: &Diagram,
    title: &str,
    top_mm: Option<f64>,
    doubt: &str,
) -> Result<String> {
    let depths = diagram.speeds.iter().filter_map(|speed| Some(1e3 * speed.limit?.depth_m.value));
    let [least, most] = [depths.clone().fold(f64::INFINITY, f64::min), depths.fold(0.0, f64::max)];
    let own = if least.is_finite() { (TOP * least).min(1.1 * most) } else { 1.0 };
    let top = top_mm.unwrap_or(own);
    let mut keys = Vec::new();
    if diagram.stated().next().is_some() {
        keys.push(Key::line(BLUE, "limit, with its 95 % interval"));
        keys.push(Key::area(GREEN.mix(0.12), "stable"));
    }
    if diagram.speeds.iter().any(|speed| speed.is_beyond) {
        keys.push(Key::area(
            INK.mix(0.2),
            "no statement: there the teeth pass outside of the band that was fitted",
        ));
    }
    picture::svg(title, doubt, &keys, picture::SIZE, |canvas| {
        let [first, last] = [diagram.speeds.first(), diagram.speeds.last()]
            .map(|speed| speed.map_or(0.0, |speed| speed.rpm));
        let mut chart =
            picture::axes(canvas, ("spindle speed, rpm", first..last), ("depth, mm", 0.0..top))?;
        // Above the top, or where no depth chatters, the line follows the top.
        let line = |depth: &dyn Fn(&Speed) -> Option<f64>| -> Vec<(f64, f64)> {
            let of = |speed: &Speed| {
                let depth = depth(speed).map_or(f64::INFINITY, |depth| 1e3 * depth);
                (speed.rpm, if depth.is_nan() { top } else { depth.min(top) })
            };
            diagram.stated().map(of).collect()
        };
        let value = line(&|speed| Some(speed.limit?.depth_m.value));
        let [low, high] =
            [0, 1].map(|end| line(&move |speed| Some(speed.limit?.depth_m.interval[end])));
        let band: Vec<(f64, f64)> = low.into_iter().chain(high.into_iter().rev()).collect();
        let ends = [value.first(), value.last()].map(|end| end.map(|end| end.0));
        let floor = ends.into_iter().rev().flatten().map(|rpm| (rpm, 0.0));
        let stable: Vec<(f64, f64)> = value.iter().copied().chain(floor).collect();
        // What lies below and above the speeds of which something is stated.
        let silent = match ends {
            [Some(low), Some(high)] => [(first, low), (high, last)],
            _ => [(first, last), (last, last)],
        };
        for (from, to) in silent.into_iter().filter(|(from, to)| from < to) {
            chart.draw_series([Rectangle::new([(from, 0.0), (to, top)], INK.mix(0.2).filled())])?;
        }
        chart.draw_series([Polygon::new(stable, GREEN.mix(0.12))])?;
        chart.draw_series([Polygon::new(band, BLUE.mix(0.3))])?;
        chart.draw_series([PathElement::new(value, BLUE.stroke_width(2))])?;
        Ok(())
    })
}
