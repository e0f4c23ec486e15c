//! Receptance, measured against modelled: magnitude, phase and coherence of each pose.

use std::f64::consts::{PI, TAU};

use flexid_prediction::TWO_SIDED;
use flexid_prediction::receptance::ReceptancePoint;
use maud::{Markup, html};

use super::format::{count, number, percent, pose};
use super::{AXES, Pose, missing};
use crate::charts::panel::{Band, Curve, Labels, Panel};
use crate::charts::scale::Scale;
use crate::charts::{Colour, Drawn, Mark, legend, svg};
use crate::document::Document;
use crate::evidence::{MeasuredPoint, MeasuredReceptance, same_pose};

/// Frequencies of a model's curve, but for those near its modes.
const POINTS: usize = 120;
/// Places near a mode, in half widths of its resonance: the peak and its flanks.
const NEAR_MODE: [f64; 7] = [-4.0, -1.5, -0.6, 0.0, 0.6, 1.5, 4.0];
/// Heights of the panels, pixels: magnitude, phase, coherence.
const HEIGHTS: [u32; 3] = [400, 250, 250];
/// Widths of what stands left of the first column, and below the last row, pixels.
const LEFT: u32 = 194;
const BELOW: u32 = 106;
/// Most decades of magnitude that are shown below the largest one. Chosen: what is smaller is neither felt nor measured.
const DECADES: f64 = 5.0;

pub(super) fn section(document: &Document, poses: &[Pose<'_>], others: usize) -> Markup {
    html! {
        section #receptance {
            h2 { "Receptance: measured against modelled" }
            p {
                "Displacement of the tool per force on it, along the axes of the tool centre point. The model's curve comes from the fitted \
                 parameters, with its 95\u{a0}% band. The measured one comes from the records alone: H₁ of three forces, from segments of \
                 the records. Such an estimate is blurred, because its segments are short and a lightly damped robot rings on. Therefore the \
                 fitted acceleration of the same records goes through the same estimate (dashed): where measured and dashed agree, the \
                 model is right, even where both leave the model's curve. The accelerometer's own motion and gravity are in both."
            }
            @if document.measured_receptance.is_none() { (missing("measured_receptance")) }
            (legend(&[
                ("model", Colour::Orange, Mark::Line),
                ("its 95 % band", Colour::Orange, Mark::Area),
                ("measured", Colour::Blue, Mark::Line),
                ("fitted acceleration, estimated as the measured one", Colour::Grey, Mark::Dashed),
            ]))
            @for (index, pose) in poses.iter().enumerate() {
                (figure(document, index, pose))
            }
            @if others > 0 {
                p { (count(others, "further pose")) " not drawn." }
            }
        }
    }
}

fn figure(document: &Document, index: usize, own: &Pose<'_>) -> Markup {
    let mut all = document.measured_receptance.iter().flatten();
    let measured = all.find(|other| same_pose(&other.pose, &own.angles));
    let modelled = curve(own);
    let title = format!("Pose {}, {} rad (m)", index + 1, pose(&own.angles));
    html! {
        figure {
            figcaption { strong { (title) } }
            @if modelled.is_empty() {
                p { "The robot does not stand in this pose: it has no stiffness there." }
            } @else {
                (chart(document, &modelled, measured, &title))
                figcaption { (note(measured)) }
            }
        }
    }
}

/// What the measured curve rests on, and what is left out of it.
fn note(measured: Option<&MeasuredReceptance>) -> Markup {
    let Some(measured) = measured else {
        return html! { "No measured curve." };
    };
    let points = measured.points.len();
    let out = |column: usize| {
        measured.points.iter().filter(|own| own.measured[0][column].is_none()).count()
    };
    let columns: Vec<(usize, usize)> =
        (0..3).map(|column| (column, out(column))).filter(|(_, out)| *out > 0).collect();
    html! {
        "Record" @if measured.records.len() > 1 { "s" } " "
        @for (index, own) in measured.records.iter().enumerate() {
            @if index > 0 { ", " }
            (own)
        }
        ": " (measured.segments) " segments of " (number(measured.segment_s)) "\u{a0}s, overlapping by a half, Hann window. "
        @if columns.is_empty() {
            "The three forces are independent enough at all " (points) " frequencies."
        } @else {
            "Left out, because a force goes with the others there: "
            @for (index, (column, out)) in columns.iter().enumerate() {
                @if index > 0 { ", " }
                "force " (AXES[*column]) " at " (percent(*out as f64 / points as f64))
            }
            " of the " (points) " frequencies."
        }
    }
}

