//! mosquitto on a free port of the loopback interface, and its own clients.

use std::fs::{self, File};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};

use serde_json::Value;

use super::{Running, until};

/// A broker with its files in a folder.
pub(crate) struct Broker {
    pub(crate) port: u16,
    folder: PathBuf,
    running: Option<Running>,
}

impl Broker {
    /// A broker that is off, with these lines in its configuration.
    pub(crate) fn new(folder: &Path, lines: &str) -> Self {
        let port = free_port();
        Self::of(folder, port, &format!("listener {port} 127.0.0.1\n{lines}"))
    }

    /// A broker that is off, with this configuration, of which a listener has the port.
    pub(crate) fn of(folder: &Path, port: u16, text: &str) -> Self {
        fs::create_dir_all(folder).unwrap();
        let text = format!("user root\nlog_dest stderr\nlog_type all\n{text}\n");
        fs::write(folder.join("mosquitto.conf"), text).unwrap();
        Self { port, folder: folder.to_owned(), running: None }
    }

    pub(crate) fn start(&mut self) {
        let log = File::options().append(true).create(true).open(self.folder.join("mosquitto.log"));
        // Debian has it where only root looks.
        let path = format!("{}:/usr/sbin:/sbin", std::env::var("PATH").unwrap());
        let mut command = Command::new("mosquitto");
        command.env("PATH", path).args(["-c", "mosquitto.conf"]).current_dir(&self.folder);
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log.unwrap()).spawn();
        self.running = Some(Running(child.expect("apt-get install mosquitto mosquitto-clients")));
        until("mosquitto listens", || TcpStream::connect(("127.0.0.1", self.port)).ok());
    }

    /// Kills it, as a power cut would.
    pub(crate) fn kill(&mut self) {
        self.running = None;
        fs::remove_file(self.folder.join("mosquitto.log")).unwrap();
    }

    pub(crate) fn id(&self) -> u32 {
        self.running.as_ref().unwrap().0.id()
    }

    fn client(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.args(["-h", "127.0.0.1", "-p", &self.port.to_string(), "-V", "5"]);
        command.stdin(Stdio::null());
        command
    }

    /// Subscribes to a topic. Each message becomes a line of the file: whether it is retained, and its text.
    pub(crate) fn subscribe(&self, topic: &str, file: &Path, arguments: &[&str]) -> Running {
        let mut command = self.client("mosquitto_sub");
        command.args(["-t", topic, "-q", "1", "-F", "%r %p"]).args(arguments);
        Running(command.stdout(File::create(file).unwrap()).spawn().unwrap())
    }

    /// Returns what the broker retains of a topic, if it retains anything.
    pub(crate) fn retained(&self, topic: &str) -> Option<Value> {
        let mut command = self.client("mosquitto_sub");
        command.args(["-t", topic, "-C", "1", "-W", "2", "--retained-only"]);
        serde_json::from_slice(&command.output().unwrap().stdout).ok()
    }

    pub(crate) fn publish(&self, topic: &str, text: &str) {
        let mut command = self.client("mosquitto_pub");
        assert!(command.args(["-q", "1", "-t", topic, "-m", text]).status().unwrap().success());
    }
}

/// A port of its own. Linux gives ports from 32768 to clients, which would take that of a broker that is off.
pub(crate) fn free_port() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(20_000);
    let is_free = |port: &u16| TcpListener::bind(("127.0.0.1", *port)).is_ok();
    std::iter::repeat_with(|| NEXT.fetch_add(1, Ordering::Relaxed)).find(is_free).unwrap()
}

/// The messages in the file of a subscription, each with whether it was retained.
pub(crate) fn messages(file: &Path) -> Vec<(bool, Value)> {
    let text = fs::read_to_string(file).unwrap();
    // The last line may be incomplete.
    let lines = text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n'));
    let parts = lines.map(|line| line.split_once(' ').unwrap());
    parts.map(|(retained, text)| (retained == "1", serde_json::from_str(text).unwrap())).collect()
}

/// The sequences of the findings in the file of a subscription, as they came.
pub(crate) fn sequences(file: &Path) -> Vec<u64> {
    messages(file).iter().map(|(_, own)| own["sequence"].as_u64().unwrap()).collect()
}
