//! Receptance, measured against modelled: magnitude, phase and coherence of each pose.

use flexid_pipeline::same_pose;
use flexid_prediction::receptance::ReceptancePoint;
use maud::{Markup, html};
use nalgebra::Complex;
use rayon::prelude::*;

use super::direction::{complex, direction_at};
use super::format::{count, number, percent, pose};
use super::{AXES, Pose, folded_section, missing};
use crate::charts::panel::{Band, Curve, Labels, Panel};
use crate::charts::scale::Scale;
use crate::charts::{Colour, Drawn, Mark, legend, svg};
use crate::document::Document;
use crate::evidence::{MeasuredPoint, MeasuredReceptance};

/// Frequencies of a model's curve, but for those near its modes.
const POINTS: usize = 96;
/// Places near a mode, in half widths of its resonance: the peak and its flanks.
const NEAR_MODE: [f64; 9] = [-4.0, -2.0, -1.0, -0.4, 0.0, 0.4, 1.0, 2.0, 4.0];
/// Heights of the panels, pixels: magnitude, phase, coherence.
const HEIGHTS: [u32; 3] = [440, 240, 270];
/// Widths of what stands left of the first column, and below the last row, pixels.
const LEFT: u32 = 194;
const BELOW: u32 = 106;
/// Most decades of magnitude that are shown below the largest one. Chosen: what is smaller is neither felt nor measured.
const DECADES: f64 = 6.0;

