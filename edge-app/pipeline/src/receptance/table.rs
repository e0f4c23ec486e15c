//! Frequency responses as a table: comma-separated, the first line names the columns.
//!
//! ```text
//! f [Hz],Hxx re [m/s^2/N],Hxx im [m/s^2/N],Hxx coherence,Hyx re [m/s^2/N],...
//! ```
//!
//! | columns                                  | what                                                      | unit                  |
//! | ---------------------------------------- | --------------------------------------------------------- | --------------------- |
//! | `f`, `freq`, `frequency`                 | frequency                                                 | Hz                    |
//! | `re` or `real`, `im` or `imag`           | parts of the response                                     | motion per force      |
//! | `mag`, `magnitude`, `abs`; `phase`       | magnitude and phase, in place of the parts                | motion per force; rad, deg |
//! | `coh`, `coherence`                       | ordinary coherence γ²                                     |                       |
//!
//! Beside its word a column has the direction of the response, and behind it that of the force: `Hyx re`, `re(Hyx)`, `h_y-z_mag`. Without a direction the
//! table is of a single response, and its line in the list says the directions. An empty cell was not measured. Other columns are left out.

mod header;

use std::path::Path;

use super::function::{Dof, Function, Grid, Kind};
use crate::columns;
use crate::input::BadInput;
use crate::poses::Direction;
use header::{Header, Part};

/// Directions of the only response of a table: force, then acceleration.
type Directions = [Option<Direction>; 2];

/// The functions of a table, whose directions are these if its names have none.
///
/// # Errors
/// A column is missing or has no unit, a cell is no number, or the frequencies are uneven.
pub(super) fn parse(
    file: &Path,
    text: &str,
    directions: Directions,
) -> Result<Vec<Function>, BadInput> {
    let mut frequencies = Vec::new();
    let mut cells: Vec<Vec<f64>> = Vec::new();
    let mut found: Option<Header> = None;
    columns::read(file, text, Header::new, |header: &Header, line, _| {
        columns::check_cells(line, header.cells)?;
        let frequency = columns::number(&line[header.frequency], "of the frequency", "Hz")?;
        frequencies.push(frequency.ok_or("has no frequency: write one, in Hz")?);
        let mut row = Vec::new();
        for (cell, name) in header.cells() {
            row.push(
                columns::number(&line[cell], name, "the unit of its column")?.unwrap_or(f64::NAN),
            );
        }
        cells.push(row);
        if found.is_none() {
            found = Some(header.clone());
        }
        Ok(())
    })?;
    let bad = |message: String| BadInput::new(file, message);
    let header = found.ok_or_else(|| bad(format!("has no frequency: {}", header::NEEDED)))?;
    let grid = Grid::of(&frequencies).map_err(|error| bad(format!("the table: {error}")))?;
    let mut functions = Vec::new();
    let mut place = 0;
    for own in &header.functions {
        let values = cells.iter().map(|row| own.value(&row[place..place + own.cells.len()]));
        let values: Vec<[f64; 2]> = values.collect();
        place += own.cells.len();
        let [force, response] =
            own.directions.map_or(directions, |[response, force]| [Some(force), Some(response)]);
        functions.push(Function {
            place: format!("the column {:?}", own.name),
            kind: match own.part {
                Part::Coherence => Kind::Coherence,
                _ => Kind::Response(own.unit.ok_or_else(|| "states no unit".to_owned())),
            },
            response: Dof { node: 0, direction: response },
            reference: Dof { node: 0, direction: force },
            grid,
            values,
        });
    }
    Ok(functions)
}
