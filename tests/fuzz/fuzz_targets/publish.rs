//! Text that calls itself a `PUBLISH.toml`, a `COLLECT.toml`, or a request to send findings again.
//!
//! A refusal is one line; a range that is read is not empty.
#![no_main]

use std::path::Path;

use flexid_fleet::collect;
use flexid_fleet::publish::{Config, request};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    // No file is there, so that no password is read.
    let file = Path::new("/proc/self/nowhere/fleet.toml");
    let refusals = [Config::parse(file, text).err(), collect::Config::parse(file, text).err()];
    for error in refusals.iter().flatten() {
        assert!(!error.to_string().contains('\n'), "{error}");
    }
    match request::parse(text.as_bytes()) {
        Ok(range) => assert!(!range.is_empty(), "{range:?}"),
        Err(error) => assert!(!error.contains('\n'), "{error}"),
    }
});
