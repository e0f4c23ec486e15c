//! Recordings in formats other than those that are read, recognised by their first bytes, and the commands that convert
//! them.
//!
//! Files of a data acquisition unit or a robot become tables. In the commands, names of groups, topics and channels are to be replaced; those
//! of the columns are then the names in `[signals]`.
//!
//! The commands were tried: h5py, pyuff and rosbags of November 2026. `can_logconvert` comes with the Python package `python-can` (4.6 was tried). It recognises formats by the file's
//! ending. `scapy` (2.7 was tried) reads captures of Wireshark and tcpdump.

use std::io::{Cursor, Read};

use flexid_pipeline::input::Binary;
use flexid_pipeline::source::is_frame;

use super::packed::Failure;

/// Number of bytes that are examined: the longest line of a table, which is longer than any header of another format.
const HEAD: u64 = 1 << 16;

/// Beginnings of texts in UTF-16.
const OF_UTF_16: [&[u8]; 2] = [b"\xFF\xFE", b"\xFE\xFF"];
const CAPTURE: &str = "is a capture of Wireshark or tcpdump (pcap): convert it with `pip install scapy; python3 -c \"from scapy.all import *; load_layer('can'); \
    [print('(%.6f) can0 %s#%s' % (p.time, ('%08X' if 'extended' in p[CAN].flags else '%03X') % p[CAN].identifier, p[CAN].data.hex())) \
    for p in PcapReader('IN.pcap')]\" > OUT.log`";
const UTF_16: &str =
    "is UTF-16, as PowerShell writes: convert it with `iconv -f UTF-16 -t UTF-8 IN.log > OUT.log`";

const BLF: &str =
    "is a BLF log: convert it with `pip install python-can; can_logconvert IN.blf OUT.log`";
const SQLITE: &str = "is a SQLite database, as python-can writes: convert it with `pip install python-can; can_logconvert IN.db OUT.log`";
/// A name in the schema of a bag, which stands in the first page of the database.
const OF_BAG: &[u8] = b"serialization_format";
const BAG_OF_SQLITE: &str = "is a bag of ROS 2 in SQLite: convert its folder with `pip install rosbags; rosbags-convert --src FOLDER --dst OUT --dst-storage mcap`, \
    or with `ros2 bag convert`, and name the MCAP file in OUT";
const BAG: &str = "is a bag of ROS 1: convert it with `pip install rosbags; rosbags-convert --src IN.bag --dst OUT --dst-storage mcap`, and name the MCAP file in OUT";
const HDF5: &str = "is an HDF5 file, as MATLAB 7.3 and others write: export its variables as a table with `writetable(table(time, Fx, Fy, Fz, ax, ay, az), 'OUT.csv')` \
    in MATLAB, or with `pip install h5py pandas; python3 -c \"import h5py, numpy, pandas; \
    v = {n: numpy.atleast_2d(x[()]) for n, x in h5py.File('IN.h5').items() if hasattr(x, 'shape')}; \
    v = {n: x.T if len(x) < x.shape[1] else x for n, x in v.items()}; rows = max(map(len, v.values())); \
    pandas.DataFrame({n + str(i or ''): c for n, x in v.items() if len(x) == rows for i, c in enumerate(x.T)}).to_csv('OUT.csv', index=False)\"`";
const UNIVERSAL: &str = "is a universal file (UFF), and not named in [receptance] file: name frequency responses there, with their pose; export time records as a table with `pip install pyuff pandas; python3 -c \"import pyuff, pandas; \
    sets = [x for x in pyuff.UFF('IN.uff').read_sets() if x['type'] == 58 and x['func_type'] == 1]; pandas.DataFrame({x['id1']: x['data'] for x in sets}, \
    index=sets[0]['x']).to_csv('OUT.csv', index_label='time')\"`";
const ASC: &str =
    "is an ASC log: convert it with `pip install python-can; can_logconvert IN.asc OUT.log`";
const TRACE: &str =
    "is a PEAK trace: convert it with `pip install python-can; can_logconvert IN.trc OUT.log`";
const CSV_OF_PYTHON_CAN: &str = "is a CSV log of python-can: convert it with `pip install python-can; can_logconvert IN.csv OUT.log`";
const PLAIN: &str = "is what candump prints without -L: record with `candump -L`, or convert it with \
    `sed -E 's/^ *(\\([0-9.]+\\)) +(\\S+) +(\\S+) +\\[[0-9]+\\] */\\1 \\2 \\3#/; :a; s/(#\\S*) /\\1/; ta' IN > OUT.log`";
