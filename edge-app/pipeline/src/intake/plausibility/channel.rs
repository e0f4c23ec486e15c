//! Checks of one axis of a sensor over time: spikes, a value that never changes, a value that is never exceeded.

/// Samples by which a spike is judged: the sample in the middle, and three neighbours on each side.
const NEAR: usize = 7;
/// Least distance of a spike from its neighbours, in units of their range. Six samples may lie close to each other by chance,
/// so that the recent mean of the range counts if it is larger. Six samples of Gaussian noise range over 2.5 standard
/// deviations on average, so that a spike lies some 25 of them away. No filter passes a single sample of that kind: a filter
/// raises the neighbours with it.
const SPIKE: f32 = 10.0;
/// Samples over which the mean range of the neighbours is taken.
const LATELY: f32 = 256.0;
/// Samples of a window. An axis that has not changed over a window is stuck. A window has thousands of samples, so that a quiet
/// sensor with a coarse step is not judged to be stuck.
pub(super) const WINDOW: u32 = 2048;
/// Samples of a piece, 64 ms at 2 kHz. A sensor rests in a piece if none of its axes moves. A piece is longer than the pause
/// between two teeth.
const PIECE: usize = 128;
/// An axis moves if its values range over more than this many steps. A cut does, the noise of a sensor at rest does not.
const MOVES: f32 = 20.0;
/// Least range of an axis, in steps, at which a flat end can be recognised. Over a smaller range the last step of a sine holds
/// more samples than the rest of `NEAR_END` of the range.
const FINE: f32 = 1000.0;
/// Part of the range that counts as near its end. A sine of 1000 steps has a fifth of the samples of this part in its last
/// step. A clipped signal has more in the last step than in all of the rest.
const NEAR_END: f32 = 0.025;
/// Fewest samples that stay at the end of a range of a flat axis.
const FLAT: u64 = 20;

/// One axis of a sensor.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    /// Smallest step of the signal.
    step: f32,
    /// Newest samples, oldest first.
    recent: [f32; NEAR],
    /// Number of samples since the last interruption.
    seen: u64,
    /// Recent mean of the range of six neighbours.
    usual_range: f32,
    window: Range,
    piece: heapless::Vec<f32, PIECE>,
    /// Value of the axis when the sensor last rested: zero, or the weight of the tool and an offset.
    rest: f32,
}

/// Least and largest value of some samples, and their number.
#[derive(Clone, Copy, Debug)]
struct Range {
    low: f32,
    high: f32,
    samples: u32,
}

/// Largest value of an axis, then of its negative, while its sensor did not rest.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ends([Option<End>; 2]);

/// Largest value, and the numbers of samples at it and near it.
#[derive(Clone, Copy, Debug)]
struct End {
    value: f32,
    /// Number of samples at the value.
    at: u64,
    /// Number of samples at the value that follow another sample at it. A tone whose period is a few samples returns to the
    /// same value, but does not stay there.
    stays: u64,
    /// Number of samples just below the value.
    near: u64,
}

/// Behaviour of an axis in a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Window {
    /// The values range over many steps.
    Moves,
    /// The values range over few steps, or there are too few samples.
    Calm,
    /// All values are equal.
    Stuck,
}

impl Range {
    const EMPTY: Self = Self { low: f32::INFINITY, high: f32::NEG_INFINITY, samples: 0 };

    fn of(values: impl IntoIterator<Item = f32>) -> Self {
        values.into_iter().fold(Self::EMPTY, Self::and)
    }

    fn and(self, value: f32) -> Self {
        let Self { low, high, samples } = self;
        Self { low: low.min(value), high: high.max(value), samples: samples + 1 }
    }

    fn size(&self) -> f32 {
        self.high - self.low
    }
}

impl Channel {
    pub(super) fn new(step: f32) -> Self {
        Self {
            step,
            recent: [0.0; NEAR],
            seen: 0,
            usual_range: 0.0,
            window: Range::EMPTY,
            piece: heapless::Vec::new(),
            rest: 0.0,
        }
    }

    /// Takes a sample. Returns whether the sample three before it is a spike.
    pub(super) fn push(&mut self, value: f32) -> bool {
        self.window = self.window.and(value);
        // There is room: `end_piece` clears a full piece.
        let _ = self.piece.push(value);
        self.recent.rotate_left(1);
        self.recent[NEAR - 1] = value;
        self.seen += 1;
        self.seen >= NEAR as u64 && self.middle_is_spike()
    }

