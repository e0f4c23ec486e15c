//! The text in a terminal of 80 × 24, in which colours, at which cost, and what the keys do.

use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use console::{measure_text_width, strip_ansi_codes};
use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::finding::Finding;
use flexid_wire::messages::{BusState, FromEdge, Phase};
use flexid_wire::report::{Acceptance, Verdict};
use flexid_wire::residuals::Objection;
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::warning::Warning;

use super::news::{bus, finding, progress, spectra, status};

/// Nothing here takes nearly as long; a test that waits for it has failed.
const PATIENCE: Duration = Duration::from_secs(30);

/// Runs `test` beside a server with a finding on six joints.
fn with_server(test: impl FnOnce(&Path, &Latest)) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    latest.publish(status(State::Measuring { implausible: None }));
    latest.publish(progress(Phase::Refining, 3));
    latest.publish(bus(BusState::Up, None));
    latest.publish(spectra(3));
    latest.publish(FromEdge::Finding(six_joints()));
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let outcome =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| test(&path, &latest)));
        latest.close();
        stop.request();
        outcome.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    });
}

/// A finding as large as that of a robot of six joints.
fn six_joints() -> Finding {
    let mut finding = finding(Acceptance::ModelSuspect, 3);
    let Finding { report, confidence, .. } = &mut finding;
    let (joint, intervals) = (report.joints[0].clone(), confidence.joints[0].clone());
    for _ in 1..6 {
        report.joints.push(joint.clone()).unwrap();
        confidence.joints.push(intervals.clone()).unwrap();
    }
    report.joints[1].stiffness_verdict[2] = Verdict::NotObservable;
    confidence.joints[1].stiffness_interval[2] = None;
    let objection = Objection::WrongMinimum { consistency: 84.0, structure: Some(0.18) };
    report.warnings =
        [Warning::Objection(objection), Warning::BusErrors { errors: 2 }].into_iter().collect();
    confidence.correlations.unknowns =
        (0..72).map(|index| clipped(format_args!("unknown {index}"))).collect();
    confidence.correlations.percent = (0..72 * 71 / 2).map(|pair| (pair % 97) as i8).collect();
    finding
}

/// `flexid watch` in a terminal of its own.
pub(crate) struct Terminal {
    child: Child,
    input: ChildStdin,
    output: ChildStdout,
    text: String,
}

impl Terminal {
    /// Starts a watch in 80 × 24. Afterwards the shell prints the terminal's mode and the processor time.
    pub(crate) fn watch(path: &Path, arguments: &str, environment: &[(&str, &str)]) -> Self {
        let program = env!("CARGO_BIN_EXE_flexid");
        let command = format!(
            "stty rows 24 cols 80; {program} watch unix:{} {arguments}; status=$?; stty -a; times; exit $status",
            path.display()
        );
        let mut child = Command::new("script")
            .args(["--quiet", "--return", "--command", &command, "/dev/null"])
            .env_remove("NO_COLOR")
            .env("TERM", "xterm-256color")
            .envs(environment.iter().copied())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("script, of Debian's bsdutils, runs");
        let (input, output) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        Self { child, input, output, text: String::new() }
    }

    pub(crate) fn press(&mut self, keys: &str) {
        self.input.write_all(keys.as_bytes()).unwrap();
    }

    /// Reads until the terminal has shown `text`.
    pub(crate) fn until(&mut self, text: &str) {
        let begun = Instant::now();
        while !self.text.contains(text) {
            let mut bytes = [0; 65_536];
            let read = self.output.read(&mut bytes).unwrap();
            self.text += &String::from_utf8_lossy(&bytes[..read]);
            assert!(read > 0 && begun.elapsed() < PATIENCE, "no {text:?} in {}", self.text);
        }
    }

    /// Waits for a whole screen with `text`.
    pub(crate) fn screen(&mut self, text: &str) -> String {
        self.until(text);
        let from = self.text.rfind("\x1b[H").unwrap();
        self.text.drain(..from);
        self.until("q quit");
        self.text.clone()
    }

    /// Reads to the end. Returns the exit status and all that the terminal has shown.
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let mut rest = Vec::new();
        self.output.read_to_end(&mut rest).unwrap();
        (self.child.wait().unwrap().code(), self.text + &String::from_utf8_lossy(&rest))
    }
}

#[test]
fn the_pages_fit_and_the_keys_turn_them() {
    with_server(|path, _| {
        let mut terminal = Terminal::watch(path, "", &[]);
        terminal.until("[1 overview]");
        for (key, page) in
            [("2", "[2 parameters]"), ("\t", "[3 spectra]"), ("\x1b[D", "[2 parameters]")]
        {
            terminal.text.clear();
            terminal.press(key);
            terminal.until(page);
        }
        terminal.press("\x1b[B");
        terminal.until("↑↓ 2-23/");
        let drawn = terminal.text.clone();
        for (index, screen) in drawn.split("\x1b[H").enumerate().skip(1) {
            // The last may not be whole yet.
            let lines: Vec<_> = screen.lines().collect();
            assert!(lines.len() <= 24, "screen {index} has {} lines: {screen}", lines.len());
            for line in lines {
                let line = strip_ansi_codes(line);
                assert!(measure_text_width(&line) <= 80, "{line:?}");
            }
        }
        terminal.press("q");
        let (status, text) = terminal.end();
        assert_eq!(status, Some(0), "{text}");
        // Everything stays below, and the terminal is as it was.
        assert!(text.contains(" about the axes of the joint frame"), "{text}");
        assert!(text.contains(" icanon") && text.contains(" echo "), "{text}");
    });
}

