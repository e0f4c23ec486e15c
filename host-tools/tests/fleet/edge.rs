//! A box: the daemon's server, and the publisher beside it.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::thread;

use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::messages::{BusState, FromEdge, Phase};
use flexid_wire::report::Acceptance;
use flexid_wire::state::State;

use super::{Running, news};

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenario");

pub(crate) struct Edge {
    pub(crate) folder: PathBuf,
    latest: Arc<Latest>,
    stop: Stop,
}

impl Edge {
    /// A box whose files lie in a folder, and whose publisher takes each finding at once.
    pub(crate) fn new(folder: &Path, robot: &str, port: u16, broker_lines: &str) -> Self {
        let config = format!(
            "site = \"hall\"\nrobot = \"{robot}\"\ndaemon = \"unix:flexid.sock\"\nedge = \"edge.toml\"\noutbox = \"outbox\"\ninterval_s = 0.0\n\n\
             [broker]\naddress = \"127.0.0.1:{port}\"\n{broker_lines}"
        );
        fs::create_dir_all(folder).unwrap();
        fs::write(folder.join("publish.toml"), config).unwrap();
        for file in ["mill3-model.toml", "mill3.dbc", "mill3.toml"] {
            fs::copy(format!("{SCENARIO}/{file}"), folder.join(file)).unwrap();
        }
        fs::copy(format!("{SCENARIO}/mill3-edge.toml"), folder.join("edge.toml")).unwrap();
        let socket = folder.join("flexid.sock");
        let listeners = [Listener::bind(&Listen::Unix(socket)).unwrap()];
        let (latest, stop) = (Arc::new(Latest::new()), Stop::new());
        latest.publish(news::status(State::Measuring { implausible: None }));
        latest.publish(news::bus(BusState::Up, None));
        let (served, stopped) = (Arc::clone(&latest), stop.clone());
        thread::spawn(move || serve(&listeners, &served, &stopped));
        Self { folder: folder.to_owned(), latest, stop }
    }

    /// The daemon settles on its finding `number`, whose first stiffness is that number.
    pub(crate) fn find(&self, number: u64) {
        self.latest.publish(news::progress(Phase::Settled, number));
        let mut finding = news::finding(Acceptance::Consistent, number);
        let joint = finding.report.joints[0].clone();
        finding.report.joints.clear();
        for name in ["joint_1", "joint_2", "joint_3"] {
            let mut joint = joint.clone();
            joint.name = flexid_wire::text::clipped(name);
            joint.stiffness[0] = number as f64;
            finding.report.joints.push(joint).unwrap();
        }
        self.latest.publish(FromEdge::Finding(finding));
    }

    /// The daemon tells again how its bus is.
    pub(crate) fn live(&self) {
        self.latest.publish(news::bus(BusState::Up, None));
    }

    /// Starts the publisher.
    pub(crate) fn publish(&self) -> Running {
        self.publish_by(env!("CARGO_BIN_EXE_flexid"), &[])
    }

    /// Starts the publisher by another program.
    pub(crate) fn publish_by(&self, program: &str, arguments: &[&str]) -> Running {
        let log = File::options().append(true).create(true).open(self.log()).unwrap();
        let mut command = Command::new(program);
        command.args(arguments).args(["publish", "--config", "publish.toml"]);
        command.current_dir(&self.folder).stdin(Stdio::null()).stderr(log);
        Running(command.spawn().unwrap())
    }

    /// The log of the publisher.
    pub(crate) fn log(&self) -> PathBuf {
        self.folder.join("publish.log")
    }

    /// The sequence up to which the broker has acknowledged.
    pub(crate) fn sent(&self) -> u64 {
        let text = fs::read_to_string(self.folder.join("outbox/sent")).unwrap_or_default();
        text.trim().parse().unwrap_or(0)
    }

    /// The number of findings in the outbox.
    pub(crate) fn kept(&self) -> usize {
        let Ok(entries) = fs::read_dir(self.folder.join("outbox")) else { return 0 };
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.ends_with(".json")).count()
    }
}

impl Drop for Edge {
    fn drop(&mut self) {
        self.latest.close();
        self.stop.request();
    }
}
