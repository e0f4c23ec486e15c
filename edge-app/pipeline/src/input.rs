//! Errors in the files of users. Each is one line that names the file, the place and the correction.

mod encoding;
mod json;
mod kind;

use std::fmt;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde_path_to_error::Segment;

pub(crate) use encoding::decode;
pub use json::parse_json;
pub use kind::{Binary, seems};
pub(crate) use kind::{in_bytes, kind};

/// Error of a file that cannot be used. Its text is one line that names the file, the place and the correction.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct BadInput {
    /// Name of the file.
    pub file: PathBuf,
    /// Line, from 1. `None` if it is not known.
    pub line: Option<usize>,
    /// The mistake and its correction.
    pub message: String,
    /// Error of the system, if it kept the file from being read.
    pub cause: Option<ErrorKind>,
}

impl BadInput {
    /// Makes an error of the file as a whole, or of a place that the message names.
    pub fn new(file: &Path, message: impl fmt::Display) -> Self {
        let message = one_line(&message.to_string());
        Self { file: file.to_path_buf(), line: None, message, cause: None }
    }

    /// Returns whether the file, or its name, must be corrected. If not, a later attempt may succeed: the storage or the system failed.
    pub fn is_mistake(&self) -> bool {
        use ErrorKind::{IsADirectory, NotADirectory, NotFound, PermissionDenied};
        self.cause.is_none_or(|cause| {
            // The last two are of names that no file can have.
            matches!(cause, NotFound | IsADirectory | NotADirectory | PermissionDenied)
                || matches!(cause, ErrorKind::InvalidInput | ErrorKind::InvalidFilename)
        })
    }
}

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, "{line}:")?;
        }
        write!(f, " {}", self.message)
    }
}

