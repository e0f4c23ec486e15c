//! The numbers of a sensor's frames, by its counter and by when they came.
//!
//! A counter tells the number up to whole turns. Without a counter, a turn is a single frame: the frames are counted, and each that was
//! lost is a turn that was missed. In both cases arrivals tell the turns. From where one was missed, no frame comes earlier than a turn
//! after the line so far. A stall does not last: its frames come late, those behind it do not.

use flexid_core::stream::{SET_BACK_S, SILENCE_S, STRAYS_S};

use super::line::{Frame, median};

/// An arrival of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    pub(super) time_s: f64,
    pub(super) counter: u32,
    pub(super) value: [f32; 3],
}

/// The frames of a sensor with their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Numbered {
    /// Frames in the order of their runs, and in each by their numbers.
    pub(super) frames: Vec<Frame>,
    /// The sample of each.
    pub(super) samples: Vec<usize>,
    /// Period by the arrivals of neighbours, s.
    pub(super) period_s: f64,
    /// Scatter of the earliest arrivals over a turn. At 0.29 turns cannot be told.
    pub(super) scatter: f64,
}

/// A stall that lasts longer counts as a loss, s: five times what UDP showed.
const STALL_S: f64 = 0.1;
/// A loss that is taken back within this time was a stall, s.
const LONG_STALL_S: f64 = 2.0;
/// Fewest frames of a stretch whose earliest arrival counts.
const FEWEST: usize = 64;
/// A frame whose counter is so few instants behind is late or doubled.
const RECENT: i64 = 10;

impl Numbered {
    /// Numbers the frames of a sensor whose counter has so many bits; `None`: it has none.
    pub(super) fn of(samples: &[Sample], bits: Option<u32>) -> Self {
        let mut pieces = pieces(samples, bits);
        let Some(mut period_s) = period_s(&pieces) else { return Self::default() };
        let turn = bits.map_or(1, |bits| 1_i64 << bits.clamp(1, 32));
        let mut numbered = Self::default();
        // Lost frames make the first period a little too long, and turns far apart need a better one.
        for _ in 0..2 {
            numbered = Self { period_s, ..Self::default() };
            let mut scatter = Scatter::default();
            for piece in &mut pieces {
                Turns { period_s, turn, has_counter: bits.is_some() }.count(
                    piece,
                    &mut numbered,
                    &mut scatter,
                );
            }
            numbered.scatter = scatter.value();
            let Some(line) = super::line::Line::of(&numbered.frames, period_s) else { break };
            period_s = line.period_s;
        }
        numbered
    }
}

/// A frame before its turns are counted.
#[derive(Clone, Copy, Debug)]
struct Provisional {
    sample: usize,
    number: i64,
    time_s: f64,
}

/// Splits the samples where time does not go on, and numbers them without turns.
fn pieces(samples: &[Sample], bits: Option<u32>) -> Vec<Vec<Provisional>> {
    let mut pieces: Vec<Vec<Provisional>> = Vec::new();
    let mut before_s = f64::NEG_INFINITY;
    for (sample, own) in samples.iter().enumerate() {
        let passed_s = own.time_s - before_s;
        before_s = own.time_s;
        let piece = match pieces.last_mut() {
            Some(piece) if (-SET_BACK_S..=SILENCE_S).contains(&passed_s) => piece,
            _ => {
                pieces.push(Vec::new());
                let Some(piece) = pieces.last_mut() else { continue };
                piece
            }
        };
        let number = match (piece.last(), bits) {
            (None, _) => 0,
            (Some(last), None) => last.number + 1,
            (Some(last), Some(bits)) => {
                let step = step(samples[last.sample].counter, own.counter, bits);
                if step <= 0 && step > -RECENT {
                    // A frame that came twice, or out of order, keeps its number.
                    let number = last.number + step;
                    if piece.iter().rev().take(2 * RECENT as usize).any(|one| one.number == number)
                    {
                        continue;
                    }
                    number
                } else {
                    last.number + step.rem_euclid(1 << bits.clamp(1, 32))
                }
            }
        };
        piece.push(Provisional { sample, number, time_s: own.time_s });
    }
    pieces
}

