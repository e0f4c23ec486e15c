//! The clock of one sensor: a line through the earliest arrivals of its frames.
//!
//! Frame n of run r is sampled, and arrives later by w, at
//!
//! ```text
//! t = a_r + T n + w        w ≥ 0
//! ```
//!
//! The period T is common to all runs; the offset a_r holds from one pause, restart or set clock to the next. The delay w is large where
//! sender, bus or reader were held up, so that only the earliest arrival of each block of frames counts (Moon, Skelly and Towsley,
//! Estimation and removal of clock skew from network delay measurements, 1999). Blocks that were held up as a whole are left out. What the
//! earliest delay is on average is no part of the line: [`delay`](super::delay) finds it.
//!
//! The noise of a block follows from the differences of neighbours (von Neumann, Distribution of the ratio of the mean square successive
//! difference to the variance, 1941). Where the blocks scatter more about the line than that, the clock wanders: the deviations contain it.

/// A frame in its run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) run: usize,
    /// Number of its instant in the run.
    pub(super) number: i64,
    /// Arrival, s.
    pub(super) time_s: f64,
}

/// The line of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) period_s: f64,
    /// Standard deviation of the period over the period.
    pub(super) drift_std: f64,
    pub(super) runs: Vec<Run>,
    /// Scatter of single blocks about the line that is no noise of arrival: the clock wanders, s.
    pub(super) wander_s: f64,
    /// The same within the blocks of a record, about its own line: the clock bends, s.
    pub(super) bend_s: f64,
    /// Number of frames that came late.
    pub(super) late: u64,
}

/// A run of frames that one count counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Run {
    /// Number of a frame in the middle, and its time, s.
    middle: f64,
    time_s: f64,
    /// Standard deviation of that time, s.
    pub(super) std_s: f64,
    /// Numbers of the first and of the last frame.
    pub(super) first: i64,
    pub(super) last: i64,
}

impl Run {
    /// Number of the instant at a time, s.
    pub(super) fn number(&self, time_s: f64, period_s: f64) -> f64 {
        self.middle + (time_s - self.time_s) / period_s
    }
}

/// Length of a block, s: a record of 4 s has sixteen. A stall of the length of a block is rarer than the pause that ends a run.
const BLOCK_S: f64 = 0.25;
/// Blocks of a record.
const OF_RECORD: usize = 16;
/// Fewest blocks of a line: a mean square of five degrees of freedom beside offset and period.
const FEWEST: usize = 7;
/// Blocks that are late by more than so many deviations were held up as a whole: of an exponential distribution one in 400 is.
const HELD_UP: f64 = 5.0;
/// Rounds in which the blocks that were held up are found.
const ROUNDS: usize = 4;
/// A ratio that is off by more than so many standard deviations is no accident: one in 700.
const SIGNIFICANT: f64 = 3.0;
/// A frame is late beyond so many times the median delay: of exponential delays one in a thousand.
const LATE: f64 = 10.0;
/// Finest resolution of arrivals, s: that of `candump`.
const FINEST_S: f64 = 1e-6;

/// The earliest arrival of a block.
#[derive(Clone, Copy, Debug)]
struct Earliest {
    run: usize,
    number: f64,
    time_s: f64,
}

/// The least squares line of some blocks, and what is left.
struct Fit {
    period_s: f64,
    /// Mean number and time of each run, and its blocks.
    means: Vec<(f64, f64, usize)>,
    /// Sum of squares of the numbers about the means of their runs.
    spread: f64,
}