/// Likeness above which a key is suggested for another. Chosen: two letters of five may be wrong.
const ALIKE: f64 = 0.55;
/// Endings of keys, and the units that they give. Longer endings stand first: `_n_per_m` also ends in `_m`.
const UNITS: [(&str, &str); 13] = [
    ("_nm_per_rad", "Nm/rad"),
    ("_nms_per_rad", "Nms/rad"),
    ("_ns_per_m", "Ns/m"),
    ("_n_per_m", "N/m"),
    ("_m_per_n", "m/N"),
    ("_rad_per_nm", "rad/Nm"),
    ("_m_per_s2", "m/s²"),
    ("_kg_m2", "kg m²"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_rad", "rad"),
    ("_m", "m"),
    ("_s", "s"),
];
/// Largest file that is read, bytes. All files for flexid are far smaller.
const LARGEST: u64 = 16 << 20;

/// Largest TOML file that is parsed, bytes. Parsing takes forty times as much memory. The largest that flexid writes, the model of a
/// robot, has some kB.
const LARGEST_TOML: usize = 1 << 20;

/// Opens a regular file. Returns `None` if it is a pipe, a folder or a device, on which a read may wait for ever.
///
/// # Errors
/// The file cannot be opened.
pub fn open_regular(file: &Path) -> io::Result<Option<File>> {
    // Without the flag, the system waits for a writer of a pipe.
    let flags = nix::libc::O_NONBLOCK;
    let open = File::options().read(true).custom_flags(flags).open(file)?;
    Ok(open.metadata()?.is_file().then_some(open))
}

/// Reads the text of a regular `file`, on which a service may rely.
///
/// # Errors
/// The errors are those of [`read`], or the file is a pipe or a device.
pub(crate) fn read_regular(file: &Path) -> Result<String, BadInput> {
    text(file, read_regular_bytes(file)?)
}

/// Reads the bytes of a regular `file`.
///
/// # Errors
/// The file cannot be read, is larger than 16 MiB, or is a pipe or a device.
pub(crate) fn read_regular_bytes(file: &Path) -> Result<Vec<u8>, BadInput> {
    match open_regular(file) {
        Ok(Some(open)) => read_all(file, open),
        Ok(None) if file.is_dir() => Err(unreadable(file, &ErrorKind::IsADirectory.into())),
        Ok(None) => Err(BadInput::new(file, "is a pipe or a device: name a regular file")),
        Err(error) => Err(unreadable(file, &error)),
    }
}

fn read_all(file: &Path, open: File) -> Result<Vec<u8>, BadInput> {
    let unreadable = |error| unreadable(file, &error);
    let mut bytes = Vec::new();
    open.take(LARGEST + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST {
        return Err(BadInput::new(file, "is larger than 16 MiB: name another file"));
    }
    Ok(bytes)
}

/// The error for a `file` that cannot be read: the cause and the remedy.
pub fn unreadable(file: &Path, error: &io::Error) -> BadInput {
    let why = match error.kind() {
        ErrorKind::NotFound if file == Path::new("-") => {
            "standard input is not read here: name a file, or /dev/stdin".to_owned()
        }
        ErrorKind::NotFound => "it does not exist: correct its name".to_owned(),
        ErrorKind::IsADirectory => "it is a folder: name a file in it".to_owned(),
        ErrorKind::PermissionDenied => "no permission: ask its owner, or copy it".to_owned(),
        _ => error.to_string(),
    };
    BadInput { cause: Some(error.kind()), ..BadInput::new(file, format!("cannot be read: {why}")) }
}

/// Reads the text of `file`, which may be a pipe: in UTF-8 or UTF-16, without its byte order mark.
///
/// # Errors
/// The file cannot be read, is larger than 16 MiB, or is no text.
pub fn read(file: &Path) -> Result<String, BadInput> {
    let open = File::open(file).map_err(|error| unreadable(file, &error))?;
    text(file, read_all(file, open)?)
}

pub(crate) fn text(file: &Path, bytes: Vec<u8>) -> Result<String, BadInput> {
    if let Some(own) = in_bytes(&bytes) {
        return Err(BadInput::new(file, format!("is {own}")));
    }
    decode(bytes).map_err(|_| BadInput::new(file, "is not text: must be UTF-8"))
}

/// Parses the TOML `text` of `file`. For a key that `T` does not have (`serde(deny_unknown_fields)`), the error suggests the
/// most similar key. The ending of a key, for example `_hz`, gives the unit in the error.
///
/// # Errors
/// The error is one line that names the file, the line, the section, the key and the correction.
pub fn parse_toml<T: DeserializeOwned>(file: &Path, text: &str) -> Result<T, BadInput> {
    let bad = |error: &toml::de::Error, place: &str, key: &str| {
        let line = error.span().map(|span| {
            let before = text.as_bytes().get(..span.start).unwrap_or_default();
            1 + before.iter().filter(|&&byte| byte == b'\n').count()
        });
        let message = match key_given_twice(error, text) {
            Some(key) => format!("`{key}` is there twice: keep one key, or join the two sections"),
            None => format!("{place}{}", mend(error.message(), key)),
        };
        BadInput { line, ..BadInput::new(file, message) }
    };
    if text.len() > LARGEST_TOML {
        return Err(BadInput::new(file, "is larger than 1 MiB: name another file"));
    }
    if text.trim().is_empty() {
        return Err(BadInput::new(
            file,
            "is empty: give a TOML file, as those in host-tools/scenario",
        ));
    }
    let document = toml::Deserializer::parse(text).map_err(|error| match kind(text) {
        Some(other) if other != "a TOML file" => {
            let own = seems(text).unwrap_or(other);
            BadInput::new(file, format!("is {own}, and no TOML file: name the right one"))
        }
        _ if is_at_the_end(&error, text) => {
            bad(&error, "the last line is wrong, or the file is cut off here: ", "")
        }
        _ => bad(&error, "", ""),
    })?;
    serde_path_to_error::deserialize(document).map_err(|error| {
        let (place, key) = place(text, error.path());
        match of_another_kind(text, error.inner().message()) {
            Some(fault) => BadInput::new(file, fault),
            None => bad(error.inner(), &place, &key),
        }
    })
}

/// Returns the message about a TOML `text` most of whose keys at the top are unknown, by serde's message about one of them.
/// Returns `None` if one of them is like a known key, and is therefore misspelled. Another file of flexid may have such keys.
fn of_another_kind(text: &str, message: &str) -> Option<String> {
    let known: Vec<&str> = message.split('`').skip(3).step_by(2).collect();
    let document: toml::Table = toml::from_str(text).ok()?;
    let unknown: Vec<&String> =
        document.keys().filter(|key| !known.contains(&key.as_str())).collect();
    let is_misspelled = |key: &&String| known.iter().any(|name| likeness(name, key) > ALIKE);
    let other = kind::in_toml(text).find(|(table, _)| !known.contains(table));
    // A key of a table below has its own known keys, none of which is at the top.
    let is_at_top = message.starts_with("unknown field")
        && message.split('`').nth(1).is_some_and(|culprit| document.contains_key(culprit));
    let is_other = other.is_some() || !unknown.iter().any(is_misspelled);
    (is_at_top && 2 * unknown.len() > document.len() && is_other).then(|| {
        let own = other.map_or("a TOML file", |(_, name)| name);
        format!("is {own}: a file with the keys {} is wanted: name that one", known.join(", "))
    })
}

/// Returns the key or section of which the TOML `text` has two, if that is the error, by the message of the crate `toml`.
fn key_given_twice<'a>(error: &toml::de::Error, text: &'a str) -> Option<&'a str> {
    let span = error.span().filter(|_| error.message() == "duplicate key")?;
    text.get(span)
}

