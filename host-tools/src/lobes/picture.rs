//! The lobes as a picture: the limit over the spindle speed, with its band of 95 %.

use anyhow::Result;
use plotters::prelude::*;

use super::{Diagram, Speed};
use crate::picture::{self, BLUE, Chart, Drawn, INK};

/// Top of the picture, in limits of the worst speed. Chosen: pockets beyond are seldom used.
const TOP: f64 = 6.0;

/// The picture, up to a depth of `top_mm`.
///
/// # Errors
/// None for numbers that are finite.
pub(crate) fn svg(diagram: &Diagram, top_mm: Option<f64>) -> Result<String> {
    let least = diagram.least_depth_m.map_or(1.0, |least| 1e3 * least.value);
    let top = top_mm.unwrap_or(TOP * least);
    let pose: Vec<String> = diagram.pose.iter().map(|angle| format!("{angle:.3}")).collect();
    let title = format!(
        "Depth of cut at which chatter begins, with 95 % interval; pose [{}]",
        pose.join(", ")
    );
    picture::svg(&title, |canvas| {
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
        chart.draw_series([Polygon::new(stable, RGBColor(0, 158, 115).mix(0.12))])?;
        chart.draw_series([Polygon::new(band, BLUE.mix(0.3))])?;
        chart.draw_series([PathElement::new(value, BLUE.stroke_width(2))])?;
        label(&mut chart, first + 0.02 * (last - first), 0.06 * top, "stable")?;
        label(&mut chart, first + 0.02 * (last - first), 0.95 * top, "chatter")
    })
}

fn label(chart: &mut Chart<'_, '_>, x: f64, y: f64, text: &'static str) -> Drawn {
    let style = ("sans-serif", 16).into_font().color(&INK);
    chart.draw_series([Text::new(text, (x, y), style)])?;
    Ok(())
}
