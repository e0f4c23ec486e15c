//! The folder of findings that were sent or are to be sent. A finding is in it before anybody hears of it, and stays.
//!
//! | file                               | what                                                                          |
//! | ---------------------------------- | ----------------------------------------------------------------------------- |
//! | `0000000017-20261130T110723Z.json` | finding 17, and when it was found                                             |
//! | `box`                              | name of the outbox, 32 digits, made once: another box counts anew             |
//! | `sent`                             | sequence up to which the broker has acknowledged                              |
//! | `new`, `lock`                      | a file that is being written; the lock of the publisher                       |

mod name;

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use flexid_pipeline::input::{BadInput, unreadable};

use crate::moment::Moment;
use name::named;

/// Most findings in the folder. 25 MB at 25 kB each, of seven joints 60 MB.
const MOST: usize = 1000;
/// Digits of a sequence in the name of a file, so that names sort by it.
const DIGITS: usize = 10;
/// Letters of a day behind the sequence and its hyphen.
const DAY: std::ops::Range<usize> = DIGITS + 1..DIGITS + 9;
/// Largest file that is read, bytes. Ten times a finding of seven joints.
const LARGEST: u64 = 1 << 20;

/// Why the folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum OutboxError {
    /// Another program has the lock.
    #[error("{0}: another `flexid publish` uses it: name another folder, or stop that one")]
    Taken(PathBuf),
    /// The folder, or a file in it, cannot be used.
    #[error(transparent)]
    Input(#[from] BadInput),
}

/// The findings of a box.
#[derive(Debug)]
pub struct Outbox {
    folder: PathBuf,
    name: String,
    /// Names of the files by their sequence.
    files: BTreeMap<u64, String>,
    sent: u64,
    most: usize,
    _lock: File,
}

/// A finding that had to make room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thinned {
    /// Sequence of the finding.
    pub sequence: u64,
    /// Whether the broker had acknowledged it.
    pub was_sent: bool,
}

