//! The rows of a table of Denavit-Hartenberg parameters, in CSV or TOML.
//!
//! A column (in TOML a key of `[[joint]]`) is a name with its unit, as `a [mm]`, `a (mm)` or `a_mm`; SI without one.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::column::Column;
use super::column::Quantity::{Angle, Length, Stroke};
use super::error::DhError;
use super::value::Value;

/// A robot as a table.
pub(super) struct Table {
    pub(super) name: String,
    pub(super) rows: Vec<Row>,
}

/// A joint with its link, or a fixed frame.
pub(super) struct Row {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// The parameters with the joint at 0, rad and m.
    pub(super) theta: f64,
    pub(super) d: f64,
    pub(super) a: f64,
    pub(super) alpha: f64,
    /// Lower and upper limit, rad or m.
    pub(super) limits: Option<[f64; 2]>,
    pub(super) body: Option<RowBody>,
}

/// Motion of a row.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Revolute,
    Prismatic,
    Fixed,
}

/// The body of a row, in its frame.
pub(super) struct RowBody {
    /// kg
    pub(super) mass: f64,
    /// m
    pub(super) centre: [f64; 3],
    /// xx, yy, zz, xy, xz, yz about the centre, kg m².
    pub(super) inertia: [f64; 6],
}

/// Columns of the body beside its mass.
const BODY: [&str; 9] = ["cx", "cy", "cz", "ixx", "iyy", "izz", "ixy", "ixz", "iyz"];
/// Length of a parameter that no arm has, m: ten times the reach of the longest (FANUC M-2000iA, 4.7 m). In mm, 60 mm are more.
const LONGEST: f64 = 50.0;

/// Returns whether a text looks like a table of these parameters.
pub(crate) fn is_table(text: &str) -> bool {
    let is_comment = |line: &&str| line.trim().is_empty() || line.trim_start().starts_with('#');
    let head = text.lines().find(|line| !is_comment(line)).unwrap_or_default();
    let has = |wanted: &str| {
        let mut fields = head.split([',', ';', '\t']);
        fields.any(|field| Column::new(field).is_ok_and(|column| column.name == wanted))
    };
    has("alpha") && has("a") || (text.contains("[[joint]]") && text.contains("alpha"))
}

fn bad(line: Option<usize>, message: String) -> DhError {
    DhError { line, message: message.split_whitespace().collect::<Vec<_>>().join(" ") }
}

impl Table {
    /// Reads a table. One in CSV has its name from outside.
    pub(super) fn read(text: &str, name: &str) -> Result<Self, DhError> {
        let is_toml = text.contains("[[joint]]");
        let (name, rows) =
            if is_toml { of_toml(text, name)? } else { (name.to_owned(), of_csv(text)?) };
        let Some((_, first)) = rows.first() else {
            return Err(bad(None, "has no rows: a row has joint, theta, d, a, alpha".to_owned()));
        };
        if let Some(missing) = ["a", "alpha", "d"].iter().find(|own| !first.contains_key(**own)) {
            return Err(bad(
                None,
                format!(
                    "has no column {missing}: theta, d, a and alpha are needed, with units, as a [mm], alpha [deg]"
                ),
            ));
        }
        let rows =
            rows.iter().enumerate().map(|(index, (line, cells))| Row::read(index, *line, cells));
        Ok(Self { name, rows: rows.collect::<Result<_, _>>()? })
    }
}

