//! Samples whose channels come in several frames.
//!
//! A sample is complete when each of its frames has come once. A frame that comes again before begins a new sample; what came of the other is
//! left out, and counted. Two halves of different samples are never put together:
//!
//! - Where each frame has a counter, those of one sample have the same.
//! - Else the frames of a sample come in a fixed order, and one of them begins it. A sensor sends a sample at once, so that the longest pause is
//!   the one before the first frame: the first [`SHOWN`] samples show it, and are not read. A frame that does not follow the first one within the
//!   time that it takes usually, and half a sampling period, is left out too: two lost frames in a row do not join two samples. Where all pauses
//!   are alike, the frame of the lowest identifier is the first, since it wins the bus.

use super::map::{Channels, MOST_CHANNELS};
use super::message::Part;

/// Number of samples that show the order of their frames: medians of so many hold although a tenth of the frames is lost or late.
const SHOWN: usize = 64;
/// Two orders are alike if the frames of a sample take the same time in both, within this part of the sampling period.
const ALIKE: f64 = 0.1;

/// Puts the frames of a sensor together.
#[derive(Clone, Debug)]
pub(super) struct Joining {
    /// Number of frames of a sample.
    parts: usize,
    rule: Rule,
    open: Option<Sample>,
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
    /// This part comes first, and the others within so many seconds.
    Order { first: usize, within_s: f64 },
}

/// A sample, as far as it has come.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) channels: Channels,
    pub(super) counter: Option<u32>,
    began_s: f64,
    /// A bit for each part that came.
    came: u32,
}

impl Joining {
    /// Makes the joining of samples of so many `parts`, of which each has a counter or not.
    pub(super) fn new(parts: usize, are_counted: bool) -> Self {
        let rule = if are_counted { Rule::Counters } else { Rule::Unknown(Vec::new()) };
        Self { parts, rule, open: None, left_out: 0 }
    }

    /// Takes the payload of a frame that came at `time_s`, s. Returns the sample that it completes.
    pub(super) fn take(&mut self, time_s: f64, part: &Part, data: &[u8]) -> Option<Sample> {
        let counter = part.count(data);
        let own = 1 << part.number;
        let lacks = |open: &Sample| open.came & own == 0;
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
            Rule::Counters => {
                self.open.as_ref().is_some_and(|open| lacks(open) && open.counter == counter)
            }
            Rule::Order { first, .. } if part.number == *first => false,
            Rule::Order { within_s, .. } => {
                let is_soon = |open: &Sample| (time_s - open.began_s).abs() <= *within_s;
                let goes_on = self.open.as_ref().is_some_and(|open| lacks(open) && is_soon(open));
                if !goes_on {
                    self.left_out += 1;
                    self.leave_out();
                    return None;
                }
                true
            }
        };
        if !goes_on {
            self.leave_out();
        }
        let open = self.open.get_or_insert(Sample {
            channels: [0.0; MOST_CHANNELS],
            counter: None,
            began_s: time_s,
            came: 0,
        });
        part.read(data, &mut open.channels);
        open.counter = open.counter.or(counter);
        open.came |= own;
        if open.came.count_ones() as usize == self.parts { self.open.take() } else { None }
    }

    /// Leaves out the frames of the sample that is not complete.
    fn leave_out(&mut self) {
        self.left_out += self.open.take().map_or(0, |open| open.came.count_ones().into());
    }
}

/// Returns the order of the frames that `came`: time, s, and part of each. `None` if fewer than half of the samples are whole: a part hardly comes.
fn order(came: &[(f64, usize)], parts: usize) -> Option<Rule> {
    let takes_s = |first| {
        let spans_s = spans_s(came, first, parts);
        if 2 * spans_s.len() < SHOWN { None } else { median(spans_s) }
    };
    let takes_s: Vec<f64> = (0..parts).map(takes_s).collect::<Option<_>>()?;
    let times_s: Vec<f64> =
        came.iter().filter(|(_, part)| *part == 0).map(|(time_s, _)| *time_s).collect();
    let period_s = median(times_s.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
    let least_s = takes_s.iter().copied().fold(f64::INFINITY, f64::min);
    let first = takes_s.iter().position(|own| *own <= least_s + ALIKE * period_s)?;
    Some(Rule::Order { first, within_s: takes_s[first] + 0.5 * period_s })
}

/// Returns the times from each frame of the part `first` until all others have come, before it comes again, s.
fn spans_s(came: &[(f64, usize)], first: usize, parts: usize) -> Vec<f64> {
    let begins = came.iter().enumerate().filter(|(_, (_, part))| *part == first);
    let span_s = |(at, (began_s, _)): (usize, &(f64, usize))| {
        let others = came.get(at + 1..at + parts)?;
        let is_whole = (0..parts)
            .filter(|part| *part != first)
            .all(|part| others.iter().any(|(_, own)| *own == part));
        is_whole.then(|| others.last().map(|(time_s, _)| time_s - began_s))?
    };
    begins.filter_map(span_s).collect()
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
                assert!((came - 2 * all.len() - joining.left_out as usize) <= 1);
            }
        }
    }

    #[test]
    fn where_the_pauses_are_alike_the_lower_identifier_is_the_first() {
        let mut joining = Joining::new(2, false);
        let all = joined(&mut joining, &samples(0, 100, [0.5, 0.0])[1..]);
        assert!(all.iter().all(|[one, other]| one + 1 == *other), "{all:?}");
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