impl Outbox {
    /// Opens the outbox in `folder`, which is made if it is not there.
    ///
    /// # Errors
    /// Another program uses the folder, or it cannot be read or written.
    pub fn open(folder: &Path) -> Result<Self, OutboxError> {
        let bad = |file: &Path, error: &io::Error| OutboxError::Input(unreadable(file, error));
        if folder.exists() && !folder.is_dir() {
            return Err(BadInput::new(folder, "is a file: name a folder for the outbox").into());
        }
        fs::create_dir_all(folder).map_err(|error| bad(folder, &error))?;
        let lock = File::create(folder.join("lock")).map_err(|error| bad(folder, &error))?;
        lock.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => OutboxError::Taken(folder.to_owned()),
            TryLockError::Error(error) => bad(folder, &error),
        })?;
        let mut files = BTreeMap::new();
        for entry in fs::read_dir(folder).map_err(|error| bad(folder, &error))? {
            let entry = entry.map_err(|error| bad(folder, &error))?;
            let Ok(file) = entry.file_name().into_string() else { continue };
            files.extend(sequence_of(&file).map(|sequence| (sequence, file)));
        }
        let name = named(folder)?;
        let sent = fs::read_to_string(folder.join("sent"));
        // What is not known to be sent is sent again, and whoever has it already leaves it out.
        let sent = sent.ok().and_then(|text| text.trim().parse().ok()).unwrap_or(0);
        Ok(Self { folder: folder.to_owned(), name, files, sent, most: MOST, _lock: lock })
    }

    /// Has it keep no more findings than that.
    #[cfg(test)]
    pub(crate) fn limit(&mut self, most: usize) {
        self.most = most;
    }

    /// Returns the name of the outbox.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the sequence of the next finding: 1 at first.
    pub fn next(&self) -> u64 {
        self.newest().unwrap_or(0).max(self.sent) + 1
    }

    /// Returns the sequence of the newest finding.
    pub fn newest(&self) -> Option<u64> {
        self.files.last_key_value().map(|(sequence, _)| *sequence)
    }

    /// Returns the sequence up to which the broker has acknowledged.
    pub fn sent(&self) -> u64 {
        self.sent
    }

    /// Returns the sequences of a range whose findings are there.
    pub fn within(&self, range: RangeInclusive<u64>) -> impl Iterator<Item = u64> {
        self.files.range(range).map(|(sequence, _)| *sequence)
    }

    /// Returns the sequence of the oldest finding that is not acknowledged.
    pub fn unsent(&self) -> Option<u64> {
        self.files.range(self.sent + 1..).next().map(|(sequence, _)| *sequence)
    }

    /// Returns the number of findings that are not acknowledged.
    pub fn waiting(&self) -> usize {
        self.files.range(self.sent + 1..).count()
    }

    /// Keeps the finding [`Outbox::next`], whole or not at all: it survives a power cut from here on. Returns what made room for it.
    ///
    /// # Errors
    /// The file cannot be written. The sequence stays free.
    pub fn put(&mut self, found_at: Moment, text: &str) -> io::Result<Option<Thinned>> {
        let sequence = self.next();
        let file = format!("{sequence:0DIGITS$}-{}.json", found_at.in_name());
        self.write(&file, text)?;
        self.files.insert(sequence, file);
        Ok(if self.files.len() > self.most { self.thin(u64::MAX) } else { None })
    }

    /// Removes a finding that is acknowledged, for room on the disk. Returns `None` if there is none, or it cannot be removed.
    pub fn make_room(&mut self) -> Option<Thinned> {
        self.thin(self.sent)
    }

    /// Removes a finding up to the sequence `last`: the oldest that another one of its day follows, else the oldest. The newest stays.
    fn thin(&mut self, last: u64) -> Option<Thinned> {
        let day = |file: &str| file.get(DAY).map(str::to_owned);
        let mut following = self.files.iter().skip(1);
        let older = self.files.iter().map_while(|own| Some((own, following.next()?)));
        let mut older = older.take_while(|((sequence, _), _)| **sequence <= last);
        let first = self.files.keys().next().copied().filter(|first| *first <= last);
        let of_a_day = older.find(|((_, own), (_, next))| day(own) == day(next));
        let first = first.filter(|_| self.files.len() > 1);
        let sequence = of_a_day.map(|((sequence, _), _)| *sequence).or(first)?;
        fs::remove_file(self.folder.join(self.files.get(&sequence)?)).ok()?;
        self.files.remove(&sequence);
        Some(Thinned { sequence, was_sent: sequence <= self.sent })
    }

    /// Reads a finding. Returns `None` if there is none of this sequence any more.
    ///
    /// # Errors
    /// The file cannot be read. The error names it.
    pub fn read(&self, sequence: u64) -> Result<Option<String>, BadInput> {
        let Some(file) = self.files.get(&sequence) else { return Ok(None) };
        let file = self.folder.join(file);
        let mut text = String::new();
        let read = File::open(&file).and_then(|open| open.take(LARGEST).read_to_string(&mut text));
        read.map_err(|error| unreadable(&file, &error))?;
        Ok(Some(text))
    }

    /// Takes note that the broker has the findings up to `sequence`. If that cannot be written, a restart sends them again.
    pub fn acknowledge(&mut self, sequence: u64) {
        self.sent = self.sent.max(sequence);
        let new = self.folder.join("sent.new");
        let written = fs::write(&new, format!("{}\n", self.sent));
        let _ = written.and_then(|()| fs::rename(new, self.folder.join("sent")));
    }

    /// Returns the path of the folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn write(&self, file: &str, text: &str) -> io::Result<()> {
        // The name is always the same: what a power cut leaves behind is overwritten.
        let new = self.folder.join("new");
        let written = || {
            let mut open = File::create(&new)?;
            open.write_all(text.as_bytes())?;
            open.sync_all()?;
            fs::rename(&new, self.folder.join(file))
        };
        written().inspect_err(|_| {
            // An incomplete file takes room, perhaps the last.
            let _ = fs::remove_file(&new);
        })?;
        // Not every file system can do this.
        let _ = File::open(&self.folder).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

