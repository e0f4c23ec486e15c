//! Columns of a table: names, quantities and units.

use std::f64::consts::PI;

/// Quantity in a column.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Word,
    Angle,
    Length,
    /// rad, or m of a sliding joint.
    Stroke,
    Mass,
    Inertia,
}
use Quantity::{Angle, Inertia, Length, Mass, Stroke, Word};

/// Names of columns.
const COLUMNS: [(&str, Quantity); 18] = [
    ("joint", Word),
    ("type", Word),
    ("theta", Angle),
    ("d", Length),
    ("a", Length),
    ("alpha", Angle),
    ("lower", Stroke),
    ("upper", Stroke),
    ("mass", Mass),
    ("cx", Length),
    ("cy", Length),
    ("cz", Length),
    ("ixx", Inertia),
    ("iyy", Inertia),
    ("izz", Inertia),
    ("ixy", Inertia),
    ("ixz", Inertia),
    ("iyz", Inertia),
];
/// Units and their SI values. Those of inertias have a letter more than they seem: what is no letter, digit or degree is left out.
const UNITS: [(Quantity, &str, f64); 10] = [
    (Angle, "rad", 1.0),
    (Angle, "deg", PI / 180.0),
    (Angle, "°", PI / 180.0),
    (Length, "m", 1.0),
    (Length, "cm", 1e-2),
    (Length, "mm", 1e-3),
    (Mass, "kg", 1.0),
    (Inertia, "kgm2", 1.0),
    (Inertia, "kgmm2", 1e-6),
    (Inertia, "kgcm2", 1e-4),
];
/// A column's name, and the SI value of its unit.
#[derive(Clone, Copy)]
pub(super) struct Column {
    pub(super) name: &'static str,
    pub(super) quantity: Quantity,
    /// Quantity of its unit, if it has one.
    pub(super) unit: Option<Quantity>,
    pub(super) scale: f64,
}

impl Column {
    /// The column of a heading such as `alpha [deg]` or `a_mm`.
    pub(super) fn new(heading: &str) -> Result<Self, String> {
        let heading = heading.trim().trim_start_matches('\u{feff}');
        let end = heading.find(|own: char| !own.is_alphanumeric()).unwrap_or(heading.len());
        let (name, unit) = heading.split_at(end);
        let name = match name.to_lowercase().as_str() {
            "θ" => "theta".to_owned(),
            "α" => "alpha".to_owned(),
            "name" | "link" | "i" => "joint".to_owned(),
            "kind" => "type".to_owned(),
            own => own.to_owned(),
        };
        let Some(&(name, quantity)) = COLUMNS.iter().find(|(own, _)| *own == name) else {
            let known: Vec<&str> = COLUMNS.iter().map(|(own, _)| *own).collect();
            return Err(format!("column {heading:?} is none of {}", known.join(", ")));
        };
        let unit: String = unit
            .replace('²', "2")
            .chars()
            .filter(|own| own.is_alphanumeric() || *own == '°')
            .collect();
        if unit.is_empty() || quantity == Word {
            return Ok(Self { name, quantity, unit: None, scale: 1.0 });
        }
        let fits =
            |own: Quantity| own == quantity || quantity == Stroke && matches!(own, Angle | Length);
        let mut units = UNITS.iter().filter(|(own, ..)| fits(*own));
        let known: Vec<&str> = units.clone().map(|(_, own, _)| *own).collect();
        match units.find(|(_, own, _)| *own == unit) {
            Some(&(own, _, scale)) => Ok(Self { name, quantity, unit: Some(own), scale }),
            None => Err(format!(
                "column {heading:?} has the unit {unit}: must be one of {}",
                known.join(", ")
            )),
        }
    }
}
