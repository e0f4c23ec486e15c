//! Numbered lines of a text, and their cells.

use std::io::{self, BufRead, BufReader, Read};

use csv_core::{ReadRecordResult, Reader, ReaderBuilder};

/// Longest line that is read, bytes: some thousand columns.
const LONGEST: u64 = 1 << 16;
/// The mark with which a text in UTF-8 may begin.
const MARK: &[u8] = b"\xEF\xBB\xBF";

/// Reads a text line by line.
pub(super) struct Lines<R> {
    text: BufReader<R>,
    line: Vec<u8>,
    /// Number of the newest line, from 1.
    pub(super) number: u64,
    /// True if the newest line has an end. The last line of a text that is cut off has none.
    pub(super) has_end: bool,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(text: R) -> Self {
        let text = BufReader::with_capacity(LONGEST as usize, text);
        Self { text, line: Vec::new(), number: 0, has_end: true }
    }

    /// Reads the next line, without its end. Returns `None` at the end of the text.
    ///
    /// # Errors
    /// The text cannot be read, or the line is longer than 64 KiB.
    pub(super) fn next(&mut self) -> io::Result<Option<&[u8]>> {
        self.line.clear();
        if (&mut self.text).take(LONGEST).read_until(b'\n', &mut self.line)? == 0 {
            return Ok(None);
        }
        self.number += 1;
        self.has_end = self.line.ends_with(b"\n");
        if self.line.len() as u64 == LONGEST && !self.has_end {
            return Err(io::Error::other("the line is longer than 64 KiB"));
        }
        let mut line = &self.line[..];
        line = line.strip_suffix(b"\n").unwrap_or(line);
        line = line.strip_suffix(b"\r").unwrap_or(line);
        // Files that are joined have one in the middle.
        Ok(Some(line.strip_prefix(MARK).unwrap_or(line)))
    }
}

/// Splits lines into cells.
pub(super) struct Cells {
    reader: Reader,
    /// The line with single spaces, if spaces separate its cells: programs write several, so that columns are aligned.
    spaced: Option<Vec<u8>>,
    text: Vec<u8>,
    ends: Vec<usize>,
    /// Number of cells of the line.
    count: usize,
}

impl Cells {
    pub(super) fn new(separator: u8) -> Self {
        let reader = ReaderBuilder::new().delimiter(separator).build();
        let spaced = (separator == b' ').then(Vec::new);
        Self { reader, spaced, text: vec![0; 1024], ends: vec![0; 64], count: 0 }
    }

    /// Takes the cells of a line.
    pub(super) fn split(&mut self, line: &[u8]) {
        self.reader.reset();
        let line = match &mut self.spaced {
            Some(spaced) => {
                spaced.clear();
                for cell in line.split(|byte| *byte == b' ').filter(|cell| !cell.is_empty()) {
                    spaced.extend_from_slice(cell);
                    spaced.push(b' ');
                }
                spaced.pop();
                &spaced[..]
            }
            None => line,
        };
        let (mut input, mut written) = (line, 0);
        self.count = 0;
        loop {
            let (result, read, of_text, of_ends) = self.reader.read_record(
                input,
                &mut self.text[written..],
                &mut self.ends[self.count..],
            );
            input = &input[read..];
            written += of_text;
            self.count += of_ends;
            match result {
                // Then the empty rest ends the record.
                ReadRecordResult::InputEmpty => input = &[],
                ReadRecordResult::OutputFull => self.text.resize(2 * self.text.len(), 0),
                ReadRecordResult::OutputEndsFull => self.ends.resize(2 * self.ends.len(), 0),
                ReadRecordResult::Record | ReadRecordResult::End => return,
            }
        }
    }

    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Returns a cell without the white space around it; an empty one where the line has none.
    pub(super) fn get(&self, cell: usize) -> &[u8] {
        let Some(&end) = self.ends[..self.count].get(cell) else { return &[] };
        let start = if cell == 0 { 0 } else { self.ends[cell - 1] };
        self.text[start..end].trim_ascii()
    }

    /// Returns all cells as text. What is not UTF-8 is taken for Windows-1252, in which older programs write.
    pub(super) fn texts(&self) -> impl Iterator<Item = String> + '_ {
        (0..self.count).map(|cell| text(self.get(cell)))
    }
}

/// Returns bytes as text.
pub(super) fn text(bytes: &[u8]) -> String {
    match str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        // The letters of units (² ° µ) are the same in Latin-1.
        Err(_) => bytes.iter().copied().map(char::from).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_numbered_and_their_ends_left_out() {
        let text = [MARK, b"a,b\r\n\nc"].concat();
        let mut lines = Lines::new(&text[..]);
        let mut next = || (lines.next().unwrap().map(<[u8]>::to_vec), lines.number, lines.has_end);
        assert_eq!(next(), (Some(b"a,b".to_vec()), 1, true));
        assert_eq!(next(), (Some(Vec::new()), 2, true));
        assert_eq!(next(), (Some(b"c".to_vec()), 3, false));
        assert_eq!(next().0, None);
        assert!(Lines::new(&[b'1'; 1 << 17][..]).next().is_err());
    }

    #[test]
    fn cells_may_stand_in_quotes_and_be_many() {
        let mut cells = Cells::new(b';');
        for (line, expected) in [
            (&b"a; b ;c"[..], vec!["a", "b", "c"]),
            (b"\"0,5\";\"x;y\";", vec!["0,5", "x;y", ""]),
            (b"a [m/s\xB2];\xB0", vec!["a [m/s²]", "°"]),
            (b"\"open", vec!["open"]),
        ] {
            cells.split(line);
            assert_eq!(cells.texts().collect::<Vec<_>>(), expected);
        }
        let long = vec!["12345.678"; 2000];
        cells.split(long.join(";").as_bytes());
        assert_eq!(cells.texts().collect::<Vec<_>>(), long);
        assert_eq!(cells.get(2000), b"");
        cells.split(b"");
        assert_eq!(cells.len(), 0);
    }
}
