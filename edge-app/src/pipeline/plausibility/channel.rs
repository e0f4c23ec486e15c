//! What one axis of a sensor looks like over time: spikes, a value that never changes, a value that nothing exceeds.

/// Samples that a spike is judged by: itself in the middle, and three neighbours on each side.
const NEAR: usize = 7;
/// A spike lies beyond its neighbours by more than this many times the range of those, and of such as came lately: six samples may
/// be close to each other by chance. Six samples of Gaussian noise range over
/// 2.5 standard deviations on average, so it lies some 25 of them away, and what a filter passes has no such sample: the
/// neighbours have their part in it.
const SPIKE: f32 = 10.0;
/// Samples over which the range of neighbours is averaged.
const LATELY: f32 = 256.0;
/// Samples after which an axis that has not changed is judged: thousands, so that a quiet sensor with a coarse step is not.
const WINDOW: u32 = 2048;
/// An axis moves if its values in a window range over more than this many steps: a cut, not the noise of a sensor at rest.
const MOVES: f32 = 20.0;
/// A signal can be seen to be flat at its end if its values range over this many steps. With fewer, the crests of a sine share
/// the last step with more than `NEAR_END` of the range holds beside it.
const FINE: f32 = 1000.0;
/// This part of the range counts as near its end. A sine of 1000 steps has a fifth of that in its last step; a clipped signal has
/// more in the last step than in all of the rest.
const NEAR_END: f32 = 0.025;
/// Fewest samples at the end of a range that are called flat.
const FLAT: u64 = 20;

/// One axis of a sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channel {
    /// Smallest step of its signal.
    step: f32,
    /// The newest samples, oldest first.
    recent: [f32; NEAR],
    /// Samples since the last interruption.
    seen: u64,
    /// Mean range of six neighbours lately.
    usual_range: f32,
    window: Range,
    ends: [End; 2],
}

/// Least and largest value.
#[derive(Clone, Copy, Debug)]
struct Range {
    low: f32,
    high: f32,
    samples: u32,
}

/// The largest value so far (of the signal, or of its negative), and how often the signal was there.
#[derive(Clone, Copy, Debug)]
struct End {
    value: f32,
    /// Samples at the value, and of these the ones that follow another such: a tone whose period is a few samples comes back to
    /// the same value, but does not stay.
    at: u64,
    stays: u64,
    /// Samples just inside.
    near: u64,
    was_there: bool,
}

/// How an axis did in a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Window {
    /// Its values range over many steps.
    Moves,
    /// Its values range over few steps, or it has too few samples.
    Calm,
    /// All its values are equal.
    Stuck,
}

impl Range {
    const EMPTY: Self = Self { low: f32::INFINITY, high: f32::NEG_INFINITY, samples: 0 };
}

impl Channel {
    pub(super) fn new(step: f32) -> Self {
        let value = f32::NEG_INFINITY;
        let end = End { value, at: 0, stays: 0, near: 0, was_there: false };
        Self {
            step,
            recent: [0.0; NEAR],
            seen: 0,
            usual_range: 0.0,
            window: Range::EMPTY,
            ends: [end; 2],
        }
    }

    /// Takes a sample; whether the one three samples before it is a spike.
    pub(super) fn push(&mut self, value: f32) -> bool {
        let Range { low, high, samples } = &mut self.window;
        (*low, *high, *samples) = (low.min(value), high.max(value), *samples + 1);
        let range = self.ends[0].value + self.ends[1].value;
        for (end, value) in self.ends.iter_mut().zip([value, -value]) {
            end.take(value, NEAR_END * range);
        }
        self.recent.rotate_left(1);
        self.recent[NEAR - 1] = value;
        self.seen += 1;
        self.seen >= NEAR as u64 && self.middle_is_spike()
    }

    /// The next sample does not follow the last: frames are missing, or the sensor started anew.
    pub(super) fn interrupt(&mut self) {
        self.seen = 0;
    }

