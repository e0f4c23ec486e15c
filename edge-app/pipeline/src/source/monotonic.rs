//! Conversion of the kernel's timestamps to a clock that does not step.
//!
//! The kernel stamps frames with CLOCK_REALTIME, which users and NTP set. Both clocks run at the same rate: the offset
//! realtime − monotonic is constant until realtime is set. The offset is measured at each batch: monotonic, realtime and
//! monotonic again are read, and the offset lies between the two differences.

use std::ops::RangeInclusive;
use std::time::Duration;

use flexid_core::stream::SET_BACK_S;
use nix::time::{ClockId, clock_gettime};

/// Longest time by which a timestamp may lie before the newest one, ns: readers on several processors swap frames. Core takes
/// the clock to be set back beyond it.
const SWAPPED_NS: i128 = (1e9 * SET_BACK_S) as i128;

/// The offset realtime − monotonic, as measured last and as before realtime was set.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Offset {
    now_ns: Option<i128>,
    before_ns: Option<i128>,
    /// Newest timestamp on CLOCK_MONOTONIC, ns.
    newest_ns: i128,
    /// Time of the newest measurement on CLOCK_MONOTONIC, ns.
    looked_ns: i128,
}

impl Offset {
    /// Measures the offset now.
    ///
    /// # Errors
    /// The system lacks one of the clocks.
    pub(super) fn measure(&mut self) -> nix::Result<()> {
        let read = |clock| clock_gettime(clock).map(|time| Duration::from(time).as_nanos() as i128);
        let first_ns = read(ClockId::CLOCK_MONOTONIC)?;
        let realtime_ns = read(ClockId::CLOCK_REALTIME)?;
        let last_ns = read(ClockId::CLOCK_MONOTONIC)?;
        self.look(realtime_ns - last_ns..=realtime_ns - first_ns, last_ns);
        Ok(())
    }

    fn look(&mut self, possible_ns: RangeInclusive<i128>, looked_ns: i128) {
        self.looked_ns = looked_ns;
        if self.now_ns.is_none_or(|now| !possible_ns.contains(&now)) {
            self.before_ns = self.now_ns;
            self.now_ns = Some((possible_ns.start() + possible_ns.end()) / 2);
        }
    }

    /// Converts a timestamp to CLOCK_MONOTONIC, s. A timestamp from before realtime was set is recognised as follows: with the
    /// new offset it would lie well before the newest timestamp, or after the measurement. A timestamp that fits neither offset
    /// gets the time of the measurement, and does not affect those after it.
    pub(super) fn monotonic_s(&mut self, realtime: Duration) -> f64 {
        let realtime_ns = realtime.as_nanos() as i128;
        let fits = |ns: &i128| (self.newest_ns - SWAPPED_NS..=self.looked_ns).contains(ns);
        let times = [self.now_ns, self.before_ns].map(|offset| realtime_ns - offset.unwrap_or(0));
        let time_ns = times.into_iter().find(fits);
        self.newest_ns = self.newest_ns.max(time_ns.unwrap_or(self.newest_ns));
        time_ns.unwrap_or(self.looked_ns) as f64 / 1e9
    }

    /// Converts a time on CLOCK_MONOTONIC to CLOCK_REALTIME as it is set now, s.
    pub(super) fn realtime_s(&self, monotonic_s: f64) -> f64 {
        monotonic_s + self.now_ns.unwrap_or(0) as f64 / 1e9
    }

    /// Returns the time of the newest measurement, on CLOCK_MONOTONIC, s.
    pub(super) fn looked_s(&self) -> f64 {
        self.looked_ns as f64 / 1e9
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i128 = 1_000_000_000;

    /// Frames come every 10 ms and are fetched every 50 ms. Realtime is set by `step_ns` at 1.02 s, in the middle of a batch.
    #[test]
    fn realtime_may_be_set_in_the_midst_of_a_batch() {
        for step_ns in [0, 3600 * SECOND, -3600 * SECOND, SECOND / 2, -SECOND / 2] {
            let mut offset = Offset::default();
            let realtime_ns = |monotonic_ns: i128| {
                let set = if monotonic_ns < 1_020_000_000 { 0 } else { step_ns };
                1_767_000_000 * SECOND + monotonic_ns + set
            };
            for batch in 1..50_i128 {
                let looked_ns = batch * 50_000_000;
                // Between the two readings of monotonic pass 150 to 1350 ns.
                let wide = 100 + 400 * (batch % 3);
                let difference_ns = realtime_ns(looked_ns) - looked_ns;
                offset.look(difference_ns - wide..=difference_ns + wide / 2, looked_ns);
                for frame in 0..5 {
                    let at_ns = looked_ns - 45_000_000 + frame * 10_000_000;
                    let stamp = Duration::from_nanos(realtime_ns(at_ns) as u64);
                    let error = offset.monotonic_s(stamp) - at_ns as f64 / 1e9;
                    assert!(error.abs() < 1e-6, "{error} s, batch {batch}, step {step_ns}");
                    let again = offset.realtime_s(at_ns as f64 / 1e9);
                    let set_s = (again - realtime_ns(looked_ns) as f64 / 1e9).abs();
                    assert!(set_s < 0.06, "{again} s, batch {batch}, step {step_ns}");
                }
            }
        }
    }

    /// The reader is 1 s behind. Two neighbours in its queue are swapped, and one stamp is an hour old.
    #[test]
    fn stamps_out_of_order_do_not_touch_the_others() {
        let mut offset = Offset::default();
        let difference_ns = 1_767_000_000 * SECOND;
        offset.look(difference_ns..=difference_ns, 2 * SECOND);
        let mut at_ns: Vec<i128> = (0..8000).map(|frame| SECOND + frame * 125_000).collect();
        at_ns[100] -= 1000 + 125_000;
        at_ns.swap(200, 201);
        at_ns[300] -= 3600 * SECOND;
        for (frame, at_ns) in at_ns.into_iter().enumerate() {
            let time_s = offset.monotonic_s(Duration::from_nanos((difference_ns + at_ns) as u64));
            let expected_s = if frame == 300 { 2.0 } else { at_ns as f64 / 1e9 };
            assert!((time_s - expected_s).abs() < 1e-9, "frame {frame}: {time_s} s");
        }
    }

    #[test]
    fn the_clocks_of_this_machine_agree() {
        let mut offset = Offset::default();
        let mut last_s = 0.0;
        for _ in 0..1000 {
            let realtime = clock_gettime(ClockId::CLOCK_REALTIME).unwrap();
            offset.measure().unwrap();
            let now_s = offset.monotonic_s(realtime.into());
            assert!(now_s >= last_s && offset.looked_s() - now_s < 1.0);
            last_s = now_s;
        }
    }
}