    /// Notes that the next sample does not follow the last: frames are missing, or the sensor has restarted.
    pub(super) fn interrupt(&mut self) {
        self.seen = 0;
    }

    /// Ends the window and returns the behaviour of the axis in it.
    pub(super) fn end_window(&mut self) -> Window {
        let window = std::mem::replace(&mut self.window, Range::EMPTY);
        // A sensor that lost more than half of its frames is not judged.
        if window.samples < WINDOW / 2 {
            Window::Calm
        } else if window.size() == 0.0 {
            Window::Stuck
        } else if window.size() > MOVES * self.step {
            Window::Moves
        } else {
            Window::Calm
        }
    }

    /// Counts the samples of the piece in `ends`. An end near the value at rest does not count, since the signal is flat there,
    /// too.
    fn note_ends(&self, ends: &mut Ends) {
        let Range { low, high, .. } = Range::of(self.piece.iter().copied());
        ends.reach([high, -low]);
        let near = NEAR_END * ends.range();
        for (end, sign) in ends.0.iter_mut().flatten().zip([1.0, -1.0]) {
            if (end.value - sign * self.rest).abs() > MOVES * self.step {
                end.note(self.piece.iter().map(|value| sign * value), near);
            }
        }
    }

    /// Returns the number of samples at the flat ends of `ends`. An end is flat if more samples stay at it than lie just below
    /// it: the sensor cannot read more.
    pub(super) fn flat(&self, ends: &Ends) -> u64 {
        let fine = ends.range() > FINE * self.step;
        let flat = |end: &&End| fine && end.stays >= FLAT && end.stays > end.near;
        ends.0.iter().flatten().filter(flat).map(|end| end.at).sum()
    }

    fn middle_is_spike(&mut self) -> bool {
        let middle = self.recent[NEAR / 2];
        let others = self.recent.iter().enumerate().filter(|(index, _)| *index != NEAR / 2);
        let Range { low, high, .. } = Range::of(others.map(|(_, value)| *value));
        let range = high - low;
        let usual = if self.usual_range == 0.0 { range } else { self.usual_range };
        self.usual_range = usual + (range - usual) / LATELY;
        (middle - high).max(low - middle) > SPIKE * range.max(usual).max(self.step)
    }
}

impl Ends {
    /// Raises the ends to `values`. The counts of an end that rises begin anew.
    fn reach(&mut self, values: [f32; 2]) {
        for (end, value) in self.0.iter_mut().zip(values) {
            if end.is_none_or(|end| value > end.value) {
                *end = Some(End { value, at: 0, stays: 0, near: 0 });
            }
        }
    }

    fn range(&self) -> f32 {
        self.0.iter().flatten().map(|end| end.value).sum()
    }
}

impl End {
    fn note(&mut self, piece: impl Iterator<Item = f32>, near: f32) {
        let mut was_there = false;
        for value in piece {
            let is_there = value == self.value;
            self.at += u64::from(is_there);
            self.stays += u64::from(is_there && was_there);
            self.near += u64::from(!is_there && value > self.value - near);
            was_there = is_there;
        }
    }
}

