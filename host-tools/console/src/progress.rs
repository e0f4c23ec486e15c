//! The progress of long work, on stderr: a bar on a terminal, elsewhere a line in ten seconds that begins with `progress: `. Work that is
//! done before has none, so that the error of a wrong input stays the only line.

use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use flexid_edge::console::complain;

use indicatif::{HumanDuration, ProgressBar, ProgressFinish, ProgressState, ProgressStyle};

/// Interval at which a bar is drawn while nothing comes to an end, so that it is there from the beginning.
const DRAWN: Duration = Duration::from_millis(250);

/// Interval between two lines where there is no terminal. Chosen: work that is shorter needs none, and an hour of work gives a log of a few
/// pages.
const SAID: Duration = Duration::from_secs(10);
/// Share from which on the time left is estimated. Chosen: before it, more than three times what was seen would be extrapolated.
const SEEN: f64 = 0.25;
/// Ticks of a part of the work in a bar of [`parts`], and of a second in one of [`simulated`].
const TICKS: f64 = 1000.0;

/// The state of the work in words: of its pace, and the ticks in all where they are known.
type Words = fn(Pace, Option<u64>) -> String;

/// How far the work is.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    /// Ticks that are done.
    done: u64,
    /// Time from the start until this number was first seen.
    reached: Duration,
    /// Time since the start.
    elapsed: Duration,
}

impl Pace {
    /// So many ticks are done after this time.
    fn see(&mut self, done: u64, elapsed: Duration) -> Self {
        let reached = if done == self.done { self.reached } else { elapsed };
        *self = Self { done, reached, elapsed };
        *self
    }
}

/// A bar of so many parts, in which [`done`] tells how far a part is.
pub fn parts(parts: usize, doing: &'static str) -> ProgressBar {
    bar(parts as u64 * TICKS as u64, doing)
}

/// So many parts of a bar of [`parts`] are done, and a part of the next one, 0 to 1.
pub fn done(bar: &ProgressBar, parts: usize, of_next: f64) {
    reached(bar, parts as f64 + of_next);
}

/// A bar of `length` ticks. From a quarter on it has the time left, as if all ticks took the same time, as long as it moves so.
pub fn bar(length: u64, doing: &'static str) -> ProgressBar {
    drawn(ProgressBar::new(length), doing, WHOLE, share)
}

/// A bar of `seconds` that a robot works, in which [`reached`] tells how many there are.
pub fn simulated(seconds: f64, doing: &'static str) -> ProgressBar {
    drawn(ProgressBar::new((seconds * TICKS).round() as u64), doing, WHOLE, of_seconds)
}

/// So many seconds of a bar of [`simulated`] are done.
pub fn reached(bar: &ProgressBar, seconds: f64) {
    bar.set_position((seconds * TICKS) as u64);
}

/// A spinner, with the time since the start, for work whose length shows only at its end.
pub fn endless(doing: &'static str) -> ProgressBar {
    drawn(ProgressBar::no_length(), doing, OPEN, share)
}

/// The style of a [`bar`], for one that was [`endless`].
pub fn known() -> ProgressStyle {
    style(WHOLE, share)
}

/// A spinner like that of [`endless`], for work whose ticks take unequal times, so that they do not tell the time left.
pub fn uneven(doing: &'static str) -> ProgressBar {
    drawn(ProgressBar::no_length(), doing, OPEN, so_far)
}

/// The style of a [`bar`], for one that was [`uneven`].
pub fn known_uneven() -> ProgressStyle {
    style(WHOLE, so_far)
}

/// Template of work of known length.
const WHOLE: &str = "{msg} [{wide_bar}] {state}";
/// Template of work of unknown length.
const OPEN: &str = "{spinner} {msg}, {state}";

fn style(template: &str, words: Words) -> ProgressStyle {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let pace = Arc::new(Mutex::new(Pace::default()));
    let state = move |state: &ProgressState, text: &mut dyn Write| {
        let mut pace = pace.lock().unwrap_or_else(PoisonError::into_inner);
        // The bar's own writer does not fail.
        let _ = text.write_str(&words(pace.see(state.pos(), state.elapsed()), state.len()));
    };
    style.progress_chars("=> ").with_key("state", state)
}

/// The bar, on a terminal from now on, until it is dropped; without a terminal the lines.
fn drawn(bar: ProgressBar, doing: &'static str, template: &str, words: Words) -> ProgressBar {
    let style = style(template, words);
    let bar = bar.with_message(doing).with_style(style).with_finish(ProgressFinish::AndClear);
    match bar.is_hidden() {
        true => say(&bar, words),
        false => bar.enable_steady_tick(DRAWN),
    }
    bar
}

