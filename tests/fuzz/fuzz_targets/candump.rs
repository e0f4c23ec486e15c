//! Bytes that call themselves a log of `candump -L`.
//!
//! They never stop the reader, and what is no frame is reported, in one line.
#![no_main]

use std::path::Path;
use std::time::Duration;

use flexid_pipeline::source::{CandumpLog, Flow, FrameSource};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut log = CandumpLog::new(Path::new("log"), data);
    let mut frames = Vec::new();
    while log.read(&mut frames, Duration::ZERO).unwrap() == Flow::Open {}
    let lines = data.split(|&byte| byte == b'\n').count() as u64;
    assert!(frames.len() as u64 <= lines);
    let troubles = log.health().troubles;
    assert!(!troubles.iter().any(|trouble| trouble.to_string().contains('\n')));
    if let Ok(mut log) = CandumpLog::new(Path::new("log"), data).on_bus("can0") {
        let mut of_one_bus = Vec::new();
        while log.read(&mut of_one_bus, Duration::ZERO).unwrap() == Flow::Open {}
        assert!(of_one_bus.len() <= frames.len());
    }
});
