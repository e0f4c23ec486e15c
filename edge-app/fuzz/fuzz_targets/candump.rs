//! Bytes that call themselves a log of `candump -L`.
//!
//! They never stop the reader, and what is no frame is counted.
#![no_main]

use std::path::Path;
use std::time::Duration;

use flexid_edge::source::{CandumpLog, Flow, FrameSource};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut log = CandumpLog::new(Path::new("log"), data);
    let mut frames = Vec::new();
    while log.read(&mut frames, Duration::ZERO).unwrap() == Flow::Open {}
    let lines = data.split(|&byte| byte == b'\n').count() as u64;
    assert!(frames.len() as u64 + log.garbage() <= lines);
    assert_eq!(log.garbage() == 0, log.health().trouble.is_empty());
    assert!(!log.health().trouble.contains('\n'));
});
