//! Lines and data sets of a universal file.

use std::ops::Range;

/// Columns of the fields of record 6 of data set 58: function type, node and direction of the response, node and direction of the reference.
const FIELDS: [Range<usize>; 5] = [0..5, 41..51, 51..55, 66..76, 76..80];
/// Number of fields of record 6, and places of the same among them.
const WORDS: (usize, [usize; 5]) = (10, [0, 5, 6, 8, 9]);

/// A universal file, line by line.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    /// Number of the last line, from 1.
    number: usize,
}

/// Head of a data set.
pub(super) struct Set {
    pub(super) number: u32,
    /// Order of bytes and format of numbers of a binary data set.
    pub(super) binary: Option<[i64; 2]>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, number: 0 }
    }

    /// Number of the last line that was read, from 1; bytes of a binary data set count for none.
    pub(super) fn number(&self) -> usize {
        self.number
    }

    /// The next line without its end.
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|byte| *byte == b'\n');
        let (line, rest) = match end {
            Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
            None => (self.rest, &[][..]),
        };
        (self.rest, self.number) = (rest, self.number + 1);
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }

    /// The next line, if it belongs to the data set.
    pub(super) fn next_in_set(&mut self) -> Option<&'a [u8]> {
        let mut ahead = Lines { rest: self.rest, number: self.number };
        let line = ahead.next().filter(|line| !is_mark(line))?;
        *self = ahead;
        Some(line)
    }

    /// The next so many bytes, or what is left.
    pub(super) fn bytes(&mut self, count: usize) -> &'a [u8] {
        let (bytes, rest) = self.rest.split_at(count.min(self.rest.len()));
        self.rest = rest;
        bytes
    }

    /// Goes on behind the mark at the start of the next data set, and reads its head.
    pub(super) fn next_set(&mut self) -> Option<Set> {
        loop {
            let line = self.next()?;
            if !is_mark(line) {
                continue;
            }
            let head = self.next()?;
            if let Some(set) = Set::of(head) {
                return Some(set);
            }
        }
    }

    /// Goes on behind the mark at the end of the data set.
    pub(super) fn skip_set(&mut self) {
        while let Some(line) = self.next() {
            if is_mark(line) {
                return;
            }
        }
    }
}

impl Set {
    fn of(head: &[u8]) -> Option<Self> {
        let head = String::from_utf8_lossy(head);
        let head = head.trim();
        let digits = head.find(|own: char| !own.is_ascii_digit()).unwrap_or(head.len());
        let (number, rest) = head.split_at(digits);
        let fields = rest.strip_prefix(['b', 'B']).map(|rest| {
            let mut words = rest.split_whitespace().map(|own| own.parse().unwrap_or(0));
            [words.next().unwrap_or(0), words.next().unwrap_or(0)]
        });
        Some(Self { number: number.parse().ok()?, binary: fields })
    }
}

/// Returns whether a line is the mark at the start and the end of a data set: -1 in its first six columns.
pub(super) fn is_mark(line: &[u8]) -> bool {
    line.get(..6) == Some(b"    -1") && line[6..].trim_ascii().is_empty()
}

/// Text in some columns of a line.
pub(super) fn text(line: &[u8], columns: Range<usize>) -> String {
    let end = columns.end.min(line.len());
    let own = line.get(columns.start.min(end)..end).unwrap_or_default();
    String::from_utf8_lossy(own).trim().to_owned()
}

/// Whole number in some columns of a line.
pub(super) fn integer(line: &[u8], columns: Range<usize>) -> Option<i64> {
    text(line, columns).parse().ok()
}

/// Node and direction.
pub(super) struct Point {
    pub(super) node: i64,
    pub(super) direction: i64,
}

/// Record 6 of data set 58.
pub(super) struct Dofs {
    pub(super) kind: i64,
    pub(super) response: Point,
    pub(super) reference: Point,
}

impl Dofs {
    pub(super) fn of(record: &[u8]) -> Result<Self, String> {
        let by_column = FIELDS.map(|columns| integer(record, columns));
        let text = String::from_utf8_lossy(record);
        let words: Vec<&str> = text.split_whitespace().collect();
        let (count, places) = WORDS;
        // Some writers leave the columns.
        let by_word = || places.map(|place| words.get(place).and_then(|own| own.parse().ok()));
        let is_whole = by_column.iter().all(Option::is_some);
        let fields = if is_whole || words.len() != count { by_column } else { by_word() };
        let [Some(kind), Some(response), Some(along), Some(reference), Some(push)] = fields else {
            return Err("the data set does not say function type, nodes and directions (record 6): export it again".to_owned());
        };
        Ok(Self {
            kind,
            response: Point { node: response, direction: along },
            reference: Point { node: reference, direction: push },
        })
    }
}
