//! Logs in formats other than that of `candump -L`, recognised by their first bytes, and the commands that convert
//! them.
//!
//! `can_logconvert` comes with the Python package `python-can` (4.6 was tried). It recognises formats by the file's
//! ending.

use std::io::{Cursor, Read};

use socketcan::dump::Reader;

use super::packed::Failure;

/// Number of bytes that are examined. The longest header of a text format has some twenty lines.
const HEAD: u64 = 4096;

/// First bytes of formats that are not text, and the remedy.
const BINARY: [(&[u8], &str); 6] = [
    // Vector's specification: the signature of the file header.
    (
        b"LOGG",
        "is a BLF log: convert it with `pip install python-can; can_logconvert IN.blf OUT.log`",
    ),
    // ASAM MDF: the identification block of a finished and of an unfinished file.
    (b"MDF     ", MEASUREMENT_DATA),
    (b"UnFinMF ", MEASUREMENT_DATA),
    (b"\xFD7zXZ\0", "is packed with xz: unpack it first with `xz -d`"),
    (b"BZh", "is packed with bzip2: unpack it first with `bzip2 -d`"),
    (b"PK\x03\x04", "is a zip archive: unpack it first with `unzip`"),
];

const MEASUREMENT_DATA: &str = "is an MDF (MF4) log: convert it with `pip install 'python-can[mf4]'; can_logconvert IN.mf4 OUT.log`";
const ASC: &str =
    "is an ASC log: convert it with `pip install python-can; can_logconvert IN.asc OUT.log`";
const TRACE: &str =
    "is a PEAK trace: convert it with `pip install python-can; can_logconvert IN.trc OUT.log`";
const CSV_OF_PYTHON_CAN: &str = "is a CSV log of python-can: convert it with `pip install python-can; can_logconvert IN.csv OUT.log`";
const CSV: &str = "is a CSV file, of which there are many kinds: export the recording as ASC or BLF instead and convert that with \
    `pip install python-can; can_logconvert IN.asc OUT.log`, or write lines like `(1767000000.000060) can0 101#0011223344556677`";
const PLAIN: &str = "is what candump prints without -L: record with `candump -L`; if it has absolute times (-t a), convert it with \
    `sed -E 's/^ *(\\([0-9.]+\\)) +(\\S+) +(\\S+) +\\[[0-9]+\\] */\\1 \\2 \\3#/; :a; s/(#\\S*) /\\1/; ta' IN > OUT.log`";
const PLAIN_WITHOUT_TIMES: &str =
    "is what candump prints without -L, and has no times: record again with `candump -L`";

const ENDLESS: &str = "is not a candump log: line 1 is longer than any of `candump -L`: \
    record it with `candump -L can0 > cut.log`, or name another log";

/// The first bytes of a log, and a reader of the whole log.
pub(super) fn head(mut bytes: Box<dyn Read + Send>) -> (Vec<u8>, Box<dyn Read + Send>) {
    let mut head = Vec::new();
    let failed = (&mut bytes).take(HEAD).read_to_end(&mut head).err();
    let all = Cursor::new(head.clone()).chain(Failure(failed)).chain(bytes);
    (head, Box::new(all))
}

/// The format of a log that begins with `head`, and the remedy; `None` if it has a line of `candump -L`, or no known
/// format.
pub fn mend(head: &[u8]) -> Option<&'static str> {
    if let Some((_, mend)) = BINARY.iter().find(|(magic, _)| head.starts_with(magic)) {
        return Some(mend);
    }
    if head.len() as u64 == HEAD && !head.contains(&b'\n') {
        return Some(ENDLESS);
    }
    if Reader::from_reader(head).any(|line| line.is_ok()) {
        return None;
    }
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.clone().find_map(of_line).or_else(|| {
        let (first, second) = (lines.next()?, lines.next()?);
        if first.starts_with("timestamp,arbitration_id,") {
            return Some(CSV_OF_PYTHON_CAN);
        }
        let columns = |line: &str, comma: char| line.matches(comma).count();
        let is_table =
            |comma| columns(first, comma) >= 2 && columns(first, comma) == columns(second, comma);
        [',', ';', '\t'].into_iter().any(is_table).then_some(CSV)
    })
}

