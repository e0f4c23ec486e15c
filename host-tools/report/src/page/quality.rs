//! Quality of the data: rates, gaps, samples that are wrong, excitation.

use maud::{Markup, html};

use super::format::{count, number, percent, pose};
use super::{folded_section, missing};
use crate::document::Document;
use crate::evidence::{DataQuality, MeasuredReceptance, RecordEvidence};

/// Names of the axes of both sensors.
const SIGNALS: [&str; 6] = ["force x", "y", "z", "acceleration x", "y", "z"];

pub(super) fn section(document: &Document) -> Markup {
    let contents = html! {
            @match &document.further.records {
                None => (missing("records")),
                Some(records) if records.is_empty() => p { "No records." },
                Some(records) => {
                    (table(records, document.further.measured_receptance.as_deref().unwrap_or_default()))
                    (excitation(records))
                },
            }
            @match &document.further.data_quality {
                None => (missing("data_quality")),
                Some(quality) => (counts(quality)),
            }
    };
    folded_section("quality", "Data quality", &contents)
}

fn table(records: &[RecordEvidence], measured: &[MeasuredReceptance]) -> Markup {
    html! {
        table {
            caption { strong { "Records that the fit rests on" } }
            thead {
                tr {
                    th { "record" } th { "pose" } th.left { "angles / rad (m)" } th { "length / s" } th { "rate / Hz" } th { "force / N" }
                    th { "starts at rest" } th { "lines taken out" } th { "coherence x, y, z" }
                }
            }
            tbody {
                @for own in records {
                    tr {
                        td { (own.number) }
                        td { (own.pose_number) }
                        td.left { (pose(&own.pose)) }
                        td { (format!("{:.3}", own.seconds)) }
                        @if own.is_of_test {
                            td { "–" } td { "–" } td { "modal test" }
                        } @else {
                            td { (format!("{:.2}", own.rate_hz)) @if own.has_doubtful_rate { " (doubtful)" } }
                            td { (number(own.rms_force_n)) }
                            td { @if own.starts_at_rest { "yes" } @else { "no" } }
                        }
                        td { (own.lines) }
                        td { (coherences(measured.iter().find(|pose| pose.records.contains(&own.number)))) }
                    }
                }
            }
        }
        p.note {
            "Force: root mean square in the band, all axes. Coherence: median over the band of the multiple coherence of the pose; it is low where \
             the segments are too short for the resonances, not only where noise is."
        }
    }
}

/// Medians of the coherence of each axis.
fn coherences(measured: Option<&MeasuredReceptance>) -> String {
    let Some(measured) = measured else { return "–".to_owned() };
    let median = |axis: usize| {
        let mut all: Vec<f64> = measured.points.iter().map(|own| own.coherence[axis]).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).map_or_else(|| "–".to_owned(), |own| format!("{own:.2}"))
    };
    (0..3).map(median).collect::<Vec<_>>().join(", ")
}

fn excitation(records: &[RecordEvidence]) -> Markup {
    let octaves = records.first().map_or(&[][..], |own| &own.octaves);
    html! {
        table.narrow {
            caption {
                strong { "Excitation" } ": share of the bins of each octave in which the power of the force is more than ten times that of its noise"
            }
            thead {
                tr {
                    th { "record" }
                    @for own in octaves { th { (number(own.band_hz[0])) " to " (number(own.band_hz[1])) " Hz" } }
                }
            }
            tbody {
                @for own in records {
                    tr {
                        td { (own.number) }
                        @for octave in &own.octaves {
                            td class=[(octave.clear < 0.5).then_some("weak")] { (percent(octave.clear)) }
                        }
                    }
                }
            }
        }
    }
}

fn counts(quality: &DataQuality) -> Markup {
    let came = quality.readings.saturating_add(quality.lost).max(1);
    let lost = quality.lost as f64 / came as f64;
    let [spiked, clipped, held, fast] = quality.refused;
    let rows: [(&str, String); 9] = [
        ("frames", quality.frames.to_string()),
        ("force and acceleration readings", quality.readings.to_string()),
        ("lost by their counters", format!("{} ({})", quality.lost, percent(lost))),
        ("bridged samples", quality.bridged.to_string()),
        (
            "restarts of counters, repeated counters",
            format!("{}, {}", quality.restarts, quality.repeated),
        ),
        (
            "frames of wrong length, of unknown identifiers",
            format!("{}, {}", quality.wrong_length, quality.unknown),
        ),
        (
            "errors of the bus, readings that are not finite",
            format!("{}, {}", quality.bus_errors, quality.not_finite),
        ),
        (
            "records cut; refused for spikes, clipping, held samples, rate",
            format!("{}; {spiked}, {clipped}, {held}, {fast}", quality.records),
        ),
        (
            "records of a wrong, of a doubtful rate",
            format!("{}, {}", quality.wrong_rate, quality.doubtful_rate),
        ),
    ];
    let samples = [
        ("at the limit of the signal", quality.at_limit),
        ("spikes of single samples", quality.spikes),
        ("clipped", quality.clipped),
        ("held", quality.held),
    ];
    let all = samples.iter().flat_map(|(_, own)| *own);
    let wrong = all.fold(0, u64::saturating_add);
    html! {
        table.narrow {
            caption { strong { "What came in" } }
            tbody {
                @for (name, value) in rows { tr { td.left { (name) } td { (value) } } }
            }
        }
        @if wrong == 0 {
            p { "No sample is at a limit, spiked, clipped or held." }
        } @else {
            table.narrow {
                caption { strong { "Wrong samples" } ", by axis: " (count(wrong as usize, "sample")) }
                thead { tr { th {} @for name in SIGNALS { th { (name) } } } }
                tbody {
                    @for (name, own) in samples {
                        tr { th scope="row" { (name) } @for number in own { td { (number) } } }
                    }
                }
            }
        }
    }
}