impl Line {
    /// Fits the line of frames in the order of their runs, whose period is about `period_s`. Returns `None` of too few.
    pub(super) fn of(frames: &[Frame], period_s: f64) -> Option<Self> {
        let block = ((BLOCK_S / period_s) as i64).max(1);
        let resolution_s = resolution(frames);
        let mut period_s = period_s;
        let (mut blocks, mut fit) = (Vec::new(), None);
        // The earliest of a block depends on the period, a little.
        for _ in 0..2 {
            blocks = earliest(frames, block, period_s);
            fit = robust(&mut blocks, period_s, resolution_s);
            period_s = fit.as_ref()?.period_s;
        }
        let fit = fit.filter(|_| blocks.len() >= FEWEST)?;
        let count = blocks.len() as f64;
        let left: Vec<f64> = blocks.iter().map(|own| fit.left(own)).collect();
        let freedom =
            (count - 1.0 - fit.means.iter().filter(|own| own.2 > 0).count() as f64).max(1.0);
        let total = left.iter().map(|own| own * own).sum::<f64>() / freedom;
        let steps = || {
            let pairs = blocks.windows(2).zip(left.windows(2));
            pairs.filter(|(pair, _)| pair[0].run == pair[1].run).map(|(_, own)| own[1] - own[0])
        };
        let successive =
            steps().map(|own| own * own).sum::<f64>() / 2.0 / (steps().count().max(1) as f64);
        let beyond = |total: f64| {
            let is_accident = successive > total * (1.0 - SIGNIFICANT / count.sqrt());
            if is_accident { 0.0 } else { (total - successive).max(0.0) }
        };
        let wander = beyond(total);
        // Of arrivals that are rounded, all blocks may be off by the same.
        let rounding = resolution_s * resolution_s / 12.0;
        let noise = total - wander;
        let span_s = frames.iter().map(|own| own.time_s).fold(f64::NEG_INFINITY, f64::max)
            - frames.iter().map(|own| own.time_s).fold(f64::INFINITY, f64::min);
        // A third of the blocks wander together.
        let slope = (noise + wander * count / 3.0) / fit.spread / (period_s * period_s);
        let drift_std = (slope + 12.0 * rounding / (span_s * span_s)).sqrt();
        let mut runs: Vec<Run> = Vec::new();
        for (&(middle, time_s, count), frames) in
            fit.means.iter().zip(frames.chunk_by(|one, other| one.run == other.run))
        {
            let numbers = || frames.iter().map(|own| own.number);
            let variance = noise / (count.max(1) as f64) + wander + rounding;
            runs.push(Run {
                middle,
                time_s,
                std_s: if count > 0 { variance.sqrt() } else { f64::INFINITY },
                first: numbers().min().unwrap_or_default(),
                last: numbers().max().unwrap_or(-1),
            });
        }
        let mut line = Self {
            period_s,
            drift_std,
            runs,
            wander_s: wander.sqrt(),
            bend_s: beyond(of_records(&blocks, &left)).sqrt(),
            late: 0,
        };
        line.late = line.count_late(frames, resolution_s);
        Some(line)
    }

    /// Time of an instant of a run, s.
    pub(super) fn time_s(&self, run: usize, number: f64) -> f64 {
        self.runs
            .get(run)
            .map_or(f64::NAN, |own| own.time_s + self.period_s * (number - own.middle))
    }

    /// Number of the instant of a run at a time, s.
    pub(super) fn number(&self, run: usize, time_s: f64) -> f64 {
        self.runs.get(run).map_or(f64::NAN, |own| own.number(time_s, self.period_s))
    }

    fn count_late(&self, frames: &[Frame], resolution_s: f64) -> u64 {
        let late = |own: &Frame| own.time_s - self.time_s(own.run, own.number as f64);
        let mut all: Vec<f64> = frames.iter().map(late).collect();
        let limit = LATE * median(&mut all).max(resolution_s);
        all.iter().filter(|own| **own > limit).count() as u64
    }
}

impl Fit {
    /// Time by which a block is later than the line, s.
    fn left(&self, own: &Earliest) -> f64 {
        let (number, time_s, _) = self.means[own.run];
        own.time_s - time_s - self.period_s * (own.number - number)
    }

    fn of(blocks: &[Earliest], runs: usize, about_s: f64) -> Option<Self> {
        let mut means = vec![(0.0, 0.0, 0_usize); runs];
        for own in blocks {
            let (number, time_s, count) = &mut means[own.run];
            (*number, *time_s, *count) = (*number + own.number, *time_s + own.time_s, *count + 1);
        }
        for (number, time_s, count) in &mut means {
            let of = (*count).max(1) as f64;
            (*number, *time_s) = (*number / of, *time_s / of);
        }
        let (mut spread, mut product) = (0.0, 0.0);
        for own in blocks {
            let (number, time_s, _) = means[own.run];
            let number = own.number - number;
            spread += number * number;
            product += number * (own.time_s - time_s - about_s * number);
        }
        (spread > 0.0).then(|| Self { period_s: about_s + product / spread, means, spread })
    }
}

