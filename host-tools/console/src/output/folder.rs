//! A folder of results, which comes with all of its files or stays empty.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use flexid_pipeline::input::BadInput;
use tempfile::TempDir;

use super::refusal::unwritable;

/// Makes `folder` if it does not exist.
///
/// # Errors
/// The folder cannot be made. The error states what to do.
pub fn folder(folder: &Path) -> Result<(), BadInput> {
    fs::create_dir_all(folder).map_err(|error| {
        let why = match error.kind() {
            ErrorKind::AlreadyExists | ErrorKind::NotADirectory => "a file is in its place".into(),
            ErrorKind::PermissionDenied => "no permission".into(),
            _ => error.to_string(),
        };
        BadInput::new(folder, format!("cannot be made: {why}: name a folder elsewhere"))
    })
}

/// A folder without files that gets some.
#[derive(Debug)]
pub struct NewFolder {
    folder: PathBuf,
    /// The folder in which the files are written first. It lies in the folder itself, which may be a link, or the one in which the user stands.
    fresh: TempDir,
}

impl NewFolder {
    /// Makes the folder, or checks that it has no files and can be written.
    ///
    /// # Errors
    /// The folder has files, or cannot be made or written. The error states what to do.
    pub fn create(path: &Path) -> Result<Self, BadInput> {
        folder(path)?;
        let unwritable = |error| unwritable(path, &error);
        if fs::read_dir(path).map_err(unwritable)?.next().is_some() {
            let message = "has files already: name a new folder, or empty this one";
            return Err(BadInput::new(path, message));
        }
        let fresh = tempfile::tempdir_in(path).map_err(unwritable)?;
        Ok(Self { folder: path.to_owned(), fresh })
    }

    /// Writes all `files`, each a name and a text. They appear in the folder when the last one is complete.
    ///
    /// # Errors
    /// The disk is full or broken. The folder is empty then.
    pub fn finish(self, files: &[(&str, String)]) -> Result<(), BadInput> {
        let places =
            files.iter().map(|(name, _)| (self.fresh.path().join(name), self.folder.join(name)));
        let places: Vec<(PathBuf, PathBuf)> = places.collect();
        for ((fresh, file), (_, text)) in places.iter().zip(files) {
            fs::write(fresh, text).map_err(|error| unwritable(file, &error))?;
        }
        for (fresh, file) in &places {
            fs::rename(fresh, file).map_err(|error| unwritable(file, &error))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_breaks_off_leaves_nothing() {
        let outer = tempfile::tempdir().unwrap();
        let path = outer.path().join("new");
        let is_empty = || fs::read_dir(&path).unwrap().next().is_none();
        // The second file cannot be written, as on a full disk.
        let files = [("a.toml", "a".to_owned()), ("gone/b.toml", "b".to_owned())];
        let error = NewFolder::create(&path).unwrap().finish(&files).unwrap_err();
        assert!(error.to_string().contains("gone/b.toml: cannot be written: "), "{error}");
        assert!(is_empty());
        NewFolder::create(&path).unwrap().finish(&files[..1]).unwrap();
        assert_eq!(fs::read_to_string(path.join("a.toml")).unwrap(), "a");
        assert_eq!(fs::read_dir(&path).unwrap().count(), 1);
        let error = NewFolder::create(&path).unwrap_err().to_string();
        assert!(error.ends_with("new: has files already: name a new folder, or empty this one"));
        let error = NewFolder::create(&path.join("a.toml")).unwrap_err().to_string();
        assert!(error.ends_with("a file is in its place: name a folder elsewhere"), "{error}");
    }
}
