//! Packed logs, recognised by their first bytes: gzip (RFC 1952) and zstd (RFC 8878), of any number of members or
//! frames.

use std::io::{self, BufRead as _, BufReader, Cursor, Read};

use flate2::read::MultiGzDecoder;
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};

/// First bytes of a gzip member.
const GZIP: [u8; 2] = [0x1F, 0x8B];
/// First bytes of a zstd frame.
const ZSTD: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];
/// Largest window of a zstd frame, bytes. `zstd -d` without `--long` has the same limit.
const WINDOW: u64 = 128 << 20;

/// A zstd block that is raw, empty and the last, and a checksum. The decoder keeps a window of its output (2 MB by
/// default) until the frame ends. This block ends a frame that breaks off.
const LAST_BLOCK: [u8; 7] = [1, 0, 0, 0, 0, 0, 0];

/// The contents of `bytes`, unpacked if they are packed. An error follows the contents before a damage or an early
/// end.
pub fn unpacked(mut bytes: impl Read + Send + 'static) -> Box<dyn Read + Send> {
    let mut head = Vec::new();
    let failed = (&mut bytes).take(ZSTD.len() as u64).read_to_end(&mut head).err();
    let (gzip, zstd) = (head.starts_with(&GZIP), head.starts_with(&ZSTD));
    let all = Cursor::new(head).chain(Failure(failed)).chain(bytes);
    if gzip {
        Box::new(Named { bytes: MultiGzDecoder::new(all), packing: "gzip" })
    } else if zstd {
        Box::new(Named { bytes: Zstd::new(all), packing: "zstd" })
    } else {
        Box::new(all)
    }
}

/// A reader that is empty, or returns an error once.
pub(super) struct Failure(pub(super) Option<io::Error>);

impl Read for Failure {
    fn read(&mut self, _into: &mut [u8]) -> io::Result<usize> {
        self.0.take().map_or(Ok(0), Err)
    }
}

/// A reader that names the packing in its errors.
struct Named<R> {
    bytes: R,
    packing: &'static str,
}

impl<R: Read> Read for Named<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.bytes.read(into).map_err(|error| match error.kind() {
            io::ErrorKind::Interrupted => error,
            // The error does not keep its kind: the reader of lines takes InvalidData for a bad line, and reads on.
            _ => io::Error::other(format!(
                "the {} data are damaged or cut off ({error})",
                self.packing
            )),
        })
    }
}

/// The contents of zstd frames, one after the other.
struct Zstd<R> {
    bytes: BufReader<R>,
    frame: FrameDecoder,
    /// Error that prevents the unpacking of the rest of the frame. It follows the contents before it.
    broken: Option<io::Error>,
}

impl<R: Read> Zstd<R> {
    fn new(bytes: R) -> Self {
        let mut frame = FrameDecoder::new();
        frame.set_max_window_size(WINDOW);
        Self { bytes: BufReader::new(bytes), frame, broken: None }
    }

    /// Begins the next frame, or skips a skippable one.
    fn begin(&mut self) -> io::Result<()> {
        match self.frame.init(&mut self.bytes) {
            Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                length,
                ..
            })) => {
                io::copy(&mut (&mut self.bytes).take(length.into()), &mut io::sink()).map(|_| ())
            }
            begun => begun.map_err(io::Error::other),
        }
    }
}

impl<R: Read> Read for Zstd<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while self.frame.can_collect() == 0 {
            if !self.frame.is_finished() {
                let one = || BlockDecodingStrategy::UptoBlocks(1);
                if let Err(error) = self.frame.decode_blocks(&mut self.bytes, one()) {
                    self.broken = Some(io::Error::other(error));
                    self.frame.decode_blocks(&LAST_BLOCK[..], one()).map_err(io::Error::other)?;
                }
            } else if let Some(error) = self.broken.take() {
                return Err(error);
            } else if self.bytes.fill_buf()?.is_empty() {
                return Ok(0);
            } else {
                self.begin()?;
            }
        }
        self.frame.read(into)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use flate2::Compression;
    use flate2::write::GzEncoder;
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};

    use super::*;

    fn gzip(text: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text).unwrap();
        encoder.finish().unwrap()
    }

    fn zstd(text: &[u8]) -> Vec<u8> {
        compress_to_vec(text, CompressionLevel::Fastest)
    }

    /// The bytes that can be read, and the error that follows.
    fn read(bytes: Vec<u8>) -> (Vec<u8>, Option<String>) {
        let mut read = Vec::new();
        let end = unpacked(Cursor::new(bytes)).read_to_end(&mut read);
        (read, end.err().map(|error| error.to_string()))
    }

    /// A text of numbers, which do not pack well, long enough for several blocks of zstd (128 kB each).
    fn text() -> Vec<u8> {
        let mut number = 1_u64;
        let mut line = || {
            number = number.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            format!("{:016X}\n", number ^ (number >> 29))
        };
        (0..40_000).flat_map(|_| line().into_bytes()).collect()
    }

    #[test]
    fn what_is_packed_in_one_or_more_parts_is_unpacked() {
        let text = text();
        let (first, second) = text.split_at(1000);
        let skipped = [&[0x50, 0x2A, 0x4D, 0x18, 3, 0, 0, 0], &b"any"[..]].concat();
        for packed in [
            text.clone(),
            gzip(&text),
            zstd(&text),
            [gzip(first), gzip(second)].concat(),
            [zstd(first), skipped, zstd(second)].concat(),
        ] {
            assert_eq!(read(packed), (text.clone(), None));
        }
        assert_eq!(read(Vec::new()), (Vec::new(), None));
        assert_eq!(read(vec![0x1F]), (vec![0x1F], None));
    }

    #[test]
    fn what_is_cut_off_keeps_what_was_there() {
        let text = text();
        for (packed, packing) in [(gzip(&text), "gzip"), (zstd(&text), "zstd")] {
            let (read, error) = read(packed[..packed.len() * 3 / 4].to_vec());
            assert!(read.len() > text.len() / 2, "{packing}: {} bytes", read.len());
            assert_eq!(read, text[..read.len()]);
            let error = error.unwrap();
            let named = format!("the {packing} data are damaged or cut off (");
            assert!(error.starts_with(&named), "{error}");
        }
    }
}
