//! Judges the rest before each cut, from which the noise of the sensors is taken.

use flexid_pipeline::check::{Examined, Survey};

use super::Finding;
use super::Severity::{Doubtful, Note};
use super::words::records;

const ABOUT: &str = "rest";
/// Shortest rest whose spectrum of noise can be read, samples (`SHORTEST` in `core/src/stream/noise/periodogram.rs`). A record without it
/// has the noise of the newest record before that has some, or else the white part of its quietest block.
const SHORTEST: usize = 128;
/// Time from a record to the next of the same cut, s: what the stream takes for a pause is longer.
const PAUSE_S: f64 = 0.5;

/// Judges the rest before the cuts of a survey.
pub(super) fn judge(survey: &Survey) -> Option<Finding> {
    let has_rest = |record: &&Examined| record.quiet_samples >= SHORTEST;
    // A record that goes on with a cut has the noise of the record before.
    let goes_on = |record: &&Examined| {
        let mut before = survey.records.iter().filter(|other| other.number + 1 == record.number);
        before.any(|before| record.start_s - (before.start_s + before.seconds) < PAUSE_S)
    };
    let begins = survey.usable().filter(|record| has_rest(record) || !goes_on(record));
    let (with, without): (Vec<&Examined>, Vec<&Examined>) = begins.partition(has_rest);
    let without: Vec<u64> = without.iter().map(|record| record.number).collect();
    let shortest_s = with.iter().map(|record| record.quiet_s).reduce(f64::min);
    Some(match (shortest_s, &without[..]) {
        (None, []) => return None,
        (Some(shortest_s), []) => {
            let finding = format!("each cut begins with at least {shortest_s:.2} s of rest");
            Finding::right(ABOUT, finding)
        }
        (Some(_), without) => {
            let begin = if without.len() == 1 { "begins" } else { "begin" };
            let finding = format!("{} {begin} without rest before the cut", records(without));
            let mend = "its noise is that of another record; rest for a second before each cut";
            Finding::new(Note, ABOUT, finding, mend)
        }
        (None, _) => Finding::new(
            Doubtful,
            ABOUT,
            "no record begins with rest before the cut: the noise is not known",
            "rest for a second before each cut, without force on the tool",
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::Severity::Right;
    use crate::check::fixture::{empty, good};

    #[test]
    fn one_record_with_rest_gives_the_noise_of_all() {
        let mut survey = good();
        assert_eq!(judge(&survey).unwrap().severity, Right);
        assert_eq!(judge(&survey).unwrap().finding, "each cut begins with at least 0.19 s of rest");
        survey.records[1].quiet_samples = 64;
        let note = judge(&survey).unwrap();
        assert_eq!(
            (note.severity, note.finding.as_str()),
            (Note, "record 2 begins without rest before the cut")
        );
        survey.records.iter_mut().for_each(|record| record.quiet_samples = 0);
        assert_eq!(judge(&survey).unwrap().severity, Doubtful);
        assert_eq!(judge(&empty()), None);
        // A cut that goes on.
        let mut long = good();
        (long.records[1].quiet_samples, long.records[1].start_s) = (0, 5.0 + 4.1);
        assert_eq!(judge(&long).unwrap().severity, Right);
        long.records[1].start_s = 5.0 + 4.7;
        assert_eq!(judge(&long).unwrap().severity, Note);
    }
}
