//! The instants of rows: their counters, and their times on one clock.
//!
//! The number of the row is the counter. Where the time says that rows are missing, the counter goes on by as many. Where the time begins anew, makes
//! a long pause, or the line of names came again, another cut begins: its times follow behind a pause, since the robot may have moved.

use flexid_core::stream::{LONG_SILENCE_S, SET_BACK_S};

use super::rates::{DIFFERS, two_rates};
use super::row::Row;

/// Pause between two cuts, s: longer than the one after which the stream forgets the joint angles.
const PAUSE_S: f64 = LONG_SILENCE_S + 1.0;
/// Longest time between two rows in which none is missing, in sampling periods, or in steps of the time where these are longer: programs may
/// write milliseconds.
const NEXT: f64 = 1.5;
/// Rows over which a rate is compared with that of the rows before. Times that are off by a period change it by less than two per cent.
const COMPARED: u32 = 64;
/// Rows in a row before each of which some are missing that show another rate. At the most missing rows that are used, one in ten
/// (`SHARE` in `intake/obstacle.rs`), this happens once in a hundred million rows.
const SPARSE: u32 = 8;

/// How the times of a table go on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pace {
    /// Sampling period, s.
    pub(super) period_s: f64,
    /// Smallest step of the time, s, or the period where that is longer.
    step_s: f64,
}

/// An instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instant {
    pub(super) counter: u32,
    /// Time of the source, s. It never goes back.
    pub(super) time_s: f64,
    /// Number of the cut, from 0, if this is its first instant.
    pub(super) begins: Option<usize>,
}

/// The clock of a table.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    /// `None` if the rows are arrivals, whose clocks are told later.
    pace: Option<Pace>,
    newest: Option<Newest>,
    /// Number of cuts so far.
    cuts: usize,
    /// Time by which those of the source are later than those of the table, s.
    offset_s: f64,
}

/// The newest row.
#[derive(Clone, Copy, Debug)]
struct Newest {
    instant: Instant,
    /// Time of the table, s.
    time_s: f64,
    /// The same of the cut's first row.
    first_s: f64,
    /// Time of the table of the row from which on the rate is compared, s, and number of rows since.
    compared: (f64, u32),
    /// Number of rows in a row before each of which some are missing.
    sparse: u32,
}

impl Clock {
    pub(super) fn new(pace: Pace) -> Self {
        Self { pace: Some(pace), newest: None, cuts: 0, offset_s: 0.0 }
    }

    /// The clock of rows that hold one sensor each, at the time of its arrival.
    pub(super) fn of_arrivals() -> Self {
        Self { pace: None, newest: None, cuts: 0, offset_s: 0.0 }
    }

    /// Returns the number of cuts so far.
    pub(super) fn cuts(&self) -> usize {
        self.cuts
    }

    /// Returns the instant of the next row.
    ///
    /// # Errors
    /// The time goes back, or comes at another rate.
    pub(super) fn next(&mut self, row: &Row) -> Result<Instant, String> {
        let Some(newest) = self.newest else { return Ok(self.begin(row)) };
        let Some(Pace { period_s, step_s }) = self.pace else {
            return Ok(self.arrive(row, newest));
        };
        let time_s = row.time_s.unwrap_or(newest.time_s + period_s);
        let passed_s = time_s - newest.time_s;
        let is_anew = passed_s < 0.0 && time_s <= newest.first_s + NEXT * step_s;
        if row.begins || is_anew || passed_s > PAUSE_S {
            return Ok(self.begin(row));
        }
        if passed_s < 0.0 {
            return Err(format!(
                "the time goes back from {} to {time_s} s, and not to its begin: sort the rows, or write each cut into a table of its own",
                newest.time_s
            ));
        }
        let steps = if passed_s < NEXT * step_s { 1.0 } else { (passed_s / period_s).round() };
        let is_next = steps == 1.0;
        let (since_s, rows) = newest.compared;
        let rows = rows.saturating_add(1);
        let sparse = if is_next { 0 } else { newest.sparse + 1 };
        let mean_s = (time_s - since_s) / f64::from(rows);
        let compared = COMPARED.saturating_mul((step_s / period_s).ceil() as u32);
        let is_other = is_next && rows >= compared && (mean_s / period_s - 1.0).abs() > DIFFERS;
        if sparse == SPARSE || is_other {
            let own_s = if is_other { mean_s } else { passed_s };
            return Err(two_rates(1.0 / period_s, 1.0 / own_s));
        }
        let instant = Instant {
            // A counter wraps.
            counter: newest.instant.counter.wrapping_add(steps as u32),
            time_s: time_s + self.offset_s,
            begins: None,
        };
        let compared = if is_next && rows < compared { (since_s, rows) } else { (time_s, 0) };
        self.newest = Some(Newest { instant, time_s, compared, sparse, ..newest });
        Ok(instant)
    }

