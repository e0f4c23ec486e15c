//! The daemon: one thread reads the bus, one solves, and one serves each client.
//!
//! Reading never waits for the solver or a client. A record without room in the queue is given up. Messages
//! for clients are published, and each client's thread fetches them.

mod bus_news;
mod epochs;
mod keeping;
mod order;
mod report_log;
mod solving;
mod state_log;
mod storing;

use std::io;
use std::sync::{Arc, Mutex};
use std::thread::{self, ScopedJoinHandle};
use std::time::{Duration, Instant};

use crossbeam_channel::{Sender, TrySendError, bounded};
use flexid_pipeline::config::Config;
use flexid_pipeline::source::{Flow, FrameSource, LinkState, SourceHealth};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Counts, Intake, Outcome, Record, STACK};
use flexid_wire::messages::{FromEdge, Status};
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::trouble::Trouble;
use thread_priority::{
    NormalThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id, thread_schedule_policy,
};
use tracing::{error, info, warn};

use crate::latest::Latest;
use crate::manager::Watchdog;
use crate::reload::Reload;
use crate::server::{self, Listener};
use crate::store::Store;
use crate::threads::no_thread;
use bus_news::{bus_health, log_changes};
use order::{Order, UnusedRecords, lock};
use solving::Solving;
use state_log::StateLog;

/// Most records that may wait for the solver: more than half a minute of milling.
const QUEUE: usize = 8;
/// Interval at which the reader checks the stop switch while the bus is silent.
const LOOK: Duration = Duration::from_millis(200);
/// Silence of force and acceleration after which the present record ends.
const SILENCE: Duration = Duration::from_secs(1);
/// Shortest interval between messages about the bus.
const BUS_NEWS: Duration = Duration::from_millis(500);

/// A daemon with all that it runs with.
#[derive(Clone, Copy, Debug)]
pub struct Daemon<'a> {
    /// Config at the start.
    pub config: &'a Config,
    /// Sockets on which clients are served.
    pub listeners: &'a [Listener],
    /// Switch that ends the daemon.
    pub stop: &'a Stop,
    /// Source of later configs. `None` if no config will come.
    pub reload: Option<&'a Reload>,
    /// File in which the state is kept. `None` if it need not be kept.
    pub store: Option<&'a Store>,
    /// Watchdog that ends the daemon if its reader hangs. `None` if there is none.
    pub watchdog: Option<Watchdog>,
}

/// Runs a daemon that keeps no state and whose config stays. See [`Daemon::run`].
///
/// # Errors
/// The errors are those of [`Daemon::run`].
pub fn run(
    config: &Config,
    source: &mut dyn FrameSource,
    listeners: &[Listener],
    stop: &Stop,
) -> io::Result<Outcome> {
    Daemon { config, listeners, stop, reload: None, store: None, watchdog: None }.run(source)
}

impl Daemon<'_> {
    /// Runs until `stop` is set or `source` ends. What was read by then is used, as far as the time after `stop` allows.
    ///
    /// # Errors
    /// The system cannot start a thread, or one of the threads has panicked.
    pub fn run(&self, source: &mut dyn FrameSource) -> io::Result<Outcome> {
        let Self { listeners, stop, .. } = *self;
        let latest = Latest::new();
        thread::scope(|scope| {
            let server = thread::Builder::new().name("flexid-server".into());
            let server = server
                .spawn_scoped(scope, || server::serve(listeners, &latest, stop))
                .map_err(no_thread("flexid-server"))?;
            let outcome = self.work(source, &latest);
            // The server must end in any case.
            latest.close();
            stop.request();
            join(server)?;
            outcome
        })
    }

    /// Reads and solves. The last report is published when it returns.
    fn work(&self, source: &mut dyn FrameSource, latest: &Latest) -> io::Result<Outcome> {
        let Self { config, stop, reload, store, watchdog, .. } = *self;
        let (sender, receiver) = bounded(QUEUE);
        let unused: &UnusedRecords = &Mutex::new(None);
        let big = |name: &str| thread::Builder::new().name(name.into()).stack_size(STACK);
        let (mut outcome, solving) = thread::scope(|scope| {
            let reader = Reader { latest, unused, stop, reload, watchdog };
            let reader = big("flexid-reader")
                .spawn_scoped(scope, move || reader.run(config, source, &sender))
                .map_err(no_thread("flexid-reader"))?;
            let solver = big("flexid-solver").spawn_scoped(scope, move || {
                // Without a solver there is no reason to read.
                let _end = StopAtEnd(stop);
                make_way();
                Solving::begin(config, stop, store, latest, unused)?.run(&receiver)
            });
            let solver =
                solver.inspect_err(|_| stop.request()).map_err(no_thread("flexid-solver"))?;
            let outcome = join(reader);
            let solving = join(solver)?;
            Ok::<_, io::Error>((outcome?, solving))
        })?;
        solving.end(&mut outcome);
        Ok(outcome)
    }
}

