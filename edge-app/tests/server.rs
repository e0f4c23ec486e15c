//! The real server in this process, and clients that behave, lie, rave and sleep.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::os::unix::net::{UnixListener, UnixStream};
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, MAX_CLIENTS, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::framing::{Decoder, FRAME_BUFFER, encode};
use flexid_wire::messages::{FromEdge, Hello, Phase, Progress, ToEdge};

/// Nothing here takes nearly as long; a test that waits for it has failed.
const PATIENCE: Duration = Duration::from_secs(30);

/// Runs `test` against a server on a Unix socket and a TCP port.
fn with_server(test: impl FnOnce(&Latest, &UnixStream, &Listen, &dyn Fn() -> UnixStream)) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let addresses = [Listen::Unix(path.clone()), Listen::Tcp("127.0.0.1:0".parse().unwrap())];
    let listeners = addresses.map(|address| Listener::bind(&address).unwrap());
    let (latest, stop) = (Latest::new(), Stop::new());
    let connect = || {
        let stream = UnixStream::connect(&path).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    };
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            test(&latest, &connect(), listeners[1].address(), &connect);
        }));
        latest.close();
        stop.request();
        if let Err(panic) = outcome {
            std::panic::resume_unwind(panic);
        }
    });
    drop(listeners);
    assert!(!path.exists(), "the socket's file is left behind");
}

fn say_hello(stream: &mut impl Write, hello: Hello) {
    let mut buffer = [0; FRAME_BUFFER];
    stream.write_all(encode(&ToEdge::Hello(hello), &mut buffer).unwrap()).unwrap();
}

/// The next message; `None` at the end of the stream.
fn receive(stream: &mut impl Read, decoder: &mut Decoder) -> Option<FromEdge> {
    loop {
        if let Some(message) = decoder.next().unwrap() {
            return Some(message);
        }
        match stream.read(decoder.space()) {
            Ok(0) | Err(_) => return None,
            Ok(bytes) => decoder.advance(bytes),
        }
    }
}

fn refusal(stream: &mut impl Read) -> String {
    let mut decoder = Decoder::new();
    match receive(stream, &mut decoder) {
        Some(FromEdge::Refused(refusal)) => {
            assert_eq!(receive(stream, &mut decoder), None, "the connection should end");
            refusal.reason.to_string()
        }
        other => panic!("expected a refusal, got {other:?}"),
    }
}

fn progress(records: u64) -> FromEdge {
    FromEdge::Progress(Progress {
        phase: Phase::Searching,
        fraction: 0.5,
        starts: 1,
        search_evaluations: 100,
        refine_iterations: 0,
        search_loss: 0.3,
        records,
    })
}

/// Somebody removes the socket's file: clients come again, and those that are there stay.
#[test]
fn a_socket_that_was_removed_is_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let mut old = UnixStream::connect(&path).unwrap();
        say_hello(&mut old, Hello::new("old"));
        let mut decoder = Decoder::new();
        assert!(matches!(receive(&mut old, &mut decoder), Some(FromEdge::Hello(_))));
        std::fs::remove_file(&path).unwrap();
        let begun = Instant::now();
        let mut new = loop {
            match UnixStream::connect(&path) {
                Ok(stream) => break stream,
                Err(_) if begun.elapsed() < PATIENCE => thread::sleep(Duration::from_millis(20)),
                Err(error) => panic!("{error}"),
            }
        };
        say_hello(&mut new, Hello::new("new"));
        assert!(matches!(receive(&mut new, &mut Decoder::new()), Some(FromEdge::Hello(_))));
        latest.publish(progress(1));
        assert_eq!(receive(&mut old, &mut decoder), Some(progress(1)));
        latest.close();
        stop.request();
    });
    drop(listeners);
    assert!(!path.exists(), "the socket's file is left behind");
}

/// The file of another socket, on which nobody answers, takes the place of the daemon's.
#[test]
fn a_socket_that_was_replaced_is_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let (path, other) = (folder.path().join("flexid.sock"), folder.path().join("other.sock"));
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        drop(UnixListener::bind(&other).unwrap());
        std::fs::rename(&other, &path).unwrap();
        let begun = Instant::now();
        let connected = loop {
            match UnixStream::connect(&path) {
                Err(_) if begun.elapsed() < PATIENCE => thread::sleep(Duration::from_millis(20)),
                connected => break connected,
            }
        };
        latest.close();
        stop.request();
        connected.expect("nobody listens");
    });
}

#[test]
fn a_client_gets_the_latest_and_then_what_changes() {
    with_server(|latest, mut stream, tcp, _| {
        latest.publish(progress(1));
        latest.publish(progress(2));
        let Listen::Tcp(address) = tcp else { panic!("no port") };
        let mut by_tcp = TcpStream::connect(address).unwrap();
        for hello in [&mut stream as &mut dyn Write, &mut by_tcp] {
            let mut hello = hello;
            say_hello(&mut hello, Hello::new("test"));
        }
        let (mut unix_decoder, mut tcp_decoder) = (Decoder::new(), Decoder::new());
        for records in [0, 2, 3] {
            if records == 3 {
                latest.publish(progress(3));
            }
            let messages =
                [receive(&mut stream, &mut unix_decoder), receive(&mut by_tcp, &mut tcp_decoder)];
            for message in messages {
                match message {
                    Some(FromEdge::Hello(hello)) => {
                        assert_eq!(records, 0);
                        assert!(hello.software.starts_with("flexid-edge "));
                    }
                    other => assert_eq!(other, Some(progress(records))),
                }
            }
        }
        latest.close();
        assert_eq!(receive(&mut stream, &mut unix_decoder), None);
    });
}

