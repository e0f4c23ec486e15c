//! The columns of a file of static tests, and a line of it as a test.

use std::ops::RangeInclusive;

use csv::StringRecord;
use flexid_core::chain::Chain;
use flexid_core::statics::{DIAL_GAUGE, Gauge, RESOLVED, Reading, StaticTest};
use nalgebra::Vector3;

use crate::columns::{self, Angle, LOAD, LOAD_POINT, number, point};
use crate::model::Model;

/// Displacements along the axes of the TCP, then along those of the base.
const DISPLACEMENT: [[&str; 3]; 2] = [["dx", "dy", "dz"], ["dx_base", "dy_base", "dz_base"]];
/// Standard deviations of the displacements.
const DEVIATION: [&str; 3] = ["sx", "sy", "sz"];
/// Point of the gauge.
const GAUGE_POINT: [&str; 3] = ["gx", "gy", "gz"];

/// Largest displacement that is accepted, m. No robot that keeps its shape gives way by more.
const LARGEST_DISPLACEMENT_M: f64 = 0.1;
/// Standard deviations of displacements that are accepted, m. A less precise one gives no information.
const DEVIATIONS_M: RangeInclusive<f64> = RESOLVED..=LARGEST_DISPLACEMENT_M;

/// Returns the names of the columns that a file needs, and of the standard deviations.
pub(super) fn needed(model: &Model) -> Vec<String> {
    let others = LOAD.iter().map(|(name, _)| *name).chain(DISPLACEMENT[0]).chain(DEVIATION);
    columns::angle_names(model).chain(others.map(str::to_string)).collect()
}

/// Returns the names of all columns.
fn known(model: &Model) -> Vec<String> {
    let others = LOAD_POINT.into_iter().chain(GAUGE_POINT).chain(DISPLACEMENT[1]);
    needed(model)
        .into_iter()
        .chain(columns::degree_names(model))
        .chain(others.map(str::to_string))
        .collect()
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

impl<'a> Table<'a> {
    /// Makes the table from the line that names the columns.
    pub(super) fn new(header: &StringRecord, model: &'a Model) -> Result<Self, String> {
        columns::check_names(header, &known(model), &needed(model))?;
        let find = |name: &str| columns::find(header, name);
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
        columns::check_cells(line, self.cells)?;
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
            *value = columns::load(&line[cell], name, unit)?;
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