/// Gives this thread the processor only while nobody else wants it: all other work of the controller comes first, above all the reading of
/// the bus.
fn make_way() {
    let idle = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle);
    // It fails as well where the thread is idle but may not set its niceness, which then has no meaning.
    let set = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, idle);
    if let Err(error) = set
        && thread_schedule_policy() != Ok(idle)
    {
        warn!("the solver has the priority of the other threads: SCHED_IDLE is refused: {error}");
    }
}

/// Requests the end when it is dropped, even by a panic.
struct StopAtEnd<'a>(&'a Stop);

impl Drop for StopAtEnd<'_> {
    fn drop(&mut self) {
        self.0.request();
    }
}

/// Returns the result of a thread. A panic, which is a bug, becomes an error, so that the other threads end in order.
fn join<T>(thread: ScopedJoinHandle<'_, io::Result<T>>) -> io::Result<T> {
    let name = thread.thread().name().unwrap_or_default().to_string();
    thread.join().unwrap_or_else(|_| Err(io::Error::other(format!("the thread {name} has died"))))
}

/// The thread that reads the bus.
struct Reader<'a> {
    latest: &'a Latest,
    unused: &'a UnusedRecords,
    stop: &'a Stop,
    reload: Option<&'a Reload>,
    watchdog: Option<Watchdog>,
}

/// Values that stay from one config to the next.
struct Watch {
    begun: Instant,
    health: SourceHealth,
    given_up: u64,
    states: StateLog,
    watchdog: Option<Watchdog>,
    /// Time from the start to the newest record, s.
    newest_record_s: Option<f64>,
}

/// Why reading ends.
enum End {
    /// Reading ends for good.
    Outcome(Box<Outcome>),
    /// A new stream begins under another config.
    Reload(Arc<Config>),
}

