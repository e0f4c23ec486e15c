//! The file of the state: put aside, claimed, written late, on a file system that hangs.

use std::fs::File;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use std::{fs, thread};

use crossbeam_channel::bounded;
use flexid_edge::store::{self, StateError, Store};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Counts, Solver, State};

use super::frames::{Feed, POSES, Replay};
use super::keeping;
use super::state::{
    PATIENCE, VISITS, config, config_with, names, on_a_large_stack, records, solver, visits,
};

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
            (&newer, StateError::Version(10)),
        ];
        for (bytes, error) in cases {
            assert_eq!(store::decode(bytes), Err(error));
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("flexid.state");
            fs::write(&file, bytes).unwrap();
            let store = Store::find(Some(&file)).unwrap();
            assert!(store.load().unwrap().is_none());
            let left = names(folder.path());
            assert!(!file.exists() && left.len() == 1, "{left:?}");
            assert_eq!(fs::read(folder.path().join(&left[0])).unwrap(), bytes);
            store.save(&state).unwrap();
            assert_eq!(store.load().unwrap(), Some(state.clone()));
        }
    });
}

/// Runs a daemon with its state in `file`, gives it the frames of one pose, and then runs `test` while it lives.
fn while_it_solves(file: &Path, test: impl FnOnce()) {
    let store = Store::find(Some(file)).unwrap();
    let config = config();
    let (stop, (feed, arrivals)) = (Stop::with_grace(Duration::ZERO), bounded(0));
    thread::scope(|scope| {
        let daemon = scope.spawn(|| keeping(&config, &stop, &store).run(&mut Feed(arrivals)));
        visits(&config, &POSES[..1])
            .chunks(500)
            .for_each(|frames| feed.send(frames.to_vec()).unwrap());
        test();
        stop.request();
        drop(feed);
        daemon.join().unwrap().unwrap();
    });
}

/// Returns as soon as the state in `file` is `awaited`.
fn await_state(file: &Path, awaited: impl Fn(&State) -> bool + Send + 'static) {
    let (file, begun) = (file.to_path_buf(), Instant::now());
    on_a_large_stack(move || {
        let store = Store::find(Some(&file)).unwrap();
        while !store.load().unwrap().is_some_and(|state| awaited(&state)) {
            assert!(begun.elapsed() < PATIENCE, "no such state is kept");
            thread::sleep(Duration::from_millis(5));
        }
    });
}

/// A kill in the midst of a solve, which may take minutes, does not cost the record. A pipe in place of the file that is written holds the
/// solver until its bytes are read.
#[test]
fn a_record_is_on_disk_before_its_solve() {
    let folder = tempfile::tempdir().unwrap();
    let (file, new) = (folder.path().join("flexid.state"), folder.path().join("flexid.state.new"));
    nix::unistd::mkfifo(&new, nix::sys::stat::Mode::S_IRWXU).unwrap();
    while_it_solves(&file, || {
        let (sender, written) = bounded(1);
        thread::spawn(move || sender.send(fs::read(new)));
        let bytes = written.recv_timeout(PATIENCE).expect("nothing is written").unwrap();
        on_a_large_stack(move || assert_eq!(store::decode(&bytes).unwrap().records(), [0, 1]));
    });
}

/// The folder is not there yet, as where its disk is mounted late: the daemon begins, and keeps its state as soon as it can.
#[test]
fn a_state_that_cannot_be_written_is_written_later() {
    let folder = tempfile::tempdir().unwrap();
    let late = folder.path().join("late");
    let file = late.join("flexid.state");
    while_it_solves(&file, || {
        // The first attempt has failed by then.
        thread::sleep(Duration::from_secs(3));
        fs::create_dir(&late).unwrap();
        await_state(&file, |state| !state.is_empty());
    });
    assert_eq!(names(&late), ["flexid.state", "flexid.state.lock"]);
}

/// File of the state of a daemon in a child of a test.
const HANGS: &str = "FLEXID_TEST_HANGS";

/// A daemon that gets a record, and is then asked to end.
#[test]
fn hangs() {
    if let Some(file) = std::env::var_os(HANGS) {
        while_it_solves(Path::new(&file), || {});
    }
}

