//! What to do where the kernel has no virtual CAN bus.

use std::env;
use std::fmt;
use std::path::{Path, PathBuf};

/// The program of the project's repository that gives a command a bus where the kernel has none.
const PROGRAM: &str = "tests/with-vcan";

/// Advice, as the end of a sentence. It names the program of the repository if the present folder lies in one.
pub(super) struct WithoutVcan;

impl fmt::Display for WithoutVcan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match env::current_dir().ok().and_then(|folder| program(&folder)) {
            Some(program) => write!(
                f,
                "where the kernel has no vcan, `{} COMMAND` runs a command with one",
                program.display()
            ),
            None => f.write_str(
                "where the kernel has no vcan (`modprobe vcan` fails), take a computer whose kernel has it, as those of Debian and Ubuntu",
            ),
        }
    }
}

/// The program in the repository that `folder` lies in, as seen from the folder if that is the repository itself.
fn program(folder: &Path) -> Option<PathBuf> {
    let repository = folder.ancestors().find(|own| own.join(PROGRAM).is_file())?;
    Some(if repository == folder { PROGRAM.into() } else { repository.join(PROGRAM) })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_program_is_found_within_its_repository_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (root, session) = (folder.path(), folder.path().join("session"));
        for folder in [root.join("tests"), session.clone()] {
            fs::create_dir(folder).unwrap();
        }
        assert_eq!(program(&session), None);
        fs::write(root.join(PROGRAM), "").unwrap();
        assert_eq!(program(root).as_deref(), Some(Path::new(PROGRAM)));
        assert_eq!(program(&session), Some(root.join(PROGRAM)));
    }

    #[test]
    fn advice_in_the_repository_names_the_program() {
        // Tests run in the folder of their crate.
        assert!(WithoutVcan.to_string().contains("/tests/with-vcan COMMAND` runs"));
    }
}
