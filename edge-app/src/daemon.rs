//! The daemon: a thread that reads the bus, one that solves, and one for each client.
//!
//! Reading never waits: a record for which there is no room is given up, and a message for a client is put on
//! the board and fetched from there.

use std::io;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::{self, ScopedJoinHandle};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};
use flexid_wire::messages::{BusHealth, BusState, FromEdge, Phase, Status};
use flexid_wire::text::clipped;
use tracing::{error, info, warn};

use crate::board::Board;
use crate::config::Config;
use crate::pipeline::{Counts, Intake, Outcome, Record, STACK, Solver, unchecked};
use crate::server::{self, Listener};
use crate::source::{Flow, FrameSource, LinkState, SourceHealth};
use crate::stop::Stop;

/// Records that may wait for the solver: more than half a minute of milling.
const QUEUE: usize = 8;
/// The reader looks at the stop switch this often when the bus is silent.
const LOOK: Duration = Duration::from_millis(200);
/// Force and acceleration that stay away this long end what was being recorded.
const SILENCE: Duration = Duration::from_secs(1);
/// News of the bus and of the work come this often at most.
const BUS_NEWS: Duration = Duration::from_millis(500);
const WORK_NEWS: Duration = Duration::from_millis(100);

/// Why the solver has found nothing although there are records.
type Refusal = Mutex<Option<String>>;
/// A record on its way to the solver, with what had come in when it was cut.
type Parcel = (Box<Record>, Counts);

/// Runs until `stop`, or until `source` ends. What was read by then is used, unless `stop` asks for haste.
///
/// # Errors
/// The system gave no thread, or one of them has died.
pub fn run(
    config: &Config,
    source: &mut dyn FrameSource,
    listeners: &[Listener],
    stop: &Stop,
) -> io::Result<Outcome> {
    let board = Board::new();
    thread::scope(|scope| {
        let server = thread::Builder::new().name("flexid-server".into());
        let server = server.spawn_scoped(scope, || server::serve(listeners, &board, stop))?;
        let outcome = work(config, source, &board, stop);
        // Whatever has happened, the server is told of the end.
        board.close();
        stop.request();
        join(server)?;
        outcome
    })
}

/// Reads and solves; the last report is on the board when it is done.
fn work(
    config: &Config,
    source: &mut dyn FrameSource,
    board: &Board,
    stop: &Stop,
) -> io::Result<Outcome> {
    let (sender, receiver) = bounded(QUEUE);
    let refusal: &Refusal = &Mutex::new(None);
    let big = |name: &str| thread::Builder::new().name(name.into()).stack_size(STACK);
    let (mut outcome, solver) = thread::scope(|scope| {
        let reader = Reader { config, board, refusal, stop };
        let reader =
            big("flexid-reader").spawn_scoped(scope, move || reader.run(source, sender))?;
        let solver = big("flexid-solver").spawn_scoped(scope, move || {
            // Without a solver there is nothing to read for.
            let _end = StopAtEnd(stop);
            solve(config, &receiver, board, refusal, stop)
        });
        let solver = solver.inspect_err(|_| stop.request())?;
        let outcome = join(reader);
        let solver = join(solver)?;
        Ok::<_, io::Error>((outcome?, solver))
    })?;
    outcome.finding = solver.finding(&outcome.counts, &outcome.trouble);
    if let Some(refusal) = solver.refusal() {
        outcome.state = refusal;
    }
    if let Some(finding) = &mut outcome.finding {
        finding.explain(&outcome.state);
        board.publish_together(finding.messages());
    }
    Ok(outcome)
}

/// Asks for the end when it goes, even by a panic.
struct StopAtEnd<'a>(&'a Stop);

impl Drop for StopAtEnd<'_> {
    fn drop(&mut self) {
        self.0.request();
    }
}

/// What a thread has come to; its panic, which is a bug, is an error here, so that the others end in order.
fn join<T>(thread: ScopedJoinHandle<'_, io::Result<T>>) -> io::Result<T> {
    let name = thread.thread().name().unwrap_or_default().to_string();
    thread.join().unwrap_or_else(|_| Err(io::Error::other(format!("the thread {name} has died"))))
}

/// The thread that reads the bus.
struct Reader<'a> {
    config: &'a Config,
    board: &'a Board,
    refusal: &'a Refusal,
    stop: &'a Stop,
}

