//! Length-delimited frames on a byte stream.
//!
//! A frame is the length of its message as a little-endian `u32`, then one postcard message of exactly that many bytes. The
//! length is checked before the message is decoded, and the buffer has a fixed size, so that a peer that sends rubbish uses
//! this buffer and no more memory.

use core::fmt;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Largest length of the message in one frame, bytes. The fullest finding takes about 37,200.
pub const MAX_FRAME: usize = 37_888;
/// Length of the prefix before each message, bytes.
pub const PREFIX: usize = 4;
/// Size of a buffer that holds any one frame with its prefix, bytes.
pub const FRAME_BUFFER: usize = PREFIX + MAX_FRAME;

/// Reason why bytes are not a frame, or why a message does not fit into one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The peer announces a frame of this many bytes, which is too long. The stream cannot be read further: close it.
    TooLong(u32),
    /// The bytes of a frame are not a message. The next frame can be read.
    Malformed,
    /// The message ends this many bytes before its frame does. The next frame can be read.
    TrailingBytes(usize),
    /// The message does not fit into [`MAX_FRAME`] or into the given buffer.
    DoesNotFit,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong(length) => write!(
                f,
                "a frame of {length} bytes is announced, at most {MAX_FRAME} are allowed: \
                 the peer does not speak flexid's protocol"
            ),
            Self::Malformed => f.write_str("a frame is not a message of flexid's protocol"),
            Self::TrailingBytes(bytes) => {
                write!(f, "a message ends {bytes} bytes before its frame does")
            }
            Self::DoesNotFit => {
                write!(f, "the message does not fit into a frame of {MAX_FRAME} bytes")
            }
        }
    }
}

impl core::error::Error for FrameError {}

/// Writes `message` as one frame with its prefix to the front of `buffer` ([`FRAME_BUFFER`] bytes hold any).
///
/// # Errors
///
/// Returns [`FrameError::DoesNotFit`] if the frame is longer than `buffer` or than a frame may be.
pub fn encode<'a, T: Serialize>(message: &T, buffer: &'a mut [u8]) -> Result<&'a [u8], FrameError> {
    let (prefix, body) = buffer.split_at_mut_checked(PREFIX).ok_or(FrameError::DoesNotFit)?;
    let allowed = body.len().min(MAX_FRAME);
    let length = postcard::to_slice(message, &mut body[..allowed])
        .map_err(|_| FrameError::DoesNotFit)?
        .len();
    prefix.copy_from_slice(&(length as u32).to_le_bytes());
    Ok(&buffer[..PREFIX + length])
}

/// Reads the message of one frame, which is given without its prefix.
///
/// # Errors
///
/// Returns an error if the frame holds no such message, or has bytes behind it.
pub fn decode<T: DeserializeOwned>(frame: &[u8]) -> Result<T, FrameError> {
    match postcard::take_from_bytes(frame) {
        Ok((message, [])) => Ok(message),
        Ok((_, rest)) => Err(FrameError::TrailingBytes(rest.len())),
        Err(_) => Err(FrameError::Malformed),
    }
}

/// A frame without its prefix, and the bytes that follow it.
pub type FrameAndRest<'a> = (&'a [u8], &'a [u8]);

/// Splits the first frame off `bytes`; `None` if the frame is not complete yet.
///
/// # Errors
///
/// Returns [`FrameError::TooLong`] if the prefix announces more bytes than a frame may have.
pub fn take_frame(bytes: &[u8]) -> Result<Option<FrameAndRest<'_>>, FrameError> {
    let Some((prefix, rest)) = bytes.split_first_chunk::<PREFIX>() else {
        return Ok(None);
    };
    let length = u32::from_le_bytes(*prefix);
    if length as usize > MAX_FRAME {
        return Err(FrameError::TooLong(length));
    }
    Ok(rest.split_at_checked(length as usize))
}

