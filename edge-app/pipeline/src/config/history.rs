//! The epochs of a daemon: spans of a robot's life, each with a finding of its own.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::sections::HistorySection;
use crate::date::is_date;

/// Findings of epochs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct History {
    /// When an epoch ends.
    pub epoch: Epoch,
    /// Folder of the findings. `None` if they lie beside the daemon's state.
    pub folder: Option<PathBuf>,
}

/// When an epoch ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Epoch {
    /// At multiples of this duration since 1970, UTC.
    Time(Duration),
    /// After so many records.
    Records(u64),
}

impl Epoch {
    /// Returns whether an epoch of so many `records`, of which the newest began at `newest_s`, ends before a record that began at `next_s`,
    /// s since 1970. A clock that is set back ends it as one that goes on. One that is set for the first time does not: time has not passed.
    pub fn ends(self, records: u64, newest_s: f64, next_s: f64) -> bool {
        match self {
            Self::Time(span) => {
                let [newest, next] = [newest_s, next_s].map(|at| (at / span.as_secs_f64()).floor());
                is_date(newest_s) == is_date(next_s) && newest != next
            }
            Self::Records(most) => records >= most,
        }
    }
}

/// Checks the section. A relative folder starts at `base`.
///
/// # Errors
/// The error names the key and the mend.
pub(super) fn history(section: &HistorySection, base: &Path) -> Result<History, String> {
    let epoch = match (&section.epoch, section.records) {
        (Some(text), None) => Epoch::Time(span(text)?),
        (None, Some(0)) => return Err("[history] records is 0: must be at least 1".into()),
        (None, Some(records)) => Epoch::Records(records),
        (None, None) => {
            return Err(
                "[history] says no end of an epoch: add epoch = \"1d\", or records = 50".into()
            );
        }
        (Some(_), Some(_)) => {
            return Err("[history] has epoch and records: leave one out".into());
        }
    };
    Ok(History { epoch, folder: section.folder.as_ref().map(|folder| base.join(folder)) })
}

fn span(text: &str) -> Result<Duration, String> {
    match humantime::parse_duration(text) {
        Ok(Duration::ZERO) => Err(format!("[history] epoch is {text:?}: must be positive")),
        Ok(span) => Ok(span),
        Err(error) => Err(format!(
            "[history] epoch is {text:?}: {error}: write a duration, as \"8h\", \"1d\" or \"1week\""
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY_S: f64 = 86_400.0;

    #[test]
    fn a_day_ends_at_midnight_utc() {
        let day = Epoch::Time(span("1d").unwrap());
        let midnight_s = 20_000.0 * DAY_S;
        for (newest_s, next_s, ends) in [
            (midnight_s - 1.0, midnight_s - 0.1, false),
            (midnight_s - 0.1, midnight_s, true),
            (midnight_s, midnight_s + DAY_S - 0.1, false),
            (midnight_s, midnight_s + 30.0 * DAY_S, true),
            (midnight_s, midnight_s - 0.1, true),
            // The clock begins in 1970, and is set.
            (42.0, 99.0, false),
            (42.0, DAY_S, true),
            (42.0, midnight_s, false),
            (midnight_s, 42.0, false),
        ] {
            assert_eq!(day.ends(1, newest_s, next_s), ends, "{newest_s} {next_s}");
        }
    }

    #[test]
    fn records_end_an_epoch_at_any_time() {
        let three = Epoch::Records(3);
        assert!(!three.ends(2, 0.0, 9.0 * DAY_S) && three.ends(3, 0.0, 0.0));
    }
}
