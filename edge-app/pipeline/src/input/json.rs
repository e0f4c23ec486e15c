//! JSON files that a command has written.

use std::path::Path;

use serde::de::{DeserializeOwned, IgnoredAny};
use serde_json::Deserializer;
use serde_json::error::Category;
use serde_path_to_error::Segment;

use super::kind::{kind, seems};
use super::{BadInput, mend};

/// Parses the JSON `text` of `file`, which `command` writes, for example `flexid identify --json`. Of several values one after the other,
/// as `flexid watch --json` writes them, it takes the last.
///
/// # Errors
/// The error is one line that names the file, the place and the correction.
pub fn parse_json<T: DeserializeOwned>(
    file: &Path,
    text: &str,
    command: &str,
) -> Result<T, BadInput> {
    let start = last(text);
    let before = text.get(..start).unwrap_or_default();
    let value = text.get(start..).unwrap_or_default();
    let mut deserializer = Deserializer::from_str(value);
    let parsed = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| (place(error.path()), error.into_inner()))
        .and_then(|parsed| match deserializer.end() {
            Ok(()) => Ok(parsed),
            Err(error) => Err((Place::default(), error)),
        });
    parsed.map_err(|(Place { path, key }, error)| {
        let give = format!("give a file as `{command}` writes it");
        let line = before.matches('\n').count() + error.line();
        let fault = match (error.classify(), kind(text)) {
            _ if text.trim().is_empty() => "is empty".to_owned(),
            _ if is_cut_off(value, &error) => {
                format!("is cut off at line {line}: copy it again, or")
            }
            (Category::Data, _) => {
                let fault = format!("{path}{}", mend(&without_position(&error), &key));
                match seems(text) {
                    // What lacks a key at the top may be another file.
                    Some(own)
                        if path.is_empty() && !own.contains(command) && own != "a JSON file" =>
                    {
                        format!("is {own}: {fault}")
                    }
                    _ => fault,
                }
            }
            (_, Some(other)) if other != "a JSON file" => {
                format!("is {}", seems(text).unwrap_or(other))
            }
            // A list whose number of entries is fixed.
            _ if is_whole(value, &error, "trailing characters") => {
                format!("{path}has too many entries")
            }
            _ if is_whole(value, &error, "number out of range") => {
                format!("{path}is a number that is too large")
            }
            _ => format!("is no JSON from line {line} on"),
        };
        let give = if fault.ends_with(" or") { format!(" {give}") } else { format!(": {give}") };
        BadInput::new(file, fault + &give)
    })
}

/// Returns whether a value is JSON, and the error about it begins so.
fn is_whole(value: &str, error: &serde_json::Error, begins: &str) -> bool {
    error.to_string().starts_with(begins) && serde_json::from_str::<IgnoredAny>(value).is_ok()
}

/// Returns whether the text ends within a value. Within a number that it skips, the parser expects a digit, and does not say that the text ends.
fn is_cut_off(value: &str, error: &serde_json::Error) -> bool {
    let last = value.lines().last().unwrap_or_default();
    let is_at_end = error.line() == value.lines().count() && error.column() >= last.len();
    error.is_eof() || error.is_syntax() && is_at_end && value.ends_with(['-', '+', '.', 'e', 'E'])
}

/// Returns where the last of the values in `text` begins, or the first that cannot be read, bytes.
fn last(text: &str) -> usize {
    let mut values = Deserializer::from_str(text).into_iter::<IgnoredAny>();
    let mut start = 0;
    loop {
        let next = values.byte_offset();
        match values.next() {
            Some(Ok(_)) => start = next,
            Some(Err(_)) => return next,
            None => return start,
        }
    }
}

/// Place of a value in the file.
#[derive(Default)]
struct Place {
    /// Keys and numbers that lead to it, with a colon: `joints[0].stiffness[2]: `.
    path: String,
    /// The last key.
    key: String,
}