    /// Returns the instant of an arrival.
    fn arrive(&mut self, row: &Row, newest: Newest) -> Instant {
        let time_s = row.time_s.unwrap_or(newest.time_s);
        let passed_s = time_s - newest.time_s;
        if row.begins || !(-SET_BACK_S..=PAUSE_S).contains(&passed_s) {
            return self.begin(row);
        }
        // Messages that are out of order are late.
        let time_s = time_s.max(newest.time_s);
        let counter = newest.instant.counter.wrapping_add(1);
        let instant = Instant { counter, time_s: time_s + self.offset_s, begins: None };
        self.newest = Some(Newest { instant, time_s, ..newest });
        instant
    }

    /// Begins a cut with its first row.
    fn begin(&mut self, row: &Row) -> Instant {
        let first_s = row.time_s.unwrap_or_default();
        let (counter, time_s) = match self.newest {
            // A counter that goes on would say that nothing lies between.
            Some(Newest { instant, .. }) => {
                self.offset_s = instant.time_s + PAUSE_S - first_s;
                (instant.counter.wrapping_add(1 << 24), instant.time_s + PAUSE_S)
            }
            None => (0, first_s),
        };
        let instant = Instant { counter, time_s, begins: Some(self.cuts) };
        self.cuts += 1;
        self.newest =
            Some(Newest { instant, time_s: first_s, first_s, compared: (first_s, 0), sparse: 0 });
        instant
    }
}

impl Pace {
    /// The pace of rows without times.
    pub(super) fn even(period_s: f64) -> Self {
        Self { period_s, step_s: period_s }
    }

