//! The cost of reading for the daemon, and for those who read what it finds:
//!
//! ```text
//! cargo build --release --bin flexid && cargo run --release -p flexid-proof --bin reader-load
//! ```
//!
//! The daemon runs as it is, with its solver. It reads the frames of the recording `nominal` from a socket pair that
//! carries the same `struct can_frame` as a CAN socket: once at the pace of the recording, 4,000 frames/s, and once
//! as fast as it takes them. For each run the program prints the frames sent, the frames lost, and the reader
//! thread's share of a core. During the first one `flexid watch` draws on a terminal, and `flexid web` serves one page:
//! the program prints their shares of a core, and how often the page changes.

mod readers;
mod recording;

use std::fmt;
use std::fs;
use std::os::fd::{AsRawFd, OwnedFd};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use flexid_edge::daemon;
use flexid_edge::server::Listener;
use flexid_pipeline::config::{Config, Listen};
use flexid_pipeline::source::CanSocket;
use flexid_pipeline::stop::Stop;
use nix::sys::socket::{AddressFamily, MsgFlags, SockFlag, SockType, send, socketpair};

use readers::{Read, Readers};
use recording::Recorded;

/// Number of experiments of the run at the pace of the recording: three quarters of a minute.
const PACED: usize = 9;
/// Number of experiments of the hurried run: five million frames.
const HURRIED: usize = 300;
/// Silence after an experiment, at the pace of the recording.
const PAUSE: Duration = Duration::from_secs(1);
/// The name of the daemon's thread that reads the bus.
const READER: &str = "flexid-reader";

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
        .map(|name| recording::frames(&folder.join("../recordings/nominal").join(name)))
        .collect::<Result<Vec<_>>>()?;
    let config = Config::load(&folder.join("../../host-tools/scenario/mill3-edge.toml"))?;

    let folder = tempfile::tempdir()?;
    let listener = Listener::bind(&Listen::Unix(folder.path().join("flexid.sock")))?;
    let readers = Readers::start(listener.address())?;
    let paced = experiments.iter().cycle().take(PACED);
    let (paced, read) = run(&config, &[listener], paced, true, Some(readers))?;
    println!("at the pace of the recording: {paced}");
    read.iter().for_each(|read| println!("    {read}"));
    let hurried = experiments.iter().cycle().take(HURRIED);
    let (hurried, _) = run(&config, &[], hurried, false, None)?;
    println!("as fast as it takes them:     {hurried}");
    Ok(())
}

/// Runs the daemon with `experiments` coming in from the other end of its socket. `readers` end before the daemon, with which `flexid watch`
/// would end.
fn run<'a>(
    config: &Config,
    listeners: &[Listener],
    experiments: impl Iterator<Item = &'a Vec<Recorded>>,
    paced: bool,
    readers: Option<Readers>,
) -> Result<(Load, Option<Read>)> {
    let (bus, robot) =
        socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)?;
    let mut source = CanSocket::from_pair(bus)?;
    let stop = Stop::new();
    thread::scope(|scope| {
        let daemon = scope.spawn(|| daemon::run(config, &mut source, listeners, &stop));
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
        let read = readers.map(Readers::end).transpose()?;
        drop(robot);
        while cpu_seconds(READER)?.is_some() {
            thread::sleep(Duration::from_millis(1)); // the reader takes what is still in the socket
        }
        stop.request();
        let outcome = daemon.join().ok().context("the daemon broke")??;
        let lost = measurements - outcome.counts.stream.frames;
        Ok((Load { frames, lost, seconds, reader_seconds }, read))
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

impl fmt::Display for Load {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames, lost, seconds, reader_seconds } = self;
        let (rate, share) = (*frames as f64 / seconds, 100.0 * reader_seconds / seconds);
        write!(f, "{frames} frames, {rate:.0}/s, {lost} lost, reader thread {share:.1} % of a core")
    }
}