fn place(path: &serde_path_to_error::Path) -> Place {
    let mut keys = path.iter().filter_map(|segment| match segment {
        Segment::Map { key } => Some(key.clone()),
        _ => None,
    });
    let key = keys.next_back().unwrap_or_default();
    let path = if key.is_empty() { String::new() } else { format!("{path}: ") };
    Place { path, key }
}

/// Returns the error without the line and column at its end.
fn without_position(error: &serde_json::Error) -> String {
    let text = error.to_string();
    match text.rfind(" at line ") {
        Some(end) => text[..end].to_owned(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    struct Fit {
        rate_hz: f64,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    struct Found {
        fits: Vec<Fit>,
    }

    fn parse(text: &str) -> Result<Found, String> {
        parse_json(Path::new("o.json"), text, "flexid fit").map_err(|error| error.to_string())
    }

    #[test]
    fn of_several_values_the_last_is_taken() {
        let found = Found { fits: vec![Fit { rate_hz: 2.5 }] };
        let text = "{\"fits\": [{\"rate_hz\": 2.5}]}\n";
        assert_eq!(parse(text), Ok(found));
        assert_eq!(parse(&format!("{{\"status\": 1}}\n{text}\n")), parse(text));
    }

    /// Reads a file, and skips one.
    #[test]
    fn every_part_of_a_file_is_cut_off() {
        let whole = r#"{"fits": [-1.5e-3, 0.25, 1E+2, true, false, null, "a\u00e9\n", {}, []]}"#;
        let parsed = |text| {
            let read = parse_json::<serde_json::Value>(Path::new("o.json"), text, "flexid fit");
            let skipped = parse_json::<IgnoredAny>(Path::new("o.json"), text, "flexid fit");
            [read.map(|_| ()), skipped.map(|_| ())]
        };
        assert!(parsed(whole).iter().all(Result::is_ok));
        for end in 1..whole.len() {
            let part = &whole[..end];
            for outcome in parsed(part) {
                let error = outcome.unwrap_err().to_string();
                assert!(error.starts_with("o.json: is cut off at line 1: "), "{part}: {error}");
            }
        }
    }

    #[test]
    fn faults_are_named_with_place_and_mend() {
        let give = "give a file as `flexid fit` writes it";
        for (text, fault) in [
            ("", "is empty: "),
            (" \n\n", "is empty: "),
            ("{\"fits\": [\n{\"rate_hz\"", "is cut off at line 2: copy it again, or "),
            ("{\"fits\": []}\n\n{\"fits\": [", "is cut off at line 3: copy it again, or "),
            ("{\"fits\": [{\"rate_hz\": -", "is cut off at line 1: copy it again, or "),
            ("{oops} -", "is no JSON from line 1 on: "),
            ("{\"fits\": [\n,] -", "is no JSON from line 2 on: "),
            ("(1767000000.000060) can0 101#03\n", "is a candump log: "),
            ("[bus]\ninterface = \"can0\"\n", "is a TOML file: "),
            ("Dear reader", "is no JSON from line 1 on: "),
            ("{\"fits\": []}\nDear reader", "is no JSON from line 2 on: "),
            ("{\"fits\": [\n,]}", "is no JSON from line 2 on: "),
            ("{}", "key `fits` is missing: "),
            ("{\"fits\": [[1, 2]]}", "fits[0]: has too many entries: "),
            (
                "{\"fits\": [{\"rate_hz\": 1e999}]}",
                "fits[0].rate_hz: is a number that is too large: ",
            ),
            ("{\"fits\": [{}]}", "fits[0]: key `rate_hz` (in Hz) is missing: "),
            (
                "{\"fits\": [{\"rate_hz\": null}]}",
                "fits[0].rate_hz: invalid type: null, expected a number (in Hz): ",
            ),
        ] {
            assert_eq!(parse(text), Err(format!("o.json: {fault}{give}")), "{text}");
        }
    }
}
