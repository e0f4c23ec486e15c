//! Numbers outlive the daemon, and a change of its config.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use std::{fs, thread};

use crossbeam_channel::{Sender, bounded};
use flexid_core::imperfection::Accuracies;
use flexid_core::stream::StreamHealth;
use flexid_edge::daemon::{self, Daemon};
use flexid_edge::reload::Reload;
use flexid_edge::store::{self, Store};
use flexid_pipeline::config::{Config, Validity};
use flexid_pipeline::source::{Arrival, Flow};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Counts, Intake, Outcome, Record, Solver, State};
use flexid_wire::finding::Finding;
use flexid_wire::report::Verdict;

use super::frames::{Feed, POSES, Replay, frames_with, robot};
use super::{assert_agree, keeping, timeless};

/// Nothing here takes nearly as long.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// More records of the first pose than are kept, so that some retire.
pub(crate) const VISITS: [[f64; 3]; 7] =
    [POSES[0], POSES[1], POSES[0], POSES[1], POSES[0], POSES[0], POSES[1]];

/// Longer records than the other tests', without gaps: noise explains what they leave, so that they may retire.
pub(crate) fn config_with(from: &str, to: &str) -> Config {
    Config { record_samples: 1024, ..super::config_with(from, to) }
}

pub(crate) fn config() -> Config {
    config_with("[bus]", "[bus]")
}

/// The frames that the robot sends.
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

/// The names of the files in a folder.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    let mut names: Vec<_> = entries.map(|name| name.into_string().unwrap()).collect();
    names.sort();
    names
}

pub(crate) fn solver(config: &Config, records: &[Record]) -> Solver {
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
    goes_on_as_if_nothing_had_happened(config());
}

/// Records retire with the imperfections that they share.
#[test]
fn a_solver_of_a_plant_goes_on_as_if_nothing_had_happened() {
    let accuracies = Accuracies::typical();
    goes_on_as_if_nothing_had_happened(Config { accuracies, ..config() });
}

fn goes_on_as_if_nothing_had_happened(config: Config) {
    on_a_large_stack(move || {
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
    let run = |frames: Vec<Arrival>| {
        let store = Store::find(Some(&file)).unwrap();
        let stop = Stop::new();
        let daemon = keeping(&config, &stop, &store);
        timeless(daemon.run(&mut Replay { frames: frames.into_iter(), breaks: false }).unwrap())
    };
    let half = run(first.clone());
    // A daemon that hears nothing says at once what the one before has said.
    assert_eq!(run(Vec::new()), half);
    let whole = run(second.clone());
    assert_eq!(names(folder.path()), ["flexid.state", "flexid.state.lock"]);
    on_a_large_stack(move || {
        let mut solver = solver(&config, &records(&config, first));
        take(&mut solver, &records(&config, second));
        let mut expected = timeless_finding(&solver);
        // Twice as many as the first daemon has taken.
        expected.report.fit.frames = 2 * half.report.fit.frames;
        assert_agree(&whole, &expected);
    });
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
                let stop = Stop::new();
                let daemon = keeping(&config, &stop, &store);
                let frames = Vec::new().into_iter();
                daemon.run(&mut Replay { frames, breaks: false }).unwrap();
                ended.store(true, Ordering::Relaxed);
            });
            let mut looked = 0;
            while !ended.load(Ordering::Relaxed) {
                let records = store.load().unwrap().unwrap().records();
                assert_eq!(records[0] + records[1], 3);
                looked += 1;
            }
            assert!(looked > 0, "it has ended before its file was looked at");
        });
        assert_eq!(store.load().unwrap().unwrap().records(), [3, 0]);
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

/// The file of a daemon that wrote format 8, before records had paths. If this fails, an upgrade forgets all robots: convert what has changed, or
/// give the parts of the configuration that are compared their old text.
#[test]
fn the_previous_format_is_read() {
    on_a_large_stack(|| {
        let state = store::decode(include_bytes!("format8.state")).unwrap();
        let now = store::decode(include_bytes!("format9.state")).unwrap();
        assert_eq!(state, now);
        // Both have fit 4.
        assert_eq!((now.records(), now.lacks_fit()), ([4, 0], true));
    });
}

/// The file of a daemon that wrote format 9 and fit 5.
#[test]
fn the_fit_of_this_version_stays() {
    on_a_large_stack(|| {
        let config = super::config();
        let bytes = include_bytes!("fit5.state");
        let state = store::decode(bytes).unwrap();
        assert_eq!((state.records(), state.retired(), state.lacks_fit()), ([4, 0], 4, false));
        assert_eq!(state.validity(&config), Validity::Whole);
        assert_eq!(store::encode(&state).unwrap(), bytes);
        let solver = Solver::resume(&config, state, &Stop::new(), |_| {}).unwrap();
        let report = solver.finding(&Counts::default(), &[]).unwrap().report;
        assert_eq!(report.fit.records, 8);
        assert!(report.fit.frames > 4000, "{:?}", report.fit);
    });
}

