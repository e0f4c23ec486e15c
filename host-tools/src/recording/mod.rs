//! The recordings that a user names: files or standard input, packed or not, one after the other.
//!
//! | module      | holds                                               |
//! | ----------- | --------------------------------------------------- |
//! | [`packed`]  | gzip and zstd, recognised by their first bytes      |
//! | [`foreign`] | other formats, and how to convert them              |
//! | `ending`    | whether the last line of a log is whole             |
//! | `meter`     | the progress of reading and of the work             |

mod ending;
pub mod foreign;
pub(crate) mod meter;
pub mod packed;

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use flexid_pipeline::config::Config;
use flexid_pipeline::input::{self, BadInput};
use flexid_pipeline::signals::SignalTable;
use flexid_pipeline::source::{CandumpLog, FrameSource, Logs};

use ending::Whole;
use meter::Meter;

/// Name of standard input.
const STANDARD_INPUT: &str = "-";

/// What a log of candump seems to be.
const LOG: &str = "a candump log";

/// A log, unpacked.
type Log = CandumpLog<Box<dyn Read + Send>>;

/// A log that can be used.
enum Usable {
    /// A file, closed again, so that only one file is open at a time.
    File(PathBuf),
    /// Standard input or a pipe, which can be opened only once.
    Open(Box<Log>),
}

/// Returns whether a log is a file, which can be read again, and not standard input or a pipe.
pub(crate) fn is_file(name: &Path) -> bool {
    name.as_os_str() != STANDARD_INPUT && fs::metadata(name).is_ok_and(|log| log.is_file())
}

/// Opens the logs of a configuration as one source. It opens and checks each log at once, so that it reports a wrong name before the
/// work begins. In place of a last line that is cut off there comes an error, as at the end of packed data that are cut off.
///
/// # Errors
/// A log cannot be read, or is not of `candump -L`. The error is one line on the first of them, with the remedy.
pub(crate) fn open(
    names: &[PathBuf],
    config: &Config,
    meter: &Meter,
) -> Result<impl FrameSource + use<>, BadInput> {
    if let Some(again) = names
        .iter()
        .enumerate()
        .find(|(index, name)| name.as_os_str() == STANDARD_INPUT && names[..*index].contains(name))
    {
        return Err(BadInput::new(again.1, "is standard input, which can be read only once"));
    }
    let usable = |name: &PathBuf| usable(name, config, meter);
    let logs = names.iter().map(usable).collect::<Result<Vec<_>, _>>()?;
    let (interface, table, meter) =
        (config.interface.clone(), config.signals.clone(), meter.clone());
    Ok(Logs::new(logs.into_iter().map(move |usable| match usable {
        Usable::Open(log) => Ok(*log),
        Usable::File(name) => {
            let file = File::open(&name).map_err(|error| input::unreadable(&name, &error));
            file.and_then(|file| log(&name, meter.read(file), &interface, &table))
                .map_err(io::Error::other)
        }
    })))
}

/// Checks the log of this name.
fn usable(name: &Path, config: &Config, meter: &Meter) -> Result<Usable, BadInput> {
    let Config { interface, signals: table, .. } = config;
    if name.as_os_str() == STANDARD_INPUT {
        let log = log(Path::new("standard input"), io::stdin(), interface, table)?;
        return Ok(Usable::Open(Box::new(log)));
    }
    let metadata = fs::metadata(name).map_err(|error| input::unreadable(name, &error))?;
    if metadata.is_dir() {
        return Err(BadInput::new(name, "is a folder: name the log files in it"));
    }
    let file = File::open(name).map_err(|error| input::unreadable(name, &error))?;
    if metadata.is_file() {
        log(name, file, interface, table)?;
        meter.expect(metadata.len());
        Ok(Usable::File(name.to_owned()))
    } else {
        Ok(Usable::Open(Box::new(log(name, file, interface, table)?)))
    }
}

/// The log in `bytes`, packed or not, if it is one of `candump -L`; messages call it `name`.
fn log(
    name: &Path,
    bytes: impl Read + Send + 'static,
    interface: &str,
    table: &SignalTable,
) -> Result<Log, BadInput> {
    let whole = Whole::new(packed::unpacked(bytes), interface.to_owned(), table.clone());
    let (head, bytes) = foreign::head(Box::new(whole));
    if let Some(mend) = foreign::mend(&head) {
        return Err(BadInput::new(name, mend));
    }
    let own = input::seems(&String::from_utf8_lossy(&head)).filter(|own| *own != LOG);
    if let Some(own) = own {
        return Err(BadInput::new(name, format!("is {own}, and no log of candump -L: name one")));
    }
    CandumpLog::new(name, bytes).on_bus(interface)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use flexid_pipeline::source::Flow;

    use super::*;

    const LINE: &[u8] = b"(1767000000.000060) can0 101#00\n";

    fn frames(mut source: impl FrameSource) -> (usize, io::Result<Flow>) {
        let mut batch = Vec::new();
        loop {
            match source.read(&mut batch, Duration::ZERO) {
                Ok(Flow::Open) => {}
                end => return (batch.len(), end),
            }
        }
    }

    /// That of the reference robot, on the bus of [`LINE`].
    fn config() -> Config {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario/mill3-edge.toml");
        Config { interface: "can0".to_owned(), ..Config::load(&file).unwrap() }
    }

    /// Number of open descriptors of this process. Other tests may open descriptors meanwhile.
    fn descriptors() -> usize {
        fs::read_dir("/proc/self/fd").unwrap().count()
    }

    #[test]
    fn of_many_logs_one_is_open_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let names: Vec<_> =
            (0..300).map(|number| folder.path().join(format!("{number}.log"))).collect();
        for name in &names {
            fs::write(name, LINE).unwrap();
        }
        let before = descriptors();
        let logs = open(&names, &config(), &Meter::hidden()).unwrap();
        assert!(descriptors() < before + 100, "{} are open", descriptors() - before);
        assert_eq!(frames(logs).0, 300);
    }

    #[test]
    fn a_log_that_goes_away_meanwhile_does_not_keep_the_others() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["a.log", "b.log"].map(|name| folder.path().join(name));
        for name in &names {
            fs::write(name, LINE).unwrap();
        }
        let logs = open(&names, &config(), &Meter::hidden()).unwrap();
        fs::remove_file(&names[0]).unwrap();
        let (frames, end) = frames(logs);
        assert_eq!(frames, 1);
        let error = end.unwrap_err().to_string();
        assert!(error.contains("a.log: cannot be read: it does not exist"), "{error}");
    }
}
