//! Reasons why a result cannot be written, each with its remedy.

use std::io::{self, ErrorKind};
use std::path::Path;

use flexid_pipeline::input::BadInput;

/// The error for a `file` that cannot be written: the cause and the remedy.
pub fn unwritable(file: &Path, error: &io::Error) -> BadInput {
    let why = match error.kind() {
        ErrorKind::NotFound => "its folder is not there: make it first".to_owned(),
        ErrorKind::IsADirectory => "is a folder: name a file in it".to_owned(),
        ErrorKind::PermissionDenied => "no permission: name a file in a folder of yours".to_owned(),
        ErrorKind::StorageFull => "the disk is full: make room".to_owned(),
        _ => format!("{error}: name a file elsewhere"),
    };
    BadInput::new(file, format!("cannot be written: {why}"))
}
