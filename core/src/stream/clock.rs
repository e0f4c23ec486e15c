//! The sampling rate of a sensor, from the counters of its instants and the times at which they arrive.
//!
//! Instant n of a run arrives at
//!
//! ```text
//! t = t₀ + n T + w
//! ```
//!
//! The delay w is never negative, and large where sender, bus or reader were held up. So only the earliest arrival of each block of
//! instants counts (Moon, Skelly and Towsley, Estimation and removal of clock skew from network delay measurements, 1999). With the
//! configured period T₀, the slope of `t − n T₀` against `n T₀` is T/T₀ − 1. The estimate is the median slope over all pairs of
//! blocks, which stands up to 29 % of blocks that were held up as a whole. Its standard deviation follows from the order of the
//! slopes without any distribution (Sen, Estimates of the regression coefficient based on Kendall's tau, 1968).
//!
//! Where delays grow, a clock is set or the rate changes, the halves of a run disagree with each other or with the whole. The
//! deviation is never smaller than that disagreement. Arrivals that wait for a poll or a tick form a staircase. The deviation is
//! never smaller than one of its steps over the span.

use heapless::Vec;

/// Capacity of a run, blocks. When it is full, every two blocks become one.
const BLOCKS: usize = 64;
/// Pairs of blocks.
const PAIRS: usize = BLOCKS * (BLOCKS - 1) / 2;
/// Instants of each of the first blocks.
const BLOCK: u64 = 16;
/// Fewest blocks from which a rate is measured: each half must have a slope with a middle.
const FEWEST: usize = 8;
/// Resolution of arrival times: what `candump` writes, s.
const RESOLUTION_S: f64 = 1e-6;
/// Blocks on either side of a step of a staircase; the earliest of them counts. Where 29 % of blocks are held up as a whole, so are
/// all four of a side once in 140 times. Two sides are no more than [`FEWEST`].
const FLAT: usize = 4;
/// Highest step of a staircase, periods. At a whole period the next instant catches the poll instead; the rest is for the jitter. A
/// higher step is no part of a staircase, and neither are the blocks beside it: the clock was set, or the rate changed.
const HIGHEST: f64 = 1.5;
/// Two rates contradict each other if they differ by more than this many standard deviations.
const CONTRADICTS: f64 = 3.0;
/// Crystals of sensors and computers are right to some tens of ppm. An error of this part moves a stiffness by about a standard
/// deviation in the reference scenario. A rate that is less certain than this is no measurement.
pub(super) const CRYSTAL: f64 = 50e-6;
/// A configured rate that is wrong by more than this part is reported: no two good crystals differ by as much.
const REPORTED: f64 = 200e-6;
/// Arrivals of a sender that keeps time stay within this of a straight line, s: USB adapters poll every 1 ms, kernels tick every
/// 4 ms. A sender that strays farther was held up, and its arrivals give no rate.
pub const STRAYS_S: f64 = 5e-3;
/// Part by which the rate of a sender that was held up may differ from the configured one without a report. A sender that is faster
/// by more over a whole run was not held up.
const TOLERANCE: f64 = 0.1;
/// An arrival that is this much earlier than the one before shows that the clock was set back, s. Readers may swap frames of
/// some ms.
pub const SET_BACK_S: f64 = 0.01;

/// The sampling period, as measured from arrivals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    /// Part by which the period is longer than the configured one.
    pub(super) excess: f64,
    /// Standard deviation of the excess.
    pub(super) deviation: f64,
    /// Time over which it was measured, s.
    pub(super) span_s: f64,
}

/// Rate of a record, and how the measured rate compares with the configured one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rate {
    /// Rate of the record, Hz.
    pub(super) rate_hz: f64,
    /// Measured rate, Hz.
    pub(super) measured_hz: f64,
    /// Standard deviation of the measured rate, Hz.
    pub(super) deviation_hz: f64,
    /// True if the measured rate contradicts the configured one by so much that it is reported.
    pub(super) is_wrong: bool,
    /// True if the measured rate contradicts the configured one, but is too uncertain to replace it.
    pub(super) is_doubtful: bool,
    /// True if samples came so much faster than configured that the record is refused.
    pub(super) is_refused: bool,
}

