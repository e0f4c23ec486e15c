//! Bytes that call themselves a log, packed or not.
//!
//! Unpacking ends, with an error after what was there or without, and a format that is recognised is named in one line.
#![no_main]

use std::io::{Cursor, Read};

use flexid::recording::foreign::mend;
use flexid::recording::packed::unpacked;
use libfuzzer_sys::fuzz_target;

/// Bytes that are unpacked of an input: a few bytes may stand for gigabytes.
const MOST: u64 = 1 << 20;

fuzz_target!(|data: &[u8]| {
    let mut text = Vec::new();
    let end = unpacked(Cursor::new(data.to_vec())).take(MOST).read_to_end(&mut text);
    if let Err(error) = end {
        // The reader of lines takes InvalidData for a bad line, and reads on.
        assert_eq!(error.kind(), std::io::ErrorKind::Other);
    }
    for head in [data, &text] {
        if let Some(mend) = mend(head) {
            assert!(!mend.contains('\n') && mend.starts_with("is "), "{mend}");
        }
    }
});
