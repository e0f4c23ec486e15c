//! Universal files: functions at nodal degrees of freedom (data set 58, ASCII and binary), and their units (data set 164).
//!
//! The records are those of Structural Dynamics Research Corporation, _Universal File Formats_, with the binary data set of the University
//! of Cincinnati. What is in other data sets is left out. The number of bytes that the head of a binary data set states is not used: writers
//! differ.

mod lines;
mod numbers;

use std::path::Path;

use super::function::{Dof, Function, Grid, Kind};
use super::unit::{Motion, Unit};
use crate::input::BadInput;
use crate::poses::Direction;
use crate::units::FORCE;
use lines::Lines;
use numbers::{floats, numbers};

/// Function types of data set 58, by their numbers.
const TYPES: [(i64, &str); 9] = [
    (0, "general function"),
    (1, "time response"),
    (2, "auto spectrum"),
    (3, "cross spectrum"),
    (5, "transmissibility"),
    (7, "auto correlation"),
    (8, "cross correlation"),
    (9, "power spectral density"),
    (12, "spectrum"),
];
const RESPONSE: i64 = 4;
const COHERENCE: i64 = 6;
/// Specific data types of motions.
const MOTIONS: [(i64, Motion); 3] =
    [(8, Motion::Displacement), (11, Motion::Velocity), (12, Motion::Acceleration)];
/// Specific data types of forces: reaction, excitation.
const FORCES: [i64; 2] = [9, 13];
/// Specific data type of a frequency, and those that do not say.
const FREQUENCIES: [i64; 3] = [18, 0, 1];
/// Most values of a function. Chosen: more than an analyser has lines.
const MOST_VALUES: usize = 1 << 20;
/// Units by their code in data set 164: length and force in a metre and a newton.
const SYSTEMS: [(i64, [f64; 2]); 3] = [(1, [1.0, 1.0]), (5, [1e3, 1e3]), (6, [1e2, 1e2])];

/// Returns whether a file is a universal one: its first line is the mark of a data set.
pub fn is_universal(bytes: &[u8]) -> bool {
    let mut lines = Lines::new(bytes);
    let first = std::iter::from_fn(|| lines.next()).find(|line| !line.trim_ascii().is_empty());
    first.is_some_and(lines::is_mark)
}

/// Size of the units of a file in a metre and a newton.
#[derive(Clone, Copy)]
struct System {
    length: f64,
    force: f64,
}

/// The functions of a universal file.
///
/// # Errors
/// A data set is cut off or contradicts the format, or there is no frequency response.
pub(super) fn parse(file: &Path, bytes: &[u8]) -> Result<Vec<Function>, BadInput> {
    let mut lines = Lines::new(bytes);
    let mut system = System { length: 1.0, force: 1.0 };
    let mut functions = Vec::new();
    let mut others: Vec<String> = Vec::new();
    while let Some(kind) = lines.next_set() {
        let line = lines.number();
        let bad = |message: String| BadInput { line: Some(line), ..BadInput::new(file, message) };
        match kind.number {
            164 => system = units(&mut lines).map_err(bad)?,
            58 => match content(&mut lines, &kind, system, line).map_err(bad)? {
                Content::Function(function) => functions.push(function),
                Content::Other(other) if others.contains(&other) => {}
                Content::Other(other) => others.push(other),
            },
            _ => {}
        }
        lines.skip_set();
    }
    if functions.iter().any(|own| matches!(own.kind, Kind::Response(_))) {
        return Ok(functions);
    }
    let others = match others.as_slice() {
        [] => "it has no data set 58".to_owned(),
        names => format!("it has {}", names.join(", ")),
    };
    Err(BadInput::new(
        file,
        format!(
            "has no frequency response (data set 58, function type 4): {others}; export the responses of the test, motion per force"
        ),
    ))
}

