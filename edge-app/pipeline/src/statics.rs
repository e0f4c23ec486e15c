//! Static tests as a spreadsheet exports them: one test in each line, comma-separated. The first line names the columns.
//!
//! ```text
//! q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz
//! 0,-0.45,0.95,0,0,-981,0,0,0,,,-1.12e-4,,,5e-6
//! ```
//!
//! The columns are the joint angles from the base (rad, or m), the force and torque on the TCP (N, Nm), the displacement of the
//! TCP, loaded less unloaded (m), and the standard deviation of the displacement (m). All but the joint angles are along the
//! TCP's axes. An empty displacement was not measured. The columns may come in any order. Empty lines and lines that begin with
//! `#` are left out.

use std::ops::RangeInclusive;
use std::path::Path;

use csv::{Position, ReaderBuilder, StringRecord, Trim};
use flexid_core::statics::{MAX_STATIC_TESTS, Reading, StaticTest};

use crate::input::{self, BadInput};
use crate::model::{Kind, Model};

/// Columns after those of the joints, each with its unit.
const COLUMNS: [(&str, &str); 12] = [
    ("fx", "N"),
    ("fy", "N"),
    ("fz", "N"),
    ("mx", "Nm"),
    ("my", "Nm"),
    ("mz", "Nm"),
    ("dx", "m"),
    ("dy", "m"),
    ("dz", "m"),
    ("sx", "m"),
    ("sy", "m"),
    ("sz", "m"),
];
/// Index of the first displacement in [`COLUMNS`].
const DISPLACEMENT: usize = 6;
/// Index of the first standard deviation in [`COLUMNS`].
const DEVIATION: usize = 9;
/// Largest displacement that is accepted, m. No robot that keeps its shape gives way by more.
const LARGEST_DISPLACEMENT_M: f64 = 0.1;
/// Standard deviations of displacements that are accepted, m. No displacement is measured more precisely than to an atom. A
/// less precise one gives no information.
const DEVIATIONS_M: RangeInclusive<f64> = 1e-9..=LARGEST_DISPLACEMENT_M;
/// Largest load that is accepted, N or Nm. No robot bears more.
const LARGEST_LOAD: f64 = 1e6;

/// Reads the static tests of a robot.
///
/// # Errors
/// The error is one line that names the file, the line, the column and the correction.
pub fn load(file: &Path, model: &Model) -> Result<Vec<StaticTest>, BadInput> {
    parse(file, &input::read(file)?, model)
}

/// Parses `text`, the content of the file of static tests `file`.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(file: &Path, text: &str, model: &Model) -> Result<Vec<StaticTest>, BadInput> {
    // Files of spreadsheets begin with a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(Trim::All)
        .flexible(true)
        .has_headers(false)
        .from_reader(text.as_bytes());
    let mut table: Option<Table> = None;
    let mut tests = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| BadInput::new(file, error))?;
        if record.iter().all(str::is_empty) {
            continue;
        }
        let line = record.position().map(|position| line(text, position));
        let bad = |message| BadInput { line, ..BadInput::new(file, message) };
        match &table {
            None => table = Some(Table::new(&record, model).map_err(bad)?),
            Some(table) => tests.push(table.test(&record).map_err(bad)?),
        }
        if tests.len() > MAX_STATIC_TESTS {
            return Err(bad(format!("is one test too many: at most {MAX_STATIC_TESTS} are used")));
        }
    }
    if tests.is_empty() {
        let mend = format!("the first line is {}, each other a test", names(model).join(","));
        return Err(BadInput::new(file, format!("has no static test: {mend}")));
    }
    Ok(tests)
}

/// Returns the names of all columns.
fn names(model: &Model) -> Vec<String> {
    let joints = (1..=model.joints.len()).map(|joint| format!("q{joint}"));
    joints.chain(COLUMNS.map(|(name, _)| name.to_string())).collect()
}

/// Returns the line number of a record. The record's position is before the empty lines and comments that precede it.
fn line(text: &str, position: &Position) -> usize {
    let ahead = text.get(position.byte() as usize..).unwrap_or_default().lines();
    let skipped = ahead.take_while(|line| line.is_empty() || line.starts_with('#')).count();
    position.line() as usize + skipped
}

/// Places of the columns in a line.
struct Table<'a> {
    model: &'a Model,
    cells: usize,
    /// Cell of each joint.
    joints: Vec<usize>,
    /// Cell of each of [`COLUMNS`].
    columns: [usize; COLUMNS.len()],
}

