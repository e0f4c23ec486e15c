//! The names of the columns of a table of frequency responses.

use std::f64::consts::PI;

use csv::StringRecord;

use crate::poses::Direction;
use crate::receptance::unit::Unit;
use crate::units;

/// What a table needs.
pub(super) const NEEDED: &str = "the first line names the columns, such as f [Hz],Hxx re [m/s^2/N],Hxx im [m/s^2/N],Hxx coherence";
/// Names of the frequency.
const FREQUENCY: [&str; 5] = ["f", "freq", "frequency", "frequency_hz", "hz"];
/// Words of the parts of a response.
const WORDS: [(&str, Part); 14] = [
    ("re", Part::Real),
    ("real", Part::Real),
    ("im", Part::Imaginary),
    ("imag", Part::Imaginary),
    ("imaginary", Part::Imaginary),
    ("mag", Part::Magnitude),
    ("magnitude", Part::Magnitude),
    ("abs", Part::Magnitude),
    ("amplitude", Part::Magnitude),
    ("phase", Part::Phase),
    ("angle", Part::Phase),
    ("coh", Part::Coherence),
    ("coherence", Part::Coherence),
    ("gamma2", Part::Coherence),
];

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Real,
    Imaginary,
    Magnitude,
    Phase,
    Coherence,
}

/// Columns of one function.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    /// Name of the first.
    pub(super) name: String,
    /// Directions of response and force.
    pub(super) directions: Option<[Direction; 2]>,
    /// Real part, magnitude, or coherence.
    pub(super) part: Part,
    /// Places and names of its cells: one, or a pair.
    pub(super) cells: Vec<(usize, String)>,
    /// Unit of the response, if the name has one.
    pub(super) unit: Option<Unit>,
    /// A unit of the phase, rad.
    radians: f64,
}

impl Columns {
    /// Real and imaginary part from the cells.
    pub(super) fn value(&self, cells: &[f64]) -> [f64; 2] {
        match (self.part, cells) {
            (Part::Magnitude, [size, phase]) => {
                let (sin, cos) = (phase * self.radians).sin_cos();
                [size * cos, size * sin]
            }
            (Part::Coherence, [own]) => [*own, 0.0],
            (_, [re, im]) => [*re, *im],
            _ => [f64::NAN; 2],
        }
    }
}

/// The columns of a table.
#[derive(Clone, Debug)]
pub(super) struct Header {
    /// Number of all cells of a line.
    pub(super) cells: usize,
    /// Place of the frequency.
    pub(super) frequency: usize,
    pub(super) functions: Vec<Columns>,
}

/// A column with a word of a part.
struct Column {
    cell: usize,
    name: String,
    part: Part,
    directions: Option<[Direction; 2]>,
    unit: Option<String>,
}

impl Header {
    pub(super) fn new(names: &StringRecord) -> Result<Self, String> {
        let mut frequency = None;
        let mut columns = Vec::new();
        for (cell, name) in names.iter().enumerate() {
            let (own, unit) = split(name);
            if FREQUENCY.contains(&own.to_lowercase().as_str()) {
                if unit.is_some_and(|unit| unit != "Hz") {
                    return Err(format!("column {name:?} is no frequency in Hz: write it in Hz"));
                }
                frequency = frequency.or(Some(cell));
            } else if let Some((part, directions)) = meaning(own) {
                let unit = unit.map(str::to_owned);
                columns.push(Column { cell, name: name.to_owned(), part, directions, unit });
            }
        }
        let frequency =
            frequency.ok_or_else(|| format!("has no column of the frequency: {NEEDED}"))?;
        let functions = functions(&columns)?;
        if !functions.iter().any(|own| own.part != Part::Coherence) {
            return Err(format!("has no frequency response: {NEEDED}"));
        }
        Ok(Self { cells: names.len(), frequency, functions })
    }

    /// Places and names of the cells of all functions.
    pub(super) fn cells(&self) -> impl Iterator<Item = (usize, &str)> {
        let cells = self.functions.iter().flat_map(|own| &own.cells);
        cells.map(|(cell, name)| (*cell, name.as_str()))
    }
}

/// Joins the columns to functions.
fn functions(columns: &[Column]) -> Result<Vec<Columns>, String> {
    let mut functions = Vec::new();
    for own in columns {
        let twin = match own.part {
            Part::Real => Some((Part::Imaginary, "the imaginary part")),
            Part::Magnitude => Some((Part::Phase, "the phase")),
            Part::Coherence => None,
            Part::Imaginary | Part::Phase => {
                let first = if own.part == Part::Phase { Part::Magnitude } else { Part::Real };
                if find(columns, own, first).is_none() {
                    return Err(format!(
                        "column {:?} lacks {}: a response has real and imaginary part, or magnitude and phase",
                        own.name,
                        if own.part == Part::Phase { "the magnitude" } else { "the real part" }
                    ));
                }
                continue;
            }
        };
        let is_same =
            |other: &&Column| other.part == own.part && other.directions == own.directions;
        if columns.iter().filter(is_same).count() > 1 {
            return Err(format!("column {:?} is there twice: name each once", own.name));
        }
        let mut cells = vec![(own.cell, own.name.clone())];
        let mut radians = 1.0;
        if let Some((part, what)) = twin {
            let twin = find(columns, own, part).ok_or_else(|| {
                format!("column {:?} lacks {what}: name its column alike", own.name)
            })?;
            if part == Part::Phase {
                radians = match twin.unit.as_deref() {
                    Some("rad") => 1.0,
                    Some("deg" | "°") => PI / 180.0,
                    _ => {
                        return Err(format!(
                            "column {:?} has no unit: write it in rad or deg",
                            twin.name
                        ));
                    }
                };
            }
            cells.push((twin.cell, twin.name.clone()));
        }
        let unit = match &own.unit {
            Some(unit) if own.part != Part::Coherence => Some(unit_of(&own.name, unit)?),
            _ => None,
        };
        functions.push(Columns {
            name: own.name.clone(),
            directions: own.directions,
            part: own.part,
            cells,
            unit,
            radians,
        });
    }
    Ok(functions)
}

