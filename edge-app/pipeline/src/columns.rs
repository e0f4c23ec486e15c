//! Lines of a table that a spreadsheet exports: comma-separated, the first names the columns. Empty lines and lines that begin with `#` are
//! left out.

use std::f64::consts::PI;
use std::path::Path;

use csv::{Position, ReaderBuilder, StringRecord, Trim};

use crate::input::{self, BadInput};
use crate::model::{Kind, Model, ModelJoint};
use crate::units;

/// Columns of a load on the tool, each with its unit.
pub(crate) const LOAD: [(&str, &str); 6] =
    [("fx", "N"), ("fy", "N"), ("fz", "N"), ("mx", "Nm"), ("my", "Nm"), ("mz", "Nm")];
/// Columns of the point of a load.
pub(crate) const LOAD_POINT: [&str; 3] = ["px", "py", "pz"];
/// Largest distance of a point from the TCP along each axis, m: the reach of the longest arms (FANUC M-2000iA, 4.7 m). In mm, a point on any tool is
/// farther.
const LARGEST_DISTANCE_M: f64 = 5.0;
/// Largest load that is accepted, N or Nm. No robot bears more.
pub(crate) const LARGEST_LOAD: f64 = 1e6;

/// Reads the table of the `text` of `file`: `header` makes of the first line what `row` needs for each other, with its number from 1.
///
/// # Errors
/// A line is no record, or one of both refuses it.
pub(crate) fn read<T>(
    file: &Path,
    text: &str,
    header: impl Fn(&StringRecord) -> Result<T, String>,
    mut row: impl FnMut(&T, &StringRecord, usize) -> Result<(), String>,
) -> Result<(), BadInput> {
    if let Some(own) = input::seems(text).filter(|own| *own != "a CSV file") {
        return Err(BadInput::new(
            file,
            format!("is {own}, and no table: name a file of comma-separated values"),
        ));
    }
    let separator = separator(text);
    let mut reader = ReaderBuilder::new()
        .delimiter(separator.unwrap_or(b','))
        .comment(Some(b'#'))
        .trim(Trim::All)
        .flexible(true)
        .has_headers(false)
        .from_reader(text.as_bytes());
    let mut table: Option<T> = None;
    for record in reader.records().skip(usize::from(separator.is_some())) {
        let record = record.map_err(|error| BadInput::new(file, error))?;
        if record.iter().all(str::is_empty) {
            continue;
        }
        let line = record.position().map(|position| line(text, position));
        let bad = |message| BadInput { line, ..BadInput::new(file, message) };
        match &table {
            None => {
                let names: StringRecord = record.iter().map(plain).collect();
                table = Some(header(&names).map_err(bad)?);
            }
            Some(table) => row(table, &record, line.unwrap_or_default()).map_err(bad)?,
        }
    }
    Ok(())
}

/// Returns the name of a column that has its unit in brackets, as the tables of flexid write it: `fx [N]` is `fx`, `q1 (deg)` is `q1_deg`. A name with
/// another unit stays as it is.
fn plain(name: &str) -> String {
    let Some((own, unit)) = units::in_brackets(name) else { return name.to_owned() };
    match unit {
        "deg" | "°" if own.starts_with('q') => format!("{own}_deg"),
        _ if units_of(own).contains(&unit) => own.to_owned(),
        _ => name.to_owned(),
    }
}

/// Returns the units that the name of a column may have behind it, beside degrees.
fn units_of(column: &str) -> &'static [&'static str] {
    match column.as_bytes().first() {
        Some(b'q') => &["rad", "m"],
        Some(b'f') => &["N"],
        Some(b'm') => &["Nm", "N·m", "N*m"],
        _ => &["m"],
    }
}

/// Returns the separator that the first line states, as Excel writes and reads it: `sep=;`.
fn separator(text: &str) -> Option<u8> {
    let first = text.lines().next()?.trim().trim_matches('"');
    match first.strip_prefix("sep=")?.as_bytes() {
        [separator] => Some(*separator),
        _ => None,
    }
}

/// Returns the line number of a record. The record's position is before the empty lines and comments that precede it.
fn line(text: &str, position: &Position) -> usize {
    let ahead = text.get(position.byte() as usize..).unwrap_or_default().lines();
    let skipped = ahead.take_while(|line| line.is_empty() || line.starts_with('#')).count();
    position.line() as usize + skipped
}

/// Refuses columns that are not `known`, and those that are there twice. A file needs those of `needed`.
pub(crate) fn check_names(
    header: &StringRecord,
    known: &[String],
    needed: &[String],
) -> Result<(), String> {
    let needed = needed.join(",");
    if header.iter().all(|name| name.is_empty() || name.parse::<f64>().is_ok()) {
        return Err(format!("has no names of columns: the first line is {needed}"));
    }
    for (index, name) in header.iter().enumerate() {
        if !known.iter().any(|known| known == name) {
            if name.contains([';', '\t']) {
                return Err(format!(
                    "unknown column {name:?}: separate columns with commas, and write decimals with points"
                ));
            }
            let lower = name.to_lowercase();
            if known.contains(&lower) {
                let name = shown(name);
                return Err(format!(
                    "unknown column {name}: did you mean {lower}? the first line is {needed}"
                ));
            }
            if let Some((own, unit)) = units::in_brackets(name)
                && known.iter().any(|known| known == own)
            {
                let degrees = if own.starts_with('q') { "deg, " } else { "" };
                let units = degrees.to_owned() + &units_of(own).join(", ");
                return Err(format!(
                    "column {own} has the unit {}: write it in {units}",
                    shown(unit)
                ));
            }
            let known = known.join(",");
            return Err(format!("unknown column {}: known are {known}", shown(name)));
        }
        if header.iter().skip(index + 1).any(|other| other == name) {
            return Err(format!("column {name} is there twice: name each once"));
        }
    }
    Ok(())
}

