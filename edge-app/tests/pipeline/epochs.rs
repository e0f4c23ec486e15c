//! Epochs of a daemon: each leaves a finding of its own records.

use std::path::Path;
use std::time::{Duration, Instant};
use std::{fs, thread};

use crossbeam_channel::bounded;
use flexid_core::imperfection::Accuracies;
use flexid_core::stream::LONG_SILENCE_S;
use flexid_edge::daemon::{self, Daemon};
use flexid_edge::history::folder;
use flexid_edge::reload::Reload;
use flexid_edge::store::Store;
use flexid_pipeline::config::{Config, Epoch, Fingerprint, History};
use flexid_pipeline::source::Arrival;
use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Counts, Record};
use flexid_wire::finding::Finding;
use flexid_wire::report::{Acceptance, Fit, JointReport};
use serde_json::Value;

use super::frames::{Feed, POSES, Replay};
use super::keeping;
use super::state::{PATIENCE, config, names, on_a_large_stack, records, solver, visits};

const DAY_S: f64 = 86_400.0;

/// Errors that findings share, and an epoch that ends as `ends` says, beside the state.
fn with_epochs(ends: &str) -> Config {
    let file = Path::new("edge.toml");
    let epoch = match ends.parse() {
        Ok(records) => Epoch::Records(records),
        Err(_) => Epoch::Time(Duration::from_secs_f64(DAY_S)),
    };
    let history = Some(History { epoch, folder: None });
    let Accuracies { force, accelerometer, mass, .. } = Accuracies::typical();
    let accuracies = Accuracies { force, accelerometer, mass, ..Accuracies::default() };
    Config { file: file.into(), accuracies, history, ..config() }
}

/// Frames that the robot sends at these poses, each on the day beside it. The silence between two is long enough for angles to hold no more, so that
/// the records of a visit are the same whether the clock ends it or the next visit.
fn days(config: &Config, visited: &[(u32, [f64; 3])]) -> Vec<Arrival> {
    let poses: Vec<[f64; 3]> = visited.iter().map(|(_, pose)| *pose).collect();
    let mut frames = visits(config, &poses);
    for frame in &mut frames {
        let place = ((frame.time_s - 1.0e9) / 10.0) as usize;
        frame.time_s += DAY_S * f64::from(visited[place].0) + LONG_SILENCE_S * place as f64;
    }
    frames
}

/// The frames of each visit to a pose.
fn each_visit(frames: &[Arrival]) -> impl Iterator<Item = &[Arrival]> {
    frames.chunk_by(|one, next| next.time_s - one.time_s < 5.0)
}

/// Number of the day since the first.
fn day(record: &Record) -> i64 {
    ((record.start_s / DAY_S).floor() - (1.0e9 / DAY_S).floor()) as i64
}

/// Waits for so many findings.
fn await_findings(folder: &Path, findings: usize) {
    let begun = Instant::now();
    let is_finding = |name: &&String| name.ends_with(".json");
    let count = || match folder.exists() {
        true => names(folder).iter().filter(is_finding).count(),
        false => 0,
    };
    while count() < findings {
        assert!(begun.elapsed() < PATIENCE, "{} of {findings} findings", count());
        thread::sleep(Duration::from_millis(20));
    }
}