/// Says every ten seconds how far the work is, so that whoever waits or reads a log sees that it goes on.
fn say(bar: &ProgressBar, words: Words) {
    let bar = bar.downgrade();
    thread::spawn(move || {
        let mut pace = Pace::default();
        loop {
            thread::sleep(SAID);
            match bar.upgrade() {
                Some(bar) if !bar.is_finished() => complain(&line(&bar, &mut pace, words)),
                _ => return,
            }
        }
    });
}

/// For example `progress: predicting, 40 %, 12 seconds left`.
fn line(bar: &ProgressBar, pace: &mut Pace, words: Words) -> String {
    let state = words(pace.see(bar.position(), bar.elapsed()), bar.length());
    format!("progress: {}, {state}", bar.message())
}

/// For example `40 %, 12 seconds left`; the time since the start where the length is not known. Nothing is left to say of work that stands
/// still for longer than was left.
fn share(pace: Pace, length: Option<u64>) -> String {
    let Some(share) = part(pace, length) else { return HumanDuration(pace.elapsed).to_string() };
    let percent = (100.0 * share) as u64;
    if share < SEEN || share == 1.0 {
        return format!("{percent} %");
    }
    let still = pace.elapsed - pace.reached;
    match pace.reached.mul_f64((1.0 - share) / share).checked_sub(still) {
        Some(left) => format!("{percent} %, {} left", HumanDuration(left)),
        None => format!("{percent} %"),
    }
}

/// For example `40 %, 12 seconds so far`; the time alone where the length is not known, and where all ticks are done and the work goes on.
fn so_far(pace: Pace, length: Option<u64>) -> String {
    let time = format!("{} so far", HumanDuration(pace.elapsed));
    match part(pace, length).filter(|share| *share < 1.0) {
        Some(share) => format!("{} %, {time}", (100.0 * share) as u64),
        None => time,
    }
}

/// Part of the ticks that is done.
fn part(pace: Pace, length: Option<u64>) -> Option<f64> {
    let length = length.filter(|length| *length > 0)?;
    Some((pace.done as f64 / length as f64).min(1.0))
}

/// For example `3.2 of 14.3 s, 22 %`.
fn of_seconds(pace: Pace, length: Option<u64>) -> String {
    let [seconds, of] = [pace.done, length.unwrap_or(pace.done)].map(|own| own as f64 / TICKS);
    format!("{seconds:.1} of {of:.1} s, {}", share(pace, length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_far_the_work_is() {
        let bar = parts(4, "predicting");
        assert_eq!(line(&bar, &mut Pace::default(), share), "progress: predicting, 0 %");
        done(&bar, 1, 0.5);
        let said = line(&bar, &mut Pace::default(), share);
        assert!(
            said.starts_with("progress: predicting, 37 %, ") && said.ends_with(" left"),
            "{said}"
        );
        let bar = endless("reading");
        bar.inc(7);
        assert_eq!(line(&bar, &mut Pace::default(), share), "progress: reading, 0 seconds");
    }

    /// Work of equal ticks that stops for a while. An estimate from the latest ticks grew to thousands of years meanwhile, one from all ticks
    /// without bound.
    #[test]
    fn the_time_left_is_that_of_all_ticks_so_far_and_of_the_first_quarter_none() {
        let mut pace = Pace::default();
        let mut at = |done, seconds| share(pace.see(done, Duration::from_secs(seconds)), Some(8));
        assert_eq!([at(0, 0), at(1, 60), at(1, 3600)], ["0 %", "12 %", "12 %"]);
        assert_eq!(at(2, 120), "25 %, 6 minutes left");
        assert_eq!([at(2, 240), at(2, 960)], ["25 %, 4 minutes left", "25 %"]);
        assert_eq!(
            [at(6, 360), at(8, 480), at(9, 490)],
            ["75 %, 2 minutes left", "100 %", "100 %"]
        );
    }

    #[test]
    fn uneven_work_says_how_long_it_takes() {
        let mut pace = Pace::default();
        let mut at =
            |done, length, seconds| so_far(pace.see(done, Duration::from_secs(seconds)), length);
        assert_eq!(at(7, None, 12), "12 seconds so far");
        assert_eq!(at(6, Some(8), 360), "75 %, 6 minutes so far");
        assert_eq!(at(8, Some(8), 480), "8 minutes so far");
    }

    #[test]
    fn simulated_work_shows_its_seconds() {
        let bar = simulated(14.288, "simulating");
        reached(&bar, 3.2);
        assert_eq!(
            line(&bar, &mut Pace::default(), of_seconds),
            "progress: simulating, 3.2 of 14.3 s, 22 %"
        );
        reached(&bar, 14.0);
        let said = line(&bar, &mut Pace::default(), of_seconds);
        assert!(said.starts_with("progress: simulating, 14.0 of 14.3 s, 97 %, "), "{said}");
    }
}