/// Reads data set 164.
fn units(lines: &mut Lines<'_>) -> Result<System, String> {
    let code = lines.next().map(|line| lines::integer(line, 0..10)).unwrap_or_default();
    let factors = numbers(lines.next().unwrap_or_default())
        .ok_or("data set 164 has no factors of length and force: export it again")?;
    let known = SYSTEMS.into_iter().find(|(own, _)| Some(*own) == code);
    match (factors.as_slice(), known) {
        ([length, force, ..], _) if *length > 0.0 && *force > 0.0 => {
            Ok(System { length: 1.0 / length, force: 1.0 / force })
        }
        (_, Some((_, [length, force]))) => Ok(System { length: 1.0 / length, force: 1.0 / force }),
        _ => {
            Err("data set 164 has no positive factors of length and force: export it again"
                .to_owned())
        }
    }
}

/// Kind, label and unit of an axis of a function.
struct Axis {
    kind: i64,
    unit: String,
}

impl Axis {
    fn of(line: &[u8]) -> Self {
        let unit = lines::text(line, 47..67);
        let unit = if matches!(unit.as_str(), "NONE" | "none" | "") { String::new() } else { unit };
        Self { kind: lines::integer(line, 0..10).unwrap_or(0), unit }
    }
}

/// Content of data set 58.
enum Content {
    Function(Function),
    /// The name of a function that is not used.
    Other(String),
}

/// Reads data set 58.
fn content(
    lines: &mut Lines<'_>,
    kind: &lines::Set,
    system: System,
    line: usize,
) -> Result<Content, String> {
    let mut records = [&b""[..]; 11];
    for record in &mut records {
        *record = lines.next().ok_or("the data set is cut off: export it again")?;
    }
    let dofs = lines::Dofs::of(records[5])?;
    let form = Form::of(records[6])?;
    let [abscissa, numerator, denominator] = [7, 8, 9].map(|record| Axis::of(records[record]));
    let values = form.values(lines, kind)?;
    if ![RESPONSE, COHERENCE].contains(&dofs.kind) {
        let known = TYPES.into_iter().find(|(own, _)| *own == dofs.kind);
        let name =
            known.map_or_else(|| format!("function type {}", dofs.kind), |own| own.1.to_owned());
        return Ok(Content::Other(name));
    }
    let name = lines::text(records[0], 0..80);
    let place = format!("the data set at line {line} ({name})");
    if !FREQUENCIES.contains(&abscissa.kind)
        || !matches!(abscissa.unit.as_str(), "" | "Hz" | "hz" | "HZ")
    {
        return Err(format!(
            "{place} has no frequencies in Hz along its abscissa: export it over frequency"
        ));
    }
    let (Some(response), Some(reference)) = (dofs.response.dof(), dofs.reference.dof()) else {
        return Ok(Content::Other("responses that turn".to_owned()));
    };
    let grid = form.grid(&values).map_err(|error| format!("{place}: {error}"))?;
    let values = form.complex(&values);
    let kind = match dofs.kind {
        COHERENCE => Kind::Coherence,
        _ => {
            check_ratio(&numerator, &denominator).map_err(|error| format!("{place} {error}"))?;
            Kind::Response(unit(&numerator, &denominator, system))
        }
    };
    Ok(Content::Function(Function { place, kind, response, reference, grid, values }))
}

/// Checks that a response is a motion over a force.
fn check_ratio(numerator: &Axis, denominator: &Axis) -> Result<(), String> {
    if FORCES.contains(&numerator.kind) || FORCE.size(&numerator.unit).is_some() {
        return Err("has a force over a motion: export the motion over the force, and not the apparent mass or the dynamic stiffness".to_owned());
    }
    let is_force = |own: i64| FORCES.contains(&own) || FREQUENCIES.contains(&own);
    if !is_force(denominator.kind) {
        return Err("has no force in its denominator: export the motion over the force".to_owned());
    }
    Ok(())
}

