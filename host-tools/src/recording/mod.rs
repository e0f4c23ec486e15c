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
use std::time::Duration;

use flexid_pipeline::config::Config;
use flexid_pipeline::input::{self, BadInput, Binary};
use flexid_pipeline::poses::Cut;
use flexid_pipeline::source::{
    Arrival, CandumpLog, Flow, FrameSource, Logs, Shown, SourceHealth, TableLog, table,
};

use ending::Whole;
use meter::Meter;

/// Name of standard input.
const STANDARD_INPUT: &str = "-";

/// Kinds that a log of candump and a table of commas seem to be of.
const READ: [&str; 2] = ["a candump log", "a CSV file"];

/// Most tables of a file of poses that an error names.
const NAMED: usize = 5;

/// The bytes of a recording, unpacked.
type Bytes = Box<dyn Read + Send>;

/// A recording, by its content.
enum Log {
    Frames(Box<CandumpLog<Bytes>>),
    Table(Box<TableLog<'static>>),
}

/// A log that can be used.
enum Usable {
    /// A file, closed again, so that only one file is open at a time.
    File(PathBuf),
    /// Standard input or a pipe, which can be opened only once.
    Open(Log),
}

impl FrameSource for Log {
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        match self {
            Self::Frames(log) => log.read(batch, timeout),
            Self::Table(table) => table.read(batch, timeout),
        }
    }

    fn health(&self) -> SourceHealth {
        match self {
            Self::Frames(log) => log.health(),
            Self::Table(table) => table.health(),
        }
    }
}

/// Takes the files of modal tests out of the names, and leaves the others. Where some are named, the configuration keeps these alone.
pub(crate) fn split(names: &[PathBuf], config: &mut Config) -> Vec<PathBuf> {
    let is_same = |one: &Path, other: &Path| {
        let of = |file: &Path| fs::canonicalize(file).ok();
        one == other || of(one).is_some_and(|own| of(other) == Some(own))
    };
    let is_test = |name: &&PathBuf| config.receptances.iter().any(|own| is_same(&own.file, name));
    let (tests, others): (Vec<PathBuf>, Vec<PathBuf>) =
        names.iter().cloned().partition(|name| is_test(&name));
    if !tests.is_empty() {
        config.receptances.retain(|own| tests.iter().any(|name| is_same(&own.file, name)));
    }
    others
}

/// Opens the recordings of a configuration as one source, and returns it with the configuration that they complete: tables have their own steps,
/// and perhaps their own rate. It opens and checks each at once, so that it reports a wrong name before the work begins. In place of a last line
/// that is cut off there comes an error, as at the end of packed data that are cut off.
///
/// # Errors
/// A recording cannot be read, or is neither of `candump -L` nor a table with the columns of the configuration. The error is one line on the first
/// of them, with the remedy.
pub(crate) fn open(
    names: &[PathBuf],
    config: &Config,
    meter: &Meter,
) -> Result<(Config, impl FrameSource + use<>), BadInput> {
    if let Some(again) = names
        .iter()
        .enumerate()
        .find(|(index, name)| name.as_os_str() == STANDARD_INPUT && names[..*index].contains(name))
    {
        return Err(BadInput::new(again.1, "is standard input, which can be read only once"));
    }
    if let Some(first) = names.first().filter(|_| config.signals.is_none()) {
        let file = config.file.display();
        return Err(BadInput::new(
            first,
            format!(
                "is no modal test that [receptance] file names, and {file} has no [signals]: name the file there, or the columns of a table in [signals]"
            ),
        ));
    }
    let mut logs = Vec::new();
    // Rate and steps of the tables together, or that there are frames.
    let mut all: Option<Option<Shown>> = None;
    for name in names {
        let (usable, shown) = usable(name, config, meter)?;
        all = Some(match (all, shown) {
            (None, shown) => shown,
            (Some(None), None) => None,
            (Some(Some(all)), Some(shown)) => {
                Some(all.and(shown).map_err(|[one_hz, other_hz]| {
                    let rates = format!("comes at {other_hz:.1} Hz, and the tables before at {one_hz:.1} Hz: identify from those of one rate");
                    BadInput::new(name, rates)
                })?)
            }
            (Some(_), _) => {
                let message = "is of another kind than the recordings before: name candump logs or tables, not both";
                return Err(BadInput::new(name, message));
            }
        });
        logs.push(usable);
    }
    let config = match all.flatten() {
        Some(shown) => config.of_tables(&shown)?,
        None => config.clone(),
    };
    let (own, meter) = (config.clone(), meter.clone());
    let source = Logs::new(logs.into_iter().map(move |usable| match usable {
        Usable::Open(log) => Ok(log),
        Usable::File(name) => {
            let file = File::open(&name).map_err(|error| input::unreadable(&name, &error));
            file.and_then(|file| log(&name, meter.read(file), &own)).map_err(io::Error::other)
        }
    }));
    Ok((config, source))
}

