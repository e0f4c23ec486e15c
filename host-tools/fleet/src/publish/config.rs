//! `PUBLISH.toml`: whose findings go where.

use std::path::{Path, PathBuf};
use std::time::Duration;

use flexid_pipeline::config::Listen;
use flexid_pipeline::input::{BadInput, parse_toml, read};
use serde::Deserialize;

use crate::broker::BrokerSection;
use crate::link::Access;
use crate::place::Place;

/// Environment variable in which systemd gives the state directory of a service.
const DIRECTORY: &str = "STATE_DIRECTORY";
/// Shortest time between two findings, s, if the file does not state it: at 25 kB each, 4 MB a day.
const INTERVAL_S: f64 = 600.0;

/// A checked `PUBLISH.toml`.
#[derive(Clone, Debug)]
pub struct Config {
    /// File from which it was read.
    pub file: PathBuf,
    /// The robot.
    pub place: Place,
    /// Address of the daemon.
    pub daemon: Listen,
    /// The daemon's configuration.
    pub edge: PathBuf,
    /// Folder of the outbox.
    pub outbox: PathBuf,
    /// Shortest time between two findings. The newest that settles meanwhile is taken at its end.
    pub interval: Duration,
    /// The broker of the box.
    pub broker: Access,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    site: String,
    robot: String,
    daemon: String,
    edge: PathBuf,
    outbox: Option<PathBuf>,
    interval_s: Option<f64>,
    broker: BrokerSection,
}

impl Config {
    /// Reads and checks the file. Relative paths start at its folder.
    ///
    /// # Errors
    /// The error is one line that names the file, the place and the correction.
    pub fn load(file: &Path) -> Result<Self, BadInput> {
        Self::parse(file, &read(file)?)
    }

    /// [`Config::load`], of the `text` of the file.
    ///
    /// # Errors
    /// The errors are those of [`Config::load`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, BadInput> {
        let bad = |message: String| BadInput::new(file, message);
        let base = file.parent().unwrap_or(Path::new(""));
        let own: File = parse_toml(file, text)?;
        let place = Place::new(&own.site, &own.robot).map_err(|error| bad(error.to_string()))?;
        let daemon =
            Listen::parse(&own.daemon, base).map_err(|error| bad(format!("daemon: {error}")))?;
        let systemds = || {
            let folders = std::env::var_os(DIRECTORY)?;
            std::env::split_paths(&folders).next()
        };
        let outbox = own.outbox.map(|outbox| base.join(outbox)).or_else(systemds);
        let outbox = outbox.ok_or_else(|| {
            bad("outbox is missing: name a folder that outlives a restart, outbox = \"outbox\""
                .into())
        })?;
        let interval_s = own.interval_s.unwrap_or(INTERVAL_S);
        let interval = Duration::try_from_secs_f64(interval_s)
            .map_err(|_| bad(format!("interval_s is {interval_s}: must be 0 or more seconds")))?;
        let broker = own.broker.access(file)?;
        if !broker.address.ip().is_loopback() {
            return Err(bad(format!(
                "[broker] address {} is open to the network, and nothing is encrypted: name the broker of this box, \"127.0.0.1:1883\", whose bridge leads on",
                broker.address
            )));
        }
        let (file, edge) = (file.to_owned(), base.join(own.edge));
        Ok(Self { file, place, daemon, edge, outbox, interval, broker })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "site = \"hall\"\nrobot = \"r1\"\ndaemon = \"unix:flexid.sock\"\nedge = \"edge.toml\"\noutbox = \"out\"\n\n[broker]\naddress = \"127.0.0.1:1883\"\n";

    fn parse(from: &str, to: &str) -> Result<Config, String> {
        assert!(TEXT.contains(from), "{from}");
        let text = TEXT.replacen(from, to, 1);
        Config::parse(Path::new("/etc/flexid/publish.toml"), &text)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn paths_start_at_the_file() {
        let config = parse("", "").unwrap();
        assert_eq!(config.daemon.to_string(), "unix:/etc/flexid/flexid.sock");
        assert_eq!(
            (config.edge, config.outbox),
            ("/etc/flexid/edge.toml".into(), "/etc/flexid/out".into())
        );
        assert_eq!(config.interval, Duration::from_secs(600));
    }

    #[test]
    fn each_mistake_is_a_line_with_its_mend() {
        for (from, to, says) in [
            ("hall", "hall/3", "site \"hall/3\" has '/': write letters"),
            ("\"r1\"", "\"\"", "robot is empty: name it"),
            ("unix:flexid.sock", "flexid.sock", "daemon: \"flexid.sock\" is no address: write"),
            ("outbox = \"out\"\n", "", "outbox is missing: name a folder"),
            (
                "[broker]",
                "interval_s = -1.0\n[broker]",
                "interval_s is -1: must be 0 or more seconds",
            ),
            ("127.0.0.1:1883", "plant", "[broker] address \"plant\": write an address"),
            ("127.0.0.1:1883", "10.0.0.1:1883", "is open to the network, and nothing is encrypted"),
            ("[broker]", "[broker]\nuser = \"u\"", "one of user and password_file: give both"),
            (
                "[broker]",
                "[broker]\nuser = \"u\"\npassword_file = \"gone\"",
                "/etc/flexid/gone: cannot be read",
            ),
            ("robot =", "robots =", "robots"),
        ] {
            let error = parse(from, to).unwrap_err();
            assert!(error.contains(says) && !error.contains('\n'), "{to}: {error}");
        }
    }
}
