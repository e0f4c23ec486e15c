//! Joint angles, and points and directions of hammer blows, as people note them beside their tables: a line for each table.
//!
//! ```text
//! file,q1 [deg],q2 [deg],q3 [deg]
//! cut1.csv,0,-25.8,54.4
//! cut2.csv,30,-10,40
//! ```
//!
//! | columns                      | what                                             | unit       |
//! | ---------------------------- | ------------------------------------------------ | ---------- |
//! | `file`                       | name of the table; `-` is standard input         |            |
//! | `q1`, `q2`… from the base    | joint angles, strokes, while the table was taken | rad, m     |
//! | `q1_deg` or `q1 [deg]`…      | a joint angle in place of `q1`, `q2`…            | deg        |
//! | `force`, `acceleration`      | direction of a sensor of one channel: `x`, `-z`  |            |
//! | `px`, `py`, `pz`             | point of the force, from the TCP along its axes  | m          |
//!
//! A table of several cuts at different poses has a line for each cut, in their order.

use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

use csv::StringRecord;

use crate::columns::{self, Angle, LOAD_POINT};
use crate::input::{self, BadInput};
use crate::model::Model;

/// Column of the names of the tables.
const FILE: &str = "file";
/// Endings of packed files, which a line may leave out.
const PACKED: [&str; 2] = ["gz", "zst"];

/// Columns of the directions of sensors of one channel.
pub(crate) const DIRECTIONS: [&str; 2] = ["force", "acceleration"];

/// The poses of tables.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Poses {
    lines: Vec<(String, Cut)>,
    /// True for force and acceleration if the lines say their direction.
    pub(crate) have_directions: [bool; 2],
}

/// Pose and force of a cut, by its line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cut {
    /// Joint angles, strokes, rad (m), base first.
    pub pose: Vec<f64>,
    /// Directions of force and acceleration, where each is of one channel.
    pub directions: [Option<Direction>; 2],
    /// Point at which the force acts, from the TCP, TCP axes, m.
    pub point: [f64; 3],
}

/// A direction along an axis of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Number of the axis, from 0.
    pub axis: usize,
    /// 1, or -1 against the axis.
    pub sign: f32,
}

impl Direction {
    /// Parses `x`, `+y` or `-Z`.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let (sign, name) = match text.strip_prefix('-') {
            Some(name) => (-1.0, name),
            None => (1.0, text.strip_prefix('+').unwrap_or(text)),
        };
        let axis = ["x", "y", "z"].iter().position(|axis| name.eq_ignore_ascii_case(axis))?;
        Some(Self { axis, sign })
    }

    /// Returns the vector of a value along this direction.
    pub fn vector(self, value: f32) -> [f32; 3] {
        let mut vector = [0.0; 3];
        vector[self.axis] = self.sign * value;
        vector
    }
}

impl Poses {
    /// Returns what the lines of a table say, one per cut. A line names it by its name and the folders before it, as many as need be: of two lines the
    /// longer one counts.
    pub fn of(&self, table: &Path) -> Vec<Cut> {
        let is_packed =
            table.extension().and_then(OsStr::to_str).is_some_and(|own| PACKED.contains(&own));
        let unpacked = if is_packed { table.with_extension("") } else { table.to_owned() };
        let length = |name: &str| {
            let line: PathBuf =
                Path::new(name).components().filter(|own| *own != Component::CurDir).collect();
            let is_own = table.ends_with(&line) || unpacked.ends_with(&line);
            is_own.then(|| line.components().count())
        };
        let longest = self.lines.iter().filter_map(|(name, _)| length(name)).max();
        let own =
            self.lines.iter().filter(|(name, _)| longest.is_some() && length(name) == longest);
        own.map(|(_, cut)| cut.clone()).collect()
    }

    /// Returns the lines: the name of a table, and what it says of a cut in it.
    pub fn lines(&self) -> impl Iterator<Item = (&str, &Cut)> {
        self.lines.iter().map(|(name, cut)| (name.as_str(), cut))
    }

    /// Returns the names of the tables.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.lines.iter().map(|(name, _)| name.as_str())
    }
}

/// Places of the columns in a line.
struct Columns<'a> {
    cells: usize,
    file: usize,
    joints: Vec<Angle<'a>>,
    directions: [Option<usize>; 2],
    point: [Option<usize>; 3],
}

/// Reads the poses of tables.
///
/// # Errors
/// The error is one line that names the file, the line, the column and the correction.
pub fn load(file: &Path, model: &Model) -> Result<Poses, BadInput> {
    parse(file, &input::read_regular(file)?, model)
}

