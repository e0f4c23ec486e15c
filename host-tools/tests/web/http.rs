//! Requests, well-behaved and hostile.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use flexid_core::stream::Reading;
use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::messages::{FromEdge, Phase, Progress};

use super::daemon::Daemon;
use super::program::Web;

/// Nothing here takes nearly as long; a test that waits for it has failed.
const PATIENCE: Duration = Duration::from_secs(30);

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// The whole answer to a request with a Host header.
fn answer(address: SocketAddr, request: &str, host: &str) -> String {
    let mut stream = connect(address);
    write!(stream, "{request} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

/// A stream of events, and what it has brought so far.
struct Events(TcpStream, String);

impl Events {
    fn open(address: SocketAddr) -> Self {
        let mut stream = connect(address);
        write!(stream, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        Self(stream, String::new())
    }

    /// Reads until `text` has come.
    fn until(&mut self, text: &str) {
        let begun = Instant::now();
        while !self.1.contains(text) {
            let mut bytes = [0; 4096];
            let read = self.0.read(&mut bytes).unwrap();
            self.1 += &String::from_utf8_lossy(&bytes[..read]);
            assert!(read > 0 && begun.elapsed() < PATIENCE, "no {text:?} in {}", self.1);
        }
    }
}

#[test]
fn the_page_is_one_document_with_a_policy() {
    let folder = tempfile::tempdir().unwrap();
    let mut web = Web::start(&folder.path().join("flexid.sock"), "127.0.0.1:0", &[]);
    let note = web.note();
    assert!(note.starts_with("note: unix:") && note.contains(": nobody listens there "), "{note}");
    let begun = Instant::now();
    // The first page may be older than the first attempt to connect.
    let page = loop {
        let page = answer(web.address, "GET /", "localhost");
        if !page.contains("not connected yet") {
            break page;
        }
        assert!(begun.elapsed() < PATIENCE, "{page}");
        thread::sleep(Duration::from_millis(50));
    };
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{page}");
    for said in [
        "content-type: text/html; charset=utf-8\r\n",
        "content-security-policy: default-src 'none'; ",
        "frame-ancestors 'none'\r\n",
        "x-content-type-options: nosniff\r\n",
        "cross-origin-resource-policy: same-origin\r\n",
        "no connection to the daemon",
        "nobody listens there",
    ] {
        assert!(page.contains(said), "{said:?} is not in {page}");
    }
    for (request, status) in [("GET /other", 404), ("POST /", 405), ("DELETE /events", 405)] {
        let answer = answer(web.address, request, "localhost");
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{request}: {answer}");
        assert!(answer.contains("content-security-policy: "), "{request}: {answer}");
    }
    assert_eq!(web.end(), Some(0));
}

#[test]
fn a_name_that_was_not_given_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("flexid.sock");
    let web = Web::start(&socket, "127.0.0.1:0", &["--name", "robot.local"]);
    let status = |path: &str, host: &str| {
        answer(web.address, &format!("GET {path}"), host)["HTTP/1.1 ".len()..][..3].to_owned()
    };
    let own = web.address.to_string();
    for host in [own.as_str(), "localhost:1", "robot.local", "[::1]:8080"] {
        assert_eq!(status("/", host), "200", "{host}");
    }
    for path in ["/", "/events", "/other"] {
        assert_eq!(status(path, "evil.example"), "421", "{path}");
    }
    assert_eq!(status("/", ""), "421");
}

#[test]
fn the_stream_brings_every_part_then_changes_and_beats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let web = Web::start(&path, "127.0.0.1:0", &[]);
    let mut events = Events::open(web.address);
    events.until("event: bus\n");
    assert!(events.1.contains("content-type: text/event-stream\r\n"), "{}", events.1);
    events.until("event: beat\n");
    let daemon = Daemon::start(&path);
    events.until("waiting for frames");
    let verdicts = events.1.matches("event: verdict\n").count();
    daemon.send(Reading::Joint { index: 1, value: 0.5 });
    events.until("waiting for force frames");
    assert_eq!(events.1.matches("event: verdict\n").count(), verdicts, "it has not changed");
}

/// The daemon's server, whose news come a hundred times a second.
#[test]
fn the_stream_has_at_most_five_changes_a_second_and_ends_with_the_newest() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    let progress = |starts| {
        FromEdge::Progress(Progress {
            phase: Phase::Searching,
            fraction: 0.5,
            starts,
            search_evaluations: 0,
            refine_iterations: 0,
            search_loss: 0.1,
            records: 1,
        })
    };
    latest.publish(progress(0));
    let outcome = thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let web = Web::start(&path, "127.0.0.1:0", &[]);
            let mut events = Events::open(web.address);
            events.until("searching for a robot that explains 1 record (attempt 0)");
            let (begun, so_far) = (Instant::now(), events.1.len());
            for starts in 1..=200 {
                latest.publish(progress(starts));
                thread::sleep(Duration::from_millis(10));
            }
            events.until("searching for a robot that explains 1 record (attempt 200)");
            let changes = events.1[so_far..].matches("event: progress\n").count() as f64;
            let most = 1.0 + begun.elapsed().as_secs_f64() / 0.2;
            assert!((5.0..=most).contains(&changes), "{changes} changes, at most {most}");
        }));
        latest.close();
        stop.request();
        outcome
    });
    outcome.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
}

