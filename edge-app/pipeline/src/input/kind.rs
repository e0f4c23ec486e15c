//! What a text seems to be that should be of another format.

/// What a file in TOML seems to be: the head of a table that is in no other one of flexid, and the name of the file.
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
/// The same of JSON: a key.
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

/// Returns what `text` seems to be, by its first line that is neither empty nor a comment. Returns `None` if it does not show.
pub(crate) fn kind(text: &str) -> Option<&'static str> {
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'))?;
    let is_markup = first.starts_with('<');
    if is_candump(first) {
        Some("a candump log")
    } else if is_markup && text.contains("<robot") {
        Some("a URDF (`flexid model import` makes a model file of it)")
    } else if is_markup && first.to_ascii_lowercase().contains("html") {
        Some("a web page")
    } else if is_markup {
        Some("an XML file")
    } else if first.starts_with('{') {
        Some("a JSON file")
    } else if first.starts_with("VERSION \"") || text.contains("\nBO_ ") {
        Some("a DBC file")
    } else if is_section(first) || is_assignment(first) {
        Some("a TOML file")
    } else if first.matches(',').count() >= 2 {
        Some("a CSV file")
    } else {
        None
    }
}

/// Whether this is a line of `candump -L`: `(1767000000.000060) can0 101#00`.
fn is_candump(line: &str) -> bool {
    let time = line.strip_prefix('(').and_then(|rest| rest.split_once(')'));
    time.is_some_and(|(time, frame)| time.parse::<f64>().is_ok() && frame.contains('#'))
}

/// Whether this is the head of a section in TOML: `[bus]`, `[[test]]`.
fn is_section(line: &str) -> bool {
    let name = line.trim_matches(['[', ']']);
    line.starts_with('[') && line.ends_with(']') && name.starts_with(char::is_alphabetic)
}

/// Whether this is a key with its value in TOML: `rate_hz = 2000.0`.
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
    fn the_first_line_shows_the_format() {
        for (text, expected) in [
            ("(1767000000.000060) can0 101#03000000FEFFFE0E\n", Some("a candump log")),
            (
                "<?xml version=\"1.0\"?>\n<robot name=\"mill3\">",
                Some("a URDF (`flexid model import`"),
            ),
            ("<!DOCTYPE html>\n<p>", Some("a web page")),
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
