//! Numbers outlive the daemon, and a change of its config.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use std::{fs, io, thread};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use flexid_edge::daemon::{self, Daemon};
use flexid_edge::reload::Reload;
use flexid_edge::store::{self, StateError, Store};
use flexid_pipeline::config::{Config, Validity};
use flexid_pipeline::source::{Arrival, Flow, FrameSource, SourceHealth};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Counts, Intake, Outcome, Record, Solver, State};
use flexid_wire::finding::Finding;
use flexid_wire::report::Verdict;

use super::frames::{POSES, Replay, frames_with, robot};
use super::{assert_agree, timeless};

/// Nothing here takes nearly as long.
const PATIENCE: Duration = Duration::from_secs(60);

/// More records of the first pose than are kept, so that some retire.
const VISITS: [[f64; 3]; 7] =
    [POSES[0], POSES[1], POSES[0], POSES[1], POSES[0], POSES[0], POSES[1]];

/// Longer records than the other tests', without gaps: noise explains what they leave, so that they may retire.
fn config_with(from: &str, to: &str) -> Config {
    Config { record_samples: 1024, ..super::config_with(from, to) }
}

pub(crate) fn config() -> Config {
    config_with("[bus]", "[bus]")
}

/// What the robot sends.
pub(crate) fn visits(config: &Config, visits: &[[f64; 3]]) -> Vec<Arrival> {
    frames_with(config, visits, u32::MAX, 0.2, |pose| robot(config, pose))
}

/// The records of what the robot sends.
pub(crate) fn records(config: &Config, frames: Vec<Arrival>) -> Vec<Record> {
    let mut intake = Intake::new(config).unwrap();
    let mut source = Replay { frames: frames.into_iter(), breaks: false };
    let mut records = Vec::new();
    while intake.read(&mut source, Duration::ZERO, |record| records.push(record.clone())).unwrap()
        == Flow::Open
    {}
    intake.finish(|record| records.push(record.clone()));
    records
}

/// Records are large.
pub(crate) fn on_a_large_stack(test: impl FnOnce() + Send + 'static) {
    thread::Builder::new().stack_size(64 << 20).spawn(test).unwrap().join().unwrap();
}

fn solver(config: &Config, records: &[Record]) -> Solver {
    let mut solver = Solver::new(config).unwrap();
    take(&mut solver, records);
    solver
}

/// Takes each record in and settles before the next.
fn take(solver: &mut Solver, records: &[Record]) {
    for record in records {
        solver.admit(record, &Stop::new(), |_| {});
        solver.work(&Stop::new(), || false, |_| {});
    }
}

fn timeless_finding(solver: &Solver) -> Finding {
    let mut finding = solver.finding(&Counts::default(), &[]).expect("a finding");
    finding.report.fit.seconds = 0.0;
    finding
}

/// Through the file's bytes and back.
fn kept(state: &State) -> State {
    let again = store::decode(&store::encode(state).unwrap()).unwrap();
    assert_eq!(again, *state);
    again
}

#[test]
fn a_solver_goes_on_as_if_nothing_had_happened() {
    on_a_large_stack(|| {
        let config = config();
        let records = records(&config, visits(&config, &VISITS));
        let whole = solver(&config, &records);
        let expected = timeless_finding(&whole);
        assert!(whole.state(&Counts::default(), &[]).retired() > 0, "no record has retired");
        for end in [0, 1, records.len() / 2, records.len() - 1, records.len()] {
            let first = solver(&config, &records[..end]);
            let state = kept(&first.state(&Counts::default(), &[]));
            assert_eq!(state.validity(&config), Validity::Whole);
            let mut second = Solver::resume(&config, state, &Stop::new(), |_| {}).unwrap();
            if end > 0 {
                assert_eq!(timeless_finding(&second), timeless_finding(&first), "after {end}");
            }
            take(&mut second, &records[end..]);
            assert_eq!(timeless_finding(&second), expected, "interrupted after {end}");
        }
    });
}