/// The model's receptance at frequencies of equal ratios, and near its modes.
fn curve(pose: &Pose<'_>) -> Vec<ReceptancePoint> {
    let Some(dynamics) = &pose.dynamics else { return Vec::new() };
    let [lower, upper] = dynamics.robot().band_hz();
    let even = (0..POINTS).map(|i| lower * (upper / lower).powf(i as f64 / (POINTS - 1) as f64));
    let near = pose.modes.iter().flat_map(|mode| {
        let (centre, ratio) = (mode.frequency_hz.value, mode.damping_ratio.value);
        NEAR_MODE.map(|place| centre * (1.0 + place * ratio))
    });
    let near = near.filter(|hz| (lower..=upper).contains(hz));
    let mut frequencies: Vec<f64> = even.chain(near).collect();
    frequencies.sort_by(f64::total_cmp);
    frequencies.dedup_by(|one, other| *one / *other < 1.0 + 1e-4);
    frequencies.into_iter().filter_map(|hz| dynamics.receptance(hz)).collect()
}

fn chart(
    document: &Document,
    modelled: &[ReceptancePoint],
    measured: Option<&MeasuredReceptance>,
    title: &str,
) -> Markup {
    let x = Scale::logarithmic(document.found.robot.band_hz());
    let points = measured.map_or(&[][..], |own| &own.points);
    let largest = modelled
        .iter()
        .flat_map(|own| own.magnitude.as_flattened())
        .map(|own| own.value)
        .fold(0.0, f64::max);
    let shown =
        modelled.iter().flat_map(|own| own.magnitude.as_flattened().iter().map(|m| m.value));
    let least = largest * 10_f64.powf(-DECADES);
    let magnitude = Scale::decades(shown.map(|own| own.max(least)));
    let [high, low, last] = HEIGHTS;
    let height = 3 * (high + low) + last + BELOW;
    let label = format!("Receptance, measured and modelled: {title}");
    svg(height, &label, |canvas| {
        let (width, _) = canvas.dim_in_pixel();
        let column_width = (width - LEFT) / 3;
        let area = |column: usize, top: u32, height: u32| {
            let left = if column == 0 { 0 } else { LEFT + column as u32 * column_width };
            let width = if column == 0 { LEFT + column_width } else { column_width };
            canvas.clone().shrink((left as i32, top as i32), (width, height))
        };
        for row in 0..3 {
            let phases: Vec<Vec<f64>> =
                (0..3).map(|column| unwrapped(modelled, row, column)).collect();
            for column in 0..3 {
                let top = row as u32 * (high + low);
                let y = |text: &str| (column == 0).then(|| text.to_owned());
                Panel {
                    x: x.clone(),
                    y: magnitude.clone(),
                    title: format!("{} per force {}", AXES[row], AXES[column]),
                    labels: Labels { x: None, y: y("m/N") },
                    bands: vec![Band {
                        colour: Colour::Orange,
                        points: modelled
                            .iter()
                            .map(|own| (own.frequency_hz, own.magnitude[row][column].interval))
                            .collect(),
                    }],
                    curves: magnitudes(modelled, points, row, column),
                }
                .draw(&area(column, top, high))?;
                let phase = Phase { modelled, unwrapped: &phases[column], row, column };
                let curves = phase.curves(points);
                Panel {
                    x: x.clone(),
                    y: phase_scale(&phases[column]),
                    title: String::new(),
                    labels: Labels { x: None, y: y("phase / °") },
                    bands: vec![phase.band()],
                    curves,
                }
                .draw(&area(column, top + high, low))?;
            }
        }
        for column in 0..3 {
            coherence(column, &x, points).draw(&area(column, 3 * (high + low), last + BELOW))?;
        }
        Drawn::Ok(())
    })
}

