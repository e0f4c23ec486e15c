//! A result file that is written part by part.

use std::fs::{File, Permissions};
use std::io::{self, Seek as _};
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use flexid_pipeline::input::BadInput;

use super::{Output, Target, folder_of, replace, unwritable};

/// A file that is written part by part. A regular file has no name before it is whole. An interrupted run therefore leaves no new file, and
/// does not change the old one.
#[derive(Debug)]
pub struct Growing {
    file: PathBuf,
    /// The bytes that have been written. It is the pipe or the device itself.
    written: File,
    /// The regular file, if it is one.
    replaced: Option<(PathBuf, Permissions)>,
}

impl Growing {
    /// Ends the file.
    ///
    /// # Errors
    /// The disk is full or broken.
    pub fn finish(mut self) -> Result<()> {
        let cannot = || format!("{}: cannot be written", self.file.display());
        let Some((path, permissions)) = &self.replaced else { return Ok(()) };
        self.written.rewind().with_context(cannot)?;
        replace(path, permissions, &mut self.written).with_context(cannot)
    }
}

impl io::Write for Growing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.written.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.written.flush()
    }
}

impl Output {
    /// The file, to be written part by part.
    ///
    /// # Errors
    /// No file can be made in its folder. The error states what to do.
    pub fn grow(self) -> Result<Growing, BadInput> {
        let Self { file, target } = self;
        let (written, replaced) = match target {
            Target::File { path, permissions } => {
                let written = tempfile::tempfile_in(folder_of(&path));
                let written = written.map_err(|error| unwritable(&file, &error))?;
                (written, Some((path, permissions)))
            }
            Target::Stream(stream) => (stream, None),
        };
        Ok(Growing { file, written, replaced })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Write as _;

    use super::*;

    #[test]
    fn what_grows_has_no_name_before_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("cut.log");
        let entries = || fs::read_dir(folder.path()).unwrap().count();
        let begun = || {
            let mut growing = Output::create(&file).unwrap().grow().unwrap();
            growing.write_all(b"frames").unwrap();
            growing
        };
        drop(begun());
        assert_eq!(entries(), 0);
        let growing = begun();
        assert_eq!(entries(), 0);
        growing.finish().unwrap();
        assert_eq!((fs::read_to_string(&file).unwrap().as_str(), entries()), ("frames", 1));
    }
}
