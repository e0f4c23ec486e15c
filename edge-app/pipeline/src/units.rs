//! Units of the field: those in which DBC files and tables give forces, accelerations, angles, strokes and times.

use std::f64::consts::PI;

/// Acceleration of a fall, m/s².
const G: f64 = 9.80665;
/// Weight of a pound, N.
const LBF: f64 = 0.453_592_37 * G;
/// An inch, m.
const INCH: f64 = 0.0254;

/// Quantity that is measured: its name for users, and the known units with their size in SI units.
#[derive(Debug)]
pub(crate) struct Quantity {
    pub(crate) name: &'static str,
    units: &'static [(&'static str, f64)],
}

pub(crate) const FORCE: Quantity = Quantity {
    name: "force",
    units: &[
        ("N", 1.0),
        ("kN", 1e3),
        ("mN", 1e-3),
        ("lbf", LBF),
        ("daN", 10.0),
        ("kgf", G),
        ("kp", G),
        // As LabVIEW calls it.
        ("Newtons", 1.0),
    ],
};
pub(crate) const ACCELERATION: Quantity = Quantity {
    name: "acceleration",
    units: &[
        ("m/s^2", 1.0),
        ("m/s²", 1.0),
        ("m/s2", 1.0),
        ("mm/s^2", 1e-3),
        ("mm/s²", 1e-3),
        ("mm/s2", 1e-3),
        ("m/s/s", 1.0),
        ("g", G),
        ("G", G),
        ("mg", 1e-3 * G),
        ("mG", 1e-3 * G),
        ("gn", G),
        ("µg", 1e-6 * G),
        ("ug", 1e-6 * G),
    ],
};
pub(crate) const ANGLE: Quantity = Quantity {
    name: "angle",
    units: &[("rad", 1.0), ("mrad", 1e-3), ("deg", PI / 180.0), ("°", PI / 180.0)],
};
pub(crate) const STROKE: Quantity = Quantity { name: "stroke", units: &[("m", 1.0), ("mm", 1e-3)] };
pub(crate) const DISPLACEMENT: Quantity = Quantity {
    name: "displacement",
    units: &[("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6), ("in", INCH)],
};
pub(crate) const VELOCITY: Quantity = Quantity {
    name: "velocity",
    units: &[("m/s", 1.0), ("mm/s", 1e-3), ("um/s", 1e-6), ("µm/s", 1e-6), ("in/s", INCH)],
};
pub(crate) const TIME: Quantity =
    Quantity { name: "time", units: &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6)] };

impl Quantity {
    /// Returns the size of a unit in SI units, or `None` if it is no unit of the quantity.
    pub(crate) fn size(&self, unit: &str) -> Option<f64> {
        // There are two letters for micro.
        let unit = unit.trim().replace('\u{3BC}', "\u{B5}");
        let known = self.units.iter().find(|(name, _)| *name == unit);
        known.map(|(_, size)| *size)
    }

    /// Returns the known units, for users.
    pub(crate) fn known(&self) -> String {
        let names: Vec<&str> = self.units.iter().map(|(name, _)| *name).collect();
        names.join(", ")
    }
}

/// Returns whether this is a unit of a quantity that a sensor or a joint has.
pub(crate) fn is_unit(unit: &str) -> bool {
    [FORCE, ACCELERATION, ANGLE, STROKE].iter().any(|quantity| quantity.size(unit).is_some())
}

/// Splits the name of a column that ends in a unit in brackets, `Fx [N]` or `az (g)`, into name and unit.
pub(crate) fn in_brackets(column: &str) -> Option<(&str, &str)> {
    let open = match column.chars().last()? {
        ']' => '[',
        ')' => '(',
        _ => return None,
    };
    let (name, unit) = column.rsplit_once(open)?;
    Some((name.trim_end(), unit[..unit.len() - 1].trim()))
}
