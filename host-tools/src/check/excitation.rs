//! Judges where in the band the force stands clear of its noise, in any record.

use flexid_pipeline::check::{Excitation, Octave, Survey};
use flexid_wire::words::Percent;

use super::Finding;
use super::Severity::Doubtful;
use super::words::{enumerate, hz};

const ABOUT: &str = "excitation";
/// Share of the bins of an octave from which on it counts as excited. Chosen: half of its bins.
const EXCITED: f64 = 0.5;

/// Judges the excitation of a survey.
pub(super) fn judge(survey: &Survey) -> Option<Finding> {
    let excitations = || survey.usable().filter_map(|record| record.excitation.as_ref().ok());
    let least = excitations().map(Excitation::share).reduce(f64::min)?;
    // A short record has other bins, and the same octaves.
    let mut best: Vec<Octave> = Vec::new();
    for excitation in excitations() {
        for (place, octave) in excitation.octaves.iter().enumerate() {
            match best.get_mut(place) {
                Some(known) if octave.share() > known.share() => *known = *octave,
                Some(_) => {}
                None => best.push(*octave),
            }
        }
    }
    let silent = silent(&best);
    if silent.is_empty() {
        let finding =
            format!("the force stands clear of its noise in {} of the bins", at_least(least));
        return Some(Finding::right(ABOUT, finding));
    }
    let finding = format!(
        "in no record the force stands clear of its noise from {}",
        enumerate(silent.iter().map(band))
    );
    let mend = "cut harder, let the tooth frequency sweep these bands, or narrow band_hz";
    Some(Finding::new(Doubtful, ABOUT, finding, mend))
}

fn at_least(share: f64) -> String {
    if share < 1.0 { format!("at least {}", Percent(share)) } else { "all".to_owned() }
}

/// Bands of neighbouring octaves that are not excited, Hz.
pub(super) fn silent(octaves: &[Octave]) -> Vec<[f64; 2]> {
    let mut bands: Vec<[f64; 2]> = Vec::new();
    for octave in octaves.iter().filter(|octave| octave.share() < EXCITED) {
        let [from, to] = octave.band_hz;
        match bands.last_mut() {
            Some(last) if last[1] == from => last[1] = to,
            _ => bands.push([from, to]),
        }
    }
    bands
}

/// A band in words: `2 to 8 Hz`.
pub(super) fn band([from, to]: &[f64; 2]) -> String {
    format!("{} to {} Hz", hz(*from), hz(*to))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::Severity::Right;
    use crate::check::fixture::{empty, good};

    /// Bins that stand clear in the octave at `place` of a record.
    fn set(survey: &mut Survey, record: usize, place: usize, clear: u32) {
        survey.records[record].excitation.as_mut().unwrap().octaves[place].clear = clear;
    }

    #[test]
    fn an_octave_is_excited_if_any_record_excites_it() {
        let mut survey = good();
        assert_eq!(judge(&survey).unwrap().severity, Right);
        for record in 0..3 {
            set(&mut survey, record, 0, 3);
            set(&mut survey, record, 1, 19);
        }
        let finding = judge(&survey).unwrap();
        assert_eq!(finding.severity, Doubtful);
        assert!(finding.finding.ends_with("from 2 to 8 Hz"), "{}", finding.finding);
        set(&mut survey, 2, 0, 20);
        assert!(judge(&survey).unwrap().finding.ends_with("from 4 to 8 Hz"));
        set(&mut survey, 1, 1, 40);
        assert_eq!(judge(&survey).unwrap().severity, Right);
        assert_eq!(judge(&empty()), None);
    }

    #[test]
    fn bands_that_are_apart_stay_apart() {
        let octave = |from: f64, clear| Octave { band_hz: [from, 2.0 * from], bins: 40, clear };
        let bands = silent(&[octave(2.0, 0), octave(4.0, 40), octave(8.0, 0), octave(16.0, 0)]);
        assert_eq!(enumerate(bands.iter().map(band)), "2 to 4 Hz and 8 to 32 Hz");
    }
}
