//! What the fit leaves of each record, beside the noise.

use maud::{Markup, html};

use super::format::{number, pose};
use super::{AXES, MOST_POSES, missing};
use crate::charts::panel::{Curve, Labels, Panel};
use crate::charts::scale::Scale;
use crate::charts::{Colour, Mark, legend, svg};
use crate::document::Document;
use crate::evidence::RecordEvidence;

/// Height of a panel, pixels; of its axis below.
const HEIGHT: u32 = 470;
const BELOW: u32 = 106;
const LEFT: u32 = 194;
/// Most records that are drawn: as many as poses.
const MOST_RECORDS: usize = MOST_POSES;
/// Decades below the largest value that are shown. Chosen: residuals and noise are there.
const DECADES: f64 = 6.0;

pub(super) fn section(document: &Document) -> Markup {
    let Some(records) = &document.further.records else {
        return html! { section #residuals { h2 { "Residuals beside the noise" } (missing("records")) } };
    };
    let scale = scale(records);
    html! {
        section #residuals {
            h2 { "Residuals beside the noise" }
            p {
                "Amplitude spectral density of the acceleration along each axis. Where the residual lies on the noise, the model explains \
                 the record; where it lies above, something is left that the model does not have. The noise is that of both sensors, the \
                 force's through the robot."
            }
            (legend(&[
                ("measured", Colour::Blue, Mark::Line),
                ("residual", Colour::Red, Mark::Line),
                ("noise", Colour::Grey, Mark::Dashed),
            ]))
            @for record in records.iter().take(MOST_RECORDS) {
                @let title = format!("Record {}, pose {}, {} rad (m)", record.number, record.pose_number, pose(&record.pose));
                figure {
                    figcaption {
                        strong { (title) }
                        ": residual/noise " (ratios(record)) "."
                    }
                    (chart(document, record, &scale, &title))
                }
            }
            @if records.len() > MOST_RECORDS {
                p {
                    "Further records, residual/noise along the axes: "
                    @for record in &records[MOST_RECORDS..] {
                        "record " (record.number) " " (ratios(record)) "; "
                    }
                }
            }
        }
    }
}

/// Root mean square of the residual in units of the noise along each axis, over the points of the curve.
fn ratios(record: &RecordEvidence) -> String {
    let spectra = &record.spectra;
    let ratio = |axis: usize| {
        let pairs = spectra.residual[axis].iter().zip(&spectra.noise[axis]);
        let squares: Vec<f64> = pairs
            .filter(|(_, noise)| **noise > 0.0)
            .map(|(own, noise)| (own / noise) * (own / noise))
            .collect();
        let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
        format!("{} {}", AXES[axis], number(mean.sqrt()))
    };
    (0..3).map(ratio).collect::<Vec<_>>().join(", ")
}

fn scale(records: &[RecordEvidence]) -> Scale {
    let curves = || {
        records.iter().flat_map(|own| {
            let spectra = &own.spectra;
            spectra.measured.iter().chain(&spectra.residual).chain(&spectra.noise)
        })
    };
    let largest = curves().flatten().copied().fold(0.0, f64::max);
    let least = largest * 10_f64.powf(-DECADES);
    Scale::decades(curves().flatten().filter(|own| **own > 0.0).map(|own| own.max(least)))
}

fn chart(document: &Document, record: &RecordEvidence, y: &Scale, title: &str) -> Markup {
    let x = Scale::logarithmic(document.found.robot.band_hz());
    let spectra = &record.spectra;
    svg(HEIGHT + BELOW, &format!("Residual and noise: {title}"), |canvas| {
        let (width, height) = canvas.dim_in_pixel();
        let column_width = (width - LEFT) / 3;
        for axis in 0..3 {
            let left = if axis == 0 { 0 } else { LEFT + axis as u32 * column_width };
            let width = if axis == 0 { LEFT + column_width } else { column_width };
            let curve = |colour, width, values: &[f64]| Curve {
                colour,
                width,
                points: spectra
                    .frequency_hz
                    .iter()
                    .zip(values)
                    .map(|(hz, own)| (*hz, Some(*own)))
                    .collect(),
            };
            Panel {
                x: x.clone(),
                y: y.clone(),
                title: AXES[axis].to_owned(),
                labels: Labels {
                    x: Some("frequency / Hz".to_owned()),
                    y: (axis == 0).then(|| "(m/s²)/√Hz".to_owned()),
                },
                bands: Vec::new(),
                curves: vec![
                    curve(Colour::Blue, 3, &spectra.measured[axis]),
                    curve(Colour::Red, 3, &spectra.residual[axis]),
                    curve(Colour::Grey, 4, &spectra.noise[axis]),
                ],
            }
            .draw(&canvas.clone().shrink((left as i32, 0), (width, height)))?;
        }
        Ok(())
    })
}
