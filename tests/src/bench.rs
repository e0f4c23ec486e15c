//! A folder with a robot and its configuration, and the commands of a user in it.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use flate2::read::GzDecoder;
use nix::sys::signal::Signal;
use tempfile::TempDir;

use crate::bus::INTERFACE;
use crate::process::{Ended, Program, until};
use crate::programs;
use crate::report::Report;

/// Address of a bench's daemon, as `flexid watch` takes it.
pub const ADDRESS: &str = "unix:flexid.sock";

/// Folder of the reference robot: URDF, DBC and scenario.
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-tools/scenario");

/// A temporary folder.
pub struct Bench {
    folder: TempDir,
}

impl Bench {
    /// An empty bench.
    pub fn empty() -> Result<Self> {
        Ok(Self { folder: tempfile::tempdir()? })
    }

    /// A bench with the reference scenario as it is shipped. Its configuration is also there as `edge.toml`.
    pub fn scenario() -> Result<Self> {
        let bench = Self::empty()?;
        for file in fs::read_dir(SCENARIO).context(SCENARIO)? {
            let file = file?;
            fs::copy(file.path(), bench.path(file.file_name()))?;
        }
        fs::copy(bench.path("mill3-edge.toml"), bench.path("edge.toml"))?;
        Ok(bench)
    }

    /// A bench with the reference scenario and the files of a recording. Its logs are unpacked beside them.
    pub fn recording(folder: &Path) -> Result<Self> {
        let bench = Self::scenario()?;
        for file in fs::read_dir(folder)? {
            let file = file?.path();
            if file.extension().is_some_and(|extension| extension == "gz") {
                let log = bench.path(file.file_stem().context("a file without a name")?);
                io::copy(&mut GzDecoder::new(File::open(&file)?), &mut File::create(log)?)?;
            } else {
                let name = file.file_name().context("a file without a name")?;
                fs::copy(&file, bench.path(name)).with_context(|| file.display().to_string())?;
            }
        }
        Ok(bench)
    }

    /// A file in the folder.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Replaces `from`, which must be there, in `edge.toml`.
    pub fn configure(&self, from: &str, to: &str) -> Result<()> {
        let text = fs::read_to_string(self.path("edge.toml"))?;
        ensure!(text.contains(from), "edge.toml has no {from}");
        Ok(fs::write(self.path("edge.toml"), text.replace(from, to))?)
    }

    /// Starts `COMMAND ARGUMENTS` in the folder, with flexid's programs on the path.
    pub fn start<I: AsRef<std::ffi::OsStr>>(
        &self,
        name: &str,
        command: &str,
        arguments: impl IntoIterator<Item = I>,
    ) -> Result<Program> {
        let mut path = OsString::from(programs::folder()?);
        path.push(":");
        path.push(std::env::var_os("PATH").unwrap_or_default());
        let mut command = Command::new(command);
        Program::start(name, command.args(arguments).env("PATH", path), self.folder.path())
    }

    /// Starts `flexid ARGUMENTS`.
    pub fn flexid<'a>(
        &self,
        name: &str,
        arguments: impl IntoIterator<Item = &'a str>,
    ) -> Result<Program> {
        self.start(name, "flexid", arguments)
    }

    /// Starts the daemon and waits until it listens.
    pub fn edge(&self) -> Result<Program> {
        let mut edge = self.start("edge", "flexid-edge", ["--config", "edge.toml"])?;
        until("the daemon listens", Duration::from_secs(20), || {
            edge.still_runs()?;
            Ok(self.path("flexid.sock").exists())
        })?;
        Ok(edge)
    }

    /// Starts a candump of `interface`, which counts the frames that it misses. Its buffer holds all that a test
    /// sends, since a guest kernel that was held up sends it in bursts.
    pub fn candump(&self, interface: &str) -> Result<Program> {
        let listener =
            self.start("candump", "candump", ["-L", "-d", "-r", "64000000", interface])?;
        std::thread::sleep(Duration::from_millis(500)); // it does not report when it listens
        Ok(listener)
    }

    /// Plays a candump log of the folder, recorded from `interface`, onto the bus at the pace of its time stamps.
    pub fn play(&self, log: &str, interface: &str) -> Result<Ended> {
        let arguments = ["-I", log, &format!("{INTERFACE}={interface}")];
        self.start("canplayer", "canplayer", arguments)?.succeed(Duration::from_secs(60))
    }

    /// Watches the daemon until it has identified the robot from `records` records, at most `timeout`.
    pub fn identified(&self, records: u64, timeout: Duration) -> Result<Report> {
        let seconds = timeout.as_secs().to_string();
        let watch = ["watch", ADDRESS, "--until", "identified", "--timeout", &seconds, "--json"];
        let mut report = None;
        until("all records are identified", timeout, || {
            let ended = self.flexid("watch", watch)?.succeed(timeout + Duration::from_secs(10))?;
            let news = report.insert(Report::last_of(&ended.output)?);
            Ok(news.fit.records >= records)
        })
        .with_context(|| {
            let found = report.as_ref().map(|report| (&report.fit, &report.warnings));
            let log = fs::read_to_string(self.path("edge.err")).unwrap_or_default();
            format!("of {records}: the newest report says {found:?}, the daemon's log:\n{log}")
        })?;
        report.context("nothing was watched")
    }

    /// Ends the daemon as an init system does, and checks that it ends cleanly.
    pub fn stop(&self, edge: Program) -> Result<Ended> {
        edge.signal(Signal::SIGTERM)?;
        let ended = edge.succeed(Duration::from_secs(10))?;
        ensure!(!self.path("flexid.sock").exists(), "the daemon left its socket behind");
        Ok(ended)
    }
}