/// Returns whether an error is at the end of `text`, as that of a text that is cut off.
fn is_at_the_end(error: &toml::de::Error, text: &str) -> bool {
    let last = text.trim_end().rfind('\n').map_or(0, |end| end + 1);
    error.span().is_some_and(|span| span.end > last)
}

/// Returns the section and the key that a path in the TOML `text` leads to. The section reads, for example,
/// `[measurement] rate_hz: `.
fn place(text: &str, path: &serde_path_to_error::Path) -> (String, String) {
    let mut keys = path.iter().filter_map(|segment| match segment {
        Segment::Map { key } => Some(key.as_str()),
        _ => None,
    });
    let Some(first) = keys.next() else { return (String::new(), String::new()) };
    let document: toml::Table = toml::from_str(text).unwrap_or_default();
    let section = match document.get(first) {
        Some(toml::Value::Table(_)) => format!("[{first}] "),
        Some(toml::Value::Array(list)) if list.iter().any(toml::Value::is_table) => {
            format!("[[{first}]] ")
        }
        _ => return (format!("{first}: "), first.to_owned()),
    };
    match keys.next() {
        Some(key) => (format!("{section}{key}: "), key.to_owned()),
        None => (section, String::new()),
    }
}

/// Converts serde's message about `key` into one for users. It adds the most similar key and its unit where they are known.
fn mend(message: &str, key: &str) -> String {
    // serde quotes in backticks first the wrong key, then the known keys.
    let mut names = message.split('`').skip(1).step_by(2);
    let culprit = names.next().unwrap_or_default();
    if message.starts_with("missing field") {
        format!("key `{culprit}`{} is missing", unit_phrase(culprit))
    } else if message.starts_with("unknown field") {
        let known: Vec<&str> = names.collect();
        let nearest = known
            .iter()
            .copied()
            .max_by(|a, b| likeness(a, culprit).total_cmp(&likeness(b, culprit)));
        match nearest.filter(|name| likeness(name, culprit) > ALIKE) {
            Some(name) => {
                format!("unknown key `{culprit}`: did you mean `{name}`{}?", unit_phrase(name))
            }
            None => format!("unknown key `{culprit}`: known are {}", known.join(", ")),
        }
    } else {
        // The names of Rust types are replaced by words for users.
        let number = format!("expected a number{}", unit_phrase(key));
        let whole = "expected a whole number that is not negative";
        message
            .replace(
                "invalid type: map, expected f64",
                "a name with points must stand in quotes, like \"a.b.c\" = 1",
            )
            .replace("expected f64", &number)
            .replace("expected usize", whole)
            .replace("expected u32", whole)
            .replace("expected u64", whole)
    }
}

/// Returns how alike two keys are, with or without their units.
fn likeness(one: &str, other: &str) -> f64 {
    word_by_word(one, other).max(word_by_word(without_unit(one), without_unit(other)))
}

