//! The real daemon in this process, on the reference scenario with short records.

use std::path::Path;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use embedded_can::Frame as _;
use flexid_core::stream::Reading;
use flexid_edge::daemon;
use flexid_edge::server::Listener;
use flexid_pipeline::config::{Config, Listen};
use flexid_pipeline::source::CanSocket;
use flexid_pipeline::stop::Stop;
use nix::sys::socket::{AddressFamily, SockFlag, SockType, socketpair};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use socketcan::{CanDataFrame, Socket as _};

/// A running daemon, and the sending end of its bus.
pub(crate) struct Daemon {
    bus: socketcan::CanSocket,
    config: Config,
    stop: Stop,
    thread: Option<JoinHandle<()>>,
}

impl Daemon {
    /// Starts a daemon that listens on a Unix socket.
    pub(crate) fn start(path: &Path) -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario/mill3-edge.toml");
        let text = std::fs::read_to_string(&file).unwrap();
        let text = text.replace("rate_hz = 2000.0", "rate_hz = 2000.0\nrecord_samples = 256");
        let text = text.replace("[2.0, 200.0]", "[20.0, 150.0]");
        let config = Config::parse(&file, &text).unwrap();
        let (ours, theirs) =
            socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)
                .unwrap();
        let mut source = CanSocket::from_pair(ours).unwrap();
        let listeners = [Listener::bind(&Listen::Unix(path.to_owned())).unwrap()];
        let stop = Stop::new();
        let thread = {
            let (config, stop) = (config.clone(), stop.clone());
            thread::spawn(move || {
                daemon::run(&config, &mut source, &listeners, &stop).unwrap();
            })
        };
        Self { bus: theirs.into(), config, stop, thread: Some(thread) }
    }

    pub(crate) fn send(&self, reading: Reading) {
        for frame in self.config.signals.encode(&[reading]).unwrap() {
            self.bus.write_frame(&CanDataFrame::new(frame.id, frame.data()).unwrap()).unwrap();
        }
    }

    /// A rest and a cut at one pose, of which the daemon makes a record: a block of a ton that is pushed, with noise of both
    /// sensors.
    pub(crate) fn cut(&self, seed: u64) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut noise = || (rng.next_u32() >> 8) as f32 / (1 << 23) as f32 - 1.0;
        (0..3).for_each(|index| self.send(Reading::Joint { index, value: 0.0 }));
        let mut state = [(0.0, 0.0); 3];
        let start = Instant::now();
        for counter in 0..640 {
            // At another rate than the config's, records are refused.
            let due = start + counter * Duration::from_micros(500);
            thread::sleep(due.saturating_duration_since(Instant::now()));
            let force = state.each_mut().map(|(smooth, force)| {
                // White force counts as noise of the sensor: cutting is smooth.
                *smooth = 0.8 * *smooth + 100.0 * noise();
                *force = 0.8 * *force + *smooth;
                if counter < 256 { 0.0 } else { *force }
            });
            let value = force.map(|force| force + 0.5 * noise());
            self.send(Reading::Force { counter, value });
            self.send(Reading::Acceleration { counter, value: value.map(|force| force * 1e-3) });
        }
    }
}

/// The daemon ends as by SIGTERM.
impl Drop for Daemon {
    fn drop(&mut self) {
        self.stop.request();
        if let Some(thread) = self.thread.take() {
            // A daemon that failed has said why.
            let _ = thread.join();
        }
    }
}
