//! The rest that the fit leaves of each record, beside the noise.

use maud::{Markup, html};

use super::spectra::{by_misfit, misfits, others_title, title, unit};
use super::{folded, missing};
use crate::charts::panel::Curve;
use crate::charts::scale::Scale;
use crate::charts::spectra::{axis_panels, density_scale};
use crate::charts::{Colour, Mark, legend};
use crate::document::Document;
use crate::evidence::RecordEvidence;

pub(super) fn section(document: &Document) -> Markup {
    let Some(records) = &document.further.records else {
        return html! { section #residuals { h2 { "Residuals" } (missing("records")) } };
    };
    let scales = [Scale::logarithmic(document.found.robot.band_hz()), scale(records)];
    let [shown, others] = by_misfit(records);
    html! {
        section #residuals {
            h2 { "Residuals" }
            p {
                "What the model leaves of the acceleration. Where the residual lies on the noise of both sensors, the model explains the record; \
                 where it lies above, something is left that the model does not have."
            }
            @for record in shown { (figure(record, &scales)) }
            @if !others.is_empty() {
                (folded(
                    &others_title(records, &others),
                    &html! { @for record in others { (figure(record, &scales)) } },
                ))
            }
        }
    }
}

fn figure(record: &RecordEvidence, scales: &[Scale; 2]) -> Markup {
    html! {
        p.note { strong { (title(record)) } ": residual/noise " (misfits(record)) "." }
        (legend(&[
            ("measured", Colour::Blue, Mark::Line),
            ("residual", Colour::Red, Mark::Line),
            ("noise", Colour::Grey, Mark::Dashed),
        ]))
        (axis_panels("Residual and noise of the", unit(record), scales, |axis| curves(record, axis)))
    }
}

/// One scale for all records, so that they compare.
fn scale(records: &[RecordEvidence]) -> Scale {
    let curves = records.iter().flat_map(|own| {
        let spectra = &own.spectra;
        spectra.measured.iter().chain(&spectra.residual).chain(&spectra.noise)
    });
    density_scale(curves.flatten().copied())
}

fn curves(record: &RecordEvidence, axis: usize) -> Vec<Curve> {
    let spectra = &record.spectra;
    let curve = |colour, width, values: &[f64]| {
        let points = spectra.frequency_hz.iter().zip(values);
        Curve { colour, width, points: points.map(|(hz, own)| (*hz, Some(*own))).collect() }
    };
    vec![
        curve(Colour::Blue, 2, &spectra.measured[axis]),
        curve(Colour::Red, 2, &spectra.residual[axis]),
        curve(Colour::Grey, 4, &spectra.noise[axis]),
    ]
}
