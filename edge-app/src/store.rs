//! The file in which a daemon keeps its state: `[state] file`, or `flexid.state` in systemd's state directory.
//!
//! ```text
//! "flexid-state"   version, u32    CRC-32 of the rest, u32    postcard of the State        numbers little-endian
//! ```
//!
//! The file is written whole or not at all. Beside it may lie:
//!
//! | name                      | what                                                                                   |
//! | ------------------------- | -------------------------------------------------------------------------------------- |
//! | `flexid.state.lock`       | the lock of the daemon that keeps its state there                                      |
//! | `flexid.state.new`        | a file that is being written                                                           |
//! | `flexid.state.1234abcd`   | state of another measurement, which this checksum of the configuration names: it is taken back when the configuration returns |
//! | `flexid.state.no-1234abcd`| a file that holds no state, named by its checksum; the newest alone stays              |

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use flexid_pipeline::config::Fingerprint;
use flexid_pipeline::input::open_regular;
use flexid_pipeline::{Format8, State};
use tracing::{info, warn};

const MAGIC: &[u8; 12] = b"flexid-state";
/// Version of the format. It changes with every struct in a state but the fit, which has a version of its own.
const VERSION: u32 = 9;
/// The version before, which is read and converted, so that an upgrade does not forget the robot.
const BEFORE: u32 = 8;
const HEADER: usize = MAGIC.len() + 4 + 4;
/// Largest file that is read, bytes: twice what a state with the most records takes.
const LARGEST: u64 = 128 << 20;
/// Most states that are put aside and kept. Chosen: a configuration that is tried and taken back has one.
const MOST_STATES: usize = 4;
/// Most files without a state that are put aside and kept. One shows what happened.
const MOST_OTHERS: usize = 1;
/// Environment variable in which systemd gives the state directory of a service: folders, with colons between them.
const DIRECTORY: &str = "STATE_DIRECTORY";
/// Name of the file in that directory.
const NAME: &str = "flexid.state";
/// Ending of the name of a file that holds no state, before its checksum.
const OTHER: &str = "no-";

/// Why bytes hold no state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// The bytes do not begin like a state.
    #[error("is no state of flexid-edge")]
    Foreign,
    /// The state is of an older or newer flexid.
    #[error("is of format {0}, this flexid-edge reads {BEFORE} and {VERSION}")]
    Version(u32),
    /// The bytes are cut off, or were changed after they were written.
    #[error("is damaged")]
    Damaged,
}

/// Why a daemon may not write the file.
#[derive(Debug, thiserror::Error)]
pub enum ClaimError {
    /// Another daemon holds the lock.
    #[error("another flexid-edge keeps its numbers there")]
    Taken,
    /// The lock cannot be made: the folder is missing, read-only or full.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Keeps a state in a file. Clones are one store.
#[derive(Clone, Debug)]
pub struct Store {
    file: PathBuf,
    /// Lock that keeps other daemons from the file. `None` until it is got.
    claim: Arc<Mutex<Option<File>>>,
}

impl Store {
    /// Finds the place of the file: `configured`, or else systemd's state directory. Returns `None` if neither is given.
    pub fn find(configured: Option<&Path>) -> Option<Self> {
        let systemds = || {
            let folders = std::env::var_os(DIRECTORY)?;
            std::env::split_paths(&folders).next().map(|folder| folder.join(NAME))
        };
        let file = configured.map(Path::to_path_buf).or_else(systemds)?;
        Some(Self { file, claim: Arc::default() })
    }

    /// Returns the path of the file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Keeps other daemons from the file as long as the store lives, by a lock on a file beside it.
    ///
    /// # Errors
    /// Another daemon holds the lock, or it cannot be made.
    pub fn claim(&self) -> Result<(), ClaimError> {
        let mut claim = self.lock();
        if claim.is_none() {
            let lock = File::create(self.beside(".lock"))?;
            lock.try_lock().map_err(|error| match error {
                TryLockError::WouldBlock => ClaimError::Taken,
                TryLockError::Error(error) => error.into(),
            })?;
            *claim = Some(lock);
        }
        Ok(())
    }