impl Reader<'_> {
    /// Reads to the end. Returns the outcome as far as the reader can determine it.
    fn run(
        &self,
        config: &Config,
        source: &mut dyn FrameSource,
        sender: &Sender<Order>,
    ) -> io::Result<Outcome> {
        let mut config = Arc::new(config.clone());
        let begun = Instant::now();
        let (health, states) = (source.health(), StateLog::new(begun));
        let watchdog = self.watchdog;
        let mut watch =
            Watch { begun, health, given_up: 0, states, watchdog, newest_record_s: None };
        loop {
            match self.read(config, source, sender, &mut watch)? {
                End::Outcome(outcome) => return Ok(*outcome),
                End::Reload(next) => config = next,
            }
        }
    }

    /// Reads until the end, or until a config comes under which the frames have another meaning.
    fn read(
        &self,
        mut config: Arc<Config>,
        source: &mut dyn FrameSource,
        sender: &Sender<Order>,
        watch: &mut Watch,
    ) -> io::Result<End> {
        let streams = Arc::clone(&config);
        let mut intake = Intake::new(&streams)?;
        let begun = Instant::now();
        let (mut published, mut published_frames) = (begun, 0);
        let (mut flow, mut broken) = (Flow::Open, None);
        let (mut heard, mut heard_frames) = (begun, 0);
        let mut lost_link = false;
        self.publish(&config, &intake, watch, 0.0);
        while flow == Flow::Open && !self.stop.requested() {
            let mut cut = Vec::new();
            if std::mem::take(&mut lost_link) {
                intake.forget_angles(keep_in(&mut cut));
            }
            flow = intake.read(source, LOOK, keep_in(&mut cut)).unwrap_or_else(|error| {
                error!("the bus cannot be read any more: {error}");
                broken = Some(error);
                Flow::Ended
            });
            // A new config waits for room in the queue, so that it stays between its records. It needs room for the records
            // that are cut, for the record that it ends, and for itself.
            let has_room = sender.len() + cut.len() + 2 <= QUEUE;
            let next = self.reload.and_then(Reload::pending).filter(|_| has_room);
            let anew = next.as_ref().is_some_and(|next| {
                next.stream() != streams.stream() || next.signals != streams.signals
            });
            // While the robot rests, no reading comes that would end its last record.
            let frames = intake.counts().stream.frames;
            if frames > heard_frames && flow == Flow::Open && !anew {
                (heard, heard_frames) = (Instant::now(), frames);
            } else if flow == Flow::Ended || anew || heard.elapsed() >= SILENCE {
                intake.finish(keep_in(&mut cut));
                heard = Instant::now();
            }
            if !cut.is_empty() {
                watch.newest_record_s = Some(watch.begun.elapsed().as_secs_f64());
            }
            watch.given_up += self.hand_over(cut, intake.counts(), source, sender);
            if let Some(next) = next {
                let counts = intake.counts();
                let order = Order::Reload { config: Arc::clone(&next), counts, anew };
                if sender.try_send(order).is_ok() {
                    self.reload.inspect(|reload| reload.taken(&next));
                    if anew && flow == Flow::Open {
                        return Ok(End::Reload(next));
                    }
                    config = next;
                }
            }
            let elapsed = published.elapsed();
            if elapsed >= BUS_NEWS || flow == Flow::Ended {
                let frames = intake.counts().all;
                let rate = (frames - published_frames) as f64 / elapsed.as_secs_f64();
                let now = source.health();
                lost_link = now.link_losses > watch.health.link_losses;
                watch.health = log_changes(&watch.health, now);
                self.publish(&config, &intake, watch, rate);
                (published, published_frames) = (Instant::now(), frames);
                // Here all of the reader's work is done once: wherever it hangs, the watchdog hears nothing.
                watch.watchdog.as_mut().into_iter().for_each(Watchdog::tell);
            }
        }
        self.keep_last(&mut intake, source, sender);
        Ok(End::Outcome(Box::new(Outcome {
            clocks: None,
            finding: None,
            robot: None,
            shared: None,
            statics: None,
            records: Vec::new(),
            course: Vec::new(),
            counts: intake.counts(),
            state: intake.state(&config),
            troubles: match &broken {
                Some(error) => vec![Trouble::BusBroken(clipped(error))],
                None => watch.health.troubles(),
            },
            broken,
        })))
    }

    /// Ends the present record at the end of the run, and waits for room in the queue. The solver takes no more time for the
    /// record then, but keeps it for the next daemon.
    fn keep_last(&self, intake: &mut Intake, source: &dyn FrameSource, sender: &Sender<Order>) {
        let mut cut = Vec::new();
        intake.finish(keep_in(&mut cut));
        for record in dated(cut, source) {
            // Without a solver the record cannot be kept.
            let _ = sender.send(Order::Record(record, intake.counts()));
        }
    }

    /// Sends records to the solver. Returns the number of samples in the records for which there is no room.
    fn hand_over(
        &self,
        records: Vec<Box<Record>>,
        counts: Counts,
        source: &dyn FrameSource,
        sender: &Sender<Order>,
    ) -> u64 {
        let mut given_up = 0;
        let first = counts.stream.records + 1 - records.len() as u64;
        for (number, record) in (first..).zip(dated(records, source)) {
            info!("record {number} at pose {:.4?}", record.pose);
            let samples = record.force[0].len() as u64;
            match sender.try_send(Order::Record(record, counts)) {
                Ok(()) => {}
                Err(TrySendError::Full(_)) => {
                    warn!("the solver is {QUEUE} records behind: a record is given up");
                    given_up += samples;
                }
                // The solver has ended, and has requested the end.
                Err(TrySendError::Disconnected(_)) => given_up += samples,
            }
        }
        given_up
    }

    fn publish(&self, config: &Config, intake: &Intake, watch: &mut Watch, frames_per_second: f64) {
        let Config { model, interface, .. } = config;
        let Watch { begun, health, given_up, states, newest_record_s, .. } = watch;
        let counts = intake.counts();
        let state = intake.state(config);
        let unused = || lock(self.unused).clone().map(State::Unused);
        // An obstacle to the next record comes before the fate of the last.
        let state = match state {
            State::NoFrames | State::AwaitingRecord { .. } | State::Measuring { .. } => {
                unused().unwrap_or(state)
            }
            state => state,
        };
        let fault = health.fault.as_ref().filter(|_| health.link != LinkState::Up);
        states.log(Some(&state).filter(|_| fault.is_none()), &counts, Instant::now());
        self.latest.publish(FromEdge::Status(Status {
            uptime_s: begun.elapsed().as_secs_f64(),
            model: clipped(&model.name),
            joints: model.joints.len() as u8,
            interface: clipped(interface),
            state: fault.map_or(state, |fault| State::BusFault(fault.clone())),
            record_fraction: intake.record_fraction(),
            newest_record_s: *newest_record_s,
        }));
        self.latest.publish(FromEdge::BusHealth(bus_health(
            &counts,
            health,
            *given_up,
            frames_per_second,
        )));
    }
}

/// Gives records the times at which they began since 1970, which hold after a restart.
fn dated(records: Vec<Box<Record>>, source: &dyn FrameSource) -> impl Iterator<Item = Box<Record>> {
    records.into_iter().map(|mut record| {
        record.start_s = source.since_1970_s(record.start_s);
        record
    })
}

/// Copies records, which are large, to the heap.
fn keep_in(cut: &mut Vec<Box<Record>>) -> impl FnMut(&Record) {
    |record| cut.push(Box::new(record.clone()))
}