/// A record that the end has interrupted is worked through by the next solver, from where the one before stood.
#[test]
fn a_record_that_was_interrupted_waits() {
    on_a_large_stack(|| {
        let config = config();
        let records = records(&config, visits(&config, &VISITS));
        let expected = timeless_finding(&solver(&config, &records[..2]));
        let mut first = solver(&config, &records[..1]);
        let stop = Stop::with_grace(Duration::ZERO);
        stop.request();
        first.admit(&records[1], &stop, |_| {});
        first.work(&stop, || false, |_| {});
        let mut state = kept(&first.state(&Counts::default(), &[]));
        assert_eq!(state.records(), [1, 1]);
        let waiting = state.take_waiting();
        let mut second = Solver::resume(&config, state, &Stop::new(), |_| {}).unwrap();
        take(&mut second, &[Record::clone(&waiting[0])]);
        assert_eq!(timeless_finding(&second), expected);
    });
}

#[test]
fn records_are_fitted_anew_where_only_the_fit_has_changed() {
    on_a_large_stack(|| {
        let before = config();
        let records = records(&before, visits(&before, &VISITS));
        let state = solver(&before, &records).state(&Counts::default(), &[]);
        let [count, _] = state.records();
        assert!(count > 4);
        let wider = config_with("[1.0e7, 2.0e8]", "[0.5e7, 4.0e8]");
        assert_eq!(state.validity(&wider), Validity::Records(vec!["[bounds]"]));
        let solver = Solver::resume(&wider, state.clone(), &Stop::new(), |_| {}).unwrap();
        let again = timeless_finding(&solver);
        assert_eq!(again.report.fit.records, count as u64);
        assert_eq!(solver.state(&Counts::default(), &[]).validity(&wider), Validity::Whole);

        // A lever arm that was not known before: what was measured means something else.
        let moved =
            config_with("[bus]", "[mounting]\naccelerometer_xyz_m = [0.1, 0.0, 0.0]\n[bus]");
        assert_eq!(state.validity(&moved), Validity::Nothing(vec!["[mounting]"]));
        let solver = Solver::resume(&moved, state, &Stop::new(), |_| {}).unwrap();
        assert!(solver.finding(&Counts::default(), &[]).is_none());
    });
}

/// A daemon that ends between two poses and is started again says in the end what one solver says of all records. (A
/// daemon that runs through knows the sensors' noise of the first pose at the second.)
#[test]
fn a_restarted_daemon_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flexid.state");
    let config = config();
    let mut first = visits(&config, &POSES);
    let second =
        first.split_off(first.iter().position(|each| each.time_s >= 1.0e9 + 10.0).unwrap());
    let store = Store::find(Some(&file)).unwrap();
    let run = |frames: Vec<Arrival>| {
        let (stop, listeners, store) = (Stop::new(), &[], Some(&store));
        let daemon = Daemon { config: &config, listeners, stop: &stop, reload: None, store };
        timeless(daemon.run(&mut Replay { frames: frames.into_iter(), breaks: false }).unwrap())
    };
    let half = run(first.clone());
    // A daemon that hears nothing says at once what the one before has said.
    assert_eq!(run(Vec::new()), half);
    let whole = run(second.clone());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something else was written");
    on_a_large_stack(move || {
        let mut solver = solver(&config, &records(&config, first));
        take(&mut solver, &records(&config, second));
        let mut expected = timeless_finding(&solver);
        // Twice as many as the first daemon has taken.
        expected.report.fit.frames = 2 * half.report.fit.frames;
        assert_agree(&whole, &expected);
    });
}

