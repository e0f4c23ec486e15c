//! Each record beside the model: measured dots on the modelled line, and the noise below.

use maud::{Markup, html};

use super::format::{count, number, pose};
use super::{AXES, MOST_RECORDS, folded, missing};
use crate::charts::spectra::{Densities, OF_RECORD, OF_TEST, panels};
use crate::document::Document;
use crate::evidence::RecordEvidence;

pub(super) fn section(document: &Document) -> Markup {
    let Some(records) = &document.further.records else {
        return html! { section #spectra { h2 { "Spectra" } (missing("records")) } };
    };
    let band_hz = document.found.robot.band_hz();
    let [shown, others] = by_misfit(records);
    html! {
        section #spectra {
            h2 { "Spectra" }
            p {
                "Amplitude spectral density of the acceleration at the tool; of a modal test, its size per force. Where the dots lie on the line, the model explains the record."
                @if !others.is_empty() { " This is the record that it explains worst." }
            }
            @for record in shown { (figure(record, band_hz)) }
            @if !others.is_empty() {
                (folded(
                    &others_title(records, &others),
                    &html! { @for record in others { (figure(record, band_hz)) } },
                ))
            }
        }
    }
}

fn figure(record: &RecordEvidence, band_hz: [f64; 2]) -> Markup {
    let spectra = &record.spectra;
    html! {
        p.note { strong { (title(record)) } }
        (panels(Densities {
            unit: unit(record),
            band_hz,
            frequency_hz: spectra.frequency_hz.clone(),
            measured: spectra.measured.clone(),
            modelled: spectra.modelled.clone(),
            noise: spectra.noise.clone(),
        }))
    }
}

/// How many records there are beside the first that is drawn, and how many of them are drawn.
pub(super) fn others_title(records: &[RecordEvidence], drawn: &[&RecordEvidence]) -> String {
    let others = records.len() - 1;
    if drawn.len() == others {
        return count(others, "further record");
    }
    format!("{} of {}", drawn.len(), count(others, "further record"))
}

/// Number, pose and angles of a record, or of its middle part.
pub(super) fn title(record: &RecordEvidence) -> String {
    let what = if record.is_of_test { ", a modal test" } else { "" };
    let RecordEvidence { number, pose_number, .. } = record;
    let own = pose(&record.pose);
    match record.path.len() {
        0 => format!("Record {number}{what}, pose {pose_number}, {own} rad (m)"),
        parts => format!("Record {number}, the middle one of its {parts} parts, at {own} rad (m)"),
    }
}

/// Unit of the acceleration of a record.
pub(super) fn unit(record: &RecordEvidence) -> &'static str {
    if record.is_of_test { OF_TEST } else { OF_RECORD }
}

/// The record whose residual is largest beside the noise, and the first of the others, as many as are drawn.
pub(super) fn by_misfit(records: &[RecordEvidence]) -> [Vec<&RecordEvidence>; 2] {
    let misfit = |own: &RecordEvidence| (0..3).map(|axis| misfit(own, axis)).fold(0.0, f64::max);
    let worst = records.iter().max_by(|a, b| misfit(a).total_cmp(&misfit(b)));
    let is_other = |own: &&RecordEvidence| worst.is_none_or(|worst| worst.number != own.number);
    let others = records.iter().filter(is_other).take(MOST_RECORDS - 1);
    [worst.into_iter().collect(), others.collect()]
}

/// Root mean square of the residual along an axis in units of the noise, over the points of the curve.
fn misfit(record: &RecordEvidence, axis: usize) -> f64 {
    let spectra = &record.spectra;
    let pairs = spectra.residual[axis].iter().zip(&spectra.noise[axis]);
    let squares: Vec<f64> = pairs
        .filter(|(_, noise)| **noise > 0.0)
        .map(|(own, noise)| (own / noise).powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// The misfits of a record: `x 1.00, y 1.02, z 0.99`.
pub(super) fn misfits(record: &RecordEvidence) -> String {
    let along = |axis: usize| format!("{} {}", AXES[axis], number(misfit(record, axis)));
    (0..3).map(along).collect::<Vec<_>>().join(", ")
}
