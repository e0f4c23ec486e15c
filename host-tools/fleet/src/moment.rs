//! Instants in UTC, and whether the clock that gives them is synchronised.

use std::fmt;
use std::process::{Command, Stdio};

use time::{Duration, OffsetDateTime, UtcDateTime};

/// An instant in UTC. Its text is that of RFC 3339 to a millisecond, `2026-11-30T11:07:23.125Z`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Moment(UtcDateTime);

impl Moment {
    /// Returns the present instant by the system's clock.
    pub fn now() -> Self {
        Self(OffsetDateTime::now_utc().to_utc())
    }

    /// Returns the instant so many seconds ago. Returns `None` if the calendar does not reach it.
    pub fn ago(self, seconds: f64) -> Option<Self> {
        self.0.checked_sub(Duration::checked_seconds_f64(seconds)?).map(Self)
    }

    /// Returns the form for the name of a file, to a second: `20261130T110723Z`. The first eight letters are the day.
    pub(crate) fn in_name(self) -> String {
        let at = self.0;
        let (month, day) = (u8::from(at.month()), at.day());
        let (hour, minute, second) = at.time().as_hms();
        format!("{:04}{month:02}{day:02}T{hour:02}{minute:02}{second:02}Z", at.year())
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = self.0;
        let (month, day) = (u8::from(at.month()), at.day());
        let (hour, minute, second, milli) = at.time().as_hms_milli();
        write!(f, "{:04}-{month:02}-{day:02}T", at.year())?;
        write!(f, "{hour:02}:{minute:02}:{second:02}.{milli:03}Z")
    }
}

/// Returns whether the system's clock is synchronised, as systemd knows it of the kernel. Returns `None` where nobody knows.
pub fn is_synchronised() -> Option<bool> {
    let mut command = Command::new("timedatectl");
    command.args(["show", "--property=NTPSynchronized", "--value"]);
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    said(&output.stdout)
}

fn said(output: &[u8]) -> Option<bool> {
    match output.trim_ascii() {
        b"yes" => Some(true),
        b"no" => Some(false),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instants_are_written_in_utc() {
        let moment = Moment(UtcDateTime::from_unix_timestamp(1_795_950_443).unwrap());
        // date -u -d @1795950443
        assert_eq!(moment.to_string(), "2026-11-29T11:07:23.000Z");
        assert_eq!(moment.in_name(), "20261129T110723Z");
        assert_eq!(moment.ago(0.125).unwrap().to_string(), "2026-11-29T11:07:22.875Z");
        assert_eq!((moment.ago(f64::NAN), moment.ago(1e15)), (None, None));
    }

    #[test]
    fn what_timedatectl_says_is_understood() {
        assert_eq!((said(b"yes\n"), said(b"no\n"), said(b"")), (Some(true), Some(false), None));
    }
}
