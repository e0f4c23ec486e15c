//! The log of the real daemon says once what keeps it from records.

#[allow(dead_code, reason = "the other tests of the pipeline need the rest")]
#[path = "pipeline/frames.rs"]
mod frames;

use std::io;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::bounded;
use embedded_can::{Id, StandardId};
use flexid_edge::daemon;
use flexid_pipeline::config::Config;
use flexid_pipeline::source::{Arrival, Frame, FrameKind};
use flexid_pipeline::stop::Stop;
use tracing_subscriber::fmt::MakeWriter;

use frames::{Feed, POSES, block, frames_with};

/// Nothing here takes nearly as long; a test that waits for it has failed.
const PATIENCE: Duration = Duration::from_secs(60);
/// Samples of a record.
const SAMPLES: usize = 256;
/// Identifiers of force, acceleration and the second joint's angle in mill3.dbc.
const FORCE: u16 = 0x101;
const ACCELERATION: u16 = 0x102;
const SECOND_ANGLE: u16 = 0x112;

/// A log in memory.
struct Log(Mutex<Vec<u8>>);

static LOG: Log = Log(Mutex::new(Vec::new()));

impl io::Write for &Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for &'static Log {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        self
    }
}

fn config() -> Config {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario/mill3-edge.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let rate = format!("rate_hz = 2000.0\nrecord_samples = {SAMPLES}");
    let text = text.replace("rate_hz = 2000.0", &rate).replace("[2.0, 200.0]", "[20.0, 150.0]");
    Config::parse(&file, &text).unwrap()
}

/// What the log holds behind what the daemon has said of `frames`, which come in one batch, once it says `awaited`.
fn logged(config: &Config, frames: Vec<Arrival>, awaited: &str) -> String {
    let (stop, (feed, arrivals)) = (Stop::with_grace(Duration::ZERO), bounded(0));
    // The log is one for all tests.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let _ = tracing_subscriber::fmt().with_ansi(false).with_writer(&LOG).try_init();
    LOG.0.lock().unwrap().clear();
    let said = || String::from_utf8(LOG.0.lock().unwrap().clone()).unwrap();
    thread::scope(|scope| {
        let daemon = scope.spawn(|| daemon::run(config, &mut Feed(arrivals), &[], &stop));
        feed.send(frames).unwrap();
        let begun = Instant::now();
        while !said().contains(awaited) && begun.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(20));
        }
        // A second line of the kind would come by now.
        thread::sleep(Duration::from_secs(1));
        stop.request();
        drop(feed);
        daemon.join().unwrap().unwrap();
    });
    said()
}

/// The frames of a cut in the first pose.
fn cut(config: &Config) -> Vec<Arrival> {
    frames_with(config, &POSES[..1], u32::MAX, 0.02, block)
}

fn id(id: u16) -> Id {
    StandardId::new(id).unwrap().into()
}

/// Frames with other data where `change` gives some. Its arguments are the number of the identifier's frame, and its data.
fn with(
    frames: Vec<Arrival>,
    of: u16,
    mut change: impl FnMut(u16, &[u8]) -> Option<Vec<u8>>,
) -> Vec<Arrival> {
    let mut number = 0;
    let frames = frames.into_iter().filter_map(|arrival| {
        if arrival.frame.id != id(of) {
            return Some(arrival);
        }
        number += 1;
        let data = change(number - 1, arrival.frame.data())?;
        Some(Arrival { frame: Frame::new(id(of), FrameKind::Data, &data), ..arrival })
    });
    frames.collect()
}

/// Replaces the counter of a sensor, the last two bytes, by what `count` makes of it.
fn counted(frames: Vec<Arrival>, of: u16, count: fn(u16) -> u16) -> Vec<Arrival> {
    with(frames, of, |_, data| {
        let counter = u16::from_le_bytes([data[6], data[7]]);
        Some([&data[..6], &count(counter).to_le_bytes()].concat())
    })
}

/// A kind of fault: what becomes of the frames of a good cut, and the line of the log.
type Fault = (&'static str, fn(Vec<Arrival>) -> Vec<Arrival>, &'static str);