/// Returns the part of the letters that need not be changed: the mean over the words if both keys have as many, so that a long word
/// does not outweigh the others.
fn word_by_word(one: &str, other: &str) -> f64 {
    let [words, of_other] = [one, other].map(|key| key.split('_'));
    let number = words.clone().count();
    if number != of_other.clone().count() {
        return strsim::normalized_damerau_levenshtein(one, other);
    }
    let alike = words.zip(of_other).map(|(a, b)| strsim::normalized_damerau_levenshtein(a, b));
    alike.sum::<f64>() / number as f64
}

/// Returns the unit of a key, for example ` (in Hz)` for `rate_hz`.
fn unit_phrase(key: &str) -> String {
    let unit = UNITS.iter().find(|(ending, _)| key.ends_with(ending));
    unit.map(|(_, unit)| format!(" (in {unit})")).unwrap_or_default()
}

/// Returns a key without the ending that gives its unit.
fn without_unit(key: &str) -> &str {
    UNITS.iter().find_map(|(ending, _)| key.strip_suffix(ending)).unwrap_or(key)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, Default, Deserialize)]
    #[serde(deny_unknown_fields, default)]
    struct Plant {
        #[serde(rename = "robot")]
        _robot: toml::Table,
        #[serde(rename = "hose")]
        _hose: toml::Table,
        #[serde(rename = "ground_m_per_n")]
        _compliance: f64,
    }

    /// A service reads its files at a signal. None may hold it up or fill its memory.
    #[test]
    fn what_may_hold_up_a_service_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        nix::unistd::mkfifo(&path("pipe"), nix::sys::stat::Mode::S_IRWXU).unwrap();
        std::fs::create_dir(path("folder")).unwrap();
        let device = Path::new("/dev/zero");
        for (file, why) in [
            (&*path("pipe"), "is a pipe or a device: name a regular file"),
            (device, "is a pipe or a device: name a regular file"),
            (&*path("folder"), "cannot be read: it is a folder: name a file in it"),
            (&*path("nothing"), "cannot be read: it does not exist: correct its name"),
        ] {
            let error = read_regular(file).unwrap_err();
            assert_eq!((&error.message[..], error.is_mistake()), (why, true));
        }
        let mut long = "# ".repeat(LARGEST_TOML / 2);
        assert!(parse_toml::<Plant>(Path::new("p.toml"), &long).is_ok());
        long.push('#');
        let error = parse_toml::<Plant>(Path::new("p.toml"), &long).unwrap_err();
        assert_eq!(error.to_string(), "p.toml: is larger than 1 MiB: name another file");
    }

    /// A service is started again after them.
    #[test]
    fn failures_of_the_system_are_no_mistakes() {
        use nix::errno::Errno::{
            self, EACCES, EIO, EMFILE, ENAMETOOLONG, ENOENT, ENOMEM, ENOTDIR, ESTALE,
        };
        let is_mistake =
            |errno: Errno| unreadable(Path::new("a.toml"), &io::Error::from(errno)).is_mistake();
        assert_eq!([EIO, EMFILE, ENOMEM, ESTALE].map(is_mistake), [false; 4]);
        assert_eq!([ENOENT, EACCES, ENOTDIR, ENAMETOOLONG].map(is_mistake), [true; 4]);
    }

    #[test]
    fn the_wrong_key_is_named() {
        for (text, expected) in [
            (
                "hose.a = 1\nhose.a = 2\n[robot]\n",
                "p.toml:2: `a` is there twice: keep one key, or join the two sections",
            ),
            ("\n[hoose]\n", "p.toml:2: [hoose] unknown key `hoose`: did you mean `hose`?"),
            ("[hoose]\n[robt]\n", "p.toml:1: [hoose] unknown key `hoose`: did you mean `hose`?"),
            (
                "ground_m_pr_n = 1.0\n",
                "p.toml:1: ground_m_pr_n: unknown key `ground_m_pr_n`: did you mean `ground_m_per_n` (in m/N)?",
            ),
            (
                "[model]\n[hosts]\n",
                "p.toml: is a configuration: a file with the keys robot, hose, ground_m_per_n is wanted: name that one",
            ),
            (
                "[package]\n",
                "p.toml: is a TOML file: a file with the keys robot, hose, ground_m_per_n is wanted: name that one",
            ),
        ] {
            let error = parse_toml::<Plant>(Path::new("p.toml"), text).unwrap_err();
            assert_eq!(error.to_string(), expected, "{text}");
        }
    }
}
