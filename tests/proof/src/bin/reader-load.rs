//! The cost of reading for the daemon: `cargo run --release -p flexid-proof --bin reader-load`.
//!
//! The daemon runs as it is, with its solver. It reads the frames of the recording `nominal` from a socket pair that
//! carries the same `struct can_frame` as a CAN socket: once at the pace of the recording, 4,000 frames/s, and once
//! as fast as it takes them. For each run the program prints the frames sent, the frames lost, and the reader
//! thread's share of a core.

use std::fmt;
use std::fs::{self, File};
use std::io::Read;
use std::os::fd::{AsRawFd, OwnedFd};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use flate2::read::GzDecoder;
use flexid_edge::daemon;
use flexid_pipeline::config::Config;
use flexid_pipeline::source::CanSocket;
use flexid_pipeline::stop::Stop;
use nix::sys::socket::{AddressFamily, MsgFlags, SockFlag, SockType, send, socketpair};

/// Number of experiments of the hurried run: five million frames.
const HURRIED: usize = 300;
/// Silence after an experiment, at the pace of the recording.
const PAUSE: Duration = Duration::from_secs(1);
/// Bytes of the kernel's `struct can_frame`.
const CAN_FRAME: usize = 16;

/// The name of the daemon's thread that reads the bus.
const READER: &str = "flexid-reader";

/// A frame of a recording.
struct Recorded {
    /// Time since the first frame.
    at: Duration,
    /// The frame as the kernel delivers it.
    frame: [u8; CAN_FRAME],
}

/// The result of one run.
struct Load {
    frames: usize,
    lost: u64,
    seconds: f64,
    reader_seconds: f64,
}

fn main() -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let experiments = ["exp_00.log.gz", "exp_01.log.gz", "exp_02.log.gz"]
        .iter()
        .map(|name| frames(&folder.join("../recordings/nominal").join(name)))
        .collect::<Result<Vec<_>>>()?;
    let config = Config::load(&folder.join("../../host-tools/scenario/mill3-edge.toml"))?;

    let paced = run(&config, experiments.iter(), true)?;
    println!("at the pace of the recording: {paced}");
    let hurried = run(&config, experiments.iter().cycle().take(HURRIED), false)?;
    println!("as fast as it takes them:     {hurried}");
    Ok(())
}

/// Runs the daemon with `experiments` coming in from the other end of its socket.
fn run<'a>(
    config: &Config,
    experiments: impl Iterator<Item = &'a Vec<Recorded>>,
    paced: bool,
) -> Result<Load> {
    let (bus, robot) =
        socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)?;
    let mut source = CanSocket::from_pair(bus)?;
    let stop = Stop::new();
    thread::scope(|scope| {
        let daemon = scope.spawn(|| daemon::run(config, &mut source, &[], &stop));
        let (mut frames, mut measurements, mut seconds) = (0, 0, 0.0);
        for experiment in experiments {
            let start = Instant::now();
            play(&robot, experiment, paced)?;
            seconds += start.elapsed().as_secs_f64();
            frames += experiment.len();
            measurements += experiment.iter().filter(|one| one.is_measurement()).count() as u64;
            if paced {
                thread::sleep(PAUSE);
            }
        }
        let reader_seconds = cpu_seconds(READER)?.context("the daemon has no reader thread")?;
        drop(robot);
        while cpu_seconds(READER)?.is_some() {
            thread::sleep(Duration::from_millis(1)); // the reader takes what is still in the socket
        }
        stop.request();
        let outcome = daemon.join().ok().context("the daemon broke")??;
        let lost = measurements - outcome.counts.stream.frames;
        Ok(Load { frames, lost, seconds, reader_seconds })
    })
}

/// Sends the frames, each when it is due, or all at once.
fn play(robot: &OwnedFd, frames: &[Recorded], paced: bool) -> Result<()> {
    let start = Instant::now();
    for Recorded { at, frame } in frames {
        if paced {
            thread::sleep((start + *at).saturating_duration_since(Instant::now()));
        }
        send(robot.as_raw_fd(), frame, MsgFlags::empty())?;
    }
    Ok(())
}

/// The frames of a compressed `candump -L` log.
fn frames(log: &Path) -> Result<Vec<Recorded>> {
    let mut text = String::new();
    GzDecoder::new(File::open(log)?).read_to_string(&mut text)?;
    let mut first = None;
    text.lines()
        .map(|line| {
            let (time_s, frame) = parse(line).with_context(|| format!("no frame: {line}"))?;
            let at = Duration::from_secs_f64(time_s - *first.get_or_insert(time_s));
            Ok(Recorded { at, frame })
        })
        .collect()
}

/// Time, s, and frame of a line like `(1767000000.000060) can0 101#00000000FFFFD289`.
fn parse(line: &str) -> Option<(f64, [u8; CAN_FRAME])> {
    let mut fields = line.split(' ');
    let time_s = fields.next()?.strip_prefix('(')?.strip_suffix(')')?.parse().ok()?;
    let (id, data) = fields.nth(1)?.split_once('#')?;
    let mut frame = [0; CAN_FRAME];
    frame[..4].copy_from_slice(&u32::from_str_radix(id, 16).ok()?.to_ne_bytes());
    frame[4] = u8::try_from(data.len() / 2).ok()?;
    for (byte, digits) in frame[8..].iter_mut().zip(data.as_bytes().chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    }
    Some((time_s, frame))
}

/// CPU time of the thread of this process with this name, s, if there is one.
fn cpu_seconds(thread: &str) -> Result<Option<f64>> {
    for task in fs::read_dir("/proc/self/task")? {
        let task = task?.path();
        // A thread may end while it is examined.
        if fs::read_to_string(task.join("comm")).is_ok_and(|name| name.trim_end() == thread)
            && let Ok(times) = fs::read_to_string(task.join("schedstat"))
        {
            let on_cpu_ns = times.split(' ').next().unwrap_or_default();
            return Ok(Some(on_cpu_ns.parse::<f64>()? * 1e-9));
        }
    }
    Ok(None)
}

impl Recorded {
    /// Whether the frame is a force or an acceleration.
    fn is_measurement(&self) -> bool {
        [0x101u32, 0x102].iter().any(|id| self.frame[..4] == id.to_ne_bytes())
    }
}

impl fmt::Display for Load {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames, lost, seconds, reader_seconds } = self;
        let (rate, share) = (*frames as f64 / seconds, 100.0 * reader_seconds / seconds);
        write!(f, "{frames} frames, {rate:.0}/s, {lost} lost, reader thread {share:.1} % of a core")
    }
}
