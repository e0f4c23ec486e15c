//! The kind of a file by its content, where another file is wanted.

use quick_xml::Reader;
use quick_xml::events::Event;

/// Formats that are not text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    /// A SQLite database.
    Sqlite,
    /// A capture of Wireshark or tcpdump: pcap or pcapng.
    Capture,
    /// A log of Vector's tools.
    Blf,
    /// Measurement data by ASAM, finished or not.
    Mdf,
    /// A bag of ROS 2 (MCAP).
    Mcap,
    /// A bag of ROS 1.
    Bag,
    /// Measurement data of LabVIEW.
    Tdms,
    /// Variables of MATLAB, up to version 7.
    Mat,
    /// An HDF5 file, such as variables of MATLAB from version 7.3 on.
    Hdf5,
    /// A file packed by gzip.
    Gzip,
    /// A file packed by zstd.
    Zstd,
    /// A file packed by xz.
    Xz,
    /// A file packed by bzip2.
    Bzip2,
    /// A zip archive, such as a workbook of today's Excel.
    Zip,
    /// A workbook of an old Excel.
    Workbook,
    /// A PDF.
    Pdf,
    /// A program.
    Program,
}

/// First bytes of these formats. Some texts begin alike.
const MAGIC: [(&[u8], Binary); 23] = [
    (b"SQLite format 3\0", Binary::Sqlite),
    // Pcap, with stamps of microseconds or nanoseconds, in both orders of bytes; then pcapng.
    (b"\xD4\xC3\xB2\xA1", Binary::Capture),
    (b"\xA1\xB2\xC3\xD4", Binary::Capture),
    (b"\x4D\x3C\xB2\xA1", Binary::Capture),
    (b"\xA1\xB2\x3C\x4D", Binary::Capture),
    (b"\n\r\r\n", Binary::Capture),
    (b"LOGG", Binary::Blf),
    (b"MDF     ", Binary::Mdf),
    (b"UnFinMF ", Binary::Mdf),
    (b"\x89MCAP0\r\n", Binary::Mcap),
    (b"#ROSBAG V", Binary::Bag),
    (b"TDSm", Binary::Tdms),
    (b"MATLAB 5.0 MAT-file", Binary::Mat),
    (b"MATLAB 7.3 MAT-file", Binary::Hdf5),
    (b"\x89HDF\r\n\x1A\n", Binary::Hdf5),
    (b"\x1F\x8B", Binary::Gzip),
    (b"\x28\xB5\x2F\xFD", Binary::Zstd),
    (b"\xFD7zXZ\0", Binary::Xz),
    (b"BZh", Binary::Bzip2),
    (b"PK\x03\x04", Binary::Zip),
    (b"\xD0\xCF\x11\xE0", Binary::Workbook),
    (b"%PDF-", Binary::Pdf),
    (b"\x7FELF", Binary::Program),
];

impl Binary {
    /// Returns the format of a file that begins with `bytes`. `None` for text, and for formats that are not known.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let (_, own) = MAGIC.into_iter().find(|(magic, _)| bytes.starts_with(magic))?;
        (!is_text(bytes)).then_some(own)
    }

    /// Says what the file is where another one is wanted, and the remedy.
    fn words(self) -> &'static str {
        match self {
            Self::Sqlite => "a SQLite database, and no text: name another file",
            Self::Capture => {
                "a capture of Wireshark or tcpdump (pcap), and no text: name another file"
            }
            Self::Blf => "a BLF log, and no text: name another file",
            Self::Mdf => "an MDF log, and no text: name another file",
            Self::Mcap | Self::Bag => "a bag of ROS, and no text: name another file",
            Self::Tdms => "a TDMS file of LabVIEW, and no text: name another file",
            Self::Mat => "a MAT file of MATLAB, and no text: name another file",
            Self::Hdf5 => "an HDF5 file, and no text: name another file",
            Self::Gzip => "packed with gzip: unpack it first with `gzip -d`",
            Self::Zstd => "packed with zstd: unpack it first with `zstd -d`",
            Self::Xz => "packed with xz: unpack it first with `xz -d`",
            Self::Bzip2 => "packed with bzip2: unpack it first with `bzip2 -d`",
            Self::Zip | Self::Workbook => {
                "a workbook of Excel or another archive, and no text: export it as comma-separated values, or unpack it"
            }
            Self::Pdf => "a PDF, and no text: name another file",
            Self::Program => "a program, and no text: name another file",
        }
    }
}

/// Returns whether bytes are those of a text in UTF-8, without control characters but white space.
fn is_text(bytes: &[u8]) -> bool {
    let is_control = |own: &u8| own.is_ascii_control() && !own.is_ascii_whitespace();
    !bytes.iter().any(is_control) && str::from_utf8(bytes).is_ok()
}

