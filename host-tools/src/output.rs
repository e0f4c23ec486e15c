//! A result file. Whether it can be written is known before the work begins, and it comes whole or not at all.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, ErrorKind, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use flexid_edge::input::BadInput;
use tempfile::NamedTempFile;

/// A file that is going to be written.
#[derive(Debug)]
pub(crate) struct Output {
    file: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    /// To be replaced by one of the same permissions.
    File { path: PathBuf, permissions: Permissions },
    /// A pipe or a device: nothing may take its place.
    Stream(File),
}

impl Output {
    /// Makes sure that `file` can be written. Nothing is changed yet.
    ///
    /// # Errors
    /// It cannot be written; what to do.
    pub(crate) fn create(file: &Path) -> Result<Self, BadInput> {
        let unwritable = |error| unwritable(file, &error);
        let target = Target::new(file).map_err(unwritable)?;
        if let Target::File { path, permissions } = &target {
            // Goes again at once: who breaks off the work finds nothing left behind.
            beside(path, permissions).map_err(unwritable)?;
        }
        Ok(Self { file: file.to_owned(), target })
    }

    /// Writes all of it. Until it is all there, the file is what it was before.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub(crate) fn finish(self, text: &str) -> Result<()> {
        let written = match self.target {
            Target::File { path, permissions } => replace(&path, &permissions, text),
            Target::Stream(mut stream) => stream.write_all(text.as_bytes()),
        };
        written.with_context(|| format!("{}: cannot be written", self.file.display()))
    }
}

impl Target {
    fn new(file: &Path) -> io::Result<Self> {
        match OpenOptions::new().append(true).open(file) {
            Ok(stream) if !stream.metadata()?.is_file() => Ok(Self::Stream(stream)),
            Ok(present) => {
                // What a link points to is replaced, not the link.
                let path = fs::canonicalize(file)?;
                Ok(Self::File { path, permissions: present.metadata()?.permissions() })
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                // The umask takes away what a new file must not allow.
                Ok(Self::File { path: file.to_owned(), permissions: Permissions::from_mode(0o666) })
            }
            Err(error) => Err(error),
        }
    }
}

/// An empty file in the folder of `path`.
fn beside(path: &Path, permissions: &Permissions) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    tempfile::Builder::new().permissions(permissions.clone()).tempfile_in(folder)
}

fn replace(path: &Path, permissions: &Permissions, text: &str) -> io::Result<()> {
    let mut fresh = beside(path, permissions)?;
    fresh.write_all(text.as_bytes())?;
    fresh.as_file().sync_all()?;
    fresh.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// Makes sure that `folder` is there.
///
/// # Errors
/// It cannot be made; what to do.
pub(crate) fn folder(folder: &Path) -> Result<(), BadInput> {
    fs::create_dir_all(folder).map_err(|error| {
        let why = match error.kind() {
            ErrorKind::AlreadyExists | ErrorKind::NotADirectory => "a file is in its place".into(),
            ErrorKind::PermissionDenied => "no permission".into(),
            _ => error.to_string(),
        };
        BadInput::new(folder, format!("cannot be made: {why}: name a folder elsewhere"))
    })
}

/// Why `file` cannot be written, and the mend.
pub(crate) fn unwritable(file: &Path, error: &io::Error) -> BadInput {
    let why = match error.kind() {
        ErrorKind::NotFound => "its folder is not there: make it first".to_owned(),
        ErrorKind::IsADirectory => "is a folder: name a file in it".to_owned(),
        ErrorKind::PermissionDenied => "no permission: name a file in a folder of yours".to_owned(),
        ErrorKind::StorageFull => "the disk is full: make room".to_owned(),
        _ => format!("{error}: name a file elsewhere"),
    };
    BadInput::new(file, format!("cannot be written: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_comes_whole_and_nothing_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let names = || {
            let entries = fs::read_dir(folder.path()).unwrap();
            let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
            names.sort();
            names
        };
        let file = folder.path().join("out.json");
        fs::write(&file, "before").unwrap();
        let _output = Output::create(&file).unwrap();
        assert_eq!((fs::read_to_string(&file).unwrap().as_str(), names().len()), ("before", 1));

        fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
        let link = folder.path().join("link.json");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        Output::create(&link).unwrap().finish("after").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "after");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(names(), ["link.json", "out.json"]);
        assert!(link.is_symlink());
    }

    #[test]
    fn a_device_stays_a_device() {
        Output::create(Path::new("/dev/null")).unwrap().finish("text").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[test]
    fn what_cannot_be_written_is_told_at_once_with_the_mend() {
        let folder = tempfile::tempdir().unwrap();
        let told = |file: &Path| Output::create(file).unwrap_err().to_string();
        let error = told(&folder.path().join("gone/out.json"));
        assert!(
            error.ends_with(
                "gone/out.json: cannot be written: its folder is not there: make it first"
            ),
            "{error}"
        );
        let error = told(folder.path());
        assert!(error.ends_with("is a folder: name a file in it"), "{error}");
    }
}