#[test]
fn what_prevents_records_is_said_once() {
    let faults: [Fault; 10] = [
        ("no force", |f| with(f, FORCE, |_, _| None), "waiting for force frames: none seen"),
        (
            "no acceleration",
            |f| with(f, ACCELERATION, |_, _| None),
            "waiting for acceleration frames: none seen",
        ),
        (
            "no angle",
            |f| with(f, SECOND_ANGLE, |_, _| None),
            "waiting for joint angles: joint_2 not seen",
        ),
        ("short", |f| with(f, FORCE, |_, data| Some(data[..7].to_vec())), "frames 0x101 "),
        ("still", |f| counted(f, FORCE, |_| 7), "[signals] force_counter stands still"),
        (
            "apart",
            |f| counted(f, ACCELERATION, |counter| counter.wrapping_mul(31).wrapping_add(5000)),
            "the counters of force and acceleration do not go together",
        ),
        (
            "jumping",
            |f| {
                let jump = |counter| counter + 1000 * (counter / 100);
                counted(counted(f, FORCE, jump), ACCELERATION, jump)
            },
            "the counters of force or acceleration jump",
        ),
        (
            "clipped",
            |f| {
                let most =
                    |_: u16, data: &[u8]| Some([&[0xFF, 0x7F].repeat(3), &data[6..]].concat());
                with(with(f, FORCE, most), ACCELERATION, most)
            },
            "are at the limit of a signal",
        ),
        (
            "degrees",
            |f| {
                // 1000 rad.
                let far = 1_000_000_000_i32.to_le_bytes();
                with(f, SECOND_ANGLE, |_, data| Some([&far, &data[4..]].concat()))
            },
            "measuring; q2 reads 1000.0000, beyond joint_2's limits",
        ),
        // The largest number of a signal is no measurement.
        (
            "not available",
            |f| {
                let none = i32::MAX.to_le_bytes();
                with(f, SECOND_ANGLE, |_, data| Some([&none, &data[4..]].concat()))
            },
            "waiting for joint angles: joint_2 not seen",
        ),
    ];
    let config = config();
    for (name, fault, line) in faults {
        let log = logged(&config, fault(cut(&config)), line);
        let lines: Vec<_> = log.lines().filter(|own| own.contains(line)).collect();
        assert_eq!(lines.len(), 1, "{name}: {log}");
        assert!(lines[0].contains(" WARN "), "{name}: {log}");
    }
}

/// A sensor that dies, or whose frames change, when there are records already.
#[test]
fn what_prevents_further_records_is_said() {
    let config = config();
    let later = |frames: Vec<Arrival>| {
        let later = |arrival: Arrival| Arrival { time_s: arrival.time_s + 1.0, ..arrival };
        frames.into_iter().map(later).collect::<Vec<_>>()
    };
    let minutes = |frames: Vec<Arrival>| -> Vec<Arrival> {
        (0..10)
            .fold((Vec::new(), frames), |(all, next), _| {
                let next = later(next);
                ([all, next.clone()].concat(), next)
            })
            .0
    };
    let silent = minutes(with(cut(&config), FORCE, |_, _| None));
    let short = minutes(with(cut(&config), FORCE, |_, data| Some(data[..7].to_vec())));
    for (rest, line) in
        [(silent, "waiting for force frames: they do not come any more"), (short, "frames 0x101 ")]
    {
        let log = logged(&config, [cut(&config), rest].concat(), line);
        let first = log.find("record 1 at pose").expect(&log);
        let said: Vec<_> = log.match_indices(line).collect();
        assert!(said.len() == 1 && said[0].0 > first, "{log}");
    }
}

/// Each record bears its own number, even when several are cut at once.
#[test]
fn records_are_numbered_one_by_one() {
    let config = config();
    let frames = frames_with(&config, &POSES, u32::MAX, 0.02, block);
    let log = logged(&config, frames, "record 2 at pose");
    let numbers: Vec<u64> = log
        .lines()
        .filter_map(|line| line.split_once(" record ")?.1.split_once(" at pose"))
        .map(|(number, _)| number.parse().unwrap())
        .collect();
    assert!(numbers.len() >= 2, "{log}");
    assert_eq!(numbers, (1..=numbers.len() as u64).collect::<Vec<_>>());
}