/// Checks the log of this name. It returns rate and steps of a table.
fn usable(
    name: &Path,
    config: &Config,
    meter: &Meter,
) -> Result<(Usable, Option<Shown>), BadInput> {
    let opened = |log: Log| {
        let shown = log.shown();
        (Usable::Open(log), shown)
    };
    if name.as_os_str() == STANDARD_INPUT {
        return Ok(opened(log(name, io::stdin(), config)?));
    }
    let metadata = fs::metadata(name).map_err(|error| input::unreadable(name, &error))?;
    if metadata.is_dir() {
        return Err(BadInput::new(name, "is a folder: name the log files in it"));
    }
    let file = File::open(name).map_err(|error| input::unreadable(name, &error))?;
    let log = log(name, file, config)?;
    if metadata.is_file() {
        meter.expect(metadata.len());
        Ok((Usable::File(name.to_owned()), log.shown()))
    } else {
        Ok(opened(log))
    }
}

impl Log {
    fn shown(&self) -> Option<Shown> {
        match self {
            Self::Frames(_) => None,
            Self::Table(table) => Some(table.shown()),
        }
    }
}

/// The recording in `bytes`, packed or not, if it is one of `candump -L` or a table; messages call it `name`.
fn log(name: &Path, bytes: impl Read + Send + 'static, config: &Config) -> Result<Log, BadInput> {
    let is_standard_input = name.as_os_str() == STANDARD_INPUT;
    let shown = if is_standard_input { Path::new("standard input") } else { name };
    let (head, bytes) = foreign::head(packed::unpacked(bytes));
    if let Some(format) = Binary::of(&head).filter(|format| table::is_read(*format)) {
        let layout = config.layout()?;
        let known = poses(name, shown, config);
        let table =
            TableLog::open_binary(shown, format, bytes, &layout, known.clone().ok().flatten())?;
        return known.map(|_| Log::Table(Box::new(table)));
    }
    if let Some(mend) = foreign::mend(&head) {
        return Err(BadInput::new(shown, mend));
    }
    let layout = config.layout()?;
    let is_log = foreign::is_candump(&head);
    let own = input::seems(&String::from_utf8_lossy(&head)).filter(|own| !READ.contains(own));
    let has_names = !is_log && table::has_names(&head, &layout);
    if let Some(own) = own.filter(|_| !is_log && !has_names) {
        return Err(BadInput::new(
            shown,
            format!("is {own}, and neither a log of candump -L nor a table: name one"),
        ));
    }
    let has_bus = !config.interface.is_empty();
    if has_names || (!is_log && (table::is_like(&head) || !has_bus)) {
        let poses = poses(name, shown, config);
        let known = poses.clone().ok().flatten();
        let table = TableLog::open(shown, bytes, &layout, known)?;
        // A file that is no table needs no pose.
        return poses.map(|_| Log::Table(Box::new(table)));
    }
    if !has_bus {
        let file = config.file.display();
        return Err(BadInput::new(
            shown,
            format!("is a candump log, and {file} has no [bus]: name interface and DBC file there"),
        ));
    }
    let Config { interface, signals, .. } = config;
    let whole = Whole::new(bytes, interface.clone(), signals.clone());
    let log = CandumpLog::new(shown, Box::new(whole) as Bytes).on_bus(interface)?;
    Ok(Log::Frames(Box::new(log)))
}

/// Poses of the cuts of a table, and blows, if the poses are not columns of it.
fn poses(name: &Path, shown: &Path, config: &Config) -> Result<Option<Vec<Cut>>, BadInput> {
    let Some(poses) = &config.poses else { return Ok(None) };
    let own = poses.of(name);
    if own.is_empty() {
        let names: Vec<&str> = poses.names().take(NAMED).collect();
        let names = names.join(", ");
        return Err(BadInput::new(
            shown,
            format!("has no line in [recording] poses, which names {names}: add its pose there"),
        ));
    }
    Ok(Some(own))
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
        let (_, logs) = open(&names, &config(), &Meter::hidden()).unwrap();
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
        let (_, logs) = open(&names, &config(), &Meter::hidden()).unwrap();
        fs::remove_file(&names[0]).unwrap();
        let (frames, end) = frames(logs);
        assert_eq!(frames, 1);
        let error = end.unwrap_err().to_string();
        assert!(error.contains("a.log: cannot be read: it does not exist"), "{error}");
    }
}