/// Connections that say nothing, half a request, or too much, and streams that nobody reads, hold up nobody.
#[test]
fn hostile_clients_hold_up_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let daemon = Daemon::start(&path);
    let web = Web::start(&path, "127.0.0.1:0", &[]);
    let mut silent: Vec<_> = (0..20).map(|_| connect(web.address)).collect();
    for stream in &mut silent[10..] {
        write!(stream, "GET / HTTP/1.1\r\nHost: local").unwrap();
    }
    let mut unread: Vec<_> = (0..10).map(|_| Events::open(web.address)).collect();

    let mut long = connect(web.address);
    let header = "a".repeat(100_000);
    // The server may close before it has read all.
    let _ = write!(long, "GET / HTTP/1.1\r\nHost: localhost\r\nX: {header}\r\n\r\n");
    let mut refusal = [0; 12];
    match long.read(&mut refusal) {
        Ok(0) | Err(_) => {}
        Ok(_) => assert_eq!(&refusal, b"HTTP/1.1 431"),
    }

    let mut good = Events::open(web.address);
    good.until("waiting for frames");
    daemon.send(Reading::Joint { index: 1, value: 0.5 });
    good.until("waiting for force frames");

    // One that says nothing is closed.
    let begun = Instant::now();
    for stream in &mut silent {
        let mut rest = Vec::new();
        let _ = stream.read_to_end(&mut rest);
        assert!(begun.elapsed() < PATIENCE, "a silent client is still connected");
    }
    // The streams of an address are bounded, and free again when their clients go.
    unread.extend((0..5).map(|_| Events::open(web.address)));
    unread.iter_mut().for_each(|events| events.until("event: bus\n"));
    let refused = answer(web.address, "GET /events", "localhost");
    assert!(refused.starts_with("HTTP/1.1 503 "), "{refused}");
    assert!(refused.ends_with("too many pages are open: close one\n"), "{refused}");
    assert!(answer(web.address, "GET /", "localhost").starts_with("HTTP/1.1 200 "));
    drop(unread);
    let begun = Instant::now();
    loop {
        let mut again = Events::open(web.address);
        let mut head = [0; 12];
        again.0.read_exact(&mut head).unwrap();
        if &head == b"HTTP/1.1 200" {
            break;
        }
        assert!(begun.elapsed() < PATIENCE, "no stream is free");
        thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn wrong_arguments_have_their_mend() {
    let folder = tempfile::tempdir().unwrap();
    let web = Web::start(&folder.path().join("flexid.sock"), "127.0.0.1:0", &[]);
    let taken = web.address.to_string();
    for (arguments, said) in [
        (
            ["web", "unix:a.sock", "--listen", &taken],
            "another program listens there: name another port",
        ),
        (["web", "unix:a.sock", "--listen", "192.0.2.1:8080"], "this machine has no such address"),
        (["web", "a.sock", "--listen", "127.0.0.1:0"], "is no address: write \"unix:PATH\""),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_flexid")).args(arguments).output().unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{errors}");
        assert!(errors.contains(said) && errors.lines().count() == 1, "{errors:?}");
    }
}