#[test]
fn a_client_of_another_version_gets_the_reason() {
    with_server(|_, mut stream, _, _| {
        say_hello(&mut stream, Hello { protocol_version: 999, ..Hello::new("test") });
        let reason = refusal(&mut stream);
        assert!(reason.starts_with("client speaks flexid protocol 999"), "{reason}");
    });
}

#[test]
fn a_client_that_sends_rubbish_gets_the_reason_and_others_are_served() {
    with_server(|latest, mut stream, _, connect| {
        stream.write_all(b"GET / HTTP/1.1\r\nHost: flexid\r\n\r\n").unwrap();
        let reason = refusal(&mut stream);
        assert!(reason.ends_with("the peer does not speak flexid's protocol"), "{reason}");

        let mut empty_message = connect();
        empty_message.write_all(&[1, 0, 0, 0, 99]).unwrap();
        assert_eq!(refusal(&mut empty_message), "a frame is not a message of flexid's protocol");

        let mut talker = connect();
        say_hello(&mut talker, Hello::new("test"));
        let mut decoder = Decoder::new();
        assert!(matches!(receive(&mut talker, &mut decoder), Some(FromEdge::Hello(_))));
        say_hello(&mut talker, Hello::new("test"));
        let reason = refusal(&mut talker);
        assert!(reason.starts_with("it talks after its Hello"), "{reason}");

        let mut good = connect();
        say_hello(&mut good, Hello::new("test"));
        latest.publish(progress(1));
        let mut decoder = Decoder::new();
        assert!(matches!(receive(&mut good, &mut decoder), Some(FromEdge::Hello(_))));
        assert_eq!(receive(&mut good, &mut decoder), Some(progress(1)));
    });
}

#[test]
fn a_client_that_says_nothing_is_dropped() {
    with_server(|_, mut stream, _, _| {
        assert_eq!(refusal(&mut stream), "it said no Hello within 5 s");
    });
}

#[test]
fn a_client_that_reads_nothing_is_dropped_and_holds_nobody_up() {
    with_server(|latest, mut stream, _, connect| {
        say_hello(&mut stream, Hello::new("sleeper"));
        let mut good = connect();
        say_hello(&mut good, Hello::new("test"));
        let mut decoder = Decoder::new();
        assert!(matches!(receive(&mut good, &mut decoder), Some(FromEdge::Hello(_))));
        // Each is awaited by the good client: more than any socket buffer holds, had the sleeper got them all.
        let mut published = 0;
        let mut publish = |count| {
            for _ in 0..count {
                published += 1;
                latest.publish(progress(published));
                assert_eq!(receive(&mut good, &mut decoder), Some(progress(published)));
            }
            published
        };
        publish(20_000);
        // A socket that the other side has closed cannot be written to.
        let begun = Instant::now();
        while stream.write_all(&[0]).is_ok() {
            assert!(begun.elapsed() < PATIENCE, "the sleeper is still connected");
            thread::sleep(Duration::from_millis(100));
        }
        let published = publish(1);
        let mut decoder = Decoder::new();
        let mut last = 0;
        while let Some(message) = receive(&mut stream, &mut decoder) {
            if let FromEdge::Progress(progress) = message {
                last = progress.records;
            }
        }
        assert!(last < published, "the sleeper got the newest message");
    });
}

#[test]
fn one_client_too_many_is_turned_away() {
    with_server(|_, first, _, connect| {
        let mut clients: Vec<UnixStream> = vec![first.try_clone().unwrap()];
        clients.extend((1..MAX_CLIENTS).map(|_| connect()));
        for client in &mut clients {
            say_hello(client, Hello::new("test"));
            assert!(matches!(receive(client, &mut Decoder::new()), Some(FromEdge::Hello(_))));
        }
        assert_eq!(refusal(&mut connect()), "16 clients are served already: close one");
    });
}

/// One process holds all slots, and half of its connections say nothing: another peer gets in nevertheless.
#[test]
fn a_crowd_makes_room_for_another_peer() {
    with_server(|latest, first, tcp, connect| {
        let mut crowd: Vec<UnixStream> = vec![first.try_clone().unwrap()];
        crowd.extend((1..MAX_CLIENTS).map(|_| connect()));
        for client in &mut crowd[..MAX_CLIENTS / 2] {
            say_hello(client, Hello::new("crowd"));
            assert!(matches!(receive(client, &mut Decoder::new()), Some(FromEdge::Hello(_))));
        }
        let Listen::Tcp(address) = tcp else { panic!("no port") };
        let mut others = Vec::new();
        for _ in 0..2 {
            let mut other = TcpStream::connect(address).unwrap();
            other.set_read_timeout(Some(PATIENCE)).unwrap();
            say_hello(&mut other, Hello::new("other"));
            let mut decoder = Decoder::new();
            match receive(&mut other, &mut decoder) {
                Some(FromEdge::Hello(_)) => others.push((other, decoder)),
                refused => panic!("the other peer gets {refused:?}"),
            }
        }
        // The evicted client gets the reason.
        let reason = refusal(&mut crowd[0]);
        assert!(reason.starts_with("all 16 slots are taken"), "{reason}");
        // The crowd does not get its slots back.
        assert_eq!(refusal(&mut connect()), "16 clients are served already: close one");
        latest.publish(progress(1));
        for (other, decoder) in &mut others {
            assert_eq!(receive(other, decoder), Some(progress(1)));
        }
    });
}
