//! The connection to a daemon: none yet, one of another version, one that ends.

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixListener;
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::framing::{FRAME_BUFFER, encode};
use flexid_wire::messages::{FromEdge, Hello, PROTOCOL_VERSION, Phase, Refusal};
use flexid_wire::report::Acceptance;
use flexid_wire::text::clipped;

use super::news::{progress, report};
use super::{assert_has_the_table_once, flexid, text, watch_at};

#[test]
fn the_timeout_covers_connecting_and_the_greeting() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let begun = Instant::now();
    let output = flexid(&path, "--until identified --timeout 0.5");
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("nobody listens there"), "{}", text(&output.stderr));
    assert!(begun.elapsed() >= Duration::from_millis(350), "a daemon may still come");

    // Takes clients, and says nothing.
    let _silent = UnixListener::bind(&path).unwrap();
    let begun = Instant::now();
    let output = flexid(&path, "--until identified --timeout 0.5");
    assert!(begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
    assert!(text(&output.stderr).contains("says nothing"), "{}", text(&output.stderr));

    // A network for documentation, where nobody is.
    let begun = Instant::now();
    let output = watch_at("tcp:192.0.2.1:1", "--until identified --timeout 0.5");
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert!(begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
}

#[test]
fn a_daemon_that_comes_later_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let (latest, stop) = (Latest::new(), Stop::new());
    latest.publish(progress(Phase::Settled, 3));
    latest.publish(report(Acceptance::Consistent, 3));
    thread::scope(|scope| {
        let watching = scope.spawn(|| flexid(&path, "--until identified --timeout 20"));
        thread::sleep(Duration::from_millis(500));
        let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
        let (latest, stop) = (&latest, &stop);
        scope.spawn(move || serve(&listeners, latest, stop));
        let output = watching.join().unwrap();
        latest.close();
        stop.request();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    });
}

#[test]
fn a_daemon_of_another_version_is_recognised() {
    let refusal =
        Refusal { reason: clipped("client speaks flexid protocol 1, this daemon speaks 9") };
    let other = Hello { protocol_version: PROTOCOL_VERSION + 1, ..Hello::new("flexid-edge 9.0.0") };
    for (answer, said) in [
        (FromEdge::Refused(refusal), "this daemon speaks 9"),
        (
            FromEdge::Hello(other),
            "flexid-edge 9.0.0 is of another version: install matching versions",
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flexid.sock");
        let listener = UnixListener::bind(&path).unwrap();
        let daemon = thread::spawn(move || {
            let (mut client, _) = listener.accept().unwrap();
            let _ = client.read(&mut [0; 256]);
            client.write_all(encode(&answer, &mut [0; FRAME_BUFFER]).unwrap()).unwrap();
        });
        let output = flexid(&path, "--json");
        daemon.join().unwrap();
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.contains(said), "{errors}");
    }
}

#[test]
fn the_daemons_end_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    latest.publish(report(Acceptance::Consistent, 3));
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let watching = ["--json", ""].map(|form| {
            let path = &path;
            scope.spawn(move || flexid(path, form))
        });
        thread::sleep(Duration::from_millis(700));
        latest.close();
        stop.request();
        let [json, lines] = watching.map(|watching| watching.join().unwrap());
        for output in [&json, &lines] {
            let errors = text(&output.stderr);
            assert_eq!(output.status.code(), Some(1));
            assert!(errors.contains("the daemon hung up"), "{errors}");
        }
        assert_eq!(text(&json.stdout).lines().count(), 1);
        assert_has_the_table_once(&text(&lines.stdout));
    });
}
