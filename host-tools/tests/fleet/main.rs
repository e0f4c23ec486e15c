//! `flexid publish` and `flexid collect` against the daemon's real server, whose news the test makes up, real mosquittos and a real PostgreSQL.

mod broker;
mod collect;
mod database;
mod edge;
mod many;
#[allow(dead_code)] // those of `watch` are more
#[path = "../watch/news.rs"]
mod news;
mod plant;
mod publish;
mod refusals;
mod tables;

use std::path::Path;
use std::process::Child;
use std::time::{Duration, Instant};

/// A program that is killed when dropped.
struct Running(Child);

impl Running {
    /// Has it end in order, and waits for that. Returns whether its exit status is 0.
    fn terminate(mut self) -> bool {
        let kill = format!("kill -TERM {}", self.0.id());
        assert!(std::process::Command::new("sh").args(["-c", &kill]).status().unwrap().success());
        self.0.wait().unwrap().success()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits until `look` returns something.
fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + Duration::from_secs(60);
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < end, "not within a minute: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Waits until a log has a line with this text.
fn until_logged(log: &Path, text: &str) {
    let read = || std::fs::read_to_string(log).unwrap_or_default();
    let what = || format!("{text:?} in {}: {}", log.display(), read());
    let end = Instant::now() + Duration::from_secs(60);
    while !read().contains(text) {
        assert!(Instant::now() < end, "not within a minute: {}", what());
        std::thread::sleep(Duration::from_millis(20));
    }
}
