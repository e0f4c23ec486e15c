//! A path of the tool with the forces on it, as a spreadsheet exports it: a place in each line, with the columns of
//! [static tests](crate::statics).
//!
//! | columns                  | what                                                       | unit        | left out                |
//! | ------------------------ | ---------------------------------------------------------- | ----------- | ----------------------- |
//! | `q1`, `q2`… or `q1_deg`… | commanded joint angle, or stroke, base first               | rad (m), deg | a mistake              |
//! | `fx`, `fy`, `fz`         | force on the tool, along its axes                          | N           | a mistake: write 0      |
//! | `mx`, `my`, `mz`         | torque on it about the tool centre point, along its axes   | Nm          | 0                       |

use std::path::Path;

use csv::StringRecord;

use crate::columns::{self, Angle, LOAD};
use crate::input::{self, BadInput};
use crate::model::Model;

/// Columns of the force, which a path must have.
const FORCES: usize = 3;

/// A place of a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Line in the file, from 1.
    pub line: usize,
    /// Joint angles, one per driven joint, rad (m).
    pub pose: Vec<f64>,
    /// Force, N, and torque, Nm, on the tool along its axes.
    pub wrench: [f64; 6],
}

/// Places of the columns in a line.
struct Table<'a> {
    cells: usize,
    joints: Vec<Angle<'a>>,
    load: [Option<usize>; 6],
}

/// Reads the path of a robot.
///
/// # Errors
/// The error is one line that names the file, the line, the column and the correction.
pub fn load(file: &Path, model: &Model) -> Result<Vec<Place>, BadInput> {
    parse(file, &input::read(file)?, model)
}

/// Parses `text`, the content of the file `file` of a path.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(file: &Path, text: &str, model: &Model) -> Result<Vec<Place>, BadInput> {
    places(file, text, model, FORCES)
}

/// Reads the poses of a robot: a path, whose forces may be left out. Joint angles, one per driven joint, rad (m).
///
/// # Errors
/// The errors are those of [`load`].
pub fn poses(file: &Path, model: &Model) -> Result<Vec<Vec<f64>>, BadInput> {
    let places = places(file, &input::read(file)?, model, 0)?;
    Ok(places.into_iter().map(|place| place.pose).collect())
}

/// Reads places, of whose load the first columns must be there.
fn places(file: &Path, text: &str, model: &Model, forces: usize) -> Result<Vec<Place>, BadInput> {
    let mut places = Vec::new();
    let needed = needed(model, forces);
    let header = |header: &_| Table::new(header, model, &needed);
    columns::read(file, text, header, |table, line, number| {
        places.push(table.place(line, number)?);
        Ok(())
    })?;
    if places.is_empty() {
        let needed = needed.join(",");
        return Err(BadInput::new(
            file,
            format!("has no place: the first line is {needed}, each other a place"),
        ));
    }
    Ok(places)
}

/// Returns the names of the columns that a file needs, with so many of the load.
fn needed(model: &Model, forces: usize) -> Vec<String> {
    let forces = LOAD.iter().take(forces).map(|(name, _)| (*name).to_owned());
    columns::angle_names(model).chain(forces).collect()
}

impl<'a> Table<'a> {
    fn new(header: &StringRecord, model: &'a Model, needed: &[String]) -> Result<Self, String> {
        let load = LOAD.iter().map(|(name, _)| (*name).to_owned());
        let known: Vec<String> =
            columns::angle_names(model).chain(load).chain(columns::degree_names(model)).collect();
        columns::check_names(header, &known, needed)?;
        let find = |name: &str| columns::find(header, name);
        let place = |name: &str| {
            let missing = || format!("column {name} is missing: name {}", needed.join(","));
            find(name).ok_or_else(missing)
        };
        for (name, _) in LOAD.iter().filter(|(name, _)| needed.iter().any(|own| own == name)) {
            place(name)?;
        }
        let joints = model.driven().zip(1..);
        let joints = joints.map(|(joint, number)| Angle::new(joint, number, find, place));
        Ok(Self {
            cells: header.len(),
            joints: joints.collect::<Result<_, _>>()?,
            load: LOAD.map(|(name, _)| find(name)),
        })
    }

    fn place(&self, line: &StringRecord, number: usize) -> Result<Place, String> {
        columns::check_cells(line, self.cells)?;
        let pose = self.joints.iter().map(|joint| joint.angle(line)).collect::<Result<_, _>>()?;
        let mut wrench = [0.0; 6];
        for ((value, cell), (name, unit)) in wrench.iter_mut().zip(self.load).zip(LOAD) {
            if let Some(cell) = cell {
                *value = columns::load(&line[cell], name, unit)?;
            }
        }
        Ok(Place { line: number, pose, wrench })
    }
}
