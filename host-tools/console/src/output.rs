//! A result file. The program checks before the work begins that it can write the file. It writes a regular file
//! whole or not at all.

mod folder;
mod growing;
mod refusal;

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, ErrorKind, Read, Write as _};
use std::os::fd::AsFd as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use flexid_edge::console::complain;
use flexid_pipeline::input::BadInput;
use tempfile::NamedTempFile;

pub use folder::{NewFolder, folder};
pub use growing::Growing;
pub use refusal::unwritable;

/// Name of standard output.
const STDOUT: &str = "-";

/// A file that is going to be written, or standard output, `-`.
#[derive(Debug)]
pub struct Output {
    file: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    /// A regular file, which a new file of the same permissions replaces.
    File { path: PathBuf, permissions: Permissions },
    /// A pipe or a device, which no other file may replace.
    Stream(File),
}

impl Output {
    /// Checks that `file` can be written, and leaves it unchanged.
    ///
    /// # Errors
    /// The file cannot be written. The error states what to do.
    pub fn create(file: &Path) -> Result<Self, BadInput> {
        let unwritable = |error| unwritable(file, &error);
        let target = Target::new(file).map_err(unwritable)?;
        if let Target::File { path, permissions } = &target {
            // The temporary file is removed at once, so that an interrupted run leaves no file behind.
            beside(path, permissions).map_err(unwritable)?;
        }
        Ok(Self { file: file.to_owned(), target })
    }

    /// Writes all of `text`. A regular file keeps its old contents until the new ones are complete.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub fn finish(self, text: &str) -> Result<()> {
        let written = match self.target {
            Target::File { path, permissions } => {
                replace(&path, &permissions, &mut text.as_bytes())
            }
            Target::Stream(mut stream) => match stream.write_all(text.as_bytes()) {
                // Who reads standard output has closed it.
                Err(error)
                    if error.kind() == ErrorKind::BrokenPipe && self.file == Path::new(STDOUT) =>
                {
                    Ok(())
                }
                written => written,
            },
        };
        written.with_context(|| format!("{}: cannot be written", self.file.display()))
    }

    /// Writes all of `text` like [`Output::finish`], and says on standard error that `what` is written. Nothing is said of a pipe or a device, such as
    /// standard output.
    ///
    /// # Errors
    /// Those of [`Output::finish`].
    pub fn finish_and_say(self, text: &str, what: &str) -> Result<()> {
        let said = match self.target {
            Target::File { .. } => Some(format!("{}: {what} written", self.file.display())),
            Target::Stream(_) => None,
        };
        self.finish(text)?;
        said.iter().for_each(|line| complain(line));
        Ok(())
    }
}

impl Target {
    fn new(file: &Path) -> io::Result<Self> {
        if file == Path::new(STDOUT) {
            return Ok(Self::Stream(io::stdout().as_fd().try_clone_to_owned()?.into()));
        }
        match OpenOptions::new().append(true).open(file) {
            Ok(stream) if !stream.metadata()?.is_file() => Ok(Self::Stream(stream)),
            Ok(present) => {
                // The target of a link is replaced, not the link.
                let path = fs::canonicalize(file)?;
                Ok(Self::File { path, permissions: present.metadata()?.permissions() })
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                // The umask removes the permissions that a new file must not have.
                Ok(Self::File { path: file.to_owned(), permissions: Permissions::from_mode(0o666) })
            }
            Err(error) => Err(error),
        }
    }
}

/// An empty temporary file in the folder of `path`.
fn beside(path: &Path, permissions: &Permissions) -> io::Result<NamedTempFile> {
    tempfile::Builder::new().permissions(permissions.clone()).tempfile_in(folder_of(path))
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

fn replace(path: &Path, permissions: &Permissions, whole: &mut impl Read) -> io::Result<()> {
    let mut fresh = beside(path, permissions)?;
    io::copy(whole, fresh.as_file_mut())?;
    fresh.as_file().sync_all()?;
    fresh.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// Checks that none of `outputs` is one of `inputs`, or another output: writing it would lose what it holds. Pipes and devices hold
/// nothing.
///
/// # Errors
/// Two of them are the same file, by whatever name.
pub fn keeps<'a>(
    inputs: impl IntoIterator<Item = &'a Path>,
    outputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), BadInput> {
    let mut taken: Vec<_> = inputs.into_iter().filter_map(place).collect();
    let inputs = taken.len();
    for output in outputs {
        let Some(place) = place(output) else { continue };
        if let Some(index) = taken.iter().position(|taken| *taken == place) {
            let what = if index < inputs { "read by this command" } else { "another result" };
            let message = format!("is {what}, and would be lost: name another file for the result");
            return Err(BadInput::new(output, message));
        }
        taken.push(place);
    }
    Ok(())
}

/// Checks that none of `outputs` is standard output, of a command that says something there.
///
/// # Errors
/// One of them is `-`.
pub fn is_not_stdout<'a>(outputs: impl IntoIterator<Item = &'a Path>) -> Result<(), BadInput> {
    match outputs.into_iter().find(|file| *file == Path::new(STDOUT)) {
        Some(file) => {
            Err(BadInput::new(file, "standard output has what the command says: name a file"))
        }
        None => Ok(()),
    }
}

/// The path at which a regular file lies or would be made, the links followed. `None` for anything else.
fn place(file: &Path) -> Option<PathBuf> {
    if file == Path::new(STDOUT) {
        return None;
    }
    match fs::canonicalize(file) {
        Ok(path) => path.is_file().then_some(path),
        Err(_) => {
            let folder = fs::canonicalize(folder_of(file)).ok()?;
            Some(folder.join(file.file_name()?))
        }
    }
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
    fn no_result_takes_the_place_of_an_input_or_of_another_result() {
        let folder = tempfile::tempdir().unwrap();
        let [log, link, json, page] =
            ["cut.log", "link.log", "found.json", "page.html"].map(|name| folder.path().join(name));
        fs::write(&log, "frames").unwrap();
        std::os::unix::fs::symlink(&log, &link).unwrap();
        let [log, link, json, page] = [&log, &link, &json, &page].map(PathBuf::as_path);
        let device = Path::new("/dev/null");
        for (outputs, refused) in [
            ([json, page], None),
            ([json, log], Some((log, "read by this command"))),
            ([link, page], Some((link, "read by this command"))),
            ([json, json], Some((json, "another result"))),
            ([device, device], None),
        ] {
            let error = keeps([log, device], outputs).err();
            assert_eq!(error.as_ref().map(|error| &*error.file), refused.map(|(file, _)| file));
            let why = refused.map_or("", |(_, why)| why);
            assert!(error.is_none_or(|error| error.message.contains(why)));
        }
        let indirect = folder.path().join("../").join(folder.path().file_name().unwrap());
        assert!(keeps([log], [&*indirect.join("cut.log")]).is_err());
    }

    #[test]
    fn a_device_stays_a_device() {
        Output::create(Path::new("/dev/null")).unwrap().finish("text").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[test]
    fn what_cannot_be_written_is_reported_at_once_with_the_mend() {
        let folder = tempfile::tempdir().unwrap();
        let refusal = |file: &Path| Output::create(file).unwrap_err().to_string();
        let error = refusal(&folder.path().join("gone/out.json"));
        assert!(
            error.ends_with(
                "gone/out.json: cannot be written: its folder is not there: make it first"
            ),
            "{error}"
        );
        let error = refusal(folder.path());
        assert!(error.ends_with("is a folder: name a file in it"), "{error}");
    }
}