/// Returns the sequence of a finding by the name of its file.
fn sequence_of(file: &str) -> Option<u64> {
    let (sequence, time) = file.strip_suffix(".json")?.split_once('-')?;
    let are_digits = sequence.bytes().all(|byte| byte.is_ascii_digit());
    let is_own = sequence.len() == DIGITS && are_digits && time.len() == 16 && time.is_ascii();
    is_own.then(|| sequence.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().unwrap()
    }

    fn sequences(outbox: &Outbox) -> Vec<u64> {
        outbox.files.keys().copied().collect()
    }

    #[test]
    fn the_sequence_has_no_gap_over_restarts() {
        let folder = folder();
        let mut names = Vec::new();
        for run in 0..3 {
            let mut outbox = Outbox::open(folder.path()).unwrap();
            for _ in 0..2 {
                let text = format!("{{\"run\":{run}}}");
                outbox.put(Moment::now(), &text).unwrap();
            }
            assert_eq!(outbox.read(2 * run + 2).unwrap().unwrap(), format!("{{\"run\":{run}}}"));
            outbox.acknowledge(2 * run + 1);
            assert_eq!((outbox.unsent(), outbox.waiting()), (Some(2 * run + 2), 1));
            assert!(matches!(Outbox::open(folder.path()), Err(OutboxError::Taken(_))));
            names.push(outbox.name().to_owned());
        }
        names.dedup();
        assert_eq!(names.len(), 1);
        // Files that somebody has removed leave no sequence that was sent to be given again.
        for entry in fs::read_dir(folder.path()).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|own| own == "json") {
                fs::remove_file(path).unwrap();
            }
        }
        let outbox = Outbox::open(folder.path()).unwrap();
        assert_eq!((outbox.next(), outbox.unsent(), outbox.read(3).unwrap()), (6, None, None));
    }

    #[test]
    fn a_full_outbox_keeps_the_newest_and_one_of_each_old_day() {
        let folder = folder();
        let mut outbox = Outbox::open(folder.path()).unwrap();
        outbox.limit(4);
        let now = Moment::now();
        // Three on each of four days.
        for finding in 0..12 {
            let days = f64::from(finding / 3) - 4.0;
            outbox.put(now.ago(-86_400.0 * days).unwrap(), "{}").unwrap();
        }
        assert_eq!(sequences(&outbox), [3, 6, 9, 12]);
        outbox.acknowledge(3);
        assert_eq!(outbox.make_room(), Some(Thinned { sequence: 3, was_sent: true }));
        assert_eq!(outbox.make_room(), None, "what is not sent makes no room");
        assert_eq!(outbox.within(4..=9).collect::<Vec<_>>(), [6, 9]);
        outbox.acknowledge(12);
        while outbox.make_room().is_some() {}
        assert_eq!(sequences(&outbox), [12]);
        let thinned = outbox.put(now, "{}").unwrap();
        assert_eq!((thinned, sequences(&outbox)), (None, vec![12, 13]));
    }

    #[test]
    fn what_is_no_finding_is_left_alone() {
        let folder = folder();
        for file in ["17.json", "notes.txt", "000000001a-20261130T110723Z.json", "new", "sent"] {
            fs::write(folder.path().join(file), "x").unwrap();
        }
        let outbox = Outbox::open(folder.path()).unwrap();
        assert_eq!((outbox.next(), outbox.unsent()), (1, None));
        drop(outbox);
        fs::write(folder.path().join("box"), "x").unwrap();
        let error = Outbox::open(folder.path()).unwrap_err().to_string();
        assert!(error.ends_with("/box: is no name of an outbox: remove the file"), "{error}");
        let file = folder.path().join("notes.txt");
        assert!(Outbox::open(&file).is_err());
    }
}