#[test]
fn a_file_that_is_no_state_is_put_aside() {
    on_a_large_stack(|| {
        let config = config();
        let records = records(&config, visits(&config, &VISITS));
        let state = solver(&config, &records[..2]).state(&Counts::default(), &[]);
        let whole = store::encode(&state).unwrap();
        let mut flipped = whole.clone();
        flipped[whole.len() / 2] ^= 1;
        let mut newer = whole.clone();
        newer[12] += 1;
        let cases: [(&[u8], StateError); 6] = [
            (&[], StateError::Foreign),
            (b"[model]\nfile = \"robot.toml\"\n", StateError::Foreign),
            (&whole[..14], StateError::Damaged),
            (&whole[..whole.len() - 1], StateError::Damaged),
            (&flipped, StateError::Damaged),
            (&newer, StateError::Version(8)),
        ];
        for (bytes, error) in cases {
            assert_eq!(store::decode(bytes), Err(error));
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("flexid.state");
            fs::write(&file, bytes).unwrap();
            let store = Store::find(Some(&file)).unwrap();
            assert!(store.load().is_none());
            let left: Vec<PathBuf> =
                fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
            assert!(!file.exists() && left.len() == 1, "{left:?}");
            assert_eq!(fs::read(&left[0]).unwrap(), bytes);
            store.save(&state).unwrap();
            assert_eq!(store.load(), Some(state.clone()));
        }
    });
}

/// A bus that brings what it is given, until the other end is dropped.
struct Feed(Receiver<Vec<Arrival>>);

impl FrameSource for Feed {
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        match self.0.recv_timeout(timeout) {
            Ok(frames) => batch.extend(frames),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(Flow::Ended),
        }
        Ok(Flow::Open)
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}

/// A kill while waiting records are worked off, which may come at any moment, costs none of them.
#[test]
fn records_wait_until_they_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::find(Some(&folder.path().join("flexid.state"))).unwrap();
    on_a_large_stack(move || {
        let config = config();
        let records = records(&config, visits(&config, &VISITS));
        let waiting: Vec<_> = records[..3].iter().cloned().map(Arc::new).collect();
        let state = Solver::new(&config).unwrap().state(&Counts::default(), &waiting);
        store.save(&state).unwrap();
        let ended = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                let (stop, listeners, store) = (Stop::new(), &[], Some(&store));
                let daemon =
                    Daemon { config: &config, listeners, stop: &stop, reload: None, store };
                let frames = Vec::new().into_iter();
                daemon.run(&mut Replay { frames, breaks: false }).unwrap();
                ended.store(true, Ordering::Relaxed);
            });
            let mut looked = 0;
            while !ended.load(Ordering::Relaxed) {
                let records = store.load().unwrap().records();
                assert_eq!(records[0] + records[1], 3);
                looked += 1;
            }
            assert!(looked > 0, "it has ended before its file was looked at");
        });
        assert_eq!(store.load().unwrap().records(), [3, 0]);
    });
}

/// More early ends in a row than there are places: the newest records stay, and the file is right.
#[test]
fn records_that_wait_are_bounded() {
    on_a_large_stack(|| {
        let config = config();
        let records = records(&config, visits(&config, &POSES[..1]));
        let record = Arc::new(records[0].clone());
        let waiting: Vec<_> = (0..100).map(|_| Arc::clone(&record)).collect();
        let state = Solver::new(&config).unwrap().state(&Counts::default(), &waiting);
        assert_eq!(kept(&state).records(), [0, 64]);
    });
}

/// A file that an earlier flexid of this version has written.
#[test]
fn the_format_stays() {
    on_a_large_stack(|| {
        let bytes = include_bytes!("../../../tests/fuzz/seeds/state/waiting.state");
        let state = store::decode(bytes).unwrap();
        assert_eq!(state.records(), [0, 1]);
        assert_eq!(store::encode(&state).unwrap(), bytes);
    });
}

/// One file is one daemon's.
#[test]
fn a_file_is_claimed_once() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::find(Some(&folder.path().join("flexid.state"))).unwrap();
    let claim = store.claim().unwrap();
    assert!(store.claim().unwrap_err().to_string().contains("another flexid-edge"));
    drop(claim);
    store.claim().unwrap();
}