/// Measures the sampling period of one sensor, over all its runs.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    period_s: f64,
    run: Run,
    /// Measurement of all earlier runs together.
    earlier: Option<Measured>,
}

/// Instants that one counter counts.
#[derive(Clone, Debug, Default)]
struct Run {
    /// Arrival of the first and of the newest instant, s.
    arrivals: Option<(f64, f64)>,
    /// Instants since the first.
    instants: u64,
    /// Instants of a block.
    block: u64,
    /// Earliest arrival of each complete block.
    blocks: Vec<Earliest, BLOCKS>,
    /// Earliest arrival of the block that is not complete.
    open: Option<Earliest>,
    /// Excess that is taken out before the arrivals of one block are compared.
    trend: f64,
}

/// The earliest arrival of a block.
#[derive(Clone, Copy, Debug)]
struct Earliest {
    instant: u64,
    /// Time at which it was due by the configured period, from the first instant, s.
    due_s: f64,
    /// Time by which it came later, s.
    late_s: f64,
}

impl Measured {
    /// The rate of a record, where `rate_hz` is the configured one.
    ///
    /// Where the two agree within the uncertainty of crystals and arrivals, it is the mean of both by their variances. Where they
    /// do not, the configuration is wrong, and the measurement is right if it is as good as a crystal.
    pub(super) fn rate(&self, rate_hz: f64) -> Rate {
        let Self { excess, deviation, span_s } = *self;
        let off = excess.abs();
        let contradicted = off > CONTRADICTS * libm::hypot(deviation, CRYSTAL);
        let weight = match (contradicted, deviation <= CRYSTAL) {
            (true, true) => 1.0,
            (true, false) => 0.0,
            (false, _) => CRYSTAL * CRYSTAL / (CRYSTAL * CRYSTAL + deviation * deviation),
        };
        let keeps_time = deviation * span_s <= STRAYS_S;
        let is_reportable = off > REPORTED + CONTRADICTS * deviation;
        let measured_hz = rate_hz / (1.0 + excess);
        Rate {
            rate_hz: rate_hz / (1.0 + weight * excess),
            measured_hz,
            deviation_hz: deviation * measured_hz,
            is_wrong: contradicted && is_reportable && (keeps_time || off > TOLERANCE),
            is_doubtful: contradicted && keeps_time && deviation > CRYSTAL,
            is_refused: contradicted && excess < 1.0 / (1.0 + TOLERANCE) - 1.0,
        }
    }

    /// Both measurements together; if they contradict each other, the newer one.
    fn and(self, older: Self) -> Self {
        let variances = [self, older].map(|each| each.deviation * each.deviation);
        let total = variances[0] + variances[1];
        if (self.excess - older.excess).abs() > CONTRADICTS * libm::sqrt(total) {
            return self;
        }
        Self {
            excess: (self.excess * variances[1] + older.excess * variances[0]) / total,
            deviation: libm::sqrt(variances[0] * variances[1] / total),
            span_s: self.span_s.max(older.span_s),
        }
    }
}

impl Clock {
    pub(super) fn new(rate_hz: f64) -> Self {
        Self { period_s: 1.0 / rate_hz, run: Run::default(), earlier: None }
    }

    /// Takes the arrival of the next instant.
    pub(super) fn arrive(&mut self, time_s: f64) {
        if self.run.arrivals.is_some_and(|(_, newest_s)| time_s < newest_s - SET_BACK_S) {
            self.end_run();
        }
        self.run.arrive(time_s, self.period_s);
    }

