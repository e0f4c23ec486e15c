//! Removes the padding of `candump -L`, which makes the names of several buses equally long.

use std::io::{self, Read};

/// Reader that reduces several spaces in a row in `text` to one. The parser of logs splits a line at each space.
pub(super) struct Unpadded<R> {
    text: R,
    /// Whether the last byte was a space.
    spaced: bool,
}

impl<R> Unpadded<R> {
    pub(super) fn new(text: R) -> Self {
        Self { text, spaced: false }
    }
}

impl<R: Read> Read for Unpadded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let len = self.text.read(buffer)?;
            let mut kept = 0;
            for i in 0..len {
                let space = buffer[i] == b' ';
                if !(space && self.spaced) {
                    buffer[kept] = buffer[i];
                    kept += 1;
                }
                self.spaced = space;
            }
            // A read of no byte means the end of the text. Padding alone is not the end.
            if kept > 0 || len == 0 {
                return Ok(kept);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text is split wherever a read may end.
    #[test]
    fn one_space_is_left_wherever_a_read_ends() {
        let text = b"(1.0)    can0 101#00\n(1.1) vcan10  102#\n     ";
        for at in 0..text.len() {
            let (first, rest) = text.split_at(at);
            let mut read = String::new();
            Unpadded::new(first.chain(rest)).read_to_string(&mut read).unwrap();
            assert_eq!(read, "(1.0) can0 101#00\n(1.1) vcan10 102#\n ");
        }
    }
}