/// strace stands for the file system: each such call to the file is interrupted, and tried again for ever.
#[test]
fn the_end_does_not_wait_for_a_file_system_that_hangs() {
    for (call, name) in [("openat", "flexid.state"), ("fsync", "flexid.state.new")] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("flexid.state");
        fs::write(&file, "precious").unwrap();
        let inject = format!("inject={call}:error=EINTR");
        let mut strace = Command::new("strace");
        strace.args(["-f", "-qq", "-o", "/dev/null", "-e", &inject, "-P"]);
        strace.arg(folder.path().join(name)).arg(std::env::current_exe().unwrap());
        strace.args(["--exact", "state_file::hangs"]).env(HANGS, &file).stdout(Stdio::null());
        let mut child = strace.spawn().expect("strace is missing: apt-get install strace");
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            if begun.elapsed() > PATIENCE {
                child.kill().unwrap();
                panic!("{call}: it still runs");
            }
            thread::sleep(Duration::from_millis(20));
        };
        assert!(status.success(), "{call}: {status}");
        if call == "openat" {
            assert_eq!(fs::read(&file).unwrap(), b"precious", "what was not read is overwritten");
        }
    }
}

/// One file is one daemon's.
#[test]
fn a_file_is_claimed_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flexid.state");
    let [first, second] = [(); 2].map(|()| Store::find(Some(&file)).unwrap());
    first.claim().unwrap();
    first.claim().unwrap();
    assert!(second.claim().unwrap_err().to_string().contains("another flexid-edge"));
    drop(first);
    second.claim().unwrap();
}

/// A state that cannot be read for a moment stays where it is, and the daemon does not begin without it.
#[test]
fn a_state_that_cannot_be_read_stays() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flexid.state");
    // A loop of links: the error of the system is neither of a missing file nor of its content.
    symlink(&file, &file).unwrap();
    let store = Store::find(Some(&file)).unwrap();
    let (config, stop) = (config(), Stop::new());
    let daemon = keeping(&config, &stop, &store);
    let frames = Vec::new().into_iter();
    let error = daemon.run(&mut Replay { frames, breaks: false }).unwrap_err().to_string();
    assert!(error.contains("flexid.state: cannot be read: "), "{error}");
    assert_eq!(names(folder.path()), ["flexid.state", "flexid.state.lock"]);
}

/// A pipe, on which a read would wait for ever, is no state. The newest file that is none stays, whatever the clock says, beside the states
/// that were put aside.
#[test]
fn the_newest_that_is_no_state_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let file = path("flexid.state");
    nix::unistd::mkfifo(&file, nix::sys::stat::Mode::S_IRWXU).unwrap();
    on_a_large_stack(move || assert!(Store::find(Some(&file)).unwrap().load().unwrap().is_none()));
    assert_eq!(names(folder.path()), ["flexid.state.no-00000000"]);
    let states =
        ["0123abcd", "1123abcd", "2123abcd", "3123abcd"].map(|sum| format!("flexid.state.{sum}"));
    states.iter().for_each(|name| _ = File::create(path(name)).unwrap());
    for content in ["a", "b"] {
        let file = path("flexid.state");
        fs::write(&file, content).unwrap();
        // A controller without a battery begins in 1970.
        File::options().write(true).open(&file).unwrap().set_modified(UNIX_EPOCH).unwrap();
        on_a_large_stack(move || assert!(Store::find(Some(&file)).unwrap().load().is_ok()));
    }
    let newest = format!("flexid.state.no-{:08x}", crc32fast::hash(b"b"));
    assert_eq!(names(folder.path()), [&states[..], &[newest]].concat());
}

/// Four states stay aside, one of which has just been put there by a controller without a clock.
#[test]
fn the_state_that_was_just_put_aside_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let states =
        ["0123abcd", "1123abcd", "2123abcd", "3123abcd"].map(|sum| format!("flexid.state.{sum}"));
    let now = SystemTime::now();
    for (name, age) in states.iter().zip([30, 40, 10, 20]) {
        let modified = now - Duration::from_secs(age);
        File::create(path(name)).unwrap().set_modified(modified).unwrap();
    }
    let (file, other) = (path("flexid.state"), config_with("rate_hz = 2000.0", "rate_hz = 1000.0"));
    on_a_large_stack(move || {
        let begun = config();
        let record = Arc::new(records(&begun, visits(&begun, &POSES[..1])).swap_remove(0));
        let state = Solver::new(&begun).unwrap().state(&Counts::default(), &[record]);
        let store = Store::find(Some(&file)).unwrap();
        store.save(&state).unwrap();
        File::options().write(true).open(&file).unwrap().set_modified(UNIX_EPOCH).unwrap();
        let stop = Stop::new();
        let daemon = keeping(&other, &stop, &store);
        let frames = Vec::new().into_iter();
        daemon.run(&mut Replay { frames, breaks: false }).unwrap();
    });
    let left = names(folder.path());
    let left: Vec<_> = left.iter().filter(|name| !name.ends_with("lock")).collect();
    assert_eq!(left.len(), 4, "{left:?}");
    assert!(!left.contains(&&states[1]), "the oldest of the others stays: {left:?}");
    assert!(states.iter().filter(|name| left.contains(name)).count() == 3, "{left:?}");
}