impl<'a> Table<'a> {
    /// Makes the table from the line that names the columns.
    fn new(header: &StringRecord, model: &'a Model) -> Result<Self, String> {
        let known = names(model);
        for (index, name) in header.iter().enumerate() {
            if !known.iter().any(|known| known == name) {
                if name.contains([';', '\t']) {
                    return Err(format!(
                        "unknown column {name:?}: separate columns with commas, and write decimals with points"
                    ));
                }
                let known = known.join(",");
                return Err(format!("unknown column {}: known are {known}", shown(name)));
            }
            if header.iter().skip(index + 1).any(|other| other == name) {
                return Err(format!("column {name} is there twice: name each once"));
            }
        }
        let place = |name: &str| {
            let missing = || format!("column {name} is missing: name {}", known.join(","));
            header.iter().position(|own| own == name).ok_or_else(missing)
        };
        let (joints, _) = known.split_at(model.joints.len());
        let mut columns = [0; COLUMNS.len()];
        for (column, (name, _)) in columns.iter_mut().zip(COLUMNS) {
            *column = place(name)?;
        }
        Ok(Self {
            model,
            cells: header.len(),
            joints: joints.iter().map(|name| place(name)).collect::<Result<_, _>>()?,
            columns,
        })
    }

    /// Returns the test that a line describes.
    fn test(&self, line: &StringRecord) -> Result<StaticTest, String> {
        if line.len() != self.cells {
            let (own, cells) = (line.len(), self.cells);
            return Err(format!("has {own} cells, the first line {cells}: write as many"));
        }
        let pose = (0..self.joints.len()).map(|joint| self.angle(line, joint));
        let mut wrench = [0.0; 6];
        for (column, value) in wrench.iter_mut().enumerate() {
            *value = self.needed(line, column, "write 0 where there is no load")?;
            if value.abs() > LARGEST_LOAD {
                let (name, unit) = COLUMNS[column];
                return Err(format!(
                    "column {name} is {value:e}: must be at most {LARGEST_LOAD:e} (in {unit})"
                ));
            }
        }
        if wrench == [0.0; 6] {
            return Err("has no load: one of fx,fy,fz,mx,my,mz must not be 0".to_string());
        }
        let mut displacement = [None; 3];
        for (axis, reading) in displacement.iter_mut().enumerate() {
            *reading = self.reading(line, axis)?;
        }
        if displacement == [None; 3] {
            return Err("has no displacement: fill one of dx,dy,dz".to_string());
        }
        Ok(StaticTest { pose: pose.collect::<Result<_, _>>()?, wrench, displacement })
    }

    /// Returns the angle of a joint, which must lie within the joint's limits. An angle in degrees hardly ever does.
    fn angle(&self, line: &StringRecord, joint: usize) -> Result<f64, String> {
        let (own, name) = (&self.model.joints[joint], format!("q{}", joint + 1));
        let unit = match own.kind {
            Kind::Revolute => "rad",
            Kind::Prismatic => "m",
        };
        let angle = number(&line[self.joints[joint]], &name, unit)?
            .ok_or_else(|| format!("column {name} is empty: must be a number (in {unit})"))?;
        let [lower, upper] = own.limits;
        if !(lower..=upper).contains(&angle) {
            let limits = format!("[{lower}, {upper}] {unit}");
            return Err(format!(
                "column {name} is {angle}: joint {:?} moves in {limits}",
                own.name
            ));
        }
        Ok(angle)
    }

    /// Returns a displacement and its deviation, or `None` if it was not measured.
    fn reading(&self, line: &StringRecord, axis: usize) -> Result<Option<Reading>, String> {
        let Some(value) = self.number(line, DISPLACEMENT + axis)? else {
            return Ok(None);
        };
        let (name, _) = COLUMNS[DISPLACEMENT + axis];
        if value.abs() > LARGEST_DISPLACEMENT_M {
            return Err(format!(
                "column {name} is {value}: must be at most {LARGEST_DISPLACEMENT_M} (in m)"
            ));
        }
        let mend = format!("write the standard deviation of {name} (in m)");
        let deviation = self.needed(line, DEVIATION + axis, &mend)?;
        if !DEVIATIONS_M.contains(&deviation) {
            let (name, _) = COLUMNS[DEVIATION + axis];
            let (least, most) = DEVIATIONS_M.into_inner();
            return Err(format!(
                "column {name} is {deviation:e}: must lie between {least:e} and {most} (in m)"
            ));
        }
        Ok(Some(Reading { value, deviation }))
    }

    fn needed(&self, line: &StringRecord, column: usize, mend: &str) -> Result<f64, String> {
        let empty = || format!("column {} is empty: {mend}", COLUMNS[column].0);
        self.number(line, column)?.ok_or_else(empty)
    }

    fn number(&self, line: &StringRecord, column: usize) -> Result<Option<f64>, String> {
        let (name, unit) = COLUMNS[column];
        number(&line[self.columns[column]], name, unit)
    }
}

/// Returns the number in a cell, or `None` if the cell is empty.
fn number(cell: &str, column: &str, unit: &str) -> Result<Option<f64>, String> {
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