    /// Takes note of instants that did not arrive.
    pub(super) fn miss(&mut self, instants: u64) {
        self.run.instants += instants;
    }

    /// Ends the run: the number of instants up to the next one is not known.
    pub(super) fn end_run(&mut self) {
        self.earlier = self.measured();
        let trend = self.earlier.map_or(0.0, |earlier| earlier.excess);
        self.run = Run { trend, ..Run::default() };
    }

    /// The rate of a record that ends now.
    pub(super) fn rate(&self) -> Rate {
        let rate_hz = 1.0 / self.period_s;
        let unmeasured = Measured { excess: 0.0, deviation: f64::INFINITY, span_s: 0.0 };
        self.measured().unwrap_or(unmeasured).rate(rate_hz)
    }

    /// The measured period; `None` if there is no measurement.
    pub(super) fn measured(&self) -> Option<Measured> {
        match (self.run.measured(self.period_s), self.earlier) {
            (Some(run), Some(earlier)) => Some(run.and(earlier)),
            (run, earlier) => run.or(earlier),
        }
    }
}

impl Run {
    fn arrive(&mut self, time_s: f64, period_s: f64) {
        let Some((first_s, _)) = self.arrivals else {
            self.arrivals = Some((time_s, time_s));
            self.instants = 0;
            self.block = BLOCK;
            self.open = Some(Earliest { instant: 0, due_s: 0.0, late_s: 0.0 });
            return;
        };
        self.arrivals = Some((first_s, time_s));
        self.instants += 1;
        let due_s = self.instants as f64 * period_s;
        let arrival = Earliest { instant: self.instants, due_s, late_s: time_s - first_s - due_s };
        self.open = Some(match self.open {
            Some(open) if open.instant / self.block == arrival.instant / self.block => {
                open.or_earlier(arrival, self.trend)
            }
            Some(complete) => {
                let _ = self.blocks.push(complete);
                arrival
            }
            None => arrival,
        });
        while self.blocks.is_full() {
            self.merge();
        }
    }

    /// Makes one block of every two.
    fn merge(&mut self) {
        self.trend = slope(&self.blocks).map_or(self.trend, |slope| slope.excess);
        self.block *= 2;
        let blocks = core::mem::take(&mut self.blocks);
        for next in blocks {
            match self.blocks.last_mut() {
                Some(last) if last.instant / self.block == next.instant / self.block => {
                    *last = last.or_earlier(next, self.trend);
                }
                _ => {
                    let _ = self.blocks.push(next);
                }
            }
        }
    }

    /// Measurement from the whole run, its newer half or its newest quarter, whichever has the smallest deviation. A part that is much
    /// faster than the whole does not count: a sender that was held up catches up.
    fn measured(&self, period_s: f64) -> Option<Measured> {
        let blocks = &self.blocks;
        // The resolution is that of the whole run: a part may lie between two steps.
        let resolution_s = resolution(blocks, period_s);
        let newest = |part| of(&blocks[blocks.len() - blocks.len() / part..], resolution_s);
        let whole = newest(1)?;
        let catches_up = |part: &Measured| part.excess < whole.excess - TOLERANCE;
        let surest = |a: &Measured, b: &Measured| a.deviation.total_cmp(&b.deviation);
        let parts = [2, 4].into_iter().filter_map(newest).filter(|part| !catches_up(part));
        core::iter::once(whole).chain(parts).min_by(surest)
    }
}

impl Earliest {
    fn or_earlier(self, other: Self, trend: f64) -> Self {
        let detrended = |each: &Self| each.late_s - trend * each.due_s;
        if detrended(&other) < detrended(&self) { other } else { self }
    }
}