impl Reader<'_> {
    /// Reads to the end; the outcome as far as it is known here.
    fn run(&self, source: &mut dyn FrameSource, sender: Sender<Parcel>) -> io::Result<Outcome> {
        let mut intake = Intake::new(self.config).map_err(unchecked)?;
        let begun = Instant::now();
        let (mut told, mut told_frames, mut given_up) = (begun, 0, 0);
        let (mut flow, mut broken) = (Flow::Open, None);
        let (mut heard, mut heard_frames) = (begun, 0);
        let mut health = source.health();
        self.tell(&intake, &health, begun, 0.0, given_up);
        while flow == Flow::Open && !self.stop.requested() {
            let mut cut = Vec::new();
            let mut keep = |record: &Record| cut.push(Box::new(record.clone()));
            flow = intake.read(source, LOOK, &mut keep).unwrap_or_else(|error| {
                error!("the bus cannot be read any more: {error}");
                broken = Some(error);
                Flow::Ended
            });
            // A robot that rests tells nothing that would end its last record.
            let frames = intake.counts().stream.frames;
            if frames > heard_frames && flow == Flow::Open {
                (heard, heard_frames) = (Instant::now(), frames);
            } else if flow == Flow::Ended || heard.elapsed() >= SILENCE {
                intake.finish(&mut keep);
                heard = Instant::now();
            }
            given_up += self.hand_over(cut, intake.counts(), &sender);
            let elapsed = told.elapsed();
            if elapsed >= BUS_NEWS || flow == Flow::Ended {
                let frames = intake.counts().all;
                let rate = (frames - told_frames) as f64 / elapsed.as_secs_f64();
                health = log_changes(&health, source.health());
                self.tell(&intake, &health, begun, rate, given_up);
                (told, told_frames) = (Instant::now(), frames);
            }
        }
        Ok(Outcome {
            finding: None,
            counts: intake.counts(),
            state: intake.state(self.config),
            trouble: match &broken {
                Some(error) => format!("the bus cannot be read any more: {error}"),
                None => health.trouble,
            },
            broken,
        })
    }

    /// Sends records to the solver; the samples of those for which there is no room.
    fn hand_over(&self, records: Vec<Box<Record>>, counts: Counts, sender: &Sender<Parcel>) -> u64 {
        let mut given_up = 0;
        for record in records {
            info!("record {} at pose {:.4?}", counts.stream.records, record.pose);
            match sender.try_send((record, counts)) {
                Ok(()) => {}
                Err(TrySendError::Full((record, _))) => {
                    warn!("the solver is {QUEUE} records behind: a record is given up");
                    given_up += record.force[0].len() as u64;
                }
                // It has asked for the end.
                Err(TrySendError::Disconnected((record, _))) => {
                    given_up += record.force[0].len() as u64;
                }
            }
        }
        given_up
    }

    fn tell(
        &self,
        intake: &Intake,
        health: &SourceHealth,
        begun: Instant,
        frames_per_second: f64,
        given_up: u64,
    ) {
        let Config { model, interface, .. } = self.config;
        let counts = intake.counts();
        let stream = &counts.stream;
        self.board.publish(FromEdge::Status(Status {
            uptime_s: begun.elapsed().as_secs_f64(),
            model: clipped(&model.name),
            joints: model.joints.len() as u8,
            interface: clipped(interface),
            state: match health.link {
                LinkState::Up => match lock(self.refusal).as_deref() {
                    Some(refusal) => clipped(refusal),
                    None => clipped(intake.state(self.config)),
                },
                LinkState::Down | LinkState::Gone => clipped(&health.trouble),
            },
        }));
        self.board.publish(FromEdge::BusHealth(BusHealth {
            state: match health.link {
                LinkState::Up => BusState::Up,
                LinkState::Down => BusState::Down,
                LinkState::Gone => BusState::Gone,
            },
            frames: stream.frames,
            frames_lost: stream.frames_lost,
            bridged: stream.bridged,
            restarts: stream.restarts,
            repeated: stream.repeated,
            frames_wrong_length: counts.wrong_length,
            frames_unknown: counts.unknown,
            frames_not_data: counts.not_data,
            frames_clipped: counts.clipped,
            kernel_dropped: health.kernel_dropped,
            receive_buffer_bytes: health.receive_buffer_bytes,
            samples_discarded: stream.samples_discarded + given_up,
            refused: stream.refused,
            wrong_rate: stream.wrong_rate,
            measured_rate_hz: stream.measured_rate_hz,
            frames_per_second,
            error: clipped(&health.trouble),
        }));
    }
}

/// What is guarded is whole between any two statements.
fn lock(refusal: &Refusal) -> MutexGuard<'_, Option<String>> {
    refusal.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Tells the log what is new at the source.
fn log_changes(before: &SourceHealth, now: SourceHealth) -> SourceHealth {
    if now.trouble != before.trouble {
        warn!("{}", now.trouble);
    }
    if now.link == LinkState::Up && before.link != LinkState::Up {
        info!("the link is up again");
    }
    if now.kernel_dropped > before.kernel_dropped {
        let dropped = now.kernel_dropped - before.kernel_dropped;
        warn!("the kernel dropped {dropped} frames: raise net.core.rmem_max");
    }
    now
}

/// The thread that solves: record by record, until there are no more.
fn solve<'a>(
    config: &'a Config,
    records: &Receiver<Parcel>,
    board: &Board,
    refusal: &Refusal,
    stop: &Stop,
) -> io::Result<Solver<'a>> {
    let mut solver = Solver::new(config)?;
    board.publish(FromEdge::Progress(solver.progress()));
    if let Some(finding) = solver.finding(&Counts::default(), "") {
        board.publish_together(finding.messages());
    }
    for (record, counts) in records {
        let (mut told, mut phase) = (Instant::now(), Phase::Waiting);
        solver.take(&record, stop, |progress| {
            if progress.phase != phase || told.elapsed() >= WORK_NEWS {
                board.publish(FromEdge::Progress(*progress));
                (told, phase) = (Instant::now(), progress.phase);
            }
        });
        board.publish(FromEdge::Progress(solver.progress()));
        let finding = solver.finding(&counts, "");
        *lock(refusal) = if finding.is_none() { solver.refusal() } else { None };
        if let Some(finding) = finding {
            board.publish_together(finding.messages());
        }
        if stop.requested() {
            solver.leave(records.try_iter().count() as u64);
            break;
        }
    }
    if let Some(refusal) = solver.refusal() {
        warn!("{refusal}");
    }
    Ok(solver)
}
