//! The name of an outbox, by which two boxes of one robot differ.

use std::fs::{self, File};
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::Path;

use flexid_pipeline::input::{BadInput, unreadable};

/// Returns the name of the outbox in `folder`, which is drawn if it has none.
pub(super) fn named(folder: &Path) -> Result<String, BadInput> {
    let file = folder.join("box");
    match fs::read_to_string(&file) {
        Ok(text) => {
            let name = text.trim();
            let is_name = name.len() == 32 && name.bytes().all(|byte| byte.is_ascii_hexdigit());
            let wrong = || BadInput::new(&file, "is no name of an outbox: remove the file");
            is_name.then(|| name.to_owned()).ok_or_else(wrong)
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let mut random = [0; 16];
            let drawn = File::open("/dev/urandom").and_then(|mut own| own.read_exact(&mut random));
            let name: String = random.iter().map(|byte| format!("{byte:02x}")).collect();
            let new = folder.join("box.new");
            let written = drawn.and_then(|()| {
                let mut open = File::create(&new)?;
                open.write_all(name.as_bytes())?;
                open.sync_all()?;
                fs::rename(&new, &file)
            });
            written.map_err(|error| unreadable(&file, &error))?;
            Ok(name)
        }
        Err(error) => Err(unreadable(&file, &error)),
    }
}