#[test]
fn the_verdict_is_first_then_the_warnings_and_both_in_colour() {
    with_server(|path, _| {
        let mut terminal = Terminal::watch(path, "", &[]);
        let screen = terminal.screen("MODEL SUSPECT");
        let place =
            |text: &str| screen.find(text).unwrap_or_else(|| panic!("no {text:?} in {screen}"));
        let order = [
            "\x1b[31mMODEL SUSPECT, 3 records: ",
            "\x1b[33mwarning: ",
            "mill3: refining the fit to 3 records",
            "vcan0 up",
            "stiff",
        ];
        let places = order.map(place);
        assert!(places.is_sorted(), "{order:?} stand at {places:?} in {screen}");
        let mut grey = screen.split("\x1b[2m").skip(1).map(|text| text.split('\x1b').next());
        assert!(grey.any(|text| text.is_some_and(|text| text.trim() == "6.0e7?")), "{screen:?}");
        terminal.press("q");
        terminal.end();

        let mut terminal = Terminal::watch(path, "", &[("NO_COLOR", "1")]);
        let screen = terminal.screen("MODEL SUSPECT");
        assert!(!screen.contains("\x1b[3"), "{screen:?}");
        terminal.press("q");
        terminal.end();
    });
}

/// Spectra of the newest record, along x; the space bar turns to y. Without colours the curves differ by their dots.
#[test]
fn the_spectra_are_drawn_anew_when_others_come() {
    with_server(|path, latest| {
        let mut terminal = Terminal::watch(path, "", &[("NO_COLOR", "1")]);
        terminal.until("[1 overview]");
        terminal.press("3");
        let screen = terminal.screen("acceleration x, (m/s²)/√Hz, record 3");
        let page = strip_ansi_codes(&screen).into_owned();
        for part in
            ["⠂ ⠂ measured  ⠒⠒ modelled  ⠒ ⠒ noise", "0.1┤", "10⁻³┤", "200 Hz", "↑↓ 1-22/66"]
        {
            assert!(page.contains(part), "{part:?} is not in {page}");
        }
        let dots = page.chars().filter(|own| ('\u{2801}'..='\u{28ff}').contains(own)).count();
        assert!(dots > 150, "{dots} cells with dots in {page}");
        assert!(!screen.contains("\x1b[3"), "{screen:?}");
        terminal.press(" ");
        terminal.screen("acceleration y, (m/s²)/√Hz, record 3");
        latest.publish(spectra(4));
        terminal.screen("acceleration y, (m/s²)/√Hz, record 4");
        terminal.press("q");
        terminal.end();
    });
}

/// At the pace of a daemon that works: progress ten times a second, the bus twice, a finding each second.
#[test]
fn a_watch_costs_less_than_three_per_cent_of_a_core() {
    const SECONDS: u64 = 8;
    with_server(|path, latest| {
        let terminal = Terminal::watch(path, &format!("--timeout {SECONDS}"), &[]);
        thread::scope(|scope| {
            let watching = scope.spawn(|| terminal.end());
            for tenth in 0..10 * SECONDS {
                let FromEdge::Progress(mut progress) = progress(Phase::Refining, 3) else {
                    unreachable!()
                };
                progress.fraction = tenth as f32 / (10 * SECONDS) as f32;
                latest.publish(FromEdge::Progress(progress));
                if tenth % 5 == 0 {
                    latest.publish(status(State::Measuring { implausible: None }));
                    latest.publish(bus(BusState::Up, None));
                }
                if tenth % 10 == 0 {
                    latest.publish(FromEdge::Finding(six_joints()));
                }
                thread::sleep(Duration::from_millis(100));
            }
            let (status, text) = watching.join().unwrap();
            assert_eq!(status, Some(0), "{text}");
            // The last line: user and system time of what the shell has run.
            let times = text.trim_end().lines().last().unwrap();
            let seconds = times.split_whitespace().map(|time| {
                let (minutes, seconds) = time.trim_end_matches('s').split_once('m').unwrap();
                60.0 * minutes.parse::<f64>().unwrap() + seconds.parse::<f64>().unwrap()
            });
            let percent = 100.0 * seconds.sum::<f64>() / SECONDS as f64;
            println!("watch costs {percent:.2} % of a core");
            assert!(percent < 3.0, "{percent:.2} % of a core: {times}");
        });
    });
}