/// SIGTERM while a record is being cut: what there is of it waits for the next daemon.
#[test]
fn the_end_in_mid_record_keeps_the_record() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::find(Some(&folder.path().join("flexid.state"))).unwrap();
    let config = config();
    let frames = visits(&config, &POSES[..1]);
    let expected = {
        let (config, frames) = (config.clone(), frames.clone());
        let large = thread::Builder::new().stack_size(64 << 20);
        large.spawn(move || records(&config, frames).len()).unwrap().join().unwrap()
    };
    let (stop, (feed, arrivals)) = (Stop::new(), bounded(0));
    thread::scope(|scope| {
        let daemon = scope.spawn(|| {
            let (listeners, store) = (&[], Some(&store));
            let daemon = Daemon { config: &config, listeners, stop: &stop, reload: None, store };
            daemon.run(&mut Feed(arrivals))
        });
        frames.chunks(500).for_each(|frames| feed.send(frames.to_vec()).unwrap());
        stop.request();
        daemon.join().unwrap().unwrap();
    });
    on_a_large_stack(move || {
        let [kept, waiting] = store.load().expect("a state").records();
        assert_eq!(kept + waiting, expected);
    });
}

/// The outcome of a daemon that gets `next` as its config between the two poses.
fn reloaded(next: Config) -> Outcome {
    let begun = config();
    let mut first = visits(&begun, &POSES);
    let second =
        first.split_off(first.iter().position(|each| each.time_s >= 1.0e9 + 10.0).unwrap());
    let (stop, reload, listeners) = (Stop::new(), Reload::new(), &[]);
    let (feed, frames): (Sender<Vec<Arrival>>, _) = bounded(0);
    thread::scope(|scope| {
        let daemon = scope.spawn(|| {
            let reload = Some(&reload);
            let daemon = Daemon { config: &begun, listeners, stop: &stop, reload, store: None };
            daemon.run(&mut Feed(frames))
        });
        // In small pieces, as a bus brings them.
        first.chunks(500).for_each(|frames| feed.send(frames.to_vec()).unwrap());
        reload.offer(next);
        let begun = Instant::now();
        while reload.is_pending() {
            assert!(begun.elapsed() < PATIENCE, "the daemon does not take the config");
            thread::sleep(Duration::from_millis(10));
        }
        second.chunks(500).for_each(|frames| feed.send(frames.to_vec()).unwrap());
        drop(feed);
        daemon.join().unwrap().unwrap()
    })
}

#[test]
fn a_daemon_takes_another_config_and_keeps_its_records() {
    let count = |outcome: Outcome| {
        let fit = timeless(outcome).report.fit;
        (fit.records, fit.frames, fit.frames_lost)
    };
    let all = timeless(reloaded(config()));
    assert!(all.report.fit.records >= 4, "{:?}", all.report.fit);

    // Under the same config nothing changes.
    let through = daemon::run(
        &config(),
        &mut Replay { frames: visits(&config(), &POSES).into_iter(), breaks: false },
        &[],
        &Stop::new(),
    );
    assert_agree(&timeless(through.unwrap()), &all);

    let fixed = "[parameters]\nfixed = { \"joint_1.stiffness.tx\" = 1e8 }\n\n[bus]";
    let outcome = timeless(reloaded(config_with("[bus]", fixed)));
    assert_eq!(outcome.report.joints[0].stiffness_verdict[0], Verdict::Fixed);
    assert_eq!(outcome.report.fit.frames, all.report.fit.frames);
    assert_eq!(outcome.report.fit.records, all.report.fit.records);

    // Another layout of the frames: what is being recorded is complete, and what follows is of another measurement.
    let mounted = "[mounting]\naccelerometer_xyz_m = [0.1, 0.0, 0.0]\n\n[bus]";
    let (records, frames, lost) = count(reloaded(config_with("[bus]", mounted)));
    assert!(records < all.report.fit.records, "{records} records");
    assert_eq!((frames, lost), (all.report.fit.frames, all.report.fit.frames_lost));
}