pub(super) fn section(document: &Document, poses: &[Pose<'_>], others: usize) -> Markup {
    let contents = html! {
            p {
                "Displacement of the tool per force on it, along the axes of the tool centre point. The measured one comes from the records alone: \
                 H₁ of three forces, from segments of the records. The modelled one is the acceleration that the fit gives for the same records, \
                 through the same estimate: where both agree, the model is right. Short segments blur both, so that they stay below the model's \
                 own curve (dashed, with its 95\u{a0}% band) at each resonance. What gravity and the place of the accelerometer add is in both. \
                 The responses of a modal test are shown as they were measured."
            }
            p {
                "An entry is left out where its standard deviation is above a third of its size, as where the three forces of a cut go together \
                 and cannot be separated. The first row shows what each cut does show: the displacement per force along the direction that the \
                 force had."
            }
            @if document.further.measured_receptance.is_none() { (missing("measured_receptance")) }
            (legend(&[
                ("measured", Colour::Blue, Mark::Line),
                ("modelled, blurred alike", Colour::Orange, Mark::Line),
                ("the model itself", Colour::Grey, Mark::Dashed),
                ("its 95 % band", Colour::Grey, Mark::Area),
            ]))
            @for (index, pose) in poses.iter().enumerate() {
                (figure(document, index, pose))
            }
            @if others > 0 {
                p { (count(others, "further pose")) " not drawn." }
            }
    };
    folded_section("receptance", "Receptance: measured against modelled", &contents)
}

fn figure(document: &Document, index: usize, own: &Pose<'_>) -> Markup {
    let mut all = document.further.measured_receptance.iter().flatten();
    let measured = all.find(|other| same_pose(&other.pose, &own.angles));
    let modelled = curve(own);
    let title = format!("Pose {}, {} rad (m)", index + 1, pose(&own.angles));
    html! {
        figure {
            figcaption { strong { (title) } }
            @if modelled.is_empty() {
                p { "The robot does not stand in this pose: it has no stiffness there." }
            } @else {
                (chart(&modelled, measured, &title))
                figcaption { (note(measured)) }
            }
        }
    }
}

/// The records that the measured curve rests on, and the part of it that is shown.
fn note(measured: Option<&MeasuredReceptance>) -> Markup {
    let Some(measured) = measured else {
        return html! { "No measured curve." };
    };
    let points = measured.points.len();
    let entries = || measured.points.iter().flat_map(|own| own.measured.as_flattened());
    let shown = entries().flatten().count() as f64 / entries().count().max(1) as f64;
    if measured.is_of_test {
        return html! {
            "Frequency responses of a modal test, as they were measured; " (points) " frequencies. Of the nine entries, " (percent(shown)) " were measured."
        };
    }
    html! {
        "Record" @if measured.records.len() > 1 { "s" } " "
        @for (index, own) in measured.records.iter().enumerate() {
            @if index > 0 { ", " }
            (own)
        }
        ": " (measured.segments) " segments of " (number(measured.segment_s)) "\u{a0}s, overlapping by a half, Hann window; " (points)
        " frequencies. Of the nine entries, " (percent(shown)) " are certain enough to be shown."
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
    frequencies.into_par_iter().filter_map(|hz| dynamics.receptance(hz)).collect()
}

fn chart(
    modelled: &[ReceptancePoint],
    measured: Option<&MeasuredReceptance>,
    title: &str,
) -> Markup {
    let ends =
        [modelled.first(), modelled.last()].map(|own| own.map_or(1.0, |own| own.frequency_hz));
    let x = Scale::logarithmic(ends);
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
    let height = 4 * (high + low) + last + BELOW;
    let label = format!("Receptance, measured and modelled: {title}");
    svg(height, &label, |canvas| {
        let (width, _) = canvas.dim_in_pixel();
        let column_width = (width - LEFT) / 3;
        let area = |column: usize, top: u32, height: u32| {
            let left = if column == 0 { 0 } else { LEFT + column as u32 * column_width };
            let width = if column == 0 { LEFT + column_width } else { column_width };
            canvas.clone().shrink((left as i32, top as i32), (width, height))
        };
        let entries = (0..9).map(|index| Entry::of(modelled, points, index / 3, index % 3));
        let along = (0..3).map(|row| Entry::along(modelled, points, row));
        // What each cut shows comes first, where there is something measured.
        let all: Vec<Entry> = match points {
            [] => entries.chain(along).collect(),
            _ => along.chain(entries).collect(),
        };
        for (index, entry) in all.iter().enumerate() {
            let (row, column) = (index / 3, index % 3);
            let top = row as u32 * (high + low);
            let y = |text: &str| (column == 0).then(|| text.to_owned());
            let labels = |text: &str| Labels { x: None, y: y(text) };
            let phase = Scale::linear([-270.0, 90.0], vec![-270.0, -180.0, -90.0, 0.0, 90.0]);
            entry.magnitude(&x, &magnitude, labels("m/N")).draw(&area(column, top, high))?;
            entry.phase(&x, &phase, labels("phase / °")).draw(&area(column, top + high, low))?;
        }
        for column in 0..3 {
            let top = 4 * (high + low);
            coherence(column, &x, points).draw(&area(column, top, last + BELOW))?;
        }
        Drawn::Ok(())
    })
}

/// Contents of two panels: curves, complex, m/N.
struct Entry {
    title: String,
    /// Curve of the model, with the 95 % bands of magnitude and phase, rad, where they are known.
    model: Vec<(f64, Option<Complex<f64>>)>,
    bands: [Vec<(f64, [f64; 2])>; 2],
    measured: Vec<(f64, Option<Complex<f64>>)>,
    /// Curve of the fitted acceleration.
    fitted: Vec<(f64, Option<Complex<f64>>)>,
}

impl Entry {
    /// Displacement along one axis per force along another.
    fn of(
        modelled: &[ReceptancePoint],
        points: &[MeasuredPoint],
        row: usize,
        column: usize,
    ) -> Self {
        let model = |own: &ReceptancePoint| {
            let (size, phase) = (own.magnitude[row][column].value, own.phase[row][column].value);
            (own.frequency_hz, Some(Complex::from_polar(size, phase)))
        };
        let magnitude =
            |own: &ReceptancePoint| (own.frequency_hz, own.magnitude[row][column].interval);
        let phase = |own: &ReceptancePoint| (own.frequency_hz, own.phase[row][column].interval);
        let entry = |own: &MeasuredPoint, of: &[[Option<[f64; 2]>; 3]; 3]| {
            (own.frequency_hz, of[row][column].map(complex))
        };
        Self {
            title: format!("{} per force {}", AXES[row], AXES[column]),
            model: modelled.iter().map(model).collect(),
            bands: [modelled.iter().map(magnitude).collect(), modelled.iter().map(phase).collect()],
            measured: points.iter().map(|own| entry(own, &own.measured)).collect(),
            fitted: points.iter().map(|own| entry(own, &own.modelled)).collect(),
        }
    }

    /// Displacement along an axis per force along the direction that it had. The model's has the direction of the frequencies that were
    /// measured on both sides, so that its resonances show between them.
    fn along(modelled: &[ReceptancePoint], points: &[MeasuredPoint], row: usize) -> Self {
        let model = |own: &ReceptancePoint| {
            let direction = direction_at(points, own.frequency_hz)?;
            let entries = own.magnitude[row].iter().zip(&own.phase[row]);
            let entries = entries.map(|(size, phase)| Complex::from_polar(size.value, phase.value));
            Some(entries.zip(direction).map(|(entry, part)| entry * part).sum())
        };
        let of =
            |own: &MeasuredPoint, of: &[[f64; 2]; 3]| (own.frequency_hz, Some(complex(of[row])));
        Self {
            title: format!("{} along the force", AXES[row]),
            model: modelled.iter().map(|own| (own.frequency_hz, model(own))).collect(),
            bands: [Vec::new(), Vec::new()],
            measured: points.iter().map(|own| of(own, &own.measured_along)).collect(),
            fitted: points.iter().map(|own| of(own, &own.modelled_along)).collect(),
        }
    }

    fn magnitude(&self, x: &Scale, y: &Scale, labels: Labels) -> Panel {
        let size = |points: &[(f64, Option<Complex<f64>>)]| {
            points.iter().map(|(hz, own)| (*hz, own.map(Complex::norm))).collect()
        };
        let bands = vec![Band { colour: Colour::Grey, points: self.bands[0].clone() }];
        let (x, y, title) = (x.clone(), y.clone(), self.title.clone());
        Panel { x, y, title, labels, bands, curves: self.curves(size) }
    }

    fn phase(&self, x: &Scale, y: &Scale, labels: Labels) -> Panel {
        let middle = |ends: &[f64; 2]| lagging((0.5 * (ends[0] + ends[1])).to_degrees());
        let bands = self.bands[1]
            .chunk_by(|(_, own), (_, next)| (middle(own) - middle(next)).abs() < 180.0);
        let degrees = |(hz, ends): &(f64, [f64; 2])| {
            let half = 0.5 * (ends[1] - ends[0]).to_degrees();
            (*hz, [middle(ends) - half, middle(ends) + half])
        };
        let bands = bands
            .map(|own| Band { colour: Colour::Grey, points: own.iter().map(degrees).collect() });
        Panel {
            x: x.clone(),
            y: y.clone(),
            title: String::new(),
            labels,
            bands: bands.collect(),
            curves: self.curves(phases),
        }
    }

    fn curves(
        &self,
        of: impl Fn(&[(f64, Option<Complex<f64>>)]) -> Vec<(f64, Option<f64>)>,
    ) -> Vec<Curve> {
        vec![
            Curve { colour: Colour::Grey, width: 3, points: of(&self.model) },
            Curve { colour: Colour::Orange, width: 4, points: of(&self.fitted) },
            Curve { colour: Colour::Blue, width: 3, points: of(&self.measured) },
        ]
    }
}

/// A phase from −180° to 180° as one from −270° to 90°: a robot lags, and the ends of its range are not those of the axis.
fn lagging(phase: f64) -> f64 {
    if phase > 90.0 { phase - 360.0 } else { phase }
}

/// Phases, degrees. The curve is broken where they jump by a whole turn.
fn phases(points: &[(f64, Option<Complex<f64>>)]) -> Vec<(f64, Option<f64>)> {
    let mut phases = Vec::new();
    let mut last: Option<f64> = None;
    for (hz, own) in points {
        let phase = own.map(|own| lagging(own.arg().to_degrees()));
        if let (Some(last), Some(phase)) = (last, phase)
            && (last - phase).abs() > 180.0
        {
            phases.push((*hz, None));
        }
        phases.push((*hz, phase));
        last = phase;
    }
    phases
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