    /// Returns the state that was kept, or `None` if there is none. A file that was read and holds no state is put aside with a
    /// warning. The calling thread needs a large stack.
    ///
    /// # Errors
    /// The file is there, but cannot be read. It stays, since a later attempt may succeed.
    pub fn load(&self) -> io::Result<Option<State>> {
        let bytes = match read(&self.file) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => {
                let place = self.file.display();
                let why = format!("{place}: cannot be read: {error}: mend that, or move it away");
                return Err(io::Error::new(error.kind(), why));
            }
        };
        match decode(&bytes) {
            Ok(state) => Ok(Some(state)),
            Err(error) => {
                let name = format!("{OTHER}{:08x}", crc32fast::hash(&bytes));
                self.put_aside(&name, &error.to_string());
                Ok(None)
            }
        }
    }

    /// Keeps `state` in place of what was kept before. Gets the lock, if it could not be got before. Returns the number of bytes.
    ///
    /// # Errors
    /// The file cannot be written. The state that was kept before stays.
    pub fn save(&self, state: &State) -> Result<usize, ClaimError> {
        self.write(&encode(state)?)
    }

    /// Keeps a state, [encoded](encode), in place of what was kept before. Gets the lock, if it could not be got before. Returns the
    /// number of bytes.
    ///
    /// # Errors
    /// The file cannot be written. The state that was kept before stays.
    pub(crate) fn write(&self, bytes: &[u8]) -> Result<usize, ClaimError> {
        self.claim()?;
        write_whole(&self.file, &self.beside(".new"), bytes)?;
        Ok(bytes.len())
    }

    /// Puts the file aside, since it holds a state of another measurement, that of `fingerprint`. [`Store::take_back`] finds it there.
    pub(crate) fn put_aside_state(&self, fingerprint: &Fingerprint, why: &str) {
        self.put_aside(&name_of(fingerprint), why);
    }

    /// Takes back the state that was put aside under the measurement of `fingerprint`, if there is one. The calling thread needs a
    /// large stack.
    pub(crate) fn take_back(&self, fingerprint: &Fingerprint) -> Option<State> {
        let aside = self.beside(&format!(".{}", name_of(fingerprint)));
        let state = match read(&aside) {
            Ok(bytes) => decode(&bytes).map_err(|error| error.to_string()),
            Err(error) if error.kind() == ErrorKind::NotFound => return None,
            Err(error) => Err(format!("cannot be read: {error}")),
        };
        let taken = state.and_then(|state| {
            let renamed = fs::rename(&aside, &self.file);
            renamed.map(|()| state).map_err(|error| format!("cannot be renamed: {error}"))
        });
        match taken {
            Ok(state) => {
                info!("{}: taken back from {}", self.file.display(), aside.display());
                Some(state)
            }
            Err(error) => {
                warn!("{}: {error}: is not taken back", aside.display());
                None
            }
        }
    }

    /// Renames the file to `NAME.ending`, with a warning that contains the reason. Removes the oldest of the others of its kind.
    fn put_aside(&self, ending: &str, why: &str) {
        let aside = self.beside(&format!(".{ending}"));
        let file = self.file.display();
        match fs::rename(&self.file, &aside) {
            Ok(()) => warn!("{file}: {why}: starts anew, and keeps it as {}", aside.display()),
            Err(error) => warn!("{file}: {why}: starts anew (and cannot rename it: {error})"),
        }
        self.remove_oldest_beside(&aside);
    }

    /// Removes the oldest files that were put aside. The `newest` stays, however old the clock says that it is.
    fn remove_oldest_beside(&self, newest: &Path) {
        let is_state = |path: &Path| self.aside(path.file_name()?);
        let own = is_state(newest);
        let entries = fs::read_dir(self.folder()).into_iter().flatten().flatten();
        let mut others: Vec<_> = entries
            .map(|entry| (entry.metadata().and_then(|data| data.modified()).ok(), entry.path()))
            .filter(|(_, path)| is_state(path) == own && path.file_name() != newest.file_name())
            .collect();
        others.sort();
        let most = if own == Some(true) { MOST_STATES } else { MOST_OTHERS };
        let excess = (others.len() + 1).saturating_sub(most);
        for (_, path) in &others[..excess] {
            match fs::remove_file(path) {
                Ok(()) => info!("{}: removed, the oldest of its kind", path.display()),
                Err(error) => warn!("{}: cannot be removed: {error}", path.display()),
            }
        }
    }

