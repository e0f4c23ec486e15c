//! Names of the columns of a table, and their places in it.

use flexid_core::chain::Chain;

use super::rates::{DIFFERS, two_rates};
use crate::units::{self, ACCELERATION, ANGLE, FORCE, Quantity, STROKE, TIME};

/// Names of a column of time, in small letters: those of flexid, LabVIEW, asammdf, and the recorders of robots.
const TIMES: [&str; 5] = ["time", "t", "timestamp", "timestamps", "x_value"];
/// Names with which the lines before the columns give the units of these, and the sampling period, s: those of LabVIEW.
pub(super) const UNITS: &[u8] = b"Y_Unit_Label";
pub(super) const PERIOD: &[u8] = b"Delta_X";
/// Likeness above which a name is suggested for another. Chosen: two letters of five may be wrong.
const ALIKE: f64 = 0.55;
/// Most names that an error lists.
const LISTED: usize = 20;

/// Names of the columns of tables.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Columns of force x, y, z and acceleration x, y, z. An axis that is not measured has an empty name.
    pub axes: [String; 6],
    /// Columns of the joints, base first, and whether each slides. Empty if the angles stand elsewhere.
    pub joints: Vec<(String, bool)>,
    /// Sampling rate that the config states, Hz.
    pub rate_hz: Option<f64>,
    /// Chain from the base to the TCP, if the force is along the axes of the base.
    pub base: Option<Chain>,
    /// Topics of bags. `None` if the config names none.
    pub topics: Option<Topics>,
}

/// Topics of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topics {
    /// Topic of the force: WrenchStamped, Wrench, Vector3Stamped or Vector3.
    pub wrench: String,
    /// Topic of the acceleration: Imu, AccelStamped, AccelWithCovarianceStamped, Accel, AccelWithCovariance, Vector3Stamped or Vector3.
    pub acceleration: String,
    /// Topic of the joint angles: JointState. `None` if they stand elsewhere.
    pub joints: Option<String>,
}

/// A column that is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Column {
    /// Place in a line.
    pub(super) cell: usize,
    /// Size of its unit in SI units.
    pub(super) scale: f64,
}

/// Columns of a table.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    pub(super) time: Option<Column>,
    /// Force x, y, z, acceleration x, y, z. `None` for an axis that is not measured.
    pub(super) axes: [Option<Column>; 6],
    pub(super) joints: Vec<Column>,
    /// Sampling period that the lines before the columns state, s.
    pub(super) period_s: Option<f64>,
    /// True if a line of units follows that of the names.
    pub(super) has_units: bool,
    /// Number of cells of the line of names.
    pub(super) cells: usize,
}

/// A line of names, before its units are known.
pub(super) struct Names {
    /// Place of time, axes and joints in the line.
    time: Option<usize>,
    axes: [Option<usize>; 6],
    joints: Vec<usize>,
    /// The cells of the line.
    cells: Vec<String>,
}

impl Layout {
    /// Returns the names of the columns that a table needs. A channel whose direction is stated elsewhere is that of three axes.
    pub(super) fn needed(&self) -> impl Iterator<Item = &str> {
        let is_new = |(axis, name): &(usize, &String)| {
            !name.is_empty() && !self.axes[..*axis].contains(name)
        };
        let axes = self.axes.iter().enumerate().filter(is_new).map(|(_, name)| name);
        axes.chain(self.joints.iter().map(|(name, _)| name)).map(String::as_str)
    }

    /// Returns the places of the names in the cells of a line, or `None` if one is missing.
    ///
    /// # Errors
    /// A name is there twice.
    pub(super) fn find(&self, cells: Vec<String>) -> Result<Option<Names>, String> {
        let mut places = Vec::new();
        for name in self.needed() {
            let mut all: Vec<usize> =
                (0..cells.len()).filter(|place| is_named(&cells[*place], name)).collect();
            if all.len() > 1 {
                // `Fx` stands beside `Fx (filtered)`.
                let is_unit = |cell: &String| {
                    units::in_brackets(cell).is_none_or(|(_, unit)| units::is_unit(unit))
                };
                all.retain(|place| cells[*place] == name || is_unit(&cells[*place]));
            }
            let place = match all[..] {
                [] => return Ok(None),
                [place] => place,
                _ => {
                    return Err(format!(
                        "column {name:?} is there twice: give each column a name of its own"
                    ));
                }
            };
            places.push(place);
        }
        // A column that has a meaning is no time. LabVIEW may repeat the time before each channel.
        let named = cells.iter().position(|cell| self.is_time(cell));
        let time = named.or_else(|| alone_in_seconds(&cells));
        let time = time.filter(|place| !places.contains(place));
        let joints = places.split_off(places.len() - self.joints.len());
        let place = |name: &String| self.needed().position(|own| own == name);
        let axes = self.axes.each_ref().map(|name| place(name).map(|own| places[own]));
        Ok(Some(Names { time, axes, joints, cells }))
    }

    /// Returns whether a column of this name is the time.
    pub(super) fn is_time(&self, cell: &str) -> bool {
        let own = units::in_brackets(cell).map_or(cell, |(name, _)| name);
        // A temperature is no time.
        own != "T" && TIMES.contains(&&*own.to_lowercase())
    }

