//! A plant as it is shipped: its broker, boxes with theirs whose bridges have certificates, and the collector.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use super::Running;
use super::broker::{Broker, free_port};
use super::database::Postgres;
use super::edge::Edge;

const DIST: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fleet/dist");
pub(crate) const FLEXID: &str = env!("CARGO_BIN_EXE_flexid");

/// A file as it is shipped, with these replacements.
pub(crate) fn shipped(name: &str, replacements: &[(&str, &str)]) -> String {
    let mut text = fs::read_to_string(format!("{DIST}/{name}")).unwrap();
    for (from, to) in replacements {
        assert!(text.contains(from), "{name} has no {from}");
        text = text.replace(from, to);
    }
    text
}

/// An authority, and certificates of the plant and of robots.
pub(crate) fn certificates(folder: &Path, robots: &[&str]) {
    let openssl = |arguments: &str| {
        let mut command = Command::new("openssl");
        command.args(arguments.split(' ')).current_dir(folder).stderr(Stdio::null());
        assert!(command.status().expect("apt-get install openssl").success(), "{arguments}");
    };
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2";
    openssl(&format!("req -x509 {key} -keyout plant-ca.key -out plant-ca.crt -subj /CN=authority"));
    for name in robots.iter().chain(&["plant"]) {
        openssl(&format!(
            "req -x509 {key} -CA plant-ca.crt -CAkey plant-ca.key -keyout {name}.key -out {name}.crt -subj /CN={name} -addext subjectAltName=DNS:localhost -addext basicConstraints=critical,CA:FALSE"
        ));
    }
}

/// The broker of the plant as it is shipped; its port is that for the collector.
pub(crate) fn plant(folder: &Path, outer: u16) -> Broker {
    let passwords = folder.join("passwords");
    fs::write(&passwords, "").unwrap();
    let mut command = Command::new("mosquitto_passwd");
    assert!(
        command.arg("-b").arg(&passwords).args(["collect", "secret"]).status().unwrap().success()
    );
    fs::copy(format!("{DIST}/flexid.acl"), folder.join("flexid.acl")).unwrap();
    let (inner, place) = (free_port(), folder.display().to_string());
    let text = shipped(
        "mosquitto-plant.conf",
        &[
            ("listener 8883", &format!("listener {outer}")),
            ("listener 1883", &format!("listener {inner}")),
            ("/etc/mosquitto/certs", &place),
            ("/etc/mosquitto", &place),
            ("autosave_interval 60", "autosave_interval 1"),
        ],
    );
    Broker::of(
        &folder.join("plant"),
        inner,
        &format!("persistence_location {place}/plant/\n{text}"),
    )
}

/// A box and its broker as it is shipped.
pub(crate) fn robot(folder: &Path, robot: &str, outer: u16) -> (Edge, Broker) {
    let (port, place) = (free_port(), folder.display().to_string());
    let text = shipped(
        "mosquitto-box.conf",
        &[
            ("listener 1883", &format!("listener {port}")),
            ("broker.plant.example:8883", &format!("localhost:{outer}")),
            ("/etc/mosquitto/certs", &place),
            ("hall-3/kr210-4711", &format!("hall/{robot}")),
            ("kr210-4711", robot),
            ("restart_timeout 5 60", "restart_timeout 1"),
        ],
    );
    let broker = Broker::of(&folder.join(format!("{robot}-broker")), port, &text);
    (Edge::new(&folder.join(robot), robot, port, ""), broker)
}

/// Makes the tables, which a second time changes nothing.
pub(crate) fn migrate(postgres: &Postgres) {
    let words = postgres.words("postgres");
    for says in ["tables: from number 0 to 1\n", "tables: from number 1 to 1\n"] {
        let output = Command::new(FLEXID).args(["collect", "--migrate", &words]).output().unwrap();
        assert_eq!(
            String::from_utf8(output.stdout).unwrap(),
            says,
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}

/// Makes the tables, and writes a configuration.
pub(crate) fn prepare(folder: &Path, postgres: &Postgres, port: u16) {
    migrate(postgres);
    fs::write(folder.join("collect.password"), "secret\n").unwrap();
    let text = shipped(
        "collect.toml",
        &[
            ("127.0.0.1:1883", &format!("127.0.0.1:{port}")),
            (
                "host=/run/postgresql user=flexid-collect dbname=flexid",
                &postgres.words("flexid-collect"),
            ),
        ],
    );
    fs::write(folder.join("collect.toml"), text).unwrap();
}

pub(crate) fn collect(folder: &Path) -> Running {
    let log = File::options().append(true).create(true).open(folder.join("collect.log")).unwrap();
    let mut command = Command::new(FLEXID);
    command.args(["collect", "--config", "collect.toml"]).current_dir(folder);
    Running(command.stdin(Stdio::null()).stderr(log).spawn().unwrap())
}
