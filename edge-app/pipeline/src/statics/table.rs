//! The columns of a file of static tests, and a line of it as a test.

use std::ops::RangeInclusive;

use csv::StringRecord;
use flexid_core::chain::Chain;
use flexid_core::statics::{DIAL_GAUGE, Gauge, RESOLVED, Reading, StaticTest};
use nalgebra::Vector3;

use crate::model::{Kind, Model, ModelJoint};

/// Columns of the load, each with its unit.
const LOAD: [(&str, &str); 6] =
    [("fx", "N"), ("fy", "N"), ("fz", "N"), ("mx", "Nm"), ("my", "Nm"), ("mz", "Nm")];
/// Displacements along the axes of the TCP, then along those of the base.
const DISPLACEMENT: [[&str; 3]; 2] = [["dx", "dy", "dz"], ["dx_base", "dy_base", "dz_base"]];
/// Standard deviations of the displacements.
const DEVIATION: [&str; 3] = ["sx", "sy", "sz"];
/// Point of the load.
const LOAD_POINT: [&str; 3] = ["px", "py", "pz"];
/// Point of the gauge.
const GAUGE_POINT: [&str; 3] = ["gx", "gy", "gz"];

/// Largest displacement that is accepted, m. No robot that keeps its shape gives way by more.
const LARGEST_DISPLACEMENT_M: f64 = 0.1;
/// Standard deviations of displacements that are accepted, m. A less precise one gives no information.
const DEVIATIONS_M: RangeInclusive<f64> = RESOLVED..=LARGEST_DISPLACEMENT_M;
/// Largest load that is accepted, N or Nm. No robot bears more.
const LARGEST_LOAD: f64 = 1e6;
/// Largest distance of a point from the TCP along each axis, m. No robot holds a longer tool.
const LARGEST_DISTANCE_M: f64 = 5.0;

/// Returns the names of the columns that a file needs, and of the standard deviations.
pub(super) fn needed(model: &Model) -> Vec<String> {
    let joints = (1..=model.driven().count()).map(|joint| format!("q{joint}"));
    let others = LOAD.iter().map(|(name, _)| *name).chain(DISPLACEMENT[0]).chain(DEVIATION);
    joints.chain(others.map(str::to_string)).collect()
}

/// Returns the names of all columns.
fn known(model: &Model) -> Vec<String> {
    let degrees = model.driven().enumerate().filter(|(_, joint)| joint.kind == Kind::Revolute);
    let degrees = degrees.map(|(joint, _)| format!("q{}_deg", joint + 1));
    let others = LOAD_POINT.into_iter().chain(GAUGE_POINT).chain(DISPLACEMENT[1]);
    needed(model).into_iter().chain(degrees).chain(others.map(str::to_string)).collect()
}

/// Places of the columns in a line.
pub(super) struct Table<'a> {
    cells: usize,
    joints: Vec<Angle<'a>>,
    load: [usize; 6],
    load_point: [Option<usize>; 3],
    displacement: [usize; 3],
    /// Names of the displacements.
    names: [&'static str; 3],
    /// Chain from the base to the TCP, if the displacements are along the axes of the base.
    to_base: Option<Chain>,
    deviation: [Option<usize>; 3],
    gauge_point: [Option<usize>; 3],
}

/// Column of a driven joint.
struct Angle<'a> {
    joint: &'a ModelJoint,
    cell: usize,
    name: String,
    unit: &'static str,
    /// The unit in rad, or m.
    scale: f64,
}

impl<'a> Table<'a> {
    /// Makes the table from the line that names the columns.
    pub(super) fn new(header: &StringRecord, model: &'a Model) -> Result<Self, String> {
        let known = known(model);
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
        let find = |name: &str| header.iter().position(|own| own == name);
        let place = |name: &str| {
            let missing = || format!("column {name} is missing: name {}", needed(model).join(","));
            find(name).ok_or_else(missing)
        };
        let mut load = [0; 6];
        for (column, (name, _)) in load.iter_mut().zip(LOAD) {
            *column = place(name)?;
        }
        let of_base = DISPLACEMENT[1].iter().find(|name| find(name).is_some());
        let of_tcp = DISPLACEMENT[0].iter().find(|name| find(name).is_some());
        if let (Some(base), Some(tcp)) = (of_base, of_tcp) {
            return Err(format!(
                "columns {tcp} and {base} are along other axes: take those of the TCP or those of the base"
            ));
        }
        let axes = usize::from(of_base.is_some());
        let mut displacement = [0; 3];
        for (column, name) in displacement.iter_mut().zip(DISPLACEMENT[axes]) {
            *column = place(name)?;
        }
        let chain =
            of_base.map(|_| model.chain()).transpose().map_err(|error| error.to_string())?;
        let joints = model.driven().zip(1..);
        let joints = joints.map(|(joint, number)| Angle::new(joint, number, find, place));
        Ok(Self {
            cells: header.len(),
            joints: joints.collect::<Result<_, _>>()?,
            load,
            load_point: LOAD_POINT.map(find),
            displacement,
            names: DISPLACEMENT[axes],
            to_base: chain,
            deviation: DEVIATION.map(find),
            gauge_point: GAUGE_POINT.map(find),
        })
    }

