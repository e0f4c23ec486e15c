//! Samples whose channels come in several frames.
//!
//! A sample is complete when each of its frames has come once. A frame that comes again before begins a new sample; what came of the other is
//! left out, and counted. Two halves of different samples are never put together:
//!
//! - Where each frame has a counter, those of one sample have the same.
//! - Else the frames of a sample come in a fixed order, and one of them begins it. A sensor sends a sample at once, so that the longest pause is
//!   the one before the first frame: the first [`SHOWN`] samples show it, and are not read. A frame that does not come when it usually does
//!   behind the first one, within half a sampling period, is left out too: two lost frames in a row do not join two samples. Where all pauses
//!   are alike, the frame of the lowest identifier is the first, since it wins the bus. Stamps that are nearer than frames last are those of a
//!   reader that fetches many at once, and show no order.
//! - A sample that follows one without its last frames is held back until the next frame: the last frames may have been late, not lost.

use flexid_core::stream::LATE_S;

use super::map::{Channels, MOST_CHANNELS};
use super::message::Part;

/// Number of samples that show the order of their frames: medians of so many hold although a tenth of the frames is lost or late.
const SHOWN: usize = 64;
/// Two orders are alike if the frames of a sample take the same time in both, within this part of the sampling period.
const ALIKE: f64 = 0.1;

/// No frame of a bus lasts less, s: the arbitration of CAN FD has 30 bits of at least 1 µs, and the data follow.
const SHORTEST_S: f64 = 30e-6;

/// Puts the frames of a sensor together.
#[derive(Clone, Debug)]
pub(super) struct Joining {
    /// Number of frames of a sample.
    parts: usize,
    rule: Rule,
    open: Option<Sample>,
    /// A complete sample, of which the next frame shows whether it is one.
    held: Option<Sample>,
    /// Number of frames that were left out, since another of their sample is missing.
    pub(super) left_out: u64,
}

/// What tells the frames of a sample.
#[derive(Clone, Debug)]
enum Rule {
    /// Each has the sample's counter.
    Counters,
    /// They come in an order that is not known yet. Time, s, and part of those that came.
    Unknown(Vec<(f64, usize)>),
    /// This part comes first, and each so long behind it, s, within so many seconds.
    Order { first: usize, after_s: Vec<f64>, within_s: f64 },
}

/// A sample, as far as it has come.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) channels: Channels,
    pub(super) counter: Option<u32>,
    began_s: f64,
    /// A bit for each part that came.
    came: u32,
    /// True if it began before the one before was complete.
    displaces: bool,
}

impl Joining {
    /// Makes the joining of samples of so many `parts`, of which each has a counter or not.
    pub(super) fn new(parts: usize, are_counted: bool) -> Self {
        let rule = if are_counted { Rule::Counters } else { Rule::Unknown(Vec::new()) };
        Self { parts, rule, open: None, held: None, left_out: 0 }
    }

    /// Takes the payload of a frame that came at `time_s`, s. Returns the sample that it completes, or shows to be one.
    pub(super) fn take(&mut self, time_s: f64, part: &Part, data: &[u8]) -> Option<Sample> {
        let counter = part.count(data);
        let own = 1 << part.number;
        let lacks = |open: &Sample| open.came & own == 0;
        let given = self.judge_held(part.number);
        let goes_on = match &mut self.rule {
            Rule::Unknown(came) => {
                came.push((time_s, part.number));
                if came.len() >= SHOWN * self.parts {
                    let known = order(came, self.parts);
                    self.left_out += if known.is_some() { 0 } else { came.len() as u64 };
                    self.rule = known.unwrap_or(Rule::Unknown(Vec::new()));
                }
                return None;
            }
            Rule::Counters => self.open.as_ref().is_some_and(|open| {
                let is_near = (time_s - open.began_s).abs() <= LATE_S;
                lacks(open) && open.counter == counter && is_near
            }),
            Rule::Order { first, .. } if part.number == *first => false,
            Rule::Order { after_s, within_s, .. } => {
                let due_s = after_s.get(part.number).copied().unwrap_or_default();
                let is_due = |open: &Sample| (time_s - open.began_s - due_s).abs() <= *within_s;
                match &self.open {
                    Some(open) if lacks(open) && is_due(open) => true,
                    // It came twice.
                    Some(open) if is_due(open) => {
                        self.left_out += 1;
                        return given;
                    }
                    _ => {
                        self.left_out += 1;
                        self.leave_out();
                        return given;
                    }
                }
            }
        };
        let displaces = !goes_on && self.leave_out();
        let open = self.open.get_or_insert(Sample {
            channels: [0.0; MOST_CHANNELS],
            counter: None,
            began_s: time_s,
            came: 0,
            displaces,
        });
        part.read(data, &mut open.channels);
        open.counter = open.counter.or(counter);
        open.came |= own;
        if open.came.count_ones() as usize != self.parts {
            return given;
        }
        let complete = self.open.take()?;
        if complete.displaces && matches!(self.rule, Rule::Order { .. }) {
            self.held = Some(complete);
            return given;
        }
        Some(complete)
    }

