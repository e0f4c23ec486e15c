//! A program that runs beside the test. Its output goes to files, the test waits for its end, and none is left
//! behind.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

/// Interval between two checks of a condition.
const POLL: Duration = Duration::from_millis(20);

/// A running program; killed when dropped.
pub struct Program {
    name: String,
    child: Child,
    output: PathBuf,
    errors: PathBuf,
}

/// A program that has ended.
#[derive(Debug)]
pub struct Ended {
    /// Exit status.
    pub status: ExitStatus,
    /// Output on stdout.
    pub output: String,
    /// Output on stderr.
    pub errors: String,
}

impl Program {
    /// Starts `command` without stdin; its output goes to `NAME.out` and `NAME.err` in `folder`.
    pub fn start(name: &str, command: &mut Command, folder: &Path) -> Result<Self> {
        let output = folder.join(format!("{name}.out"));
        let errors = folder.join(format!("{name}.err"));
        let child = command
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(File::create(&output)?)
            .stderr(File::create(&errors)?)
            .spawn()
            .with_context(|| format!("{:?} cannot be run", command.get_program()))?;
        Ok(Self { name: name.to_string(), child, output, errors })
    }

    /// Number of the process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal.
    pub fn signal(&self, signal: Signal) -> Result<()> {
        Ok(kill(Pid::from_raw(i32::try_from(self.id())?), signal)?)
    }

    /// Waits for the end, at most `timeout`.
    pub fn wait(mut self, timeout: Duration) -> Result<Ended> {
        let status = self.await_end(timeout)?;
        Ok(Ended { status, output: self.output()?, errors: self.errors()? })
    }

    /// Waits for an end with exit status 0, at most `timeout`.
    pub fn succeed(self, timeout: Duration) -> Result<Ended> {
        let name = self.name.clone();
        let ended = self.wait(timeout)?;
        if !ended.status.success() {
            bail!("{name}: {}\n{}{}", ended.status, ended.output, ended.errors);
        }
        Ok(ended)
    }

    /// Output on stdout so far.
    pub fn output(&self) -> Result<String> {
        Ok(String::from_utf8_lossy(&fs::read(&self.output)?).into_owned())
    }

    /// Output on stderr so far.
    pub fn errors(&self) -> Result<String> {
        Ok(String::from_utf8_lossy(&fs::read(&self.errors)?).into_owned())
    }

    /// Fails if the program has ended already.
    pub fn still_runs(&mut self) -> Result<()> {
        match self.child.try_wait()? {
            None => Ok(()),
            Some(status) => bail!("{} ended early: {status}\n{}", self.name, self.errors()?),
        }
    }

    fn await_end(&mut self, timeout: Duration) -> Result<ExitStatus> {
        let start = Instant::now();
        while start.elapsed() < timeout {
            if let Some(status) = self.child.try_wait()? {
                return Ok(status);
            }
            std::thread::sleep(POLL);
        }
        bail!("{} still ran after {timeout:?}\n{}{}", self.name, self.output()?, self.errors()?)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // The program may have ended before. The errors are then expected.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Checks `condition` until it holds, at most `timeout`; `what` names it in the error.
pub fn until(
    what: &str,
    timeout: Duration,
    mut condition: impl FnMut() -> Result<bool>,
) -> Result<()> {
    let start = Instant::now();
    while !condition()? {
        if start.elapsed() > timeout {
            bail!("{what}: not within {timeout:?}");
        }
        std::thread::sleep(POLL);
    }
    Ok(())
}