/// Kinds of files in XML by the name of the root.
const IN_XML: [(&str, &str); 9] = [
    ("robot", "a URDF (`flexid model import` makes a model file of it)"),
    ("mujoco", "a MuJoCo model (MJCF)"),
    ("sdf", "a Gazebo model (SDF)"),
    ("gazebo", "a Gazebo model (SDF)"),
    ("COLLADA", "a mesh (COLLADA)"),
    ("html", "a web page"),
    (
        "AUTOSAR",
        "an AUTOSAR file (`pip install 'canmatrix[arxml]'; canconvert IN.arxml OUT.dbc` makes a DBC file of it)",
    ),
    (
        "NetworkDefinition",
        "a KCD file (`pip install 'canmatrix[kcd]'; canconvert IN.kcd OUT.dbc` makes a DBC file of it)",
    ),
    ("svg", "a picture (SVG)"),
];
const SYMBOLS: &str = "a symbol file of PEAK (`pip install 'canmatrix[sym]'; canconvert IN.sym OUT.dbc` makes a DBC file of it)";

/// Kinds of files in TOML by the head of a table that is in no other one of flexid.
const IN_TOML: [(&str, &str); 12] = [
    ("[[joint]]", "the model of a robot"),
    ("[[truth]]", "a scenario"),
    ("[[experiment]]", "a scenario"),
    ("[model]", "a configuration"),
    ("[force_sensor]", PLANT),
    ("[accelerometer]", PLANT),
    ("[tool]", PLANT),
    ("[robot]", PLANT),
    ("[pedestal]", PLANT),
    ("[bending]", PLANT),
    ("[hose]", PLANT),
    ("[joints]", PLANT),
];
const PLANT: &str = "a plant file";
/// Kinds of files in JSON by a key.
const IN_JSON: [(&str, &str); 2] = [
    ("\"search_evaluations\"", "a result of `flexid identify --json`"),
    ("\"truth\"", "a file of `flexid simulate --truth-json`"),
];

/// Returns what `text` seems to be, by its first line, and of files in TOML and JSON which one of flexid's.
pub fn seems(text: &str) -> Option<&'static str> {
    let own = kind(text)?;
    let known = match own {
        "a TOML file" => in_toml(text).next(),
        "a JSON file" => IN_JSON.into_iter().find(|(key, _)| text.contains(key)),
        _ => None,
    };
    Some(known.map_or(own, |(_, name)| name))
}

/// Returns each table of `text` that is in only one of flexid's files, and the name of that file.
pub(super) fn in_toml(text: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
    let has = |head: &str| text.lines().any(|line| line.trim_start().starts_with(head));
    let tables = IN_TOML.into_iter().filter(move |(head, _)| has(head));
    tables.map(|(head, name)| (head.trim_matches(['[', ']']), name))
}

/// Returns what the first of the `bytes` of a file show it to be, with the remedy, if it is no text.
pub(crate) fn in_bytes(bytes: &[u8]) -> Option<&'static str> {
    Binary::of(bytes).map(Binary::words)
}

/// Returns what `text` seems to be, by its first line that is neither empty nor a comment. Returns `None` if it does not show.
pub(crate) fn kind(text: &str) -> Option<&'static str> {
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'))?;
    if is_candump(first) {
        Some("a candump log")
    } else if first.starts_with('<') {
        Some(in_xml(text))
    } else if first.starts_with('{') {
        Some("a JSON file")
    } else if first.starts_with("FormatVersion=") {
        Some(SYMBOLS)
    } else if first.starts_with("VERSION \"") || text.contains("\nBO_ ") {
        Some("a DBC file")
    } else if first.trim_matches('"').starts_with("sep=") {
        Some("a CSV file")
    } else if is_section(first) || is_assignment(first) {
        Some("a TOML file")
    } else if first.matches(',').count() >= 2 {
        Some("a CSV file")
    } else {
        None
    }
}

/// Returns what a `text` in XML is, by its root. The text may be the beginning of a file.
fn in_xml(text: &str) -> &'static str {
    let mut reader = Reader::from_str(text);
    let own = loop {
        match reader.read_event() {
            Ok(Event::Start(root) | Event::Empty(root)) => {
                break IN_XML
                    .iter()
                    .find(|(name, _)| name.as_bytes() == root.local_name().as_ref());
            }
            Ok(Event::DocType(kind)) if kind.to_ascii_lowercase().starts_with(b"html") => {
                break IN_XML.iter().find(|(name, _)| *name == "html");
            }
            Ok(Event::Eof) | Err(_) => break None,
            Ok(_) => {}
        }
    };
    own.map_or("an XML file", |(_, name)| name)
}

/// Returns whether this is a line of `candump -L`: `(1767000000.000060) can0 101#00`.
fn is_candump(line: &str) -> bool {
    let time = line.strip_prefix('(').and_then(|rest| rest.split_once(')'));
    time.is_some_and(|(time, frame)| time.parse::<f64>().is_ok() && frame.contains('#'))
}