/// The unit of a response, or the reason why the file states none.
fn unit(numerator: &Axis, denominator: &Axis, system: System) -> Result<Unit, String> {
    let force = match denominator.unit.as_str() {
        "" => system.force,
        unit => FORCE.size(unit).ok_or_else(|| format!("has the force in {unit:?}"))?,
    };
    let motion = MOTIONS.into_iter().find(|(own, _)| *own == numerator.kind).map(|own| own.1);
    let label = numerator.unit.as_str();
    if label.is_empty() {
        let motion = motion.ok_or("states no unit")?;
        return Ok(Unit { motion, size: system.length / force });
    }
    // Some writers put the unit of the whole response here.
    let stated = Unit::parse(label).or_else(|| {
        let own = Unit::of_motion(label)?;
        Some(Unit { size: own.size / force, ..own })
    });
    let stated =
        stated.ok_or_else(|| format!("has the unit {label:?}, which is none of a motion"))?;
    if motion.is_some_and(|motion| motion != stated.motion) {
        return Err(format!("has the unit {label:?}, and is said to be another motion"));
    }
    Ok(stated)
}

/// Form of the values.
struct Form {
    is_complex: bool,
    is_double: bool,
    is_even: bool,
    count: usize,
    first_hz: f64,
    spacing_hz: f64,
}

impl Form {
    fn of(record: &[u8]) -> Result<Self, String> {
        let own = numbers(record).filter(|own| own.len() >= 5);
        let wrong = || {
            "the data set does not say what its values are (record 7): export it again".to_owned()
        };
        let own = own.ok_or_else(wrong)?;
        let kind = own[0];
        if ![2.0, 4.0, 5.0, 6.0].contains(&kind) || !(2.0..=MOST_VALUES as f64).contains(&own[1]) {
            return Err(wrong());
        }
        Ok(Self {
            is_complex: kind >= 5.0,
            is_double: kind == 4.0 || kind == 6.0,
            is_even: own[2] == 1.0,
            count: own[1] as usize,
            first_hz: own[3],
            spacing_hz: own[4],
        })
    }

    /// Numbers of one value.
    fn width(&self) -> usize {
        usize::from(!self.is_even) + if self.is_complex { 2 } else { 1 }
    }

    /// Reads all numbers.
    fn values(&self, lines: &mut Lines<'_>, kind: &lines::Set) -> Result<Vec<f64>, String> {
        let wanted = self.count * self.width();
        let values = match kind.binary {
            Some([1 | 2, 2]) => {
                let is_big = kind.binary == Some([2, 2]);
                let bytes = lines.bytes(wanted * if self.is_double { 8 } else { 4 });
                floats(bytes, self.is_double, is_big)
            }
            Some([order, format]) => {
                return Err(format!(
                    "the binary data set has byte order {order} and floating point format {format}: 1 or 2, and 2 (IEEE 754) are read; export it in ASCII"
                ));
            }
            None => {
                let mut values = Vec::new();
                while values.len() < wanted
                    && let Some(line) = lines.next_in_set()
                {
                    let own = numbers(line)
                        .ok_or("the data set has a value that is no number: export it again")?;
                    values.extend(own);
                }
                values
            }
        };
        if values.len() < wanted {
            return Err(format!(
                "the data set has {} of {} values: it is cut off; copy or export it again",
                values.len() / self.width(),
                self.count
            ));
        }
        Ok(values[..wanted].to_vec())
    }

    /// The frequencies of the numbers.
    fn grid(&self, values: &[f64]) -> Result<Grid, String> {
        if self.is_even {
            return Grid::new(self.first_hz, self.spacing_hz);
        }
        let frequencies: Vec<f64> = values.chunks_exact(self.width()).map(|own| own[0]).collect();
        Grid::of(&frequencies)
    }

    /// Real and imaginary parts of the numbers.
    fn complex(&self, values: &[f64]) -> Vec<[f64; 2]> {
        let first = usize::from(!self.is_even);
        let values = values.chunks_exact(self.width());
        values.map(|own| [own[first], if self.is_complex { own[first + 1] } else { 0.0 }]).collect()
    }
}

impl lines::Point {
    /// The degree of freedom, if it is no turn.
    fn dof(&self) -> Option<Dof> {
        let axis = self.direction.unsigned_abs() as usize;
        let direction = match axis {
            0 => None,
            1..=3 => Some(Direction {
                axis: axis - 1,
                sign: if self.direction < 0 { -1.0 } else { 1.0 },
            }),
            _ => return None,
        };
        Some(Dof { node: self.node, direction })
    }
}

#[cfg(test)]
mod tests;