/// Leaves the frozen state behind as this version makes it, to be frozen when the format or the meaning of a fit has changed.
#[test]
fn this_version_makes_the_frozen_state() {
    on_a_large_stack(|| {
        let config = super::config();
        let frames = visits(&config, &[POSES[0]; 8]);
        let counts = Counts {
            stream: StreamHealth { frames: 4480, ..StreamHealth::default() },
            ..Counts::default()
        };
        let state = solver(&config, &records(&config, frames)).state(&counts, &[]);
        let bytes = store::encode(&state).unwrap();
        let decoded = store::decode(&bytes).unwrap();
        assert!(!decoded.lacks_fit());
        assert_eq!(store::encode(&decoded).unwrap(), bytes);
        fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/fit5.state"), bytes).unwrap();
    });
}

/// A fit of another version, or one that is none, is left out, and the records are fitted anew.
#[test]
fn records_outlive_the_format_of_the_fit() {
    on_a_large_stack(|| {
        let config = super::config();
        let records = records(&config, visits(&config, &POSES));
        let state = solver(&config, &records[..2]).state(&Counts::default(), &[]);
        let bytes = store::encode(&state).unwrap();
        // Behind the header: the checksums of the config, and three counts of 0; then the fit is there, of version 5, behind its length.
        let header = 20;
        let (_, rest) =
            postcard::take_from_bytes::<([u32; 11], [u64; 3])>(&bytes[header..]).unwrap();
        let version = bytes.len() - rest.len() + 1;
        assert_eq!(bytes[version - 1..=version], [1, 5]);
        let changed = |change: fn(&mut [u8])| {
            let mut bytes = bytes.clone();
            change(&mut bytes[version..]);
            let checksum = crc32fast::hash(&bytes[header..]);
            bytes[header - 4..header].copy_from_slice(&checksum.to_le_bytes());
            store::decode(&bytes).unwrap()
        };
        for older in [changed(|fit| fit[0] = 1), changed(|fit| fit[5..2005].fill(0xFF))] {
            assert!(older.lacks_fit());
            assert_eq!(older.records(), [2, 0]);
            let solver = Solver::resume(&config, older, &Stop::new(), |_| {}).unwrap();
            assert_eq!(solver.finding(&Counts::default(), &[]).unwrap().report.fit.records, 2);
        }
    });
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
        let daemon = scope.spawn(|| keeping(&config, &stop, &store).run(&mut Feed(arrivals)));
        frames.chunks(500).for_each(|frames| feed.send(frames.to_vec()).unwrap());
        stop.request();
        daemon.join().unwrap().unwrap();
    });
    on_a_large_stack(move || {
        let [kept, waiting] = store.load().unwrap().expect("a state").records();
        assert_eq!(kept + waiting, expected);
    });
}

/// The outcome of a daemon that gets `next` as its config between the two poses.
fn reloaded(next: Config) -> Outcome {
    reloaded_with(&[next], None)
}

/// The outcome of a daemon that gets each of `next` as its config between the two poses, and keeps its state in `store`.
fn reloaded_with(next: &[Config], store: Option<&Store>) -> Outcome {
    let begun = config();
    let mut first = visits(&begun, &POSES);
    let second =
        first.split_off(first.iter().position(|each| each.time_s >= 1.0e9 + 10.0).unwrap());
    let (stop, reload, listeners) = (Stop::new(), Reload::new(), &[]);
    let (feed, frames): (Sender<Vec<Arrival>>, _) = bounded(0);
    thread::scope(|scope| {
        let daemon = scope.spawn(|| {
            let reload = Some(&reload);
            let daemon =
                Daemon { config: &begun, listeners, stop: &stop, reload, store, watchdog: None };
            daemon.run(&mut Feed(frames))
        });
        // In small pieces, as a bus brings them.
        first.chunks(500).for_each(|frames| feed.send(frames.to_vec()).unwrap());
        for config in next {
            reload.offer(config.clone());
            let begun = Instant::now();
            while reload.is_pending() {
                assert!(begun.elapsed() < PATIENCE, "the daemon does not take the config");
                thread::sleep(Duration::from_millis(10));
            }
        }
        second.chunks(500).for_each(|frames| feed.send(frames.to_vec()).unwrap());
        drop(feed);
        daemon.join().unwrap().unwrap()
    })
}

/// A mistake in the configuration that is corrected costs nothing.
#[test]
fn a_state_is_taken_back_when_its_configuration_returns() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::find(Some(&folder.path().join("flexid.state"))).unwrap();
    let mistaken = config_with("rate_hz = 2000.0", "rate_hz = 1000.0");
    let outcome = timeless(reloaded_with(&[mistaken, config()], Some(&store)));
    let all = timeless(reloaded(config()));
    // The change ends a record early.
    assert!(outcome.report.fit.records >= all.report.fit.records, "{:?}", outcome.report.fit);
    assert_eq!(outcome.report.fit.frames, all.report.fit.frames);
    assert_eq!(names(folder.path()), ["flexid.state", "flexid.state.lock"]);
}

/// The folder of the file is missing all the time.
#[test]
fn a_state_that_cannot_be_written_is_taken_back_when_its_configuration_returns() {
    let store = Store::find(Some(Path::new("/no/such/folder/flexid.state"))).unwrap();
    let mistaken = config_with("rate_hz = 2000.0", "rate_hz = 1000.0");
    let all = timeless(reloaded(config()));
    for store in [Some(&store), None] {
        let outcome = timeless(reloaded_with(&[mistaken.clone(), config()], store));
        assert!(outcome.report.fit.records >= all.report.fit.records, "{:?}", outcome.report.fit);
        assert_eq!(outcome.report.fit.frames, all.report.fit.frames);
    }
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
