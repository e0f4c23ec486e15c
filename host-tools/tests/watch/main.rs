//! `flexid watch` against the daemon's real server, whose news the test makes up.

mod connection;
mod end;
mod metrics;
mod news;
mod printed;
mod spectra;
mod terminal;

use std::path::Path;
use std::process::{Command, Output};
use std::thread;

use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::messages::FromEdge;

/// Watches a server that has published `news`.
fn watch(news: &[FromEdge], arguments: &str) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    for message in news {
        latest.publish(message.clone());
    }
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let output = flexid(&path, arguments);
        latest.close();
        stop.request();
        output
    })
}

fn flexid(path: &Path, arguments: &str) -> Output {
    watch_at(&format!("unix:{}", path.display()), arguments)
}

fn watch_at(address: &str, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexid"))
        .args(["watch", address])
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn assert_has_the_table_once(lines: &str) {
    assert_eq!(lines.matches(" tx ty tz along").count(), 1, "{lines}");
    assert!(lines.contains("60.0 MN/m"), "{lines}");
}