/// The cells of a row by the names of their columns, and the line on which it stands.
type Cells = (Option<usize>, BTreeMap<&'static str, (Column, String)>);

fn of_csv(text: &str) -> Result<Vec<Cells>, DhError> {
    let is_comment = |line: &&str| line.trim().is_empty() || line.trim_start().starts_with('#');
    let head = text.lines().find(|line| !is_comment(line)).unwrap_or_default();
    let delimiter = [';', '\t', ','].into_iter().find(|own| head.contains(*own)).unwrap_or(',');
    let mut reader = csv::ReaderBuilder::new();
    reader
        .delimiter(delimiter as u8)
        .flexible(true)
        .has_headers(false)
        .trim(csv::Trim::All)
        .comment(Some(b'#'));
    let mut columns: Option<Vec<Column>> = None;
    let mut rows = Vec::new();
    for record in reader.from_reader(text.as_bytes()).records() {
        let record = record.map_err(|error| bad(None, error.to_string()))?;
        let line = record.position().map(|own| own.line() as usize);
        let Some(columns) = &columns else {
            let own: Result<Vec<Column>, String> = record.iter().map(Column::new).collect();
            columns = Some(own.map_err(|message| bad(line, message))?);
            continue;
        };
        if record.len() != columns.len() {
            return Err(bad(
                line,
                format!("has {} fields, and the head {} columns", record.len(), columns.len()),
            ));
        }
        let cell =
            |text: &str| if delimiter == ',' { text.to_owned() } else { text.replace(',', ".") };
        rows.push((line, cells(line, columns.iter().copied().zip(record.iter().map(cell)))?));
    }
    Ok(rows)
}

fn of_toml(text: &str, name: &str) -> Result<(String, Vec<Cells>), DhError> {
    let table: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let line =
            error.span().map(|span| 1 + text.get(..span.start).unwrap_or("").matches('\n').count());
        bad(line, error.message().to_owned())
    })?;
    let name = table.get("name").and_then(|own| own.as_str()).unwrap_or(name).to_owned();
    if let Some(other) = table.keys().find(|own| !["name", "joint"].contains(&own.as_str())) {
        return Err(bad(None, format!("unknown key `{other}`: known are name and [[joint]]")));
    }
    let joints = table.get("joint").and_then(toml::Value::as_array).cloned().unwrap_or_default();
    let mut rows = Vec::new();
    for (index, joint) in joints.iter().enumerate() {
        let in_row = |message: String| bad(None, format!("[[joint]] {}: {message}", index + 1));
        let own = joint.as_table().into_iter().flatten().map(|(key, value)| {
            let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            Ok((Column::new(key).map_err(in_row)?, value))
        });
        let own: Vec<(Column, String)> = own.collect::<Result<_, DhError>>()?;
        rows.push((None, cells(None, own.into_iter()).map_err(|error| in_row(error.message))?));
    }
    Ok((name, rows))
}

fn cells(
    line: Option<usize>,
    all: impl Iterator<Item = (Column, String)>,
) -> Result<BTreeMap<&'static str, (Column, String)>, DhError> {
    let mut cells = BTreeMap::new();
    for (column, text) in all {
        if cells.insert(column.name, (column, text)).is_some() {
            return Err(bad(line, format!("column {} is there twice: keep one", column.name)));
        }
    }
    Ok(cells)
}