/// Decoder of messages from a stream that is read in pieces of any size.
///
/// ```
/// # use flexid_wire::{framing::*, messages::*, text::clipped};
/// # let mut buffer = [0; FRAME_BUFFER];
/// # let mut socket = encode(&ToEdge::Hello(Hello::new("flexid 0.1.0")), &mut buffer).unwrap();
/// # use std::io::Read;
/// let mut decoder = Decoder::new();
/// let hello: ToEdge = loop {
///     if let Some(message) = decoder.next()? {
///         break message;
///     }
///     let read = socket.read(decoder.space())?;
///     decoder.advance(read);
/// };
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Decoder {
    buffer: [u8; FRAME_BUFFER],
    /// Index at which the next frame starts.
    start: usize,
    /// Index at which the bytes that were read end.
    end: usize,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A decoder at the beginning of a stream.
    pub const fn new() -> Self {
        Self { buffer: [0; FRAME_BUFFER], start: 0, end: 0 }
    }

    /// Space for the next bytes of the stream. It is never empty after [`next`](Self::next) has returned `None`.
    pub fn space(&mut self) -> &mut [u8] {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        &mut self.buffer[self.end..]
    }

    /// Takes the first `bytes` bytes of [`space`](Self::space) as read.
    pub fn advance(&mut self, bytes: usize) {
        self.end = (self.end + bytes).min(FRAME_BUFFER);
    }

    /// The next message; `None` if the stream must be read first.
    ///
    /// # Errors
    ///
    /// The errors are those of [`take_frame`] and [`decode`]. After [`FrameError::TooLong`] every call returns this error again.
    /// After any other error the frame is skipped.
    #[expect(
        clippy::should_implement_trait,
        reason = "the kind of message may differ between calls"
    )]
    pub fn next<T: DeserializeOwned>(&mut self) -> Result<Option<T>, FrameError> {
        let Some((frame, _)) = take_frame(&self.buffer[self.start..self.end])? else {
            return Ok(None);
        };
        self.start += PREFIX + frame.len();
        decode(frame).map(Some)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;
    use std::vec::Vec;

    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;
    use crate::messages::{FromEdge, Hello, Phase, Progress, Refusal, ToEdge};
    use crate::spectra::{Band, Spectra};
    use crate::text::clipped;

    fn some_messages() -> [FromEdge; 4] {
        [
            FromEdge::Hello(Hello::new("flexid-edge 0.1.0")),
            FromEdge::Refused(Refusal { reason: clipped("because") }),
            FromEdge::Progress(Progress {
                phase: Phase::Searching,
                fraction: 0.25,
                starts: 1,
                search_evaluations: 500,
                refine_iterations: 0,
                search_loss: 0.3,
                records: 3,
            }),
            FromEdge::Spectra(Spectra {
                record: 3,
                pose: [0.5, -1.0].into_iter().collect(),
                band_hz: [2.0, 200.0],
                bands: (1..8)
                    .map(|index| Band {
                        frequency_hz: index as f32,
                        measured: [0.5; 3],
                        modelled: [0.25, 0.5, 1.0],
                        noise: [1e-3; 3],
                    })
                    .collect(),
            }),
        ]
    }

    fn stream(messages: &[FromEdge]) -> Vec<u8> {
        let mut buffer = [0; FRAME_BUFFER];
        messages.iter().flat_map(|message| encode(message, &mut buffer).unwrap().to_vec()).collect()
    }

    /// Feeds `bytes` in pieces of the given sizes, in turn, and collects the results.
    fn read(bytes: &[u8], pieces: &[usize]) -> Vec<Result<FromEdge, FrameError>> {
        let (mut decoder, mut rest, mut out) = (Decoder::new(), bytes, Vec::new());
        for &piece in pieces.iter().cycle() {
            let space = decoder.space();
            assert!(!space.is_empty(), "the decoder is stuck");
            let count = piece.min(space.len()).min(rest.len());
            space[..count].copy_from_slice(&rest[..count]);
            rest = &rest[count..];
            decoder.advance(count);
            while let Some(message) = decoder.next().transpose() {
                let lost = matches!(message, Err(FrameError::TooLong(_)));
                out.push(message);
                if lost {
                    return out;
                }
            }
            if rest.is_empty() {
                break;
            }
        }
        out
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..Default::default() })]

        #[test]
        fn any_split_gives_the_same_messages(pieces in prop::collection::vec(1usize..40, 1..20)) {
            let messages = some_messages();
            let read: Vec<_> = read(&stream(&messages), &pieces).into_iter().map(Result::unwrap).collect();
            prop_assert_eq!(read, messages);
        }

        #[test]
        fn rubbish_ends_in_an_error_or_in_waiting(
            bytes in prop::collection::vec(any::<u8>(), 0..300),
            pieces in prop::collection::vec(1usize..40, 1..20),
        ) {
            prop_assert_eq!(read(&bytes, &pieces), read(&bytes, &[FRAME_BUFFER]));
        }
    }

    #[test]
    fn a_long_stream_passes_through_the_fixed_buffer() {
        let messages = some_messages().into_iter().cycle().take(1000).collect::<Vec<_>>();
        let read: Vec<_> =
            read(&stream(&messages), &[FRAME_BUFFER]).into_iter().flatten().collect();
        assert_eq!(read, messages);
    }

    #[test]
    fn a_frame_that_is_too_long_is_refused_by_its_prefix_alone() {
        let announced = (MAX_FRAME as u32 + 1).to_le_bytes();
        assert_eq!(take_frame(&announced), Err(FrameError::TooLong(37_889)));
        assert_eq!(
            FrameError::TooLong(37_889).to_string(),
            "a frame of 37889 bytes is announced, at most 37888 are allowed: \
             the peer does not speak flexid's protocol"
        );
        assert_eq!(take_frame(&(MAX_FRAME as u32).to_le_bytes()), Ok(None));
    }

    #[test]
    fn a_frame_longer_than_its_message_is_refused_and_skipped() {
        let mut bytes = stream(&some_messages()[..1]);
        bytes[0] += 2;
        bytes.extend([0, 0]);
        bytes.extend(stream(&some_messages()[1..2]));
        assert_eq!(
            read(&bytes, &[1]),
            [Err(FrameError::TrailingBytes(2)), Ok(some_messages()[1].clone())]
        );
    }

    #[test]
    fn a_frame_that_is_no_message_is_refused_and_skipped() {
        let mut bytes = std::vec![2, 0, 0, 0, 99, 99, 0, 0, 0, 0];
        bytes.extend(stream(&some_messages()[1..2]));
        assert_eq!(
            read(&bytes, &[3]),
            [
                Err(FrameError::Malformed),
                Err(FrameError::Malformed),
                Ok(some_messages()[1].clone())
            ]
        );
    }

    #[test]
    fn a_small_buffer_is_an_error() {
        let hello = ToEdge::Hello(Hello::new("flexid 0.1.0"));
        for size in 0..PREFIX + 20 {
            assert_eq!(encode(&hello, &mut [0; 64][..size]), Err(FrameError::DoesNotFit));
        }
        assert_eq!(encode(&[0u64; 1000].as_slice(), &mut [0; 9000]).map(<[u8]>::len), Ok(1006));
        assert_eq!(
            encode(&[0u64; MAX_FRAME].as_slice(), &mut [0; 2 * MAX_FRAME]),
            Err(FrameError::DoesNotFit)
        );
    }
}