fn find<'a>(columns: &'a [Column], own: &Column, part: Part) -> Option<&'a Column> {
    columns.iter().find(|other| other.part == part && other.directions == own.directions)
}

/// Returns the unit that stands in brackets, if it is one of a response.
fn unit_of(name: &str, unit: &str) -> Result<Unit, String> {
    Unit::parse(unit).ok_or_else(|| {
        format!(
            "column {name:?} has the unit {unit:?}: write a motion per force, such as {}",
            Unit::EXAMPLES
        )
    })
}

/// Splits a name into itself and its unit. Brackets about a direction are none of a unit: `re(Hxy)`.
fn split(name: &str) -> (&str, Option<&str>) {
    match units::in_brackets(name) {
        Some((own, unit)) if directions(unit).is_none() && !own.is_empty() => (own, Some(unit)),
        _ => (name, None),
    }
}

/// What a name without its unit says. `None` if it has no word of a part.
fn meaning(name: &str) -> Option<(Part, Option<[Direction; 2]>)> {
    let lower = name.to_lowercase();
    let is_apart = |own: char| !own.is_alphanumeric() && !matches!(own, '+' | '-');
    let mut part = None;
    let mut along = None;
    for word in lower.split(is_apart).filter(|word| !word.is_empty()) {
        if let Some((_, own)) = WORDS.into_iter().find(|(known, _)| *known == word) {
            part = part.or(Some(own));
        } else if let Some(own) = directions(word) {
            along = along.or(Some(own));
        }
    }
    if part.is_none() && along.is_some() && name.trim().starts_with('|') {
        part = Some(Part::Magnitude);
    }
    Some((part?, along))
}

/// The directions of response and force: `xy`, `Hxy`, `x-z`.
fn directions(word: &str) -> Option<[Direction; 2]> {
    let lower = word.to_lowercase();
    let rest = lower.strip_prefix('h').unwrap_or(&lower);
    let second = rest.char_indices().filter(|(_, own)| own.is_ascii_lowercase()).nth(1)?.0;
    let second =
        rest[..second].rfind(|own: char| own.is_ascii_lowercase()).map(|first| first + 1)?;
    Some([Direction::parse(&rest[..second])?, Direction::parse(&rest[second..])?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(names: &str) -> Result<Header, String> {
        Header::new(&names.split(',').collect())
    }

    #[test]
    fn names_say_parts_and_directions() {
        for (name, part, expected) in [
            ("Hxy re", Part::Real, Some("xy")),
            ("re(Hyx)", Part::Real, Some("yx")),
            ("h_zz_imag", Part::Imaginary, Some("zz")),
            ("|Hxx|", Part::Magnitude, Some("xx")),
            ("H_x-z phase", Part::Phase, Some("x-z")),
            ("coherence", Part::Coherence, None),
            ("Real", Part::Real, None),
        ] {
            let (own, _) = split(name);
            let (found, along) = meaning(own).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(
                (found, along),
                (part, expected.map(|own| directions(own).unwrap())),
                "{name}"
            );
        }
        for name in ["f", "time", "Hxy", "x", "std"] {
            assert_eq!(meaning(name), None, "{name}");
        }
    }

    #[test]
    fn mistakes_are_named() {
        for (names, expected) in [
            ("a,b", "has no column of the frequency: the first line names"),
            ("f,coherence", "has no frequency response: the first line names"),
            ("f [kHz],re,im", "column \"f [kHz]\" is no frequency in Hz"),
            ("f,re", "column \"re\" lacks the imaginary part"),
            ("f,Hxx re,Hxy im", "column \"Hxx re\" lacks the imaginary part"),
            ("f,phase [deg]", "column \"phase [deg]\" lacks the magnitude"),
            ("f,mag [m/N],phase", "column \"phase\" has no unit: write it in rad or deg"),
            ("f,re [N/m],im", "column \"re [N/m]\" has the unit \"N/m\": write a motion per force"),
            ("f,re,im,real", "column \"re\" is there twice"),
        ] {
            let error = header(names).unwrap_err();
            assert!(error.starts_with(expected), "{error}");
        }
        let own = header("f [Hz],Hxx mag [g/N],Hxx phase [deg],Hxx coh,note").unwrap();
        assert_eq!(own.functions.len(), 2);
        let [re, im] = own.functions[0].value(&[2.0, 90.0]);
        assert!(re.abs() < 1e-12 && (im - 2.0).abs() < 1e-12);
    }
}