    /// How it did since it was last asked.
    pub(super) fn end_window(&mut self) -> Window {
        let Range { low, high, samples } = std::mem::replace(&mut self.window, Range::EMPTY);
        // A sensor that lost half its frames is not judged.
        if samples < WINDOW / 2 {
            Window::Calm
        } else if high == low {
            Window::Stuck
        } else if high - low > MOVES * self.step {
            Window::Moves
        } else {
            Window::Calm
        }
    }

    /// Samples at the largest or the least value of all, where more of them are there than just inside: the sensor cannot read
    /// more.
    pub(super) fn flat(&self) -> u64 {
        let [top, bottom] = &self.ends;
        let fine = top.value + bottom.value > FINE * self.step;
        // At rest a force is zero, and that may be the least of all.
        let off_zero = |end: &End| end.value.abs() > MOVES * self.step;
        let flat = |end: &&End| fine && off_zero(end) && end.stays >= FLAT && end.stays > end.near;
        self.ends.iter().filter(flat).map(|end| end.at).sum()
    }

    fn middle_is_spike(&mut self) -> bool {
        let middle = self.recent[NEAR / 2];
        let neighbours = || {
            let others = self.recent.iter().enumerate().filter(|(index, _)| *index != NEAR / 2);
            others.map(|(_, value)| *value)
        };
        let low = neighbours().fold(f32::INFINITY, f32::min);
        let high = neighbours().fold(f32::NEG_INFINITY, f32::max);
        let range = high - low;
        let usual = if self.usual_range == 0.0 { range } else { self.usual_range };
        self.usual_range = usual + (range - usual) / LATELY;
        (middle - high).max(low - middle) > SPIKE * range.max(usual).max(self.step)
    }
}

impl End {
    fn take(&mut self, value: f32, near: f32) {
        if value > self.value {
            *self = Self { value, at: 1, stays: 0, near: 0, was_there: true };
            return;
        }
        let is_there = value == self.value;
        self.at += u64::from(is_there);
        self.stays += u64::from(is_there && self.was_there);
        self.near += u64::from(!is_there && value > self.value - near);
        self.was_there = is_there;
    }
}

/// Whether so many frames of a sensor end a window.
pub(super) fn ends_window(frames: u64) -> bool {
    frames.is_multiple_of(WINDOW.into())
}

/// Frames of a window.
pub(super) const FRAMES: u64 = WINDOW as u64;

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const STEP: f32 = 0.1;

    /// Of unit variance, about normal.
    fn noise(rng: &mut Xoshiro256PlusPlus) -> f32 {
        (0..12).map(|_| (rng.next_u32() >> 8) as f32 / (1 << 24) as f32).sum::<f32>() - 6.0
    }

    fn rounded(value: f32) -> f32 {
        (value / STEP).round() * STEP
    }

    /// Spikes and flat samples of a signal.
    fn judged(signal: impl Iterator<Item = f32>) -> (usize, u64) {
        let mut channel = Channel::new(STEP);
        let spikes = signal.filter(|value| channel.push(rounded(*value))).count();
        (spikes, channel.flat())
    }

    #[test]
    fn noise_and_tones_have_neither_spikes_nor_flats() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        for size in [0.01, 0.05, 0.16, 0.775, 1.0, 100.0] {
            assert_eq!(judged((0..200_000).map(|_| size * noise(&mut rng))), (0, 0), "{size}");
        }
        // Radians a sample, from far below the rate to half of it.
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
            (0..8000_u32).map(|n| 300.0 * (0.05 * n as f32).sin() + noise(&mut rng)).collect();
        assert_eq!(judged(signal.iter().copied()).1, 0);
        let flat = judged(signal.iter().map(|value| value.clamp(-1e3, 250.0))).1;
        let beyond = signal.iter().filter(|value| rounded(**value) >= 250.0).count();
        assert_eq!(flat, beyond as u64);
    }

    #[test]
    fn a_window_tells_what_moves_from_what_is_stuck() {
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
