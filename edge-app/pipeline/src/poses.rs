//! Joint angles of tables that do not hold them, as people note them: a table in each line.
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
//!
//! A table of several cuts at different poses has a line for each cut, in their order.

use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};

use csv::StringRecord;

use crate::columns::{self, Angle};
use crate::input::{self, BadInput};
use crate::model::Model;

/// Column of the names of the tables.
const FILE: &str = "file";
/// Endings of packed files, which a line may leave out.
const PACKED: [&str; 2] = ["gz", "zst"];

/// The poses of tables.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Poses(Vec<(String, Vec<f64>)>);

impl Poses {
    /// Returns the poses of a table, one per cut, rad (m). A line names it by its name and the folders before it, as many as need be: of two lines the
    /// longer one counts.
    pub fn of(&self, table: &Path) -> Vec<Vec<f64>> {
        let is_packed =
            table.extension().and_then(OsStr::to_str).is_some_and(|own| PACKED.contains(&own));
        let unpacked = if is_packed { table.with_extension("") } else { table.to_owned() };
        let length = |name: &str| {
            let line: PathBuf =
                Path::new(name).components().filter(|own| *own != Component::CurDir).collect();
            let is_own = table.ends_with(&line) || unpacked.ends_with(&line);
            is_own.then(|| line.components().count())
        };
        let longest = self.0.iter().filter_map(|(name, _)| length(name)).max();
        let own = self.0.iter().filter(|(name, _)| longest.is_some() && length(name) == longest);
        own.map(|(_, pose)| pose.clone()).collect()
    }

    /// Returns the names of the tables.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(name, _)| name.as_str())
    }
}

/// Places of the columns in a line.
struct Columns<'a> {
    cells: usize,
    file: usize,
    joints: Vec<Angle<'a>>,
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
    let mut poses = Vec::new();
    let names = || columns::angle_names(model);
    let needed: Vec<String> = std::iter::once(FILE.to_owned()).chain(names()).collect();
    let known: Vec<String> = needed.iter().cloned().chain(columns::degree_names(model)).collect();
    let header = |header: &StringRecord| {
        columns::check_names(header, &known, &needed)?;
        let find = |name: &str| columns::find(header, name);
        let place = |name: &str| {
            find(name).ok_or_else(|| format!("column {name} is missing: name {}", needed.join(",")))
        };
        let joints = model.driven().zip(1..);
        let joints = joints.map(|(joint, number)| Angle::new(joint, number, find, place));
        let joints = joints.collect::<Result<_, _>>()?;
        Ok(Columns { cells: header.len(), file: place(FILE)?, joints })
    };
    columns::read(file, text, header, |columns, line, _| {
        columns::check_cells(line, columns.cells)?;
        let pose =
            columns.joints.iter().map(|joint| joint.angle(line)).collect::<Result<_, _>>()?;
        match &line[columns.file] {
            "" => Err(format!("column {FILE} is empty: name the table")),
            name => {
                poses.push((name.to_owned(), pose));
                Ok(())
            }
        }
    })?;
    if poses.is_empty() {
        let needed = needed.join(",");
        let mend = format!("the first line is {needed}, each other the pose of a table");
        return Err(BadInput::new(file, format!("has no pose: {mend}")));
    }
    Ok(Poses(poses))
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
                .map(|pose| pose[0].to_degrees().round())
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
            ("file,q1 [turns],q2,q3\n", "p.csv:1: unknown column \"q1 [turns]\": known are "),
            (
                "file,q1,q2,q3\na.csv,0,-60,0\n",
                "p.csv:2: column q2 is -60: joint \"joint_2\" moves in ",
            ),
        ] {
            assert!(refused(text).starts_with(expected), "{}", refused(text));
        }
    }
}
