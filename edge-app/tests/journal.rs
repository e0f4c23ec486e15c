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

/// Returns what the daemon has logged of `frames` some time after it has said `awaited`.
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
        frames.chunks(50).for_each(|frames| feed.send(frames.to_vec()).unwrap());
        let begun = Instant::now();
        while !said().contains(awaited) && begun.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(20));
        }
        // A second line of the kind would come by now: a state stands for 2 s before it is said.
        thread::sleep(Duration::from_secs(3));
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

/// Instants of a long rest.
const RESTS: u16 = 8000;

/// The frames of a long rest in the first pose.
fn rest(config: &Config) -> Vec<Arrival> {
    let config = Config { record_samples: RESTS.into(), ..config.clone() };
    let mut frames = cut(&config);
    let end_s = frames[0].time_s + f64::from(RESTS) / config.rate_hz;
    frames.retain(|frame| frame.time_s < end_s);
    frames
}

/// The largest value along each axis, behind `of` so many frames of each sensor.
fn clipped(frames: Vec<Arrival>, of: u16) -> Vec<Arrival> {
    let most = |number: u16, data: &[u8]| {
        let largest = [[0xFF, 0x7F].repeat(3), data[6..].to_vec()].concat();
        Some(if number < of { data.to_vec() } else { largest })
    };
    with(with(frames, FORCE, most), ACCELERATION, most)
}

/// No measurement: the largest number of the signal, beyond the limits of the joint.
fn not_available(_: u16, data: &[u8]) -> Option<Vec<u8>> {
    Some([&i32::MAX.to_le_bytes(), &data[4..]].concat())
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
        if arrival.frame().unwrap().id != id(of) {
            return Some(arrival);
        }
        number += 1;
        let data = change(number - 1, arrival.frame().unwrap().data())?;
        Some(Arrival::of_frame(arrival.time_s, Frame::new(id(of), FrameKind::Data, &data)))
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
        ("clipped", |f| clipped(f, 0), "are at the limit of a signal"),
        (
            "degrees",
            |f| {
                // 1000 rad.
                let far = 1_000_000_000_i32.to_le_bytes();
                with(f, SECOND_ANGLE, |_, data| Some([&far, &data[4..]].concat()))
            },
            "measuring; q2 reads 1000.0000, beyond joint_2's limits",
        ),
        (
            "not available",
            |f| with(f, SECOND_ANGLE, not_available),
            "waiting for joint angles: joint_2 comes, but reads 2147.4836, ",
        ),
    ];
    let config = config();
    for fault in faults {
        assert_said_once(&config, &cut(&config), fault);
    }
}

/// Faults that begin long after the last record, or where there was none.
#[test]
fn faults_that_begin_late_are_said_once() {
    let faults: [Fault; 3] = [
        // They are fewer than a tenth of all that has come.
        ("clipped", |f| clipped(f, RESTS - 600), "are at the limit of a signal"),
        (
            "no angle any more",
            |f| with(f, SECOND_ANGLE, |number, data| (number < 5).then(|| data.to_vec())),
            "waiting for joint angles: joint_2 does not come any more",
        ),
        (
            "not available any more",
            |f| {
                let late = |number, data: &[u8]| match number {
                    0..5 => Some(data.to_vec()),
                    _ => not_available(number, data),
                };
                with(f, SECOND_ANGLE, late)
            },
            "waiting for joint angles: joint_2 comes, but reads 2147.4836, ",
        ),
    ];
    let config = config();
    for fault in faults {
        assert_said_once(&config, &rest(&config), fault);
    }
}

fn assert_said_once(config: &Config, good: &[Arrival], (name, fault, line): Fault) {
    let log = logged(config, fault(good.to_vec()), line);
    let lines: Vec<_> = log.lines().filter(|own| own.contains(line)).collect();
    assert_eq!(lines.len(), 1, "{name}: {log}");
    assert!(lines[0].contains(" WARN "), "{name}: {log}");
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
