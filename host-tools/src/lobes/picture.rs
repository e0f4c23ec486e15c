//! The lobes as a picture: the limit over the spindle speed, with its band of 95 %.

use anyhow::Result;
use flexid_prediction::milling::Cutter;
use plotters::prelude::*;

use super::{Diagram, Speed};
use crate::picture::{self, BLUE, GREEN, Key, ORANGE};

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
    let mut keys = vec![
        Key::line(BLUE, "limit, with its 95 % interval"),
        Key::area(GREEN.mix(0.12), "stable"),
    ];
    let beyond = format!(
        "chatters above {:.1} Hz, where the band that was fitted ends",
        diagram.fitted_to_hz
    );
    if diagram.speeds.iter().any(|speed| speed.is_beyond) {
        keys.push(Key::line(ORANGE, &beyond));
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
            diagram.speeds.iter().map(of).collect()
        };
        let value = line(&|speed| Some(speed.limit?.depth_m.value));
        let [low, high] =
            [0, 1].map(|end| line(&move |speed| Some(speed.limit?.depth_m.interval[end])));
        let band: Vec<(f64, f64)> = low.into_iter().chain(high.into_iter().rev()).collect();
        let stable = value.iter().copied().chain([(last, 0.0), (first, 0.0)]).collect::<Vec<_>>();
        chart.draw_series([Polygon::new(stable, GREEN.mix(0.12))])?;
        chart.draw_series([Polygon::new(band, BLUE.mix(0.3))])?;
        chart.draw_series([PathElement::new(value.clone(), BLUE.stroke_width(2))])?;
        // From each speed that is beyond to the next one.
        let strokes = value.windows(2).zip(&diagram.speeds).filter(|(_, speed)| speed.is_beyond);
        chart.draw_series(
            strokes.map(|(stroke, _)| PathElement::new(stroke.to_vec(), ORANGE.stroke_width(2))),
        )?;
        Ok(())
    })
}