/// Ends the piece of a sensor's axes if it is full. A piece at rest gives the value of each axis at rest. Any other piece is
/// counted in all sets of `ends`, each of which has one item for each axis.
pub(super) fn end_piece<'a>(axes: &mut [Channel], ends: impl Iterator<Item = &'a mut [Ends]>) {
    if !axes.iter().all(|axis| axis.piece.is_full()) {
        return;
    }
    let range = |axis: &Channel| Range::of(axis.piece.iter().copied());
    if axes.iter().all(|axis| range(axis).size() <= MOVES * axis.step) {
        for axis in &mut *axes {
            let Range { low, high, .. } = range(axis);
            axis.rest = f32::midpoint(low, high);
        }
    } else {
        for ends in ends {
            axes.iter().zip(ends).for_each(|(axis, ends)| axis.note_ends(ends));
        }
    }
    axes.iter_mut().for_each(|axis| axis.piece.clear());
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const STEP: f32 = 0.1;

    /// Returns noise of unit variance, about normal.
    fn noise(rng: &mut Xoshiro256PlusPlus) -> f32 {
        (0..12).map(|_| (rng.next_u32() >> 8) as f32 / (1 << 24) as f32).sum::<f32>() - 6.0
    }

    fn rounded(value: f32) -> f32 {
        (value / STEP).round() * STEP
    }

    /// Returns the numbers of spikes and of flat samples in the signal of a sensor with one axis.
    fn judged(signal: impl Iterator<Item = f32>) -> (usize, u64) {
        let (mut axis, mut ends) = ([Channel::new(STEP)], [Ends::default()]);
        let spikes = signal.filter(|value| {
            let is_spike = axis[0].push(rounded(*value));
            end_piece(&mut axis, [&mut ends[..]].into_iter());
            is_spike
        });
        let spikes = spikes.count();
        (spikes, axis[0].flat(&ends[0]))
    }

    #[test]
    fn noise_and_tones_have_neither_spikes_nor_flats() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        for size in [0.01, 0.05, 0.16, 0.775, 1.0, 100.0] {
            assert_eq!(judged((0..200_000).map(|_| size * noise(&mut rng))), (0, 0), "{size}");
        }
        // The frequencies, radians a sample, go from far below the rate to half of it.
        for turn in [0.001, 0.01, 0.1, 0.7, 1.9, 3.0, 3.13] {
            for size in [1.0, 51.0, 300.0, 3000.0] {
                let tone = |n: u32| size * (turn * f64::from(n)).sin() as f32;
                assert_eq!(judged((0..50_000).map(tone)), (0, 0), "{turn} {size}");
            }
        }
    }

    #[test]
    fn single_samples_far_off_are_spikes_and_steps_are_not() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let signal: Vec<f32> = (0..40_000_u32)
            .map(|n| {
                let cut = if n >= 20_000 { 80.0 * (0.3 * n as f32).sin() + 200.0 } else { 0.0 };
                let glitch = if n % 1000 == 500 { 3000.0 } else { 0.0 };
                cut + glitch + 0.2 * noise(&mut rng)
            })
            .collect();
        assert_eq!(judged(signal.into_iter()).0, 40);
    }

    #[test]
    fn a_signal_that_is_cut_off_is_flat_there() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let signal: Vec<f32> =
            (0..8192_u32).map(|n| 300.0 * (0.05 * n as f32).sin() + noise(&mut rng)).collect();
        assert_eq!(judged(signal.iter().copied()).1, 0);
        let flat = judged(signal.iter().map(|value| value.clamp(-1e3, 250.0))).1;
        let beyond = signal.iter().filter(|value| rounded(**value) >= 250.0).count();
        assert_eq!(flat, beyond as u64);
    }

    /// The sensor is not tared and carries the tool. Its noise is smaller than its step. Its value at rest is its least or its
    /// largest value.
    #[test]
    fn rest_at_an_end_is_not_flat() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let pressing: fn(f32) -> f32 = |n| 150.0 - 150.0 * (0.3 * n).cos();
        let tooth_by_tooth = |n: f32| 400.0 * (0.06 * n).sin().max(0.0);
        for cut in [pressing, tooth_by_tooth] {
            for (rests, sign) in [(300, 1.0), (300, -1.0), (5000, 1.0)] {
                let force = |n: u32| {
                    let cutting = (n % (rests + 5000)).checked_sub(rests);
                    sign * (cutting.map_or(0.0, |n| cut(n as f32)) - 98.1)
                };
                let signal: Vec<f32> =
                    (0..60_000).map(|n| force(n) + 0.09 * STEP * noise(&mut rng)).collect();
                assert_eq!(judged(signal.iter().copied()).1, 0, "{rests} {sign}");
                // An overdriven sensor is still recognised.
                let clamped = signal.iter().map(|value| value.clamp(-110.0, 110.0));
                assert!(judged(clamped).1 > 1000, "{rests} {sign}");
            }
        }
    }

    #[test]
    fn a_window_distinguishes_what_moves_from_what_is_stuck() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let mut window = |size: f32, samples: u32| {
            let mut channel = Channel::new(STEP);
            (0..samples).for_each(|_| {
                channel.push(rounded(size * noise(&mut rng)));
            });
            channel.end_window()
        };
        assert_eq!(window(0.0, WINDOW), Window::Stuck);
        assert_eq!(window(0.0, WINDOW / 2 - 1), Window::Calm);
        assert_eq!(window(0.16, WINDOW), Window::Calm);
        assert_eq!(window(10.0, WINDOW), Window::Moves);
    }
}