    /// Returns whether a column of this name, of a group or of none, is read.
    pub(super) fn wants(&self, group: &str, cell: &str) -> bool {
        let whole = format!("{group}/{cell}");
        self.is_time(cell)
            || self.needed().any(|name| is_named(cell, name) || is_named(&whole, name))
    }

    /// Returns how many of the names stand in the cells of a line.
    pub(super) fn matches(&self, cells: &[String]) -> usize {
        self.needed().filter(|name| cells.iter().any(|cell| is_named(cell, name))).count()
    }

    /// Says which names a line lacks, what it has, and which of these are near.
    pub(super) fn lacks(&self, cells: &[String]) -> String {
        let cells: Vec<&String> = cells.iter().filter(|cell| !cell.is_empty()).collect();
        let lacking: Vec<&str> =
            self.needed().filter(|name| !cells.iter().any(|cell| is_named(cell, name))).collect();
        let free = || cells.iter().filter(|cell| !self.needed().any(|name| is_named(cell, name)));
        let near: Vec<String> = lacking
            .iter()
            .filter_map(|name| {
                let like = |cell: &String| {
                    let bare = units::in_brackets(cell).map_or(&**cell, |(own, _)| own);
                    strsim::normalized_damerau_levenshtein(
                        &bare.to_lowercase(),
                        &name.to_lowercase(),
                    )
                };
                let best = free().max_by(|one, other| like(one).total_cmp(&like(other)))?;
                (like(best) > ALIKE).then(|| format!("{best:?} for {name:?}"))
            })
            .collect();
        let quoted = |names: &[&str]| {
            let shown: Vec<String> =
                names.iter().take(LISTED).map(|name| format!("{name:?}")).collect();
            let more = names.len().saturating_sub(LISTED);
            let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
            shown.join(", ") + &rest
        };
        let has: Vec<&str> = cells.iter().map(|cell| cell.as_str()).collect();
        let meant =
            if near.is_empty() { String::new() } else { format!(" (is it {}?)", near.join(", ")) };
        format!(
            "has no column {}: it has {}{meant}: write the names of its columns in [signals], or name another table",
            quoted(&lacking),
            quoted(&has)
        )
    }
}

impl Columns {
    /// Returns the columns that are read.
    pub(super) fn all(&self) -> impl Iterator<Item = &Column> {
        self.time.iter().chain(self.axes.iter().flatten()).chain(&self.joints)
    }
}

impl Names {
    /// Returns the columns, given the lines `before` the names and the line that `follows` them. A unit stands in brackets behind the name, below
    /// it, or in LabVIEW's line of units. Without any, it is that of SI.
    ///
    /// # Errors
    /// A unit is none of its quantity.
    pub(super) fn columns(
        &self,
        layout: &Layout,
        before: &[Vec<String>],
        follows: &[String],
    ) -> Result<Columns, String> {
        let quantity = |place: usize| self.quantity(layout, place);
        let below = |place: usize| bare(follows.get(place).map_or("", String::as_str));
        let is_unit = |place: usize| {
            let below = below(place);
            below.is_empty() || quantity(place).size(&below).is_some()
        };
        let any = self.places().any(|place| follows.get(place).is_some_and(|own| !own.is_empty()));
        let has_units = any && self.places().all(is_unit);
        let stated = before.iter().rev().find(|line| is_labels(line));
        let column = |place: usize| {
            let (name, known) = (&self.cells[place], quantity(place));
            // The first cell of that line names it.
            let above = || {
                let unit = stated.and_then(|line| line.get(place)).filter(|_| place > 0);
                unit.cloned().filter(|unit| !unit.is_empty())
            };
            let below = || has_units.then(|| below(place)).filter(|unit| !unit.is_empty());
            let is_whole =
                layout.needed().any(|own| own == name || unit_beside(name, own).is_some());
            // Of a name that the config states with what stands in brackets, that may be no unit.
            let behind = units::in_brackets(name)
                .filter(|(_, unit)| !is_whole || known.size(unit).is_some())
                .map(|(_, unit)| unit.to_owned());
            let beside = layout.needed().find_map(|own| unit_beside(name, own)).map(str::to_owned);
            let stated = [behind, beside, below(), above()];
            let mut scales = stated.into_iter().flatten().map(|unit| {
                known.size(&unit).ok_or_else(|| {
                    let (what, units) = (known.name, known.known());
                    format!("column {name:?} has unit {unit:?}: {what} must be in one of {units}")
                })
            });
            let first = scales.next().transpose()?;
            for other in scales {
                if Some(other?) != first {
                    return Err(format!("column {name:?} has two units: leave one out"));
                }
            }
            Ok::<_, String>((place, first))
        };
        let mut axes = [None; 6];
        for triple in 0..2 {
            let of_axis = |axis: usize| self.axes[3 * triple + axis].map(column).transpose();
            let stated = [of_axis(0)?, of_axis(1)?, of_axis(2)?];
            let named = || stated.iter().flatten();
            if let Some((without, _)) = named().find(|(_, scale)| scale.is_none())
                && named().any(|(_, scale)| scale.is_some())
            {
                let name = &self.cells[*without];
                return Err(format!(
                    "column {name:?} has no unit, and another axis has: give each of the three its unit"
                ));
            }
            for (axis, own) in stated.into_iter().enumerate() {
                axes[3 * triple + axis] = own.map(in_si);
            }
        }
        let column = |place: usize| column(place).map(in_si);
        Ok(Columns {
            time: self.time.map(column).transpose()?,
            axes,
            joints: self.joints.iter().map(|place| column(*place)).collect::<Result<_, _>>()?,
            period_s: self.period_s(before)?,
            has_units,
            cells: self.cells.len(),
        })
    }