/// Resolution of the arrivals, s: the highest step between the blocks before and after, beside the trend.
///
/// USB adapters poll and kernels tick. Where the sampling period is a part of that time, or the reverse, every block has the same
/// few phases. Its earliest arrival is then late by the same time until the sensor has drifted by a whole phase.
fn resolution(blocks: &[Earliest], period_s: f64) -> f64 {
    let apart = |both: &[Earliest]| {
        let [first, .., last] = both else { return 0.0 };
        (last.late_s - first.late_s) / (last.due_s - first.due_s)
    };
    // The trend is that of most of the blocks, also where the rate changed.
    let mut trends: Vec<f64, BLOCKS> = blocks.windows(1 + FLAT).map(apart).collect();
    trends.sort_unstable_by(f64::total_cmp);
    let trend = trends.get(trends.len() / 2).copied().unwrap_or_default();
    let earliest = |side: &[Earliest]| {
        side.iter().map(|each| each.late_s - trend * each.due_s).fold(f64::INFINITY, f64::min)
    };
    let step = |both: &[Earliest]| (earliest(&both[FLAT..]) - earliest(&both[..FLAT])).abs();
    let steps: Vec<f64, BLOCKS> = blocks.windows(2 * FLAT).map(step).collect();
    let highest_s = HIGHEST * period_s;
    let is_of_staircase = |index: usize| {
        let beside = [index.checked_sub(FLAT), Some(index), Some(index + FLAT)];
        beside.into_iter().flatten().filter_map(|i| steps.get(i)).all(|step| *step <= highest_s)
    };
    let own = steps.iter().enumerate().filter(|(index, _)| is_of_staircase(*index));
    own.fold(RESOLUTION_S, |highest, (_, step)| highest.max(*step))
}

/// Measurement from these blocks. Its deviation is at least the disagreement of their halves, and the resolution of the arrivals is
/// added.
fn of(blocks: &[Earliest], resolution_s: f64) -> Option<Measured> {
    if blocks.len() < FEWEST {
        return None;
    }
    let (older, newer) = blocks.split_at(blocks.len() / 2);
    let (whole, older, newer) = (slope(blocks)?, slope(older)?.excess, slope(newer)?.excess);
    let apart = (older - newer).abs() / 2.0;
    let shifted = (whole.excess - (older + newer) / 2.0).abs();
    let deviation = whole.deviation.max(apart).max(shifted) + resolution_s / whole.span_s;
    Some(Measured { deviation, ..whole })
}