/// Returns whether this is the head of a section in TOML: `[bus]`, `[[test]]`.
fn is_section(line: &str) -> bool {
    let name = line.trim_matches(['[', ']']);
    line.starts_with('[') && line.ends_with(']') && name.starts_with(char::is_alphabetic)
}

/// Returns whether this is a key with its value in TOML: `rate_hz = 2000.0`.
fn is_assignment(line: &str) -> bool {
    let is_of_name = |own: char| own.is_alphanumeric() || "_-.\"".contains(own);
    line.split_once('=').is_some_and(|(key, _)| {
        let key = key.trim_end();
        !key.is_empty() && key.chars().all(is_of_name)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_and_keys_tell_the_files_of_flexid_apart() {
        for (text, expected) in [
            ("name = \"mill3\"\n[[joint]]\n", Some("the model of a robot")),
            ("robot = \"mill3\"\n[bounds]\n[[truth]]\n", Some("a scenario")),
            ("[model]\nfile = \"a.toml\"\n", Some("a configuration")),
            ("[robot]\n", Some("a plant file")),
            ("# one hose\n[hose]\nmass_kg = 1.0\n", Some("a plant file")),
            ("[joints]\n", Some("a plant file")),
            ("[other]\n", Some("a TOML file")),
            (
                "{\"fit\": {\"search_evaluations\": 3}}",
                Some("a result of `flexid identify --json`"),
            ),
            ("{\"truth\": {}}", Some("a file of `flexid simulate --truth-json`")),
            ("{}", Some("a JSON file")),
            ("Dear reader\n", None),
        ] {
            assert_eq!(seems(text), expected, "{text}");
        }
    }

    #[test]
    fn the_first_bytes_show_what_is_no_text() {
        for (bytes, expected) in [
            (&b"SQLite format 3\0\x10\0"[..], "a SQLite database, and no text: "),
            (b"\xD4\xC3\xB2\xA1\x02\0\x04\0", "a capture of Wireshark or tcpdump (pcap), "),
            (b"\n\r\r\n\xA4\0\0\0", "a capture of Wireshark or tcpdump (pcap), "),
            (b"PK\x03\x04\x14\0", "a workbook of Excel or another archive, "),
            (b"\x1F\x8B\x08", "packed with gzip: unpack it first with `gzip -d`"),
            (b"UnFinMF 4.10    logger\0", "an MDF log, and no text: "),
        ] {
            assert!(in_bytes(bytes).is_some_and(|own| own.starts_with(expected)), "{expected}");
        }
        assert_eq!(in_bytes(b"VERSION \"\"\n"), None);
    }

    #[test]
    fn the_first_line_shows_the_format() {
        for (text, expected) in [
            ("(1767000000.000060) can0 101#03000000FEFFFE0E\n", Some("a candump log")),
            (
                "<?xml version=\"1.0\"?>\n<robot name=\"mill3\">",
                Some("a URDF (`flexid model import`"),
            ),
            ("<!DOCTYPE html>\n<p>", Some("a web page")),
            ("<html lang=\"en\"><robot/>", Some("a web page")),
            ("<!-- <robot/> -->\n<mujoco model=\"m\"/>", Some("a MuJoCo model (MJCF)")),
            ("<sdf version=\"1.9\"><model name=\"robot\">", Some("a Gazebo model (SDF)")),
            ("<AUTOSAR xmlns=\"http://autosar.org/schema/r4.0\">", Some("an AUTOSAR file (`pip")),
            ("<!-- <robot/> -->\n<p", Some("an XML file")),
            ("FormatVersion=6.0 // Do not edit this line!\n", Some("a symbol file of PEAK (`pip")),
            ("sep=;\nq1;q2\n", Some("a CSV file")),
            ("\"sep=,\"\nq1,q2\n", Some("a CSV file")),
            ("<?xml version=\"1.0\"?>\n<p>", Some("an XML file")),
            ("{\"joints\": 1}", Some("a JSON file")),
            ("VERSION \"\"\n", Some("a DBC file")),
            ("NS_ :\n\nBO_ 257 FORCE: 8 EDGE\n", Some("a DBC file")),
            ("# a comment\n\n[bus]\n", Some("a TOML file")),
            ("[[experiments]]\n", Some("a TOML file")),
            ("name = \"mill3\"\n", Some("a TOML file")),
            ("q1,q2,q3,fx\n", Some("a CSV file")),
            ("[1, 2]\n", None),
            ("Dear reader\n", None),
            ("(see above) # no log\n", None),
            ("", None),
        ] {
            let kind = kind(text);
            assert_eq!(kind.is_some(), expected.is_some(), "{text}");
            assert!(kind.unwrap_or_default().starts_with(expected.unwrap_or_default()), "{text}");
        }
    }
}