/// Returns the signed difference of two counters that wrap.
fn step(from: u32, to: u32, bits: u32) -> i64 {
    let span = 1_i64 << bits.clamp(1, 32);
    let difference = (i64::from(to) - i64::from(from)).rem_euclid(span);
    if difference > span / 2 { difference - span } else { difference }
}

/// Returns the period by the arrivals of frames that are some apart.
fn period_s(pieces: &[Vec<Provisional>]) -> Option<f64> {
    let mut all = Vec::new();
    for piece in pieces {
        let pairs = piece.iter().zip(piece.get(FEWEST..).unwrap_or_default());
        all.extend(
            pairs.filter(|(one, other)| other.number > one.number).map(|(one, other)| {
                (other.time_s - one.time_s) / (other.number - one.number) as f64
            }),
        );
    }
    let period_s = median(&mut all);
    (!all.is_empty() && period_s > 0.0).then_some(period_s)
}

/// Counts the turns that frames missed.
struct Turns {
    period_s: f64,
    /// Frames of a turn.
    turn: i64,
    has_counter: bool,
}

/// Mean square of what steps of the envelope are beside whole turns, over a turn.
#[derive(Default)]
struct Scatter {
    squares: f64,
    count: u64,
}

impl Scatter {
    fn note(&mut self, turns: f64) {
        self.squares += (turns - turns.round()).powi(2);
        self.count += 1;
    }

    fn value(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}

impl Turns {
    /// Returns whether a counter goes on by more than the time allows, as where a sensor starts anew.
    fn runs_ahead(&self, before: &Provisional, own: &Provisional) -> bool {
        let counted_s = self.period_s * (own.number - before.number) as f64;
        counted_s > own.time_s - before.time_s + LONG_STALL_S
    }

    /// Puts a piece behind those that were numbered before.
    fn count(&self, piece: &[Provisional], numbered: &mut Numbered, scatter: &mut Scatter) {
        let window = FEWEST.max((STALL_S / self.period_s) as usize);
        let turn_s = self.turn as f64 * self.period_s;
        let late = |own: &Provisional| own.time_s - self.period_s * own.number as f64;
        let lates: Vec<f64> = piece.iter().map(late).collect();
        let ahead = earliest_ahead(&lates, window);
        let mut run = numbered.frames.last().map_or(0, |own| own.run + 1);
        let mut missed = 0;
        // The earliest of the frames before, without the turns that were missed.
        let mut behind = Earliest::default();
        let mut begun = 0;
        // The newest loss, or one that comes: the frame behind it, and the turns.
        let mut newest: Option<(usize, i64)> = None;
        for (index, own) in piece.iter().enumerate() {
            if let Some((_, turns)) = newest.filter(|(at, _)| *at == index) {
                missed += turns;
            }
            let runs_ahead = index.checked_sub(1).and_then(|before| piece.get(before));
            if runs_ahead.is_some_and(|before| self.runs_ahead(before, own)) {
                (run, missed) = (run + 1, 0);
                (behind, begun, newest) = (Earliest::default(), index, None);
            }
            let is_clear = newest.is_none_or(|(at, _)| at < index);
            // Of half a window the earliest says little.
            let is_judged =
                is_clear && index - begun >= window / 2 && piece.len() - index >= window / 2;
            if let Some(least_s) = behind.least().filter(|_| is_judged) {
                let since = |late_s: f64| late_s - missed as f64 * turn_s - least_s;
                // What lasts is that none of those ahead is earlier; what is early is so by itself.
                let (lasting_s, own_s) = (since(ahead[index]), since(lates[index]));
                let step_s = if own_s < 0.0 { own_s } else { lasting_s.max(0.0) };
                let turns = (step_s / turn_s).round();
                let beside_s = step_s - turns * turn_s;
                if index % window == 0 {
                    scatter.note(lasting_s / turn_s);
                }
                // A larger step that is no turn: the counter began anew, or the clock was set.
                let is_turn = !self.has_counter || beside_s.abs() < STRAYS_S;
                let was_stall = newest.filter(|(at, of)| {
                    let passed_s = (index - at) as f64 * self.period_s;
                    (-*of..0).contains(&(turns as i64)) && passed_s < LONG_STALL_S
                });
                if let Some((at, _)) = was_stall {
                    // What seemed a loss was a stall: its frames are left out, and those behind it go on.
                    let left = numbered.frames.len().saturating_sub(index - at);
                    numbered.frames.truncate(left);
                    numbered.samples.truncate(left);
                    missed += turns as i64;
                    (behind, begun, newest) = (Earliest::default(), index, None);
                } else if turns < 0.0 || !is_turn {
                    (run, missed) = (run + 1, 0);
                    (behind, begun, newest) = (Earliest::default(), index, None);
                } else if turns > 0.0 {
                    newest =
                        self.loss(index, &lates, &ahead, window, least_s + missed as f64 * turn_s);
                    if let Some((_, turns)) = newest.filter(|(at, _)| *at == index) {
                        missed += turns;
                    }
                }
            }
            let number = own.number + missed * self.turn;
            // A late frame from before a loss that is taken for one behind it makes nothing earlier.
            let is_near = newest.is_some_and(|(at, _)| index < at + window / 2);
            let floor_s = behind.least().filter(|_| is_near).unwrap_or(f64::NEG_INFINITY);
            behind.push(index, (lates[index] - missed as f64 * turn_s).max(floor_s), window);
            numbered.frames.push(Frame { run, number, time_s: own.time_s });
            numbered.samples.push(own.sample);
        }
        numbered.sort_from(piece.len());
    }