fn read(file: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

fn fit(file: &Value) -> Fit {
    serde_json::from_value(file["fit"].clone()).unwrap()
}

/// What was determined agrees to 0.3 standard deviations, and these to a fifth.
fn assert_alike(file: &Value, fresh: &Finding) {
    let joints: Vec<JointReport> = serde_json::from_value(file["joints"].clone()).unwrap();
    let mut determined = 0;
    for (own, other) in joints.iter().zip(&fresh.report.joints) {
        let values = own.stiffness.iter().chain(&own.damping);
        let others = other.stiffness.iter().chain(&other.damping);
        let stds = own.stiffness_std.iter().chain(&own.damping_std);
        let other_stds = other.stiffness_std.iter().chain(&other.damping_std);
        for (((own, other), std), other_std) in values.zip(others).zip(stds).zip(other_stds) {
            let (Some(std), Some(other_std)) = (std, other_std) else { continue };
            assert!((own - other).abs() < 0.3 * std, "{own} ± {std} is not {other} ± {other_std}");
            assert!((0.8..1.25).contains(&(std / other_std)), "± {std} is not ± {other_std}");
            determined += 1;
        }
    }
    assert!(determined >= 5, "{determined} of 36 parameters are determined");
}

/// The findings go into a folder of the build, to be frozen for `flexid history`.
#[test]
fn each_day_leaves_the_finding_of_its_own_records() {
    let place = tempfile::tempdir().unwrap();
    let store = Store::find(Some(&place.path().join("flexid.state"))).unwrap();
    let (config, history) = (with_epochs("1d"), place.path().join("history"));
    let [a, b] = POSES;
    let frames = days(&config, &[(0, a), (0, b), (1, a), (1, b), (2, a)]);
    let (stop, (feed, arrivals)) = (Stop::new(), bounded(0));
    let outcome = thread::scope(|scope| {
        let daemon = scope.spawn(|| keeping(&config, &stop, &store).run(&mut Feed(arrivals)));
        for (frames, findings) in each_visit(&frames).zip([0, 0, 1, 1, 2]) {
            // All at once: where frames come late, as under load, the daemon cuts a record in two.
            feed.send(frames.to_vec()).unwrap();
            // The queue has room for the records of a day.
            await_findings(&history, findings);
        }
        drop(feed);
        daemon.join().unwrap().unwrap()
    });
    let found = names(&history);
    let expected = ["2001-09-09T01-46-40.383Z.json", "2001-09-10T01-47-20.383Z.json"];
    assert_eq!(found, expected);
    let frozen = Path::new(env!("CARGO_TARGET_TMPDIR")).join("epochs");
    fs::create_dir_all(&frozen).unwrap();
    let files: Vec<Value> = found
        .iter()
        .map(|name| {
            fs::copy(history.join(name), frozen.join(name)).unwrap();
            read(&history.join(name))
        })
        .collect();
    assert_eq!(files[1]["origin"]["date"].as_str().unwrap()[..13], *"2001-09-10T01");
    on_a_large_stack(move || {
        let all = records(&config, frames);
        for (number, file) in files.iter().enumerate() {
            let own: Vec<Record> =
                all.iter().filter(|record| day(record) == number as i64).cloned().collect();
            let fresh = solver(&config, &own).finding(&Counts::default(), &[]).unwrap();
            let fit = fit(file);
            assert_eq!(fit.records, fresh.report.fit.records);
            assert_eq!(fit.acceptance, Acceptance::Consistent);
            assert_alike(file, &fresh);
            assert!(file["shared"]["imperfections"].as_array().unwrap().len() > 5);
        }
        // Each has the frames of its own records.
        let [first, second] = [0, 1].map(|number| fit(&files[number]).frames);
        assert!(second < 3 * first / 2, "{first} {second}");
        let last = outcome.finding.unwrap().report.fit;
        assert!(last.records <= 3 && last.frames < first, "{last:?}");
    });
}

/// A restart, and the end just when the next epoch begins, cost nothing.
#[test]
fn an_epoch_outlives_the_daemon() {
    let place = tempfile::tempdir().unwrap();
    let store = Store::find(Some(&place.path().join("flexid.state"))).unwrap();
    let (config, history) = (with_epochs("1d"), place.path().join("history"));
    let run = |frames: &[Arrival]| {
        let (stop, frames) = (Stop::new(), frames.to_vec());
        let mut source = Replay { frames: frames.into_iter(), breaks: false };
        keeping(&config, &stop, &store).run(&mut source).unwrap();
    };
    let [a, b] = POSES;
    let frames = days(&config, &[(0, a), (0, b), (1, a)]);
    for visit in each_visit(&frames) {
        assert!(!history.exists(), "the day is not over");
        run(visit);
    }
    run(&[]);
    let found = names(&history);
    assert_eq!(found.len(), 1, "{found:?}");
    let fit = fit(&read(&history.join(&found[0])));
    on_a_large_stack(move || {
        let expected: Vec<usize> =
            each_visit(&frames).map(|visit| records(&config, visit.to_vec()).len()).collect();
        assert_eq!(fit.records, (expected[0] + expected[1]) as u64);
        let [kept, waiting] = store.load().unwrap().unwrap().records();
        assert_eq!(kept + waiting, expected[2]);
    });
}

/// The config of a daemon that runs gets epochs, and its records stay.
#[test]
fn epochs_begin_with_a_reload() {
    let place = tempfile::tempdir().unwrap();
    let store = Store::find(Some(&place.path().join("flexid.state"))).unwrap();
    let (next, history) = (with_epochs("1d"), place.path().join("history"));
    let begun = Config { history: None, ..next.clone() };
    assert_eq!(Fingerprint::of(&begun), Fingerprint::of(&next));
    let [a, _] = POSES;
    let frames = days(&begun, &[(0, a), (1, a), (2, a)]);
    let (stop, reload) = (Stop::new(), Reload::new());
    let (feed, arrivals) = bounded(0);
    thread::scope(|scope| {
        let daemon = scope.spawn(|| {
            let (reload, store) = (Some(&reload), Some(&store));
            let config = &begun;
            let listeners = &[];
            let daemon = Daemon { config, listeners, stop: &stop, reload, store, watchdog: None };
            daemon.run(&mut Feed(arrivals))
        });
        for (visit, frames) in each_visit(&frames).enumerate() {
            if visit == 2 {
                assert!(!history.exists());
                reload.offer(next.clone());
                while reload.is_pending() {
                    thread::sleep(Duration::from_millis(10));
                }
            }
            frames.chunks(500).for_each(|frames| feed.send(frames.to_vec()).unwrap());
        }
        drop(feed);
        daemon.join().unwrap().unwrap();
    });
    let found = names(&history);
    // The records of a visit may come when the next one begins.
    assert!((1..=2).contains(&found.len()) && found[0].starts_with("2001-09-09T"), "{found:?}");
}

#[test]
fn records_end_an_epoch() {
    let place = tempfile::tempdir().unwrap();
    let store = Store::find(Some(&place.path().join("flexid.state"))).unwrap();
    let config = with_epochs("1");
    let frames = days(&config, &[(0, POSES[0]), (0, POSES[1])]).into_iter();
    let stop = Stop::new();
    keeping(&config, &stop, &store).run(&mut Replay { frames, breaks: false }).unwrap();
    let history = place.path().join("history");
    let found = names(&history);
    assert!(!found.is_empty());
    found.iter().for_each(|name| assert_eq!(fit(&read(&history.join(name))).records, 1));
}

#[test]
fn epochs_need_a_folder() {
    let config = with_epochs("1d");
    let expected = "edge.toml: [history] folder is missing, and there is no state beside which it would lie: add folder = \"history\", or [state] file";
    assert_eq!(folder(&config, None).unwrap_err().to_string(), expected);
    let mut empty = Replay { frames: Vec::new().into_iter(), breaks: false };
    let error = daemon::run(&config, &mut empty, &[], &Stop::new()).unwrap_err();
    assert_eq!(error.to_string(), expected);
    let store = Store::find(Some(Path::new("flexid.state"))).unwrap();
    assert_eq!(folder(&config, Some(&store)).unwrap().unwrap(), Path::new("./history"));
    let mut named = config;
    named.history.iter_mut().for_each(|own| own.folder = Some("/a".into()));
    assert_eq!(folder(&named, None).unwrap().unwrap(), Path::new("/a"));
}