    /// Returns the sampling period that the lines before the names state, s.
    ///
    /// # Errors
    /// It is another one for another column.
    fn period_s(&self, before: &[Vec<String>]) -> Result<Option<f64>, String> {
        let stated = before.iter().rev().map(|line| period_s(line, self.places()));
        stated.filter_map(Result::transpose).next().transpose()
    }

    /// Returns the places of the columns that are read.
    pub(super) fn places(&self) -> impl Iterator<Item = usize> + '_ {
        self.time
            .into_iter()
            .chain(self.axes.into_iter().flatten())
            .chain(self.joints.iter().copied())
    }

    fn quantity(&self, layout: &Layout, place: usize) -> &'static Quantity {
        let joint = self.joints.iter().position(|own| *own == place);
        match (joint, self.axes.iter().position(|own| *own == Some(place))) {
            (Some(joint), _) if layout.joints.get(joint).is_some_and(|(_, slides)| *slides) => {
                &STROKE
            }
            (Some(_), _) => &ANGLE,
            (None, Some(0..3)) => &FORCE,
            (None, Some(_)) => &ACCELERATION,
            (None, None) => &TIME,
        }
    }
}

/// Returns the sampling period that a line states for the columns at these places, s. A channel that is not read may have another one; one value alone
/// is that of all columns.
///
/// # Errors
/// It is another one for another column.
pub(super) fn period_s(
    line: &[String],
    places: impl Iterator<Item = usize>,
) -> Result<Option<f64>, String> {
    let Some((_, rest)) = line.split_first().filter(|(first, _)| first.as_bytes() == PERIOD) else {
        return Ok(None);
    };
    let mut of_columns = places.filter_map(|place| seconds(line.get(place)?));
    let Some(own) = of_columns.next() else {
        let mut all = rest.iter().filter(|cell| !cell.is_empty());
        let alone = all.next().filter(|_| all.next().is_none());
        return Ok(alone.and_then(|cell| seconds(cell)));
    };
    match of_columns.find(|other| (other / own - 1.0).abs() > DIFFERS) {
        Some(other) => Err(two_rates(1.0 / own, 1.0 / other)),
        None => Ok(Some(own)),
    }
}

/// Returns the place of the only column with a unit of time in brackets, whatever its name: `Zeit [s]`.
fn alone_in_seconds(cells: &[String]) -> Option<usize> {
    let is_of_time =
        |cell: &String| units::in_brackets(cell).is_some_and(|(_, unit)| TIME.size(unit).is_some());
    let mut all = (0..cells.len()).filter(|place| is_of_time(&cells[*place]));
    all.next().filter(|_| all.next().is_none())
}

/// Returns the period in a cell, s.
fn seconds(cell: &str) -> Option<f64> {
    let period_s: f64 = cell.replacen(',', ".", 1).parse().ok()?;
    (period_s > 0.0 && period_s.is_finite()).then_some(period_s)
}

/// Returns whether a line has the units of the columns, as LabVIEW writes them.
pub(super) fn is_labels(line: &[String]) -> bool {
    line.first().is_some_and(|own| own.as_bytes() == UNITS)
}

/// Returns the column at a place, whose unit has this size. Without one it is that of SI.
fn in_si((cell, scale): (usize, Option<f64>)) -> Column {
    Column { cell, scale: scale.unwrap_or(1.0) }
}

/// Returns a line without the sign of a comment before it: NumPy writes names so.
pub(super) fn uncommented(line: &[u8]) -> &[u8] {
    let bare = line.trim_ascii_start();
    match bare.strip_prefix(b"#").or_else(|| bare.strip_prefix(b"%")) {
        Some(names) => names.trim_ascii_start(),
        None => line,
    }
}

/// Returns whether a cell has this name, with or without a unit behind one of them.
pub(super) fn is_named(cell: &str, name: &str) -> bool {
    cell == name
        || units::in_brackets(cell).is_some_and(|(own, _)| own == name)
        || unit_beside(cell, name).is_some()
}

/// Returns the unit behind a name of the config that a cell has without one.
fn unit_beside<'a>(cell: &str, name: &'a str) -> Option<&'a str> {
    let (own, unit) = units::in_brackets(name)?;
    (own == cell && units::is_unit(unit)).then_some(unit)
}

/// Returns a unit without brackets around it.
fn bare(unit: &str) -> String {
    unit.trim_matches(['[', ']', '(', ')']).trim().to_owned()
}