const PLAIN_DATES: &str = "is what candump prints without -L, with dates (-t A): record with `candump -L`, or convert it with \
    `awk '{ gsub(/[-(]/, \" \", $1); split($2, s, /[:.)]/); printf \"(%d.%s) %s %s#\", mktime($1 \" \" s[1] \" \" s[2] \" \" s[3]), s[4], $3, $4; \
    for (i = 6; i <= NF; i++) printf \"%s\", $i; print \"\" }' IN > OUT.log`";
const PLAIN_DIFFERENCES: &str = "is what candump prints without -L, with differences of times (-t d): record with `candump -L`, or convert it with \
    `awk '{ t += substr($1, 2, 10); printf \"(%.6f) %s %s#\", t, $2, $3; for (i = 5; i <= NF; i++) printf \"%s\", $i; print \"\" }' IN > OUT.log`";
const PLAIN_WITHOUT_TIMES: &str =
    "is what candump prints without -L, and has no times: record again with `candump -L`";

const ENDLESS: &str = "is neither a candump log nor a table: line 1 is longer than 64 KiB: \
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
    if OF_UTF_16.iter().any(|mark| head.starts_with(mark)) {
        return Some(UTF_16);
    }
    if let Some(format) = Binary::of(head) {
        return way(format, head);
    }
    if head.len() as u64 == HEAD && !head.contains(&b'\n') {
        return Some(ENDLESS);
    }
    if is_candump(head) {
        return None;
    }
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.clone().find_map(of_line).or_else(|| of_plain(lines.clone())).or_else(|| {
        let (first, second) = (lines.next()?, lines.next()?);
        if first.starts_with("timestamp,arbitration_id,") {
            Some(CSV_OF_PYTHON_CAN)
        } else {
            // A data set stands between two lines of -1, the first of which is followed by its number.
            let is_set = first == "-1" && second.starts_with(|own: char| own.is_ascii_digit());
            is_set.then_some(UNIVERSAL)
        }
    })
}

/// Returns whether a log that begins with `head` has a line of `candump -L`.
pub(super) fn is_candump(head: &[u8]) -> bool {
    String::from_utf8_lossy(head).lines().any(is_frame)
}

/// The way from a format that is not text to a log or a table. `None` for one that is read.
fn way(format: Binary, head: &[u8]) -> Option<&'static str> {
    Some(match format {
        Binary::Mcap | Binary::Mdf | Binary::Mat | Binary::Tdms => return None,
        Binary::Blf => BLF,
        Binary::Bag => BAG,
        Binary::Hdf5 => HDF5,
        Binary::Sqlite if head.windows(OF_BAG.len()).any(|part| part == OF_BAG) => BAG_OF_SQLITE,
        Binary::Sqlite => SQLITE,
        Binary::Capture => CAPTURE,
        Binary::Gzip => "is packed with gzip, and more than once: unpack it first with `gzip -d`",
        Binary::Zstd => "is packed with zstd, and more than once: unpack it first with `zstd -d`",
        Binary::Xz => "is packed with xz: unpack it first with `xz -d`",
        Binary::Bzip2 => "is packed with bzip2: unpack it first with `bzip2 -d`",
        Binary::Zip => {
            "is a workbook of Excel or another archive: save its sheet as CSV, or unpack it first with `unzip`"
        }
        Binary::Workbook => "is a workbook of Excel: save its sheet as CSV",
        Binary::Pdf => "is a PDF, and no log: name another file",
        Binary::Program => "is a program, and no log: name another file",
    })
}

/// The format that this line alone determines.
fn of_line(line: &str) -> Option<&'static str> {
    let mut words = line.split_whitespace();
    match (words.next()?, words.next()) {
        // The header has the line `base hex  timestamps absolute`.
        ("base", Some("hex" | "dec")) => Some(ASC),
        (first, _) if first.starts_with(";$FILEVERSION=") => Some(TRACE),
        _ => None,
    }
}

/// The kind of the times that candump prints without -L.
fn of_plain<'a>(lines: impl Iterator<Item = &'a str>) -> Option<&'static str> {
    let mut plain = lines.filter(|line| is_plain(line)).peekable();
    let first = plain.peek()?.split_whitespace().next()?;
    let stamp = |line: &str| -> Option<f64> {
        let word = line.split_whitespace().next()?;
        word.strip_prefix('(')?.strip_suffix(')')?.parse().ok()
    };
    Some(if first.starts_with('(') && first.contains('-') {
        PLAIN_DATES
    } else if stamp(first).is_none() {
        PLAIN_WITHOUT_TIMES
    } else if plain.filter_map(stamp).is_sorted() {
        PLAIN
    } else {
        PLAIN_DIFFERENCES
    })
}