    /// Returns whether a file that was put aside is a state, by its name. Returns `None` if none of this name was put aside.
    fn aside(&self, name: &OsStr) -> Option<bool> {
        let own = self.file.file_name()?.as_encoded_bytes();
        let ending = name.as_encoded_bytes().strip_prefix(own)?.strip_prefix(b".")?;
        let other = ending.strip_prefix(OTHER.as_bytes());
        let sum = other.unwrap_or(ending);
        (sum.len() == 8 && sum.iter().all(u8::is_ascii_hexdigit)).then_some(other.is_none())
    }

    /// Returns the folder of the file.
    pub fn folder(&self) -> &Path {
        folder_of(&self.file)
    }

    fn beside(&self, ending: &str) -> PathBuf {
        let mut name = self.file.clone().into_os_string();
        name.push(ending);
        name.into()
    }

    fn lock(&self) -> MutexGuard<'_, Option<File>> {
        // The value is whole between any two statements, so that a panic leaves it valid.
        self.claim.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes a file whole or not at all, in place of what is there: as `new` in the same folder, which is then renamed. The name of `new` is always
/// the same: a file that a power cut leaves behind is overwritten, and files do not accumulate.
pub(crate) fn write_whole(file: &Path, new: &Path, bytes: &[u8]) -> io::Result<()> {
    let written = || {
        let mut open = File::create(new)?;
        open.write_all(bytes)?;
        open.sync_all()?;
        fs::rename(new, file)
    };
    written().inspect_err(|_| {
        // An incomplete file takes room, perhaps the last.
        let _ = fs::remove_file(new);
    })?;
    // Not every file system can do this. A power cut may then bring back the state before, which is whole.
    let _ = File::open(folder_of(file)).and_then(|folder| folder.sync_all());
    Ok(())
}

fn folder_of(file: &Path) -> &Path {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Reads a file. What is no regular file has no bytes.
fn read(file: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if let Some(open) = open_regular(file)? {
        open.take(LARGEST).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

/// Returns the name under which a state of this measurement is put aside.
fn name_of(fingerprint: &Fingerprint) -> String {
    format!("{:08x}", fingerprint.of_measurement())
}

/// Returns the bytes of a file that holds `state`.
///
/// # Errors
/// A number of the state is beyond what the format holds.
pub fn encode(state: &State) -> io::Result<Vec<u8>> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend([0; 4]);
    let mut bytes = postcard::to_extend(state, bytes).map_err(io::Error::other)?;
    let checksum = crc32fast::hash(&bytes[HEADER..]);
    bytes[HEADER - 4..HEADER].copy_from_slice(&checksum.to_le_bytes());
    Ok(bytes)
}

/// Returns the state that the bytes of a file hold. The calling thread needs a large stack.
///
/// # Errors
/// The bytes hold no state.
pub fn decode(bytes: &[u8]) -> Result<State, StateError> {
    let (magic, rest) = bytes.split_first_chunk().ok_or(StateError::Foreign)?;
    if magic != MAGIC {
        return Err(StateError::Foreign);
    }
    let (version, rest) = rest.split_first_chunk().ok_or(StateError::Damaged)?;
    let version = u32::from_le_bytes(*version);
    if ![BEFORE, VERSION].contains(&version) {
        return Err(StateError::Version(version));
    }
    let (checksum, body) = rest.split_first_chunk().ok_or(StateError::Damaged)?;
    if crc32fast::hash(body) != u32::from_le_bytes(*checksum) {
        return Err(StateError::Damaged);
    }
    let state = match version {
        BEFORE => postcard::from_bytes::<Format8>(body).map(State::from),
        _ => postcard::from_bytes(body),
    };
    state.ok().and_then(State::checked).ok_or(StateError::Damaged)
}