    /// Returns the test that a line describes.
    pub(super) fn test(&self, line: &StringRecord) -> Result<StaticTest, String> {
        if line.len() != self.cells {
            let (own, cells) = (line.len(), self.cells);
            return Err(format!("has {own} cells, the first line {cells}: write as many"));
        }
        let pose = self.joints.iter().map(|joint| joint.angle(line));
        let pose = pose.collect::<Result<heapless::Vec<_, _>, _>>()?;
        let wrench = self.wrench(line)?;
        let mut displacement = [None; 3];
        for (axis, reading) in displacement.iter_mut().enumerate() {
            *reading = self.reading(line, axis)?;
        }
        if displacement == [None; 3] {
            let names = self.names.join(",");
            return Err(format!("has no displacement: fill one of {names}"));
        }
        let place = point(line, &self.gauge_point, &GAUGE_POINT)?;
        let mut gauge = Gauge { place, ..Gauge::default() };
        if let Some(chain) = &self.to_base {
            gauge = gauge.along_base(chain, &pose);
        }
        Ok(StaticTest { pose, wrench, gauge, displacement })
    }

    /// Returns force and torque about the TCP. A force f at the point p has the torque `p × f`.
    fn wrench(&self, line: &StringRecord) -> Result<[f64; 6], String> {
        let mut wrench = [0.0; 6];
        for ((value, cell), (name, unit)) in wrench.iter_mut().zip(self.load).zip(LOAD) {
            *value = number(&line[cell], name, unit)?
                .ok_or_else(|| format!("column {name} is empty: write 0 where there is no load"))?;
            at_most(name, *value, LARGEST_LOAD, unit)?;
        }
        if wrench == [0.0; 6] {
            return Err("has no load: one of fx,fy,fz,mx,my,mz must not be 0".to_string());
        }
        let arm = Vector3::from(point(line, &self.load_point, &LOAD_POINT)?);
        let [fx, fy, fz, torque @ ..] = wrench;
        let torque = Vector3::from(torque) + arm.cross(&Vector3::new(fx, fy, fz));
        Ok([fx, fy, fz, torque.x, torque.y, torque.z])
    }

    /// Returns a displacement and its deviation, or `None` if it was not measured.
    fn reading(&self, line: &StringRecord, axis: usize) -> Result<Option<Reading>, String> {
        let name = self.names[axis];
        let Some(value) = number(&line[self.displacement[axis]], name, "m")? else {
            return Ok(None);
        };
        if value.abs() > LARGEST_DISPLACEMENT_M {
            return Err(format!(
                "column {name} is {value}: must be at most {LARGEST_DISPLACEMENT_M} (in m)"
            ));
        }
        let deviation = match self.deviation[axis] {
            Some(cell) => number(&line[cell], DEVIATION[axis], "m")?,
            None => None,
        };
        let Some(deviation) = deviation else {
            return Ok(Some(Reading { value, deviation: DIAL_GAUGE, is_stated: false }));
        };
        if !DEVIATIONS_M.contains(&deviation) {
            let (least, most) = DEVIATIONS_M.into_inner();
            return Err(format!(
                "column {} is {deviation:e}: must lie between {least:e} and {most} (in m)",
                DEVIATION[axis]
            ));
        }
        Ok(Some(Reading::stated(value, deviation)))
    }
}

impl<'a> Angle<'a> {
    /// Finds the column of the driven joint of this number, from 1, by `find`, or refuses by `place`.
    fn new(
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
    fn angle(&self, line: &StringRecord) -> Result<f64, String> {
        let Self { joint, cell, name, unit, scale } = self;
        let angle = number(&line[*cell], name, unit)?
            .ok_or_else(|| format!("column {name} is empty: must be a number (in {unit})"))?;
        let [lower, upper] = joint.limits.map(|limit| limit / scale);
        if !(lower..=upper).contains(&angle) {
            let [lower, upper] = match *unit {
                "deg" => [format!("{lower:.1}"), format!("{upper:.1}")],
                _ => [lower.to_string(), upper.to_string()],
            };
            return Err(format!(
                "column {name} is {angle}: joint {:?} moves in [{lower}, {upper}] {unit}",
                joint.name
            ));
        }
        Ok(angle * scale)
    }
}

/// Returns a point from the TCP, m. What is empty or left out is 0.
fn point(
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
fn at_most(column: &str, value: f64, most: f64, unit: &str) -> Result<(), String> {
    if value.abs() <= most {
        return Ok(());
    }
    Err(format!("column {column} is {value:e}: must be at most {most:e} (in {unit})"))
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