/// Returns the earliest arrival of each block by this period.
fn earliest(frames: &[Frame], block: i64, period_s: f64) -> Vec<Earliest> {
    let mut all: Vec<(Earliest, i64, f64)> = Vec::new();
    for own in frames {
        let (place, late_s) =
            (own.number.div_euclid(block), own.time_s - period_s * own.number as f64);
        let arrival = Earliest { run: own.run, number: own.number as f64, time_s: own.time_s };
        match all.last_mut() {
            Some((last, at, least_s)) if last.run == own.run && *at == place => {
                if late_s < *least_s {
                    (*last, *least_s) = (arrival, late_s);
                }
            }
            _ => all.push((arrival, place, late_s)),
        }
    }
    all.into_iter().map(|(own, ..)| own).collect()
}

/// Fits a line, and takes out the blocks that were held up as a whole.
fn robust(blocks: &mut Vec<Earliest>, about_s: f64, resolution_s: f64) -> Option<Fit> {
    let runs = blocks.last()?.run + 1;
    let all = std::mem::take(blocks);
    blocks.clone_from(&all);
    let mut about_s = median_slope(&all).unwrap_or(about_s);
    let mut fit = None;
    for _ in 0..ROUNDS {
        let own = Fit::of(blocks, runs, about_s)?;
        about_s = own.period_s;
        // By the medians of each run, which blocks that are late do not move.
        let left = |own: &Earliest| own.time_s - about_s * own.number;
        let mut middles = vec![Vec::new(); runs];
        blocks.iter().for_each(|own| middles[own.run].push(left(own)));
        let middles: Vec<f64> = middles.iter_mut().map(|own| median(own)).collect();
        let mut scatter: Vec<f64> =
            blocks.iter().map(|own| (left(own) - middles[own.run]).abs()).collect();
        let limit = HELD_UP * (1.4826 * median(&mut scatter)).max(resolution_s);
        *blocks = all.iter().filter(|own| left(own) - middles[own.run] < limit).copied().collect();
        fit = Fit::of(blocks, runs, about_s);
    }
    fit
}

/// Returns the median slope of blocks that are half of the longest run apart.
fn median_slope(blocks: &[Earliest]) -> Option<f64> {
    let longest = blocks.chunk_by(|a, b| a.run == b.run).map(<[_]>::len).max()?;
    let lag = (longest / 2).max(1);
    let pairs = blocks.iter().zip(blocks.get(lag..)?);
    let mut slopes: Vec<f64> = pairs
        .filter(|(one, other)| one.run == other.run)
        .map(|(one, other)| (other.time_s - one.time_s) / (other.number - one.number))
        .collect();
    (!slopes.is_empty()).then(|| median(&mut slopes))
}

/// Returns the mean square of what is left of the blocks of each record about their own line, s².
fn of_records(blocks: &[Earliest], left: &[f64]) -> f64 {
    let (mut squares, mut freedom) = (0.0, 0.0);
    for (blocks, left) in blocks.chunks_exact(OF_RECORD).zip(left.chunks_exact(OF_RECORD)) {
        if blocks.first().map(|own| own.run) != blocks.last().map(|own| own.run) {
            continue;
        }
        let mean = left.iter().sum::<f64>() / OF_RECORD as f64;
        let place = |index: usize| index as f64 - 0.5 * (OF_RECORD - 1) as f64;
        let spread: f64 = (0..OF_RECORD).map(|index| place(index).powi(2)).sum();
        let slope =
            left.iter().enumerate().map(|(index, own)| place(index) * own).sum::<f64>() / spread;
        let own = left.iter().enumerate().map(|(index, own)| own - mean - slope * place(index));
        squares += own.map(|own| own * own).sum::<f64>();
        freedom += (OF_RECORD - 2) as f64;
    }
    if freedom > 0.0 { squares / freedom } else { 0.0 }
}

/// Returns the power of ten of which nearly all arrivals are multiples, s: what the log rounds to.
fn resolution(frames: &[Frame]) -> f64 {
    const SEEN: usize = 1000;
    let is_of = |unit_s: &f64| {
        let from_s = frames.first().map_or(0.0, |own| own.time_s);
        // Times of a day are known to a thousandth of the finest.
        let is_multiple = |own: &Frame| {
            let times = (own.time_s - from_s) / unit_s;
            (times - times.round()).abs() < 0.01
        };
        frames.iter().take(SEEN).all(is_multiple)
    };
    [1e-2, 1e-3, 1e-4, 1e-5].into_iter().find(is_of).unwrap_or(FINEST_S)
}

/// Returns the middle value, 0 of none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
