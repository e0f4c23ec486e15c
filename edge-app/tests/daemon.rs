//! The real daemon in this process, on a socket pair that carries the same frames as a bus.

use std::io::Read;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use embedded_can::{Frame as _, StandardId};
use flexid_core::stream::Reading;
use flexid_edge::daemon;
use flexid_edge::server::Listener;
use flexid_pipeline::Outcome;
use flexid_pipeline::config::{Config, Listen};
use flexid_pipeline::source::CanSocket;
use flexid_pipeline::stop::Stop;
use flexid_wire::finding::Finding;
use flexid_wire::framing::{Decoder, FRAME_BUFFER, encode};
use flexid_wire::messages::{BusHealth, BusState, FromEdge, Hello, Status, ToEdge};
use flexid_wire::spectra::Spectra;
use flexid_wire::trouble::BusFaultKind;
use nix::sys::socket::{AddressFamily, SockFlag, SockType, socketpair};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use socketcan::{CanDataFrame, CanErrorFrame, Socket as _};

/// Nothing here takes nearly as long; a test that waits for it has failed.
const PATIENCE: Duration = Duration::from_secs(60);

/// The sending end of the bus.
struct Bus {
    socket: socketcan::CanSocket,
    config: Config,
}

/// A client that has been greeted.
struct Client {
    stream: UnixStream,
    decoder: Decoder,
}

/// Runs the daemon on the reference scenario, but with short records, while `test` has the bus and a way to
/// connect; its outcome.
fn with_daemon(test: impl FnOnce(Bus, &dyn Fn() -> Client, &Stop)) -> Outcome {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario/mill3-edge.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let text = text.replace("rate_hz = 2000.0", "rate_hz = 2000.0\nrecord_samples = 256");
    let text = text.replace("[2.0, 200.0]", "[20.0, 150.0]");
    let config = Config::parse(&file, &text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (ours, theirs) =
        socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC).unwrap();
    let mut source = CanSocket::from_pair(ours).unwrap();
    let stop = Stop::new();
    thread::scope(|scope| {
        let daemon = scope.spawn(|| daemon::run(&config, &mut source, &listeners, &stop));
        let bus = Bus { socket: theirs.into(), config: config.clone() };
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            test(bus, &|| Client::connect(&path), &stop);
        }));
        stop.request();
        let outcome = outcome.map(|()| daemon.join().unwrap().unwrap());
        outcome.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

impl Bus {
    fn send(&self, reading: Reading) {
        for frame in self.config.signals.encode(&[reading]).unwrap() {
            self.socket.write_frame(&CanDataFrame::new(frame.id, frame.data()).unwrap()).unwrap();
        }
    }

    fn send_raw(&self, id: u16, data: &[u8]) {
        let id = StandardId::new(id).unwrap();
        self.socket.write_frame(&CanDataFrame::new(id, data).unwrap()).unwrap();
    }

    /// An error frame of this class, with what the controller says.
    fn error(&self, class: u32, says: u8) {
        let frame = CanErrorFrame::new_error(class, &[0, says, 0, 0, 0, 0, 0, 0]).unwrap();
        self.socket.write_frame(&frame).unwrap();
    }

    /// One instant of both sensors: a block of a ton that is pushed.
    fn instant(&self, counter: u32, force: [f32; 3]) {
        self.send(Reading::Force { counter, value: force });
        self.send(Reading::Acceleration { counter, value: force.map(|force| force * 1e-3) });
    }

    /// A rest of 256 instants and a cut of 384, in which the force along each axis is what `next` says; both have noise.
    fn cut(&self, mut next: impl FnMut(u32, &mut dyn FnMut() -> f32) -> [f32; 3]) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut noise = || (rng.next_u32() >> 8) as f32 / (1 << 23) as f32 - 1.0;
        self.joints();
        let start = Instant::now();
        for counter in 0..640 {
            // At another rate than the config's, records are refused.
            let due = start + counter * Duration::from_micros(500);
            thread::sleep(due.saturating_duration_since(Instant::now()));
            let force = if counter < 256 { [0.0; 3] } else { next(counter, &mut noise) };
            self.instant(counter, force.map(|force| force + 0.5 * noise()));
        }
    }

    fn joints(&self) {
        for index in 0..3 {
            self.send(Reading::Joint { index, value: 0.0 });
        }
    }
}

impl Client {
    fn connect(path: &Path) -> Self {
        let mut stream = UnixStream::connect(path).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut buffer = [0; FRAME_BUFFER];
        let hello = encode(&ToEdge::Hello(Hello::new("test")), &mut buffer).unwrap();
        std::io::Write::write_all(&mut stream, hello).unwrap();
        let mut client = Self { stream, decoder: Decoder::new() };
        assert!(matches!(client.receive(), Some(FromEdge::Hello(_))));
        client
    }

    /// The next message; `None` at the end of the stream.
    fn receive(&mut self) -> Option<FromEdge> {
        loop {
            if let Some(message) = self.decoder.next().unwrap() {
                return Some(message);
            }
            match self.stream.read(self.decoder.space()).unwrap() {
                0 => return None,
                bytes => self.decoder.advance(bytes),
            }
        }
    }

    /// Waits for a finding. Returns it with the spectra that have come before.
    fn finding(&mut self) -> (Finding, Option<Spectra>) {
        let mut spectra = None;
        loop {
            match self.receive().expect("the daemon ended") {
                FromEdge::Spectra(own) => spectra = Some(own),
                FromEdge::Finding(finding) => return (finding, spectra),
                _ => {}
            }
        }
    }