    /// Returns the sample that was held back, if the part of the next frame begins another one. Where another of its parts comes again, the
    /// one that it took was late.
    fn judge_held(&mut self, next: usize) -> Option<Sample> {
        let held = self.held.take()?;
        if matches!(self.rule, Rule::Order { first, .. } if first == next) {
            return Some(held);
        }
        self.left_out += self.parts as u64;
        None
    }

    /// Leaves out the frames of the sample that is not complete. Returns whether there is one.
    fn leave_out(&mut self) -> bool {
        let open = self.open.take();
        self.left_out += open.as_ref().map_or(0, |open| u64::from(open.came.count_ones()));
        open.is_some()
    }
}

/// Returns the order of the frames that `came`: time, s, and part of each. `None` if fewer than half of the samples are whole, since a part hardly
/// comes, and if the frames of a sample have the stamps of a reader.
fn order(came: &[(f64, usize)], parts: usize) -> Option<Rule> {
    let takes_s = |first| {
        let spans_s = spans_s(came, first, parts).map(|of_parts| largest(&of_parts));
        let spans_s: Vec<f64> = spans_s.collect();
        if 2 * spans_s.len() < SHOWN { None } else { median(spans_s) }
    };
    let takes_s: Vec<f64> = (0..parts).map(takes_s).collect::<Option<_>>()?;
    let times_s: Vec<f64> =
        came.iter().filter(|(_, part)| *part == 0).map(|(time_s, _)| *time_s).collect();
    let period_s = median(times_s.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
    let least_s = takes_s.iter().copied().fold(f64::INFINITY, f64::min);
    if least_s < SHORTEST_S * (parts - 1) as f64 {
        return None;
    }
    let first = takes_s.iter().position(|own| *own <= least_s + ALIKE * period_s)?;
    let of_part = |part| {
        median(spans_s(came, first, parts).filter_map(|own| own.get(part).copied()).collect())
    };
    let after_s = (0..parts).map(of_part).collect::<Option<_>>()?;
    Some(Rule::Order { first, after_s, within_s: 0.5 * period_s })
}

/// Returns the times from each frame of the part `first` to each part, before it comes again, s.
fn spans_s(
    came: &[(f64, usize)],
    first: usize,
    parts: usize,
) -> impl Iterator<Item = Vec<f64>> + '_ {
    let begins = came.iter().enumerate().filter(move |(_, (_, part))| *part == first);
    begins.filter_map(move |(at, (began_s, _))| {
        let own = came.get(at..at + parts)?;
        let after_s = |part| {
            let of_part = own.iter().find(|(_, own)| *own == part);
            of_part.map(|(time_s, _)| time_s - began_s)
        };
        (0..parts).map(after_s).collect()
    })
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Passes frames, time in ms and part with a count, and returns the counts of each whole sample, by part.
    fn joined(joining: &mut Joining, frames: &[(f64, usize, u32)]) -> Vec<[u32; 2]> {
        let take = |&(ms, number, count): &(f64, usize, u32)| {
            let part = part(number, matches!(joining.rule, Rule::Counters));
            let sample = joining.take(1e-3 * ms, &part, &count.to_le_bytes())?;
            Some([sample.channels[0] as u32, sample.channels[1] as u32])
        };
        frames.iter().filter_map(take).collect()
    }

    fn part(number: usize, is_counted: bool) -> Part {
        use flexid_wire::bits::{ByteOrder, Number, Signal};
        let count = Signal {
            start_bit: 0,
            length: 32,
            byte_order: ByteOrder::Intel,
            number: Number::Unsigned,
            scale: 1.0,
            offset: 0.0,
        };
        let counter = is_counted.then_some(count);
        Part { sensor: 0, number, counter, channels: vec![(number, count)] }
    }

    /// The frames of so many samples a millisecond apart: part 0 after `delays_ms[0]`, part 1 after `delays_ms[1]`.
    fn samples(begin: u32, number: u32, delays_ms: [f64; 2]) -> Vec<(f64, usize, u32)> {
        let of = |n: u32| [0, 1].map(|part| (f64::from(n) + delays_ms[part], part, n));
        let mut frames: Vec<_> = (begin..begin + number).flat_map(of).collect();
        frames.sort_by(|one, other| one.0.total_cmp(&other.0));
        frames
    }

    #[test]
    fn the_pauses_show_the_first_frame_wherever_the_log_begins() {
        for delays_ms in [[0.0, 0.13], [0.13, 0.0], [0.0, 0.4], [0.4, 0.0]] {
            for begin in 0..2 {
                let frames = &samples(0, 200, delays_ms)[begin..];
                let mut joining = Joining::new(2, false);
                let all = joined(&mut joining, frames);
                assert!(all.len() >= 135 && all.iter().all(|[one, other]| one == other));
                assert!(joining.left_out <= 1);
            }
        }
    }

    #[test]
    fn no_loss_joins_two_samples() {
        for delays_ms in [[0.0, 0.13], [0.13, 0.0]] {
            for is_counted in [false, true] {
                let mut joining = Joining::new(2, is_counted);
                joined(&mut joining, &samples(0, 64, delays_ms));
                let (mut all, mut came, mut random) = (Vec::new(), 0, 1_u32);
                for n in 64..4000 {
                    // A third of the frames is lost.
                    let frames = samples(n, 1, delays_ms).into_iter().filter(|_| {
                        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                        random >> 16 >= 21_845
                    });
                    let frames: Vec<_> = frames.collect();
                    came += frames.len();
                    all.extend(joined(&mut joining, &frames));
                }
                assert!(all.len() > 1600 && all.iter().all(|[one, other]| one == other));
                let open = joining.open.as_ref().map_or(0, |own| own.came.count_ones() as usize);
                let held = if joining.held.is_some() { 2 } else { 0 };
                assert_eq!(2 * all.len() + joining.left_out as usize + open + held, came);
            }
        }
    }

    #[test]
    fn where_the_pauses_are_alike_the_lower_identifier_is_the_first() {
        let mut joining = Joining::new(2, false);
        let all = joined(&mut joining, &samples(0, 100, [0.5, 0.0])[1..]);
        assert!(all.iter().all(|[one, other]| one + 1 == *other), "{all:?}");
    }

    /// The stamps of a reader that polls every 4 ms: frames of four samples are 12 µs apart.
    #[test]
    fn stamps_of_a_reader_show_no_order() {
        for delays_ms in [[0.0, 0.13], [0.13, 0.0]] {
            let frames = samples(0, 400, delays_ms).into_iter().scan((0.0, 0.0), |state, frame| {
                let poll_ms = (frame.0 / 4.0).ceil() * 4.0;
                *state =
                    if state.0 == poll_ms { (poll_ms, state.1 + 0.012) } else { (poll_ms, 0.0) };
                Some((poll_ms + state.1, frame.1, frame.2))
            });
            let mut joining = Joining::new(2, false);
            assert!(joined(&mut joining, &frames.collect::<Vec<_>>()).is_empty());
            assert!(joining.left_out >= 700);
        }
    }

    /// The second frame of sample 70 comes behind the first of sample 71.
    #[test]
    fn a_late_frame_joins_no_other_sample() {
        let mut frames = samples(0, 100, [0.0, 0.13]);
        let late = frames.iter().position(|frame| frame.1 == 1 && frame.2 == 70).unwrap();
        frames[late].0 = 71.05;
        frames.swap(late, late + 1);
        let mut joining = Joining::new(2, false);
        let all = joined(&mut joining, &frames);
        assert!(all.iter().all(|[one, other]| one == other), "{all:?}");
        assert_eq!((all.len(), joining.left_out), (34, 4));
    }

    #[test]
    fn a_frame_that_comes_twice_costs_no_sample() {
        let mut frames = samples(0, 100, [0.0, 0.13]);
        let twice = frames.iter().position(|frame| frame.1 == 1 && frame.2 == 70).unwrap();
        frames.insert(twice, frames[twice]);
        let mut joining = Joining::new(2, false);
        assert_eq!((joined(&mut joining, &frames).len(), joining.left_out), (36, 1));
    }

    #[test]
    fn a_part_that_hardly_comes_makes_no_sample() {
        let mut joining = Joining::new(2, false);
        let frame = |n: u32| (f64::from(n), usize::from(n.is_multiple_of(50)), n);
        let frames: Vec<_> = (0..1000).map(frame).collect();
        assert!(joined(&mut joining, &frames).is_empty());
        assert_eq!(joining.left_out, 1000 / 128 * 128);
    }
}