/// Returns the place of a column in the line that names the columns.
pub(crate) fn find(header: &StringRecord, name: &str) -> Option<usize> {
    header.iter().position(|own| own == name)
}

/// Returns the names of the columns of the joint angles, in rad and m.
pub(crate) fn angle_names(model: &Model) -> impl Iterator<Item = String> {
    (1..=model.driven().count()).map(|joint| format!("q{joint}"))
}

/// Returns the names of the columns of the joint angles in degrees.
pub(crate) fn degree_names(model: &Model) -> impl Iterator<Item = String> {
    let degrees = model.driven().enumerate().filter(|(_, joint)| joint.kind == Kind::Revolute);
    degrees.map(|(joint, _)| format!("q{}_deg", joint + 1))
}

/// Refuses a line of another number of cells than that of the columns.
pub(crate) fn check_cells(line: &StringRecord, cells: usize) -> Result<(), String> {
    match line.len() {
        own if own == cells => Ok(()),
        own => Err(format!("has {own} cells, the first line {cells}: write as many")),
    }
}

/// Returns the load in a cell, in the column of this name and unit.
pub(crate) fn load(cell: &str, name: &str, unit: &str) -> Result<f64, String> {
    let value = number(cell, name, unit)?
        .ok_or_else(|| format!("column {name} is empty: write 0 where there is no load"))?;
    at_most(name, value, LARGEST_LOAD, unit)?;
    Ok(value)
}

/// Column of a driven joint.
pub(crate) struct Angle<'a> {
    joint: &'a ModelJoint,
    cell: usize,
    name: String,
    unit: &'static str,
    /// The unit in rad, or m.
    scale: f64,
}

impl<'a> Angle<'a> {
    /// Finds the column of the driven joint of this number, from 1, by `find`, or refuses by `place`.
    pub(crate) fn new(
        joint: &'a ModelJoint,
        number: usize,
        find: impl Fn(&str) -> Option<usize>,
        place: impl Fn(&str) -> Result<usize, String>,
    ) -> Result<Self, String> {
        let name = format!("q{number}");
        let degrees = format!("{name}_deg");
        if let Some(cell) = find(&degrees) {
            if find(&name).is_some() {
                return Err(format!("columns {name} and {degrees} are the same angle: name one"));
            }
            return Ok(Self { joint, cell, name: degrees, unit: "deg", scale: 1_f64.to_radians() });
        }
        let unit = if joint.kind == Kind::Revolute { "rad" } else { "m" };
        Ok(Self { joint, cell: place(&name)?, name, unit, scale: 1.0 })
    }

    /// Returns the angle of a joint, which must lie within the joint's limits. An angle in degrees hardly ever does.
    pub(crate) fn angle(&self, line: &StringRecord) -> Result<f64, String> {
        let Self { joint, cell, name, unit, scale } = self;
        let angle = number(&line[*cell], name, unit)?
            .ok_or_else(|| format!("column {name} is empty: must be a number (in {unit})"))?;
        let [lower, upper] = joint.limits.map(|limit| limit / scale);
        if !(lower..=upper).contains(&angle) {
            let [lower, upper] = match *unit {
                "deg" => [format!("{lower:.1}"), format!("{upper:.1}")],
                _ => [lower.to_string(), upper.to_string()],
            };
            let [least, most] = joint.limits;
            let degrees = match *unit {
                "rad" if angle.abs() > PI && (least..=most).contains(&angle.to_radians()) => {
                    format!(": looks like degrees: name the column {name}_deg")
                }
                _ => String::new(),
            };
            return Err(format!(
                "column {name} is {angle}: joint {:?} moves in [{lower}, {upper}] {unit}{degrees}",
                joint.name
            ));
        }
        Ok(angle * scale)
    }
}

/// Returns a point from the TCP, m. What is empty or left out is 0.
pub(crate) fn point(
    line: &StringRecord,
    cells: &[Option<usize>; 3],
    names: &[&str; 3],
) -> Result<[f64; 3], String> {
    let mut point = [0.0; 3];
    for ((value, cell), name) in point.iter_mut().zip(cells).zip(names) {
        if let Some(cell) = cell {
            *value = number(&line[*cell], name, "m")?.unwrap_or(0.0);
            at_most(name, *value, LARGEST_DISTANCE_M, "m from the TCP")?;
        }
    }
    Ok(point)
}

/// Refuses what is larger than `most`, in either direction.
pub(crate) fn at_most(column: &str, value: f64, most: f64, unit: &str) -> Result<(), String> {
    if value.abs() <= most {
        return Ok(());
    }
    Err(format!("column {column} is {value:e}: must be at most {most:e} (in {unit})"))
}

/// Returns the number in a cell, or `None` if the cell is empty.
pub(crate) fn number(cell: &str, column: &str, unit: &str) -> Result<Option<f64>, String> {
    if cell.is_empty() {
        return Ok(None);
    }
    match cell.parse() {
        Ok(number) if f64::is_finite(number) => Ok(Some(number)),
        _ => Err(format!("column {column} is {}: must be a number (in {unit})", shown(cell))),
    }
}

/// Returns a cell in quotes. Only the beginning of a very long cell is shown, since a quote may not be closed.
fn shown(cell: &str) -> String {
    match cell.char_indices().nth(40) {
        Some((end, _)) => format!("{:?}... (is a quote not closed?)", &cell[..end]),
        None => format!("{cell:?}"),
    }
}
