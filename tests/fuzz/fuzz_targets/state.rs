//! Bytes that call themselves the state of a daemon.
//!
//! They never stop the reader. With a checksum that is right, what is read is written and read again as itself.
#![no_main]

use flexid_edge::store::{decode, encode};
use libfuzzer_sys::fuzz_target;

/// Name of the format, version and checksum.
const HEADER: usize = 20;

fuzz_target!(|data: &[u8]| {
    // A record is larger than the stack of this thread likes.
    let big = std::thread::Builder::new().stack_size(64 << 20);
    std::thread::scope(|scope| {
        big.spawn_scoped(scope, || {
            let _ = decode(data);
            let mut bytes = data.to_vec();
            if bytes.len() < HEADER {
                return;
            }
            let checksum = crc32fast::hash(&bytes[HEADER..]);
            bytes[..16].copy_from_slice(b"flexid-state\x08\0\0\0");
            bytes[16..HEADER].copy_from_slice(&checksum.to_le_bytes());
            if let Ok(state) = decode(&bytes) {
                assert!(decode(&encode(&state).unwrap()).is_ok());
            }
        })
        .unwrap();
    });
});