/// The median slope of all pairs of blocks, with its standard deviation.
fn slope(blocks: &[Earliest]) -> Option<Measured> {
    let mut slopes = Vec::<f32, PAIRS>::new();
    for (index, earlier) in blocks.iter().enumerate() {
        for later in &blocks[index + 1..] {
            let slope = (later.late_s - earlier.late_s) / (later.due_s - earlier.due_s);
            let _ = slopes.push(slope as f32);
        }
    }
    slopes.sort_unstable_by(f32::total_cmp);
    // Variance of Kendall's statistic of n points: n (n − 1) (2n + 5) / 18.
    let (n, pairs) = (blocks.len() as f64, slopes.len() as f64);
    let spread = libm::sqrt(n * (n - 1.0) * (2.0 * n + 5.0) / 18.0);
    let at = |rank: f64| slopes.get((rank.max(0.0) as usize).min(slopes.len().saturating_sub(1)));
    let [lower, upper] = [at((pairs - spread) / 2.0)?, at((pairs + spread) / 2.0 + 1.0)?];
    let excess = f64::from((at((pairs - 1.0) / 2.0)? + at(pairs / 2.0)?) / 2.0);
    let span_s = blocks.last()?.due_s - blocks.first()?.due_s;
    Some(Measured { excess, deviation: f64::from(upper - lower) / 2.0, span_s })
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const RATE_HZ: f64 = 2000.0;

    /// Measures `instants` of a sensor whose period is longer by `excess`, that arrive late by `delay_s` of instant and number.
    fn measure(instants: u32, excess: f64, mut delay_s: impl FnMut(f64) -> f64) -> Clock {
        let mut clock = Clock::new(RATE_HZ);
        for instant in 0..instants {
            let at_s = f64::from(instant) * (1.0 + excess) / RATE_HZ;
            let microseconds = (1e6 * (1.767e9 + at_s + delay_s(at_s))).round();
            clock.arrive(microseconds / 1e6);
        }
        clock
    }

    fn uniform(rng: &mut Xoshiro256PlusPlus) -> f64 {
        f64::from(rng.next_u32()) / 2_f64.powi(32)
    }

    /// Jitter, and a few times a second a hold-up of 5 to 60 ms, after which all that waited comes at once.
    fn held_up(seed: u64) -> impl FnMut(f64) -> f64 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut free_s = 0.0;
        move |at_s| {
            if uniform(&mut rng) < 3.0 / RATE_HZ {
                free_s = at_s + 0.005 + 0.055 * uniform(&mut rng);
            }
            (free_s - at_s).max(0.0) + 1e-4 * uniform(&mut rng)
        }
    }

    #[test]
    fn the_period_is_found_and_its_deviation_is_honest() {
        let (mut worst, mut beyond, mut runs) = (0.0_f64, 0, 0);
        for seed in 0..50 {
            for (excess, instants) in
                [(0.0, 10_000), (2e-3, 10_000), (-0.05, 9000), (54e-6, 40_000)]
            {
                let found = measure(instants, excess, held_up(seed)).measured().unwrap();
                let error = (found.excess - excess).abs();
                worst = worst.max(error);
                beyond += u32::from(error > 3.0 * found.deviation);
                runs += 1;
            }
        }
        assert!(worst < 10e-6, "{:.1} ppm off", worst * 1e6);
        assert!(beyond <= runs / 50, "{beyond} of {runs} beyond three standard deviations");
    }

    #[test]
    fn jitter_alone_leaves_a_ppm() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let found = measure(9000, 1e-4, |_| 1e-4 * uniform(&mut rng)).measured().unwrap();
        assert!((found.excess - 1e-4).abs() < 1e-6 && found.deviation < 2e-6, "{found:?}");
    }

    /// Arrivals that wait for a poll of 1 ms or a tick of 4 ms, with jitter before or after it. In 4.5 s the sensor drifts by two
    /// or three steps, and most pairs of blocks lie on the same step.
    #[test]
    fn a_staircase_is_not_taken_for_a_rate() {
        for (poll_s, before_s, behind_s) in [
            (1e-3, 1e-4, 0.0),
            (1e-3, 0.0, 1e-4),
            (1e-3, 0.0, 1e-5),
            (1e-3, 5e-5, 5e-5),
            (4e-3, 1e-4, 0.0),
            (2.5e-4, 1e-4, 0.0),
        ] {
            let mut worst = 0.0_f64;
            for seed in 0..40 {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                let off = (250.0 + 50.0 * uniform(&mut rng)) * 1e-6;
                let excess = if seed % 2 == 0 { off } else { -off };
                let phase_s = poll_s * uniform(&mut rng);
                let clock = measure(9000, excess, |at_s| {
                    let ready_s = at_s + phase_s + before_s * uniform(&mut rng);
                    (ready_s / poll_s).ceil() * poll_s + behind_s * uniform(&mut rng) - at_s
                });
                let found = clock.measured().unwrap();
                worst = worst.max((found.excess - excess).abs() / found.deviation);
                let rate = clock.rate();
                let error = (rate.rate_hz * (1.0 + excess) / RATE_HZ - 1.0).abs();
                let sure = rate.is_wrong && !rate.is_doubtful;
                assert!(!sure || error < CRYSTAL, "{poll_s} {seed}: {excess:e} {found:?} {rate:?}");
            }
            assert!(
                worst < CONTRADICTS,
                "{poll_s} {before_s} {behind_s}: {worst:.1} deviations off"
            );
        }
    }

    /// The sender falls behind, or the clock is set. Neither is a measurement, nor a reason to doubt the configured rate.
    #[test]
    fn a_sender_that_falls_behind_determines_no_rate() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut behind_s = 0.0;
        let falls = measure(10_000, 0.0, |_| {
            if uniform(&mut rng) < 0.01 {
                behind_s += 0.02 * uniform(&mut rng);
            }
            behind_s
        });
        let set = measure(10_000, 0.0, |at_s| if at_s < 2.0 { 0.0 } else { 0.4 });
        for (clock, is_wrong) in [(falls, true), (set, false)] {
            let rate = clock.rate();
            assert_eq!(
                (rate.is_wrong, rate.is_doubtful, rate.is_refused),
                (is_wrong, false, false)
            );
            assert!((rate.rate_hz / RATE_HZ - 1.0).abs() < 20e-6, "{rate:?}");
        }
    }

    /// The sender shares a processor. For up to three seconds it sends slower than the sensor samples, then it catches up.
    #[test]
    fn a_sender_that_catches_up_is_not_too_fast() {
        for seed in 0..200 {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut clock = Clock::new(RATE_HZ);
            let (mut free_s, mut starved, mut until_s) = (0.0_f64, false, 0.5);
            for run in 0..3 {
                clock.end_run();
                for instant in 0..8192 {
                    let at_s = f64::from(run) * 6.0 + f64::from(instant) / RATE_HZ;
                    let sent_s = free_s.max(at_s);
                    clock.arrive(1.767e9 + sent_s);
                    let periods = if starved { 0.5 + 2.5 * uniform(&mut rng) } else { 0.1 };
                    free_s = sent_s + periods / RATE_HZ;
                    if free_s > until_s {
                        starved = !starved;
                        until_s = free_s + 3.0 * uniform(&mut rng);
                    }
                }
                let rate = clock.rate();
                assert!(!rate.is_refused, "{seed} {run}: {:?} {rate:?}", clock.measured());
                let off = (rate.rate_hz / RATE_HZ - 1.0).abs();
                assert!(off < CRYSTAL, "{seed} {run}: {off:e} {rate:?}");
            }
        }
    }

    #[test]
    fn a_rate_that_changes_is_followed() {
        let mut clock = measure(20_000, 0.0, held_up(2));
        clock.end_run();
        let start_s = 1.767e9 + 20.0;
        let mut delay_s = held_up(3);
        for instant in 0..10_000 {
            let at_s = f64::from(instant) * 1.003 / RATE_HZ;
            clock.arrive(start_s + at_s + delay_s(at_s));
        }
        let found = clock.measured().unwrap();
        assert!((found.excess - 3e-3).abs() < 10e-6, "{found:?}");
        // Without a restart: the whole run disagrees with itself, its newest part does not.
        let found = measure(30_000, 0.0, |at_s| (at_s - 5.0).max(0.0) * 3e-3).measured().unwrap();
        assert!((found.excess - 3e-3).abs() < 10e-6 && found.deviation < CRYSTAL, "{found:?}");
    }

    #[test]
    fn a_clock_that_is_set_back_begins_anew() {
        let mut clock = measure(5000, 1e-3, |at_s| if at_s < 1.0 { 0.0 } else { -3600.0 });
        assert!((clock.measured().unwrap().excess - 1e-3).abs() < 5e-6);
        clock.end_run();
        assert!((clock.measured().unwrap().excess - 1e-3).abs() < 5e-6);
    }

    #[test]
    fn what_is_too_short_for_a_measurement_is_doubtful_if_it_is_off() {
        for (excess, doubtful) in [(0.0, false), (0.01, true), (-0.01, true)] {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
            let rate = measure(300, excess, |_| 3e-4 * uniform(&mut rng)).rate();
            assert_eq!(
                (rate.is_doubtful, rate.is_wrong),
                (doubtful, doubtful),
                "{excess} {rate:?}"
            );
        }
    }
}
