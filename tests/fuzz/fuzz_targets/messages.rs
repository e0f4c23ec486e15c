//! Bytes from a peer, as a stream of frames and as one frame.
//!
//! Any split of a stream gives the same messages; a message that was read is written and read again as itself.
#![no_main]

use flexid_wire::framing::{self, Decoder, FRAME_BUFFER, FrameError, PREFIX};
use flexid_wire::messages::{FromEdge, ToEdge};
use libfuzzer_sys::fuzz_target;
use serde::Serialize;
use serde::de::DeserializeOwned;

fuzz_target!(|data: &[u8]| {
    round_trip::<ToEdge>(data);
    round_trip::<FromEdge>(data);
    let Some((&piece, stream)) = data.split_first() else {
        return;
    };
    any_split_is_equal::<ToEdge>(stream, piece);
    any_split_is_equal::<FromEdge>(stream, piece);
});

/// Compares bytes, not messages, since a NaN is not equal to itself.
fn round_trip<T: Serialize + DeserializeOwned>(frame: &[u8]) {
    let Ok(message) = framing::decode::<T>(frame) else {
        return;
    };
    let mut once = [0; FRAME_BUFFER];
    let once = framing::encode(&message, &mut once).unwrap();
    // A varint may come in more bytes than it needs, never in fewer.
    assert!(once.len() - PREFIX <= frame.len());
    let longer = [&once[PREFIX..], &[0]].concat();
    assert!(matches!(framing::decode::<T>(&longer), Err(FrameError::TrailingBytes(1))));
    let again: T = framing::decode(&once[PREFIX..]).unwrap();
    let mut twice = [0; FRAME_BUFFER];
    assert_eq!(framing::encode(&again, &mut twice).unwrap(), once);
}

fn any_split_is_equal<T: Serialize + DeserializeOwned>(stream: &[u8], piece: u8) {
    assert_eq!(read::<T>(stream, usize::from(piece).max(1)), read::<T>(stream, FRAME_BUFFER));
}

/// The result of a decoder from `stream` in pieces of `piece` bytes: each message as its frame.
fn read<T: Serialize + DeserializeOwned>(
    mut stream: &[u8],
    piece: usize,
) -> Vec<Result<Vec<u8>, FrameError>> {
    let (mut decoder, mut out) = (Decoder::new(), Vec::new());
    while !stream.is_empty() {
        let space = decoder.space();
        assert!(!space.is_empty(), "the decoder is stuck");
        let count = piece.min(space.len()).min(stream.len());
        space[..count].copy_from_slice(&stream[..count]);
        stream = &stream[count..];
        decoder.advance(count);
        while let Some(message) = decoder.next::<T>().transpose() {
            let frame = message
                .map(|message| framing::encode(&message, &mut [0; FRAME_BUFFER]).unwrap().to_vec());
            let lost = matches!(frame, Err(FrameError::TooLong(_)));
            out.push(frame);
            if lost {
                return out;
            }
        }
    }
    out
}