/// The format that this line alone determines.
fn of_line(line: &str) -> Option<&'static str> {
    let mut words = line.split_whitespace();
    match (words.next()?, words.next()) {
        // The header has the line `base hex  timestamps absolute`.
        ("base", Some("hex" | "dec")) => Some(ASC),
        (first, _) if first.starts_with(";$FILEVERSION=") => Some(TRACE),
        (first, _) if is_plain(line) => {
            // Absolute times look like `(1767000000.000060)`. The times of -t z and -t d are shorter and cannot be
            // used.
            let absolute = first.starts_with('(') && first.contains('.') && first.len() >= 19;
            Some(if absolute { PLAIN } else { PLAIN_WITHOUT_TIMES })
        }
        _ => None,
    }
}

/// Whether a line is one of plain candump: `  (TIME)  vcan0  101   [8]  03 00 00 00 FE FF FE 0E`.
fn is_plain(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    let is_length = |word: &str| {
        let number = word.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        number.is_some_and(|number| number.parse::<u8>().is_ok_and(|bytes| bytes <= 64))
    };
    let is_identifier = |word: &str| matches!(word.len(), 3 | 8) && is_hexadecimal(word);
    words.iter().position(|word| is_length(word)).is_some_and(|length| {
        length >= 2
            && is_identifier(words[length - 1])
            && words[length + 1..]
                .iter()
                .take(8)
                .all(|byte| byte.len() == 2 && is_hexadecimal(byte))
    })
}

fn is_hexadecimal(word: &str) -> bool {
    word.bytes().all(|byte| byte.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files as Vector's, PEAK's and python-can's tools write them.
    #[test]
    fn other_formats_are_named_with_the_conversion() {
        let asc = b"date Mon Dec 29 09:20:00.000 am 2025\nbase hex  timestamps absolute\n\
            internal events logged\n// version 9.0.0\n   0.000131 1  102             Rx   d 8 01 00 02 00 03 00 04 00\n";
        let cases: [(&[u8], &str); 13] = [
            (&[0; HEAD as usize], "is not a candump log: line 1 is longer than "),
            (b"LOGG\x90\0\0\0\x05\0\0\0", "is a BLF log: "),
            (b"MDF     4.10    python\0", "is an MDF (MF4) log: "),
            (b"UnFinMF 4.10    logger\0", "is an MDF (MF4) log: "),
            (b"\xFD7zXZ\0\0\x04", "is packed with xz: "),
            (asc, "is an ASC log: "),
            (b";$FILEVERSION=2.1\r\n;$STARTTIME=46020.38888888958\r\n;\r\n", "is a PEAK trace: "),
            (
                b"timestamp,arbitration_id,extended,remote,error,dlc,data\n1767000000.00006,0x101,0,0,0,8,AwAAAP7//g4=\n",
                "is a CSV log of python-can: ",
            ),
            (b"time;id;data\n0.1;101;00\n", "is a CSV file, "),
            (
                b"  vcan0  101   [8]  03 00 00 00 FE FF FE 0E\n",
                "is what candump prints without -L, and has no times: ",
            ),
            (
                b" (1767000000.000060)  vcan0  101   [8]  03 00 00 00 FE FF FE 0E\n",
                "is what candump prints without -L: record with ",
            ),
            (
                b" (000.000060)  vcan0  12345678   [1]  03\n",
                "is what candump prints without -L, and has no times: ",
            ),
            (
                b"  can0  TX - -  101   [2]  03 00   '..'\n  can0  TX - -  101   [2]  03 00\n",
                "is what candump prints without -L, and has no times: ",
            ),
        ];
        for (head, named) in cases {
            let mend = mend(head).unwrap_or_else(|| panic!("{}", String::from_utf8_lossy(head)));
            assert!(mend.starts_with(named), "{mend}");
        }
    }

    #[test]
    fn a_log_of_candump_is_none_of_them() {
        let cases: [&[u8]; 6] = [
            b"(1767000000.000060) can0 101#03000000FEFFFE0E\n",
            b"a,b,c\n(1767000000.000060) can0 101#03\n",
            b"(1767000000.000060) can0 101#R T\n",
            b"",
            b"\0\xFF\x01",
            b"<robot name=\"mill3\">\n",
        ];
        for head in cases {
            assert_eq!(mend(head), None, "{}", String::from_utf8_lossy(head));
        }
    }
}
