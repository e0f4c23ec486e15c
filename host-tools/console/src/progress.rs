//! The progress of long work, on stderr: a bar on a terminal. Elsewhere work that can be counted says now and then how far it is; the
//! reading of logs is silent there, since its errors are single lines.

use std::fmt::Write;
use std::thread;
use std::time::Duration;

use flexid_edge::console::complain;

use indicatif::{HumanDuration, ProgressBar, ProgressFinish, ProgressState, ProgressStyle};

/// Interval at which a bar is drawn while nothing comes to an end, so that it is there from the beginning.
const DRAWN: Duration = Duration::from_millis(250);

/// Interval between two lines where there is no terminal. Chosen: work that is shorter needs none, and an hour of work gives a log of a page
/// or two.
const SAID: Duration = Duration::from_secs(10);
/// Ticks of a part of the work, in a bar of [`parts`].
const TICKS: f64 = 1000.0;

/// A bar of so many parts, in which [`done`] tells how far a part is.
pub fn parts(parts: usize, doing: &'static str) -> ProgressBar {
    bar(parts as u64 * TICKS as u64, doing)
}

/// So many parts of a bar of [`parts`] are done, and a part of the next one, 0 to 1.
pub fn done(bar: &ProgressBar, parts: usize, of_next: f64) {
    bar.set_position(((parts as f64 + of_next) * TICKS) as u64);
}

/// A bar of `length` ticks, with the time left estimated from the ticks so far; without a terminal lines that say the same.
pub fn bar(length: u64, doing: &'static str) -> ProgressBar {
    let bar = drawn(ProgressBar::new(length), doing, estimated());
    if bar.is_hidden() {
        say(&bar);
    }
    bar
}

/// A bar of `length` milliseconds of work in real time. The milliseconds left are the time left.
pub fn timed(length: u64, doing: &'static str) -> ProgressBar {
    let left = |state: &ProgressState, text: &mut dyn Write| {
        // The bar's own writer does not fail.
        let _ = text.write_str(&time_left(state.pos(), state.len()));
    };
    drawn(ProgressBar::new(length), doing, with_time_left(left))
}

/// A spinner for work of unknown length.
pub fn endless(doing: &'static str) -> ProgressBar {
    drawn(ProgressBar::no_length(), doing, style("{spinner} {msg}"))
}

/// The style of a [`bar`].
pub fn estimated() -> ProgressStyle {
    with_time_left(|state: &ProgressState, text: &mut dyn Write| {
        // Before the first tick nothing is known.
        let left = match state.pos() {
            0 => "some time".to_owned(),
            _ => HumanDuration(state.eta()).to_string(),
        };
        let _ = text.write_str(&left);
    })
}

fn with_time_left(
    left: impl Fn(&ProgressState, &mut dyn Write) + Clone + Send + Sync + 'static,
) -> ProgressStyle {
    style("{msg} [{wide_bar}] {percent:>3} %, {left} left").with_key("left", left)
}

fn style(template: &str) -> ProgressStyle {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    style.progress_chars("=> ")
}

/// The bar, on a terminal from now on, until it is dropped.
fn drawn(bar: ProgressBar, doing: &'static str, style: ProgressStyle) -> ProgressBar {
    let bar = bar.with_message(doing).with_style(style).with_finish(ProgressFinish::AndClear);
    if !bar.is_hidden() {
        bar.enable_steady_tick(DRAWN);
    }
    bar
}

/// Says every ten seconds how far the work is, so that whoever waits or reads a log sees that it goes on.
fn say(bar: &ProgressBar) {
    let bar = bar.downgrade();
    thread::spawn(move || {
        loop {
            thread::sleep(SAID);
            match bar.upgrade() {
                Some(bar) if !bar.is_finished() => complain(&line(&bar)),
                _ => return,
            }
        }
    });
}

/// For example `predicting: 40 %, 12 seconds left`.
fn line(bar: &ProgressBar) -> String {
    let message = bar.message();
    match bar.length() {
        Some(length) if length > 0 && bar.position() > 0 => {
            let percent = 100 * bar.position().min(length) / length;
            format!("{message}: {percent} %, {} left", HumanDuration(bar.eta()))
        }
        _ => format!("{message}: {}", HumanDuration(bar.elapsed())),
    }
}

/// The time left of a bar of `length` milliseconds, in words.
fn time_left(position: u64, length: Option<u64>) -> String {
    let left = length.unwrap_or_default().saturating_sub(position);
    HumanDuration(Duration::from_secs(left.div_ceil(1000))).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_far_the_work_is() {
        let bar = parts(4, "predicting");
        assert_eq!(line(&bar), "predicting: 0 seconds");
        done(&bar, 1, 0.5);
        let line = line(&bar);
        assert!(line.starts_with("predicting: 37 %, ") && line.ends_with(" left"), "{line}");
    }

    /// The time left does not depend on the first ticks. An estimate from them was off by hundreds of times.
    #[test]
    fn the_time_left_of_work_in_time_is_what_is_left_of_it() {
        assert_eq!(time_left(0, Some(14_288)), "15 seconds");
        assert_eq!(time_left(14_000, Some(14_288)), "1 second");
        assert_eq!(time_left(14_288, Some(14_288)), "0 seconds");
        let bar = timed(14_288, "simulating");
        assert_eq!(bar.length(), Some(14_288));
    }
}
