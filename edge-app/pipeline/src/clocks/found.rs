//! What the rules of time found, for people and scripts.

use std::fmt;

use flexid_core::imperfection::Accuracies;
use serde::Serialize;

use super::delay::Delay;

/// What was found of the clocks of force and acceleration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundClocks {
    /// Clocks of the force and of the acceleration, on that of the recording.
    pub sensors: [FoundClock; 2],
    /// Delay of the acceleration after the force. `None` if the data do not tell, and the configuration states its width.
    pub delay: Option<Delay>,
    /// Standard deviation of the difference of both rates over the rate.
    pub drift_std: f64,
    /// Standard deviation of the delay from record to record, s.
    pub record_delay_std_s: f64,
}

/// What was found of one clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FoundClock {
    /// Rate, Hz.
    pub rate_hz: f64,
    /// Rate over the configured one less 1, parts in a million.
    pub ppm: f64,
    /// Standard deviation of the same.
    pub ppm_std: f64,
    /// Number of frames.
    pub frames: u64,
    /// Number of frames that came later than ten times the median delay.
    pub late: u64,
    /// Number of instants within the runs whose frame is missing.
    pub lost: u64,
    /// Number of runs: a pause, a counter that begins anew, or a clock that is set begins another.
    pub runs: usize,
}

/// Why the clocks of a recording cannot be told, and what to do. As text it is one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Untold {
    /// The reason.
    pub reason: String,
    /// The mend.
    pub mend: &'static str,
}

/// Names of the sensors.
pub(super) const NAMES: [&str; 2] = ["force", "acceleration"];
/// Rates that differ by more are no error of a quartz, parts in a million: data sheets state up to 100.
const QUARTZ_PPM: f64 = 200.0;
/// Half of a 95 % interval over a standard deviation.
const HALF: f64 = 1.96;

impl fmt::Display for Untold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.reason, self.mend)
    }
}

impl fmt::Display for FoundClock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rate_hz, ppm, ppm_std, frames, late, lost, runs } = self;
        if ppm.abs() > QUARTZ_PPM {
            write!(
                f,
                "{rate_hz:.2} Hz (rate_hz is off by {:.2} %)",
                -1e-4 * ppm / (1.0 + 1e-6 * ppm)
            )?;
        } else {
            write!(f, "{ppm:+.2} ± {:.2} ppm", HALF * ppm_std)?;
        }
        let part = |count: u64| 100.0 * count as f64 / (*frames).max(1) as f64;
        write!(f, ", {:.2} % late, {lost} lost", part(*late))?;
        if *runs > 1 { write!(f, ", {runs} runs") } else { Ok(()) }
    }
}

/// In one line.
impl fmt::Display for FoundClocks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, clock) in NAMES.iter().zip(&self.sensors) {
            write!(f, "{name} {clock}; ")?;
        }
        match &self.delay {
            Some(Delay { delay_s, std_s, share, pieces, .. }) => write!(
                f,
                "the acceleration comes {:.3} ± {:.3} ms after the force (as a mass, {:.0} % of {pieces} pieces)",
                1e3 * delay_s,
                1e3 * HALF * std_s,
                100.0 * share
            ),
            None => f.write_str("the delay of the acceleration is that of [calibration] delay_s"),
        }
    }
}

impl FoundClocks {
    /// Returns the number of frames of both sensors that are missing.
    pub(crate) fn lost(&self) -> u64 {
        self.sensors.iter().map(|own| own.lost).sum()
    }

    /// Returns accuracies that are wide enough for what the clocks leave unknown, beside what is `typical` without them. A delay that a fit seeks
    /// has a prior of its own.
    pub(crate) fn widen(
        &self,
        own: &Accuracies,
        typical: &Accuracies,
        seeks_delay: bool,
    ) -> Accuracies {
        let wider = |own: f64, typical: f64, std: f64| own.max(typical.hypot(std));
        let delay_std_s = self.delay.map_or(0.0, |delay| delay.std_s);
        Accuracies {
            delay: if seeks_delay {
                own.delay
            } else {
                wider(own.delay, typical.delay, delay_std_s)
            },
            delay_drift: wider(own.delay_drift, typical.delay_drift, self.drift_std),
            record_delay: wider(own.record_delay, typical.record_delay, self.record_delay_std_s),
            ..*own
        }
    }

    /// Returns whether the rate of the slower sensor differs from the configured one by more than any quartz.
    pub fn has_wrong_rate(&self) -> bool {
        let [one, other] = &self.sensors;
        let slower = if other.rate_hz < one.rate_hz { other } else { one };
        slower.ppm.abs() > QUARTZ_PPM
    }
}
