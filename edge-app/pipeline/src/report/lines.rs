//! Lines of noise that were subtracted from the records, by frequency.

use flexid_wire::warning::{Line, MAX_LINES, Warning};

use crate::record::Experiment;

/// Most bins by which the frequency of a line differs from one record to the next.
const APART: f64 = 0.5;

/// Returns the warning about the lines of `experiments`. Returns `None` if there are none.
pub(crate) fn lines(experiments: &[Experiment]) -> Option<Warning> {
    let of_record = |experiment: &Experiment| {
        let bin_hz = experiment.spacing / std::f64::consts::TAU;
        experiment
            .tones_hz()
            .map(move |(hz, amplitude)| (hz, amplitude, bin_hz))
            .collect::<Vec<_>>()
    };
    warning(experiments.iter().flat_map(of_record).collect())
}

/// Returns the warning about tones: frequency, Hz, amplitude, m/s², and distance of the bins, Hz, of each.
fn warning(mut tones: Vec<(f64, f64, f64)>) -> Option<Warning> {
    tones.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lines: Vec<Line> = Vec::new();
    for (hz, amplitude, bin_hz) in tones {
        match lines.last_mut() {
            Some(line) if hz - line.frequency_hz < APART * bin_hz => {
                line.amplitude = line.amplitude.max(amplitude);
                line.records += 1;
            }
            _ => lines.push(Line { frequency_hz: hz, amplitude, records: 1 }),
        }
    }
    let more = lines.len().saturating_sub(MAX_LINES) as u32;
    lines.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    lines.truncate(MAX_LINES);
    lines.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    (!lines.is_empty()).then(|| Warning::Lines { lines: lines.into_iter().collect(), more })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_several_records_is_named_once() {
        let bin_hz = 0.25;
        let of_records = [50.01, 167.8, 49.99, 47.0, 50.0].map(|hz| (hz, 0.001 * hz, bin_hz));
        let Some(Warning::Lines { lines, more: 0 }) = warning(of_records.to_vec()) else {
            panic!("no lines")
        };
        let found: Vec<_> = lines.iter().map(|line| (line.frequency_hz, line.records)).collect();
        assert_eq!(found, [(47.0, 1), (49.99, 3), (167.8, 1)]);
        assert_eq!(lines[1].amplitude, 0.001 * 50.01);
        assert_eq!(warning(Vec::new()), None);
    }

    #[test]
    fn the_strongest_lines_are_named() {
        let many = (0..9).map(|n| (10.0 * f64::from(n + 1), f64::from(n % 5), 0.25)).collect();
        let Some(Warning::Lines { lines, more: 3 }) = warning(many) else { panic!("three more") };
        assert!(lines.iter().all(|line| line.amplitude >= 1.0), "{lines:?}");
        assert!(lines.is_sorted_by_key(|line| line.frequency_hz), "{lines:?}");
    }
}