/// Parses `text`, the content of the file `file` of poses.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(file: &Path, text: &str, model: &Model) -> Result<Poses, BadInput> {
    let mut poses = Poses::default();
    let names = || columns::angle_names(model);
    let needed: Vec<String> = std::iter::once(FILE.to_owned()).chain(names()).collect();
    let known = needed.iter().cloned().chain(columns::degree_names(model));
    let others = DIRECTIONS.iter().chain(&LOAD_POINT).map(|name| (*name).to_owned());
    let known: Vec<String> = known.chain(others).collect();
    let header = |header: &StringRecord| {
        columns::check_names(header, &known, &needed)?;
        let find = |name: &str| columns::find(header, name);
        let place = |name: &str| {
            find(name).ok_or_else(|| format!("column {name} is missing: name {}", needed.join(",")))
        };
        let joints = model.driven().zip(1..);
        let joints = joints.map(|(joint, number)| Angle::new(joint, number, find, place));
        let joints = joints.collect::<Result<_, _>>()?;
        let (directions, point) = (DIRECTIONS.map(find), LOAD_POINT.map(find));
        Ok(Columns { cells: header.len(), file: place(FILE)?, joints, directions, point })
    };
    columns::read(file, text, header, |columns, line, _| {
        columns::check_cells(line, columns.cells)?;
        let pose =
            columns.joints.iter().map(|joint| joint.angle(line)).collect::<Result<_, _>>()?;
        match &line[columns.file] {
            "" => Err(format!("column {FILE} is empty: name the table")),
            name => {
                let mut directions = [None; 2];
                for (sensor, cell) in columns.directions.iter().enumerate() {
                    poses.have_directions[sensor] = cell.is_some();
                    let Some(cell) = cell else { continue };
                    directions[sensor] = Some(direction(&line[*cell], DIRECTIONS[sensor])?);
                }
                let point = columns::point(line, &columns.point, &LOAD_POINT)?;
                poses.lines.push((name.to_owned(), Cut { pose, directions, point }));
                Ok(())
            }
        }
    })?;
    if poses.lines.is_empty() {
        let needed = needed.join(",");
        let mend = format!("the first line is {needed}, each other the pose of a table");
        return Err(BadInput::new(file, format!("has no pose: {mend}")));
    }
    Ok(poses)
}

/// Reads the direction of a sensor in a cell of this column.
fn direction(cell: &str, column: &str) -> Result<Direction, String> {
    let wrong = || {
        format!("column {column} is {cell:?}: must be x, y or z, or -x, -y or -z against the axis")
    };
    Direction::parse(cell).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mill3() -> Model {
        let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
        Model::parse(Path::new("model.toml"), text).unwrap()
    }

    #[test]
    fn a_table_has_the_poses_of_its_lines() {
        let text =
            "file,q1 [deg],q2_deg,q3\ncut.csv,90,-45,0.5\nday 2/cut.csv,0,0,0\ncut.csv,45,0,1\n";
        let poses = parse(Path::new("poses.csv"), text, &mill3()).unwrap();
        let of = |name: &str| {
            poses
                .of(Path::new(name))
                .iter()
                .map(|cut| cut.pose[0].to_degrees().round())
                .collect::<Vec<_>>()
        };
        assert_eq!(of("cut.csv"), [90.0, 45.0]);
        assert_eq!(of("anywhere/cut.csv.gz"), [90.0, 45.0]);
        for path in ["day 2/cut.csv", "./day 2/cut.csv", "/data/day 2/cut.csv.gz"] {
            assert_eq!(of(path), [0.0]);
        }
        assert_eq!(of("other.csv"), [0.0; 0]);
    }

    #[test]
    fn a_line_says_where_and_along_what_a_hammer_struck() {
        let text = "file,q1,q2,q3,force,acceleration,px,pz\na.csv,0,0,0,-Z,+x,0.1,\n";
        let poses = parse(Path::new("poses.csv"), text, &mill3()).unwrap();
        let [cut] = &poses.of(Path::new("a.csv"))[..] else { panic!("one line") };
        let directions = cut.directions.map(|own| own.unwrap().vector(2.0));
        assert_eq!((directions, cut.point), ([[0.0, 0.0, -2.0], [2.0, 0.0, 0.0]], [0.1, 0.0, 0.0]));
        assert_eq!(poses.have_directions, [true; 2]);
    }

    #[test]
    fn mistakes_are_named_with_their_line_and_column() {
        let refused =
            |text: &str| parse(Path::new("p.csv"), text, &mill3()).unwrap_err().to_string();
        for (text, expected) in [
            ("file,q1,q2\n", "p.csv:1: column q3 is missing: name file,q1,q2,q3"),
            ("q1,q2,q3\n", "p.csv:1: column file is missing: name file,q1,q2,q3"),
            ("file,q1,q2,q3\n", "p.csv: has no pose: the first line is file,q1,q2,q3, each other"),
            (
                "file,q1,q2,q3\na.csv,0,0,x\n",
                "p.csv:2: column q3 is \"x\": must be a number (in rad)",
            ),
            ("file,q1,q2,q3\n,0,0,0\n", "p.csv:2: column file is empty: name the table"),
            (
                "file,q1 [turns],q2,q3\n",
                "p.csv:1: column q1 has the unit \"turns\": write it in deg, rad, m",
            ),
            ("file,q1,q2,q3,px [mm]\n", "p.csv:1: column px has the unit \"mm\": write it in m"),
            ("file,q1,q2,q3,px [N]\n", "p.csv:1: column px has the unit \"N\": write it in m"),
            (
                "file,q1,q2,q3\na.csv,0,-60,0\n",
                "p.csv:2: column q2 is -60: joint \"joint_2\" moves in ",
            ),
            (
                "file,q1,q2,q3,force\na.csv,0,0,0,w\n",
                "p.csv:2: column force is \"w\": must be x, y or z, or -x, -y or -z",
            ),
            (
                "file,q1,q2,q3,px\na.csv,0,0,0,40\n",
                "p.csv:2: column px is 4e1: must be at most 5e0 (in m from the TCP)",
            ),
        ] {
            assert!(refused(text).starts_with(expected), "{}", refused(text));
        }
    }
}