    /// Waits for the bus to be as `wanted`.
    fn bus_health(&mut self, wanted: impl Fn(&BusHealth) -> bool) -> BusHealth {
        let begun = Instant::now();
        while let Some(message) = self.receive() {
            assert!(begun.elapsed() < PATIENCE, "the daemon does not say it");
            match message {
                FromEdge::BusHealth(health) if wanted(&health) => return health,
                _ => {}
            }
        }
        panic!("the daemon ended without it")
    }

    /// Waits for the daemon to say `wanted`.
    fn state(&mut self, wanted: &str) -> Status {
        let begun = Instant::now();
        while let Some(message) = self.receive() {
            assert!(begun.elapsed() < PATIENCE, "the daemon does not say {wanted:?}");
            match message {
                FromEdge::Status(status) if status.state.to_string().contains(wanted) => {
                    return status;
                }
                _ => {}
            }
        }
        panic!("the daemon ended without saying {wanted:?}")
    }
}

#[test]
fn says_what_it_waits_for() {
    with_daemon(|bus, connect, _| {
        let mut client = connect();
        let status = client.state("waiting for frames");
        assert_eq!((status.model.as_str(), status.joints), ("mill3", 3));
        assert_eq!(status.interface, "vcan0");
        bus.send(Reading::Joint { index: 1, value: 0.5 });
        client.state("waiting for force frames");
        bus.instant(0, [0.0; 3]);
        client.state("waiting for joint angles: joint_1, joint_3 not seen");
        bus.send(Reading::Joint { index: 0, value: 0.0 });
        bus.send(Reading::Joint { index: 2, value: 0.0 });
        client.state("waiting for the first record: 0.1 s of milling, standing or at an even feed");
    });
}

/// A daemon at another bit rate than the bus hears errors and no frame. What is over is no trouble any more.
#[test]
fn says_what_the_bus_reports() {
    with_daemon(|bus, connect, _| {
        let mut client = connect();
        (0..7).for_each(|_| bus.error(0x088, 0));
        client.state(
            "waiting for frames: 7 errors of the bus and no frame: is the bit rate of vcan0",
        );
        for times in 1..3 {
            bus.error(0x040, 0);
            let health = client.bus_health(|health| health.errors.bus_off == times);
            assert_eq!((health.state, health.errors.protocol), (BusState::BusOff, 7));
            let fault = health.fault.map(|fault| fault.kind);
            assert_eq!(fault, Some(BusFaultKind::BusOff));
            bus.error(0x100, 0);
            let health = client.bus_health(|health| health.errors.restarted == times);
            assert_eq!((health.state, health.fault), (BusState::Up, None));
        }
    });
}

#[test]
fn counts_what_is_wrong_on_the_bus_and_takes_the_rest() {
    with_daemon(|bus, connect, _| {
        bus.joints();
        for counter in 0..100 {
            bus.instant(counter, [0.0; 3]);
            bus.send_raw(0x101, &[0; 7]);
            bus.send_raw(0x7FF, &[0; 8]);
        }
        let health = connect().bus_health(|health| health.frames_unknown == 100);
        assert_eq!((health.frames, health.frames_lost), (200, 0));
        assert_eq!((health.frames_wrong_length, health.kernel_dropped), (100, 0));
        assert_eq!(health.state, BusState::Up);
        assert!(health.receive_buffer_bytes > 0);
    });
}

#[test]
fn a_bus_that_falls_silent_ends_the_record() {
    let outcome = with_daemon(|bus, connect, _| {
        let mut state = [(0.0, 0.0); 3];
        // White force counts as noise of the sensor: cutting is smooth.
        bus.cut(|_, noise| {
            state.each_mut().map(|(smooth, force)| {
                *smooth = 0.8 * *smooth + 100.0 * noise();
                *force = 0.8 * *force + *smooth;
                *force
            })
        });
        // No joint angle follows that would show that the robot stood still to the end.
        let (finding, spectra) = connect().finding();
        let Finding { report, confidence, .. } = &finding;
        assert_eq!((report.joints.len(), report.fit.frames), (3, 1280));
        assert_eq!(confidence.joints.len(), 3);
        let spectra = spectra.expect("the spectra come before the finding");
        assert_eq!((spectra.record, spectra.pose.len()), (1, 3));
        // The band has 17 bins of 256 samples.
        assert_eq!(spectra.bands.len(), 17);
        assert!(spectra.bands.is_sorted_by_key(|band| band.frequency_hz), "{spectra:?}");
        assert_eq!(connect().finding(), (finding, Some(spectra)), "who comes later gets both");
        drop(bus);
    });
    assert!(outcome.finding.is_some());
}

/// Who mills above the band must hear that no record is good enough, or wait for ever.
#[test]
fn says_why_records_are_refused() {
    with_daemon(|bus, connect, _| {
        let mut client = connect();
        bus.cut(|counter, _| [3.0 * (0.3 * std::f32::consts::PI * counter as f32).sin(); 3]);
        client.state("refused, the first because its force in the band is hardly above its noise");
    });
}

#[test]
fn ends_with_its_bus_and_disconnects_its_clients() {
    let outcome = with_daemon(|bus, connect, _| {
        let mut client = connect();
        client.state("waiting for frames");
        drop(bus);
        while client.receive().is_some() {}
    });
    assert!(outcome.finding.is_none() && outcome.broken.is_none());
}

#[test]
fn ends_when_it_is_asked_to() {
    let outcome = with_daemon(|bus, connect, stop| {
        let mut client = connect();
        stop.request();
        while client.receive().is_some() {}
        drop(bus);
    });
    assert!(outcome.finding.is_none() && outcome.broken.is_none());
}