    /// Returns the first frame behind a loss that frames from `index` on show, and the turns. Half a window further on, the earliest shows
    /// whether it lasts. What is earlier by half a turn came before it.
    fn loss(
        &self,
        index: usize,
        lates: &[f64],
        ahead: &[f64],
        window: usize,
        least_s: f64,
    ) -> Option<(usize, i64)> {
        let turn_s = self.turn as f64 * self.period_s;
        let further = (index + window / 2).min(lates.len() - 1);
        let turns = ((ahead[further] - least_s) / turn_s).round();
        let is_before = |late_s: &f64| late_s - least_s < (turns - 0.5) * turn_s;
        let before = lates[index..further].iter().rposition(is_before).map_or(0, |last| last + 1);
        (turns > 0.0).then_some((index + before, turns as i64))
    }
}

impl Numbered {
    /// Brings the newest frames into the order of their numbers.
    fn sort_from(&mut self, newest: usize) {
        let first = self.frames.len().saturating_sub(newest);
        let key = |own: &Frame| (own.run, own.number);
        if self.frames[first..].is_sorted_by_key(key) {
            return;
        }
        let mut both: Vec<(Frame, usize)> =
            self.frames.drain(first..).zip(self.samples.drain(first..)).collect();
        both.sort_by_key(|(own, _)| key(own));
        both.dedup_by_key(|(own, _)| key(own));
        let (frames, samples): (Vec<_>, Vec<_>) = both.into_iter().unzip();
        self.frames.extend(frames);
        self.samples.extend(samples);
    }
}

/// The least of the newest values.
#[derive(Default)]
struct Earliest {
    /// Values that are less than all behind them, with their places.
    rising: std::collections::VecDeque<(usize, f64)>,
}

impl Earliest {
    fn push(&mut self, place: usize, value: f64, window: usize) {
        while self.rising.back().is_some_and(|(_, last)| *last >= value) {
            self.rising.pop_back();
        }
        self.rising.push_back((place, value));
        while self.rising.front().is_some_and(|(first, _)| first + window <= place) {
            self.rising.pop_front();
        }
    }

    fn least(&self) -> Option<f64> {
        self.rising.front().map(|(_, value)| *value)
    }
}

/// Returns the least of each value and those behind it, `window` in all.
fn earliest_ahead(values: &[f64], window: usize) -> Vec<f64> {
    let mut least = Earliest::default();
    let mut all: Vec<f64> = values
        .iter()
        .rev()
        .enumerate()
        .map(|(place, value)| {
            least.push(place, *value, window);
            least.least().unwrap_or(*value)
        })
        .collect();
    all.reverse();
    all
}
