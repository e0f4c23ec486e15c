//! The progress bar of long work: shown on a terminal, silent elsewhere.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `length` ticks with the time left.
pub(crate) fn bar(length: u64, doing: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(length).with_message(doing);
    let template = "{msg} [{wide_bar}] {percent:>3} %, {eta} left";
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style.progress_chars("=> ")),
        Err(_) => bar,
    }
}
