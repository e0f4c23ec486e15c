//! Dates of records, ISO 8601, UTC.

use std::time::{Duration, SystemTime};

/// Earliest time that is taken for a date and not for seconds since a start: the year 2000, s since 1970.
const DATES_BEGIN: f64 = 946_684_800.0;
/// Latest time that has a date of four digits, s since 1970.
const DATES_END: f64 = 253_402_300_799.0;

/// Returns whether a time, s since 1970, is a date, and not that of a clock that has not been set.
pub fn is_date(seconds: f64) -> bool {
    (DATES_BEGIN..=DATES_END).contains(&seconds)
}

/// Returns a time, s since 1970, as a date, to the second: `2026-03-03T07:12:09Z`. Returns `None` if the clock shows no date.
pub fn date(seconds: f64) -> Option<String> {
    is_date(seconds).then(|| humantime::format_rfc3339_seconds(at(seconds)).to_string())
}

/// Returns a time, s since 1970, as part of a file's name, to the millisecond: `2026-03-03T07-12-09.250Z`. Names of later times come later in
/// the alphabet.
pub fn stamp(seconds: f64) -> String {
    humantime::format_rfc3339_millis(at(seconds)).to_string().replace(':', "-")
}

/// Times that have no date of four digits are the nearest that have, and what is no number is the first.
fn at(seconds: f64) -> SystemTime {
    let since = Duration::try_from_secs_f64(seconds.clamp(0.0, DATES_END)).unwrap_or_default();
    SystemTime::UNIX_EPOCH + since
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_since_1970_are_dates() {
        assert_eq!(date(1_764_068_400.9).as_deref(), Some("2025-11-25T11:00:00Z"));
        assert_eq!(date(951_782_400.0).as_deref(), Some("2000-02-29T00:00:00Z"));
        for none in [0.0, 12.5, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(date(none), None, "{none}");
        }
    }

    #[test]
    fn every_time_has_a_stamp() {
        assert_eq!(stamp(1_764_068_400.25), "2025-11-25T11-00-00.250Z");
        for (time, expected) in [
            (-5.0, "1970-01-01T00-00-00.000Z"),
            (f64::NAN, "1970-01-01T00-00-00.000Z"),
            (f64::INFINITY, "9999-12-31T23-59-59.000Z"),
        ] {
            assert_eq!(stamp(time), expected);
        }
    }
}