    /// Returns the pace of rows. The period is the median over pairs of rows that are far apart, so that neither the digits of the time nor a row
    /// that is missing changes it. Where the rate changes, the pairs are those like the first two that agree. Returns `None` without times, and if
    /// they do not go on.
    pub(super) fn of<'a>(rows: impl Iterator<Item = &'a Row>) -> Option<Self> {
        let times: Vec<f64> = rows.map_while(|row| row.time_s).collect();
        let is_onward = |step: &f64| *step > 0.0;
        let apart = (times.len() / 8).max(1);
        let pairs = times.iter().zip(times.get(apart..)?).step_by(apart.div_ceil(4));
        let periods = pairs.map(|(earlier, later)| (later - earlier) / apart as f64);
        // Not across two cuts.
        let mut periods: Vec<f64> = periods.filter(is_onward).collect();
        let mut period_s = median(&periods)?;
        let are_alike = |one: f64, other: f64| (other / one - 1.0).abs() < DIFFERS;
        if !periods.iter().all(|own| are_alike(period_s, *own)) {
            // Pairs behind each other do not overlap.
            let agreed = periods.windows(5).find(|own| are_alike(own[0], own[4])).map(|own| own[0]);
            periods.retain(|own| agreed.is_none_or(|agreed| are_alike(agreed, *own)));
            period_s = median(&periods)?;
        }
        let steps = times.windows(2).map(|pair| pair[1] - pair[0]).filter(is_onward);
        let step_s = steps.fold(f64::INFINITY, f64::min).max(period_s);
        Some(Self { period_s, step_s })
    }
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 5e-4;

    fn row(time_s: f64) -> Row {
        let (axes, joints) = ([0.0; 6], heapless::Vec::new());
        Row { line: 1, begins: false, time_s: Some(time_s), axes, joints }
    }

    /// The counters of rows of these times, or the error.
    fn counters(times: impl IntoIterator<Item = f64>) -> Result<Vec<u32>, String> {
        let mut clock = Clock::new(Pace::even(PERIOD_S));
        times.into_iter().map(|time_s| Ok(clock.next(&row(time_s))?.counter)).collect()
    }

    fn evenly(rows: u32) -> impl Iterator<Item = f64> {
        (0..rows).map(|row| f64::from(row) * PERIOD_S)
    }

    #[test]
    fn the_number_of_the_row_is_the_counter_and_missing_rows_count() {
        assert_eq!(counters(evenly(200)).unwrap().last(), Some(&199));
        let missing = evenly(200).enumerate().filter(|(row, _)| !(50..60).contains(row));
        assert_eq!(counters(missing.map(|(_, time)| time)).unwrap().last(), Some(&199));
    }

    /// The pace is that of the first quarter of the rows, wherever the rate changes later and although rows are missing.
    #[test]
    fn the_pace_is_that_before_another_rate() {
        for at in [1000, 2000, 3000] {
            let time = |row: u32| f64::from(row.min(at) + 2 * row.saturating_sub(at)) * PERIOD_S;
            let missing = |row: &u32| !(10..20).contains(row);
            let rows: Vec<_> = (0..4000).filter(missing).map(|at| row(time(at))).collect();
            let pace = Pace::of(rows.iter()).unwrap();
            assert!((pace.period_s / PERIOD_S - 1.0).abs() < 1e-9, "{at}: {pace:?}");
        }
        // Every twelfth row is missing in that quarter.
        let is_there = |row: &u32| *row >= 1000 || row % 12 != 5;
        let rows: Vec<_> =
            (0..4000).filter(is_there).map(|at| row(f64::from(at) * PERIOD_S)).collect();
        assert!((Pace::of(rows.iter()).unwrap().period_s / PERIOD_S - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_time_of_few_digits_hides_no_row() {
        for digits in [2, 3, 4] {
            let scale = 10_f64.powi(digits);
            let rows: Vec<_> =
                evenly(2000).map(|time| row((time * scale).floor() / scale)).collect();
            let mut clock = Clock::new(Pace::of(rows.iter()).unwrap());
            let instants = rows.iter().map(|row| clock.next(row).unwrap());
            assert_eq!(instants.last().unwrap().counter, 1999, "{digits}");
        }
    }

    #[test]
    fn where_the_time_begins_anew_a_cut_begins() {
        let mut clock = Clock::new(Pace::even(PERIOD_S));
        let twice = evenly(20).chain(evenly(20));
        let instants: Vec<_> = twice.map(|time_s| clock.next(&row(time_s)).unwrap()).collect();
        let begins: Vec<_> = instants.iter().filter_map(|instant| instant.begins).collect();
        assert_eq!(begins, [0, 1]);
        assert!(instants.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
        assert!(instants[20].time_s - instants[19].time_s > 10.0);
        assert!(instants[20].counter - instants[19].counter > 1000);
    }

    #[test]
    fn a_time_that_goes_back_and_another_rate_are_errors() {
        let back = evenly(20).chain([5.0 * PERIOD_S]);
        assert!(
            counters(back).unwrap_err().starts_with("the time goes back from 0.0095 to 0.0025 s")
        );
        for (factor, hz) in [(2.0, "1000.0"), (0.5, "4000.0"), (1.25, "1600.0"), (3.0, "666.7")] {
            let end_s = 200.0 * PERIOD_S;
            let other = evenly(200).skip(1).map(|time| end_s + factor * time);
            let error = counters(evenly(201).chain(other)).unwrap_err();
            // The rows that are compared may have begun before.
            assert!(error.contains("and what is before at 2000.0 Hz"), "{hz}: {error}");
        }
        let missing = evenly(2000).enumerate().filter(|(row, _)| row % 10 != 0);
        assert!(counters(missing.map(|(_, time)| time)).is_ok());
    }

    #[test]
    fn the_period_is_that_of_most_rows() {
        let of = |times: Vec<f64>| {
            let rows: Vec<_> = times.into_iter().map(row).collect();
            Pace::of(rows.iter()).map(|pace| pace.period_s)
        };
        let is_right = |times: Vec<f64>, off: f64| {
            let period = of(times).unwrap();
            assert!((period / PERIOD_S - 1.0).abs() < off, "{period}");
        };
        is_right(evenly(20_000).collect(), 1e-9);
        is_right(evenly(20_000).map(|time| (time * 1e3).round() / 1e3).collect(), 1e-3);
        is_right(evenly(20_000).filter(|time| !(3.0..3.1).contains(time)).collect(), 1e-9);
        is_right(evenly(3000).chain(evenly(3000)).chain(evenly(3000)).collect(), 1e-9);
        is_right(evenly(2).collect(), 1e-9);
        assert_eq!(of(vec![1.0]), None);
        assert_eq!(of(vec![1.0; 50]), None);
    }
}