fn magnitudes(
    modelled: &[ReceptancePoint],
    points: &[MeasuredPoint],
    row: usize,
    column: usize,
) -> Vec<Curve> {
    let of = |entry: fn(&MeasuredPoint) -> &[[Option<[f64; 2]>; 3]; 3]| {
        let size = |own: &MeasuredPoint| entry(own)[row][column].map(|[re, im]| re.hypot(im));
        points.iter().map(|own| (own.frequency_hz, size(own))).collect()
    };
    let model = |own: &ReceptancePoint| (own.frequency_hz, Some(own.magnitude[row][column].value));
    vec![
        Curve { colour: Colour::Orange, width: 4, points: modelled.iter().map(model).collect() },
        Curve { colour: Colour::Blue, width: 4, points: of(|own| &own.measured) },
        Curve { colour: Colour::Grey, width: 3, points: of(|own| &own.modelled) },
    ]
}

/// The model's phase of an entry without jumps, rad.
fn unwrapped(modelled: &[ReceptancePoint], row: usize, column: usize) -> Vec<f64> {
    let mut last: Option<f64> = None;
    modelled
        .iter()
        .map(|own| {
            let phase = own.phase[row][column].value;
            // A passive robot lags: of the first, 0 to −π.
            let near = last.unwrap_or(-0.5 * PI);
            let own = phase - TAU * ((phase - near) / TAU).round();
            last = Some(own);
            own
        })
        .collect()
}

fn phase_scale(phases: &[f64]) -> Scale {
    let degrees = phases.iter().map(|own| own.to_degrees());
    Scale::steps(degrees.flat_map(|own| [own - 30.0, own + 30.0]), 90.0)
}

/// The phase of one entry.
struct Phase<'a> {
    modelled: &'a [ReceptancePoint],
    unwrapped: &'a [f64],
    row: usize,
    column: usize,
}

impl Phase<'_> {
    fn band(&self) -> Band {
        let points = self.modelled.iter().zip(self.unwrapped).map(|(own, phase)| {
            let half = TWO_SIDED * own.phase[self.row][self.column].std.min(PI);
            (own.frequency_hz, [phase - half, phase + half].map(f64::to_degrees))
        });
        Band { colour: Colour::Orange, points: points.collect() }
    }

    fn curves(&self, points: &[MeasuredPoint]) -> Vec<Curve> {
        let of = |entry: fn(&MeasuredPoint) -> &[[Option<[f64; 2]>; 3]; 3]| {
            let phase = |own: &MeasuredPoint| {
                let [re, im] = entry(own)[self.row][self.column]?;
                let (phase, near) = (im.atan2(re), self.near(own.frequency_hz)?);
                Some((phase - TAU * ((phase - near) / TAU).round()).to_degrees())
            };
            points.iter().map(|own| (own.frequency_hz, phase(own))).collect()
        };
        let model = self.modelled.iter().zip(self.unwrapped);
        let model =
            model.map(|(own, phase)| (own.frequency_hz, Some(phase.to_degrees()))).collect();
        vec![
            Curve { colour: Colour::Orange, width: 4, points: model },
            Curve { colour: Colour::Blue, width: 4, points: of(|own| &own.measured) },
            Curve { colour: Colour::Grey, width: 3, points: of(|own| &own.modelled) },
        ]
    }

    /// The model's phase at the next frequency.
    fn near(&self, frequency_hz: f64) -> Option<f64> {
        let next = self.modelled.partition_point(|own| own.frequency_hz < frequency_hz);
        self.unwrapped.get(next.min(self.unwrapped.len().checked_sub(1)?)).copied()
    }
}

fn coherence(row: usize, x: &Scale, points: &[MeasuredPoint]) -> Panel {
    let curve = points.iter().map(|own| (own.frequency_hz, Some(own.coherence[row]))).collect();
    Panel {
        x: x.clone(),
        y: Scale::linear([0.0, 1.0], vec![0.0, 0.5, 1.0]),
        title: format!("coherence of {}", AXES[row]),
        labels: Labels {
            x: Some("frequency / Hz".to_owned()),
            y: (row == 0).then(|| "γ²".to_owned()),
        },
        bands: Vec::new(),
        curves: vec![Curve { colour: Colour::Blue, width: 4, points: curve }],
    }
}