impl Row {
    fn read(
        index: usize,
        line: Option<usize>,
        cells: &BTreeMap<&'static str, (Column, String)>,
    ) -> Result<Self, DhError> {
        let word = |name: &str| {
            cells.get(name).map(|(_, text)| text.trim()).filter(|text| !text.is_empty())
        };
        let name = match word("joint") {
            Some(own) if own.parse::<u32>().is_err() => own.to_owned(),
            _ => format!("joint_{}", index + 1),
        };
        let bad = |message: String| bad(line, format!("row of {name}: {message}"));
        let kind = match word("type").unwrap_or("revolute").to_lowercase().as_str() {
            "revolute" | "r" | "rotational" => Kind::Revolute,
            "prismatic" | "p" | "linear" => Kind::Prismatic,
            "fixed" | "f" | "tool" => Kind::Fixed,
            other => {
                return Err(bad(format!(
                    "type is {other:?}: must be revolute, prismatic or fixed"
                )));
            }
        };
        let given = |name: &str| -> Result<Option<f64>, DhError> {
            let Some((column, text)) = cells.get(name).filter(|(_, text)| !text.trim().is_empty())
            else {
                return Ok(None);
            };
            let value = Value::new(text)
                .filter(|own| own.of_pi.is_none() || matches!(column.quantity, Angle | Stroke));
            let Value { number, of_pi, has_variable } = value.ok_or_else(|| {
                bad(format!("{name} is {text:?}: must be a number, as -90, pi/2 or q2-90"))
            })?;
            let of_joint = match kind {
                Kind::Revolute => "theta",
                Kind::Prismatic => "d",
                Kind::Fixed => "",
            };
            if has_variable && name != of_joint {
                return Err(bad(format!(
                    "{name} is {text:?}: a joint's variable stands in theta where type is revolute, in d where it is prismatic: put a number here"
                )));
            }
            let other = match kind {
                Kind::Revolute => Some(Length),
                Kind::Prismatic => Some(Angle),
                Kind::Fixed => None,
            };
            if column.quantity == Stroke && column.unit.is_some() && column.unit == other {
                let (motion, unit) = if kind == Kind::Revolute {
                    ("turns", "an angle")
                } else {
                    ("slides", "a length")
                };
                return Err(bad(format!(
                    "{motion}, and the unit of {name} is not that of {unit}: head the column {name} without a unit, and give rad and m"
                )));
            }
            let own = column.scale * number + of_pi.unwrap_or_default();
            let (most, unit, mend) = match column.quantity {
                Angle => (TAU, "rad", "deg"),
                Length => (LONGEST, "m", "mm"),
                _ => (f64::INFINITY, "", ""),
            };
            if own.abs() > most * (1.0 + 1e-9) {
                return Err(bad(format!(
                    "{name} is {own} {unit}: in {mend}? Head the column {name} [{mend}]"
                )));
            }
            Ok(Some(own))
        };
        let parameter = |name| Ok::<f64, DhError>(given(name)?.unwrap_or(0.0));
        let limits = match (given("lower")?, given("upper")?) {
            (Some(lower), Some(upper)) => Some([lower, upper]),
            (None, None) => None,
            _ => return Err(bad("has one limit: give lower and upper, or neither".to_owned())),
        };
        let mass = given("mass")?;
        for name in BODY {
            // A row without a body may have zeros.
            let is_lost = |own: f64| mass.is_none() || mass == Some(0.0) && own != 0.0;
            if given(name)?.is_some_and(is_lost) {
                return Err(bad(format!(
                    "has {name} without a mass: give it, or leave {name} out"
                )));
            }
        }
        let body = match mass {
            Some(mass) if mass < 0.0 => {
                return Err(bad(format!("mass is {mass} kg: must be positive")));
            }
            Some(mass) if mass > 0.0 => {
                let moments = ["ixx", "iyy", "izz"].map(given);
                let [xx, yy, zz] = moments;
                let (Some(xx), Some(yy), Some(zz)) = (xx?, yy?, zz?) else {
                    return Err(bad(
                        "has a mass without ixx, iyy, izz [kg m2] about its centre: give them, or leave masses out and add --total-mass KG".to_owned(),
                    ));
                };
                let (Some(x), Some(y), Some(z)) = (given("cx")?, given("cy")?, given("cz")?) else {
                    return Err(bad(
                        "has a mass without cx, cy, cz, its centre in the frame of the row: give all three".to_owned(),
                    ));
                };
                let centre = [x, y, z];
                let inertia = [xx, yy, zz, parameter("ixy")?, parameter("ixz")?, parameter("iyz")?];
                Some(RowBody { mass, centre, inertia })
            }
            _ => None,
        };
        Ok(Self {
            kind,
            theta: parameter("theta")?,
            d: parameter("d")?,
            a: parameter("a")?,
            alpha: parameter("alpha")?,
            limits,
            body,
            name,
        })
    }
}
