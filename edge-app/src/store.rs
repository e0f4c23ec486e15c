//! The file in which a daemon keeps its state: `[state] file`, or `flexid.state` in systemd's state directory.
//!
//! ```text
//! "flexid-state"   version, u32    CRC-32 of the rest, u32    postcard of the State        numbers little-endian
//! ```
//!
//! The file is written whole or not at all. A file that holds no usable state is put aside under another name, never deleted.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use tracing::warn;

use flexid_pipeline::State;

const MAGIC: &[u8; 12] = b"flexid-state";
/// Version of the format. A file of another version is not read. The version changes with every struct that is in a state.
const VERSION: u32 = 7;
const HEADER: usize = MAGIC.len() + 4 + 4;
/// Largest file that is read, bytes: twice what a state with the most records takes.
const LARGEST: u64 = 128 << 20;
/// Environment variable in which systemd gives the state directory of a service: folders, with colons between them.
const DIRECTORY: &str = "STATE_DIRECTORY";
/// Name of the file in that directory.
const NAME: &str = "flexid.state";

/// Why bytes hold no state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// The bytes do not begin like a state.
    #[error("is no state of flexid-edge")]
    Foreign,
    /// The state is of an older or newer flexid.
    #[error("is of format {0}, this flexid-edge writes format {VERSION}")]
    Version(u32),
    /// The bytes are cut off, or were changed after they were written.
    #[error("is damaged")]
    Damaged,
}

/// Keeps a state in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Store {
    file: PathBuf,
}

impl Store {
    /// Finds the place of the file: `configured`, or else systemd's state directory. Returns `None` if neither is given.
    pub fn find(configured: Option<&Path>) -> Option<Self> {
        let systemds = || {
            let folders = std::env::var_os(DIRECTORY)?;
            std::env::split_paths(&folders).next().map(|folder| folder.join(NAME))
        };
        configured.map(Path::to_path_buf).or_else(systemds).map(|file| Self { file })
    }

    /// Returns the path of the file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Keeps other daemons from the file as long as the returned value lives, by a lock on a file beside it.
    ///
    /// # Errors
    /// Another daemon holds the lock, or the folder does not exist or is not writable.
    pub fn claim(&self) -> io::Result<File> {
        let lock = File::create(self.beside(".lock"))?;
        match lock.try_lock() {
            Ok(()) => Ok(lock),
            Err(TryLockError::WouldBlock) => {
                Err(io::Error::other("another flexid-edge keeps its numbers there"))
            }
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// Returns the state that was kept, or `None` if there is none. A file that holds no state is put aside with a warning. The
    /// calling thread needs a large stack.
    pub fn load(&self) -> Option<State> {
        let bytes = match self.read() {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
            Err(error) => {
                self.put_aside(&format!("cannot be read: {error}"));
                return None;
            }
        };
        match decode(&bytes) {
            Ok(state) => Some(state),
            Err(error) => {
                self.put_aside(&error.to_string());
                None
            }
        }
    }

    /// Keeps `state` in place of what was kept before.
    ///
    /// # Errors
    /// The file cannot be written. The state that was kept before stays.
    pub fn save(&self, state: &State) -> io::Result<()> {
        // The name is always the same: a file that a power cut leaves behind is overwritten, and files do not accumulate.
        let new = self.beside(".new");
        let mut file = File::create(&new)?;
        file.write_all(&encode(state)?)?;
        file.sync_all()?;
        fs::rename(&new, &self.file)?;
        // Not every file system can do this. A power cut may then bring back the state before, which is whole.
        let folder = self.file.parent().filter(|folder| !folder.as_os_str().is_empty());
        let _ = File::open(folder.unwrap_or(Path::new("."))).and_then(|folder| folder.sync_all());
        Ok(())
    }

    /// Renames the file, with a warning that contains the reason.
    pub fn put_aside(&self, why: &str) {
        let now = SystemTime::UNIX_EPOCH.elapsed().map(|elapsed| elapsed.as_secs());
        let aside = self.beside(&format!(".{}", now.unwrap_or_default()));
        let file = self.file.display();
        match fs::rename(&self.file, &aside) {
            Ok(()) => warn!("{file}: {why}: starts anew, and keeps it as {}", aside.display()),
            Err(error) => warn!("{file}: {why}: starts anew (and cannot rename it: {error})"),
        }
    }

    fn read(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        File::open(&self.file)?.take(LARGEST).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    fn beside(&self, ending: &str) -> PathBuf {
        let mut name = self.file.clone().into_os_string();
        name.push(ending);
        name.into()
    }
}

/// Returns the bytes of a file that holds `state`.
///
/// # Errors
/// There is no error: a state can always be written.
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
    if version != VERSION {
        return Err(StateError::Version(version));
    }
    let (checksum, body) = rest.split_first_chunk().ok_or(StateError::Damaged)?;
    if crc32fast::hash(body) != u32::from_le_bytes(*checksum) {
        return Err(StateError::Damaged);
    }
    let state: State = postcard::from_bytes(body).map_err(|_| StateError::Damaged)?;
    if state.is_possible() { Ok(state) } else { Err(StateError::Damaged) }
}
