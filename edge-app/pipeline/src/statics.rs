//! Static tests as a spreadsheet exports them: one test in each line, comma-separated. The first line names the columns.
//!
//! ```text
//! q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz
//! 0,-0.45,0.95,0,0,-981,0,0,0,,,-1.12e-4,,,5e-6
//! ```
//!
//! | columns                      | what                                                                  | unit   | left out or empty     |
//! | ---------------------------- | --------------------------------------------------------------------- | ------ | --------------------- |
//! | `q1`, `q2`… from the base    | joint angles, strokes                                                 | rad, m | a mistake             |
//! | `q1_deg`, `q2_deg`…          | a joint angle in place of `q1`, `q2`…                                 | deg    |                       |
//! | `fx`, `fy`, `fz`             | force on the TCP, or at the point of the load                         | N      | a mistake             |
//! | `mx`, `my`, `mz`             | torque about the TCP, beside that of the force                        | Nm     | a mistake             |
//! | `px`, `py`, `pz`             | point of the load, from the TCP                                       | m      | 0                     |
//! | `dx`, `dy`, `dz`             | displacement of the TCP, or at the gauge, loaded less unloaded        | m      | empty: not measured   |
//! | `dx_base`, `dy_base`, `dz_base` | the same along the axes of the base, in place of `dx`, `dy`, `dz`  | m      | empty: not measured   |
//! | `sx`, `sy`, `sz`             | standard deviation of each displacement                               | m      | by the residuals      |
//! | `gx`, `gy`, `gz`             | point of the tool that the gauge measures, from the TCP               | m      | 0                     |
//!
//! All but the joint angles are along the TCP's axes, at the pose of the line. The columns may come in any order. Empty lines and lines
//! that begin with `#` are left out.

mod table;

use std::path::Path;

use flexid_core::statics::{MAX_STATIC_TESTS, StaticTest};

use crate::columns;
use crate::input::{self, BadInput};
use crate::model::Model;
use table::Table;

/// The static tests of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StaticTests {
    /// Tests, in their order in the file.
    pub tests: Vec<StaticTest>,
    /// Line of each test in the file, from 1.
    pub lines: Vec<usize>,
}

/// Reads the static tests of a robot.
///
/// # Errors
/// The error is one line that names the file, the line, the column and the correction.
pub fn load(file: &Path, model: &Model) -> Result<StaticTests, BadInput> {
    parse(file, &input::read_regular(file)?, model)
}

/// Parses `text`, the content of the file of static tests `file`.
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(file: &Path, text: &str, model: &Model) -> Result<StaticTests, BadInput> {
    let mut all = StaticTests::default();
    let header = |header: &_| Table::new(header, model);
    columns::read(file, text, header, |table, line, number| {
        all.tests.push(table.test(line)?);
        all.lines.push(number);
        match all.tests.len() {
            ..=MAX_STATIC_TESTS => Ok(()),
            _ => Err(format!("is one test too many: at most {MAX_STATIC_TESTS} are used")),
        }
    })?;
    if all.tests.is_empty() {
        let needed = table::needed(model).join(",");
        let mend = format!("the first line is {needed}, each other a test");
        return Err(BadInput::new(file, format!("has no static test: {mend}")));
    }
    Ok(all)
}