/// Tells whether a line is one of plain candump: `  (TIME)  vcan0  101   [8]  03 00 00 00 FE FF FE 0E`.
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
        let cases: [(&[u8], &str); 24] = [
            (&[0; HEAD as usize], "is neither a candump log nor a table: line 1 is longer than "),
            (b"LOGG\x90\0\0\0\x05\0\0\0", "is a BLF log: "),
            (b"#ROSBAG V2.0\nE\0\0\0", "is a bag of ROS 1: "),
            (b"SQLite format 3\0\x10\0CREATE TABLE topics(id, serialization_format", "is a bag of ROS 2 in SQLite: "),
            (b"MATLAB 7.3 MAT-file\0", "is an HDF5 file, "),
            (b"\x89HDF\r\n\x1A\n\0", "is an HDF5 file, "),
            (b"    -1\n   151\nMODEL\n", "is a universal file (UFF), and not named in [receptance] file: "),
            (b"\xFD7zXZ\0\0\x04", "is packed with xz: "),
            // Formats that the configuration's reader knows are known here, too.
            (b"\xD0\xCF\x11\xE0\xA1\xB1", "is a workbook of Excel: save its sheet as CSV"),
            (b"%PDF-1.7\n%\xE2\xE3", "is a PDF, and no log: "),
            (asc, "is an ASC log: "),
            (b";$FILEVERSION=2.1\r\n;$STARTTIME=46020.38888888958\r\n;\r\n", "is a PEAK trace: "),
            (
                b"timestamp,arbitration_id,extended,remote,error,dlc,data\n1767000000.00006,0x101,0,0,0,8,AwAAAP7//g4=\n",
                "is a CSV log of python-can: ",
            ),
            (b"SQLite format 3\0\x10\0", "is a SQLite database, as python-can writes: "),
            (b"\xD4\xC3\xB2\xA1\x02\0\x04\0", "is a capture of Wireshark "),
            (b"\xA1\xB2\x3C\x4D\0\x02\0\x04", "is a capture of Wireshark "),
            (b"\x0A\x0D\x0D\x0A\x1C\0\0\0", "is a capture of Wireshark "),
            (b"\xFF\xFE(\x001\x007\x006\0", "is UTF-16, as PowerShell writes: "),
            (
                b"  vcan0  101   [8]  03 00 00 00 FE FF FE 0E\n",
                "is what candump prints without -L, and has no times: ",
            ),
            (
                b" (1767000000.000060)  vcan0  101   [8]  03 00 00 00 FE FF FE 0E\n",
                "is what candump prints without -L: record with `candump -L`, or convert it with `sed ",
            ),
            (
                b" (000.000060)  vcan0  12345678   [1]  03\n (000.000160)  vcan0  101   [1]  03\n",
                "is what candump prints without -L: record with `candump -L`, or convert it with `sed ",
            ),
            (
                b" (000.000060)  vcan0  12345678   [1]  03\n (000.000050)  vcan0  101   [1]  03\n",
                "is what candump prints without -L, with differences of times (-t d): ",
            ),
            (
                b" (2025-12-29 09:20:00.000060)  vcan0  101   [1]  03\n",
                "is what candump prints without -L, with dates (-t A): ",
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
    fn what_is_read_is_none_of_them() {
        let cases: [&[u8]; 13] = [
            // These are read.
            b"MDF     4.10    python\0",
            b"\x89MCAP0\r\n\x01",
            b"TDSm\x0E\0\0\0",
            b"MATLAB 5.0 MAT-file Platform: posix\0",
            b"(1767000000.000060) can0 101#03000000FEFFFE0E\n",
            b"a,b,c\n(1767000000.000060) can0 101#03\n",
            b"(1767000000.000060) can0 101#R T\n",
            b"(1767000000.000060123) can0 101#00\n",
            b"(1767000000.5) can0 101#00\n",
            b"(1767000000.000060) can0 101#0102030405060708_F\n",
            b"",
            b"\0\xFF\x01",
            b"<robot name=\"mill3\">\n",
        ];
        for head in cases {
            assert_eq!(mend(head), None, "{}", String::from_utf8_lossy(head));
        }
    }
}
