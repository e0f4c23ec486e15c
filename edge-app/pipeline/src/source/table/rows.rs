//! Rows of a table: the line of names is searched, then each line of numbers becomes a row. The line of names may come again: another cut
//! begins behind it, as LabVIEW and whoever joins files write it.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::layout::{Column, Columns, Layout, is_labels, period_s, uncommented};
use super::lines::{Cells, Lines, text};
use super::number::{NoNumber, Numbers};
use super::rates::{DIFFERS, two_rates};
use super::row::{Row, RowSource};
use crate::input::BadInput;
use crate::units::TIME;

/// Separators of cells that are tried.
pub(super) const SEPARATORS: [u8; 4] = [b'\t', b';', b',', b' '];
/// Most lines before the line of names, at the beginning and between two cuts. LabVIEW writes some twenty, and DynoWare some fifty.
const BEFORE: usize = 256;
/// Latest time that is one, s: some thousand years.
const LATEST_S: f64 = 1e11;
/// Most letters of a cell that an error shows.
const SHOWN: usize = 40;
/// Mend of a line that is no row.
const MEND: &str = "correct it, or export the table again";
/// The same of a column of times.
const MEND_TIME: &str =
    "correct it, write seconds, or rename the column and state [measurement] rate_hz";

/// Kind of a line that is not empty.
enum Line {
    /// There is no line any more.
    End,
    /// The names come again. The next line is of numbers.
    Names,
    /// Any other line. Its cells are taken.
    Other,
}

/// Reads the rows of a table.
pub(super) struct Rows<R> {
    file: PathBuf,
    lines: Lines<R>,
    cells: Cells,
    numbers: Numbers,
    layout: Layout,
    pub(super) columns: Columns,
    /// The line of names.
    names: Vec<u8>,
    /// The line of units below the names, if there is one.
    units: Option<Vec<u8>>,
    /// LabVIEW's line of units.
    labels: Option<Vec<String>>,
    /// A line that was read with that of the names, and is not of units.
    waiting: Option<Vec<u8>>,
    /// Place of the column of time, if it is empty in the first row.
    empty_time: Option<usize>,
    /// Numbers of cells of the first two rows. LabVIEW writes a comment behind the first.
    widths: heapless::Vec<usize, 2>,
}

impl<R: Read + Send> Rows<R> {
    /// Searches the line of names.
    ///
    /// # Errors
    /// No line has them, one has them twice, or a unit is none.
    pub(super) fn open(file: &Path, text: R, layout: &Layout) -> Result<Self, BadInput> {
        let mut lines = Lines::new(text);
        let mut splitters = SEPARATORS.map(|separator| (separator, Cells::new(separator)));
        let mut before: Vec<Vec<u8>> = Vec::new();
        let bad = |line: u64, message: String| BadInput {
            line: Some(line as usize),
            ..BadInput::new(file, message)
        };
        let (separator, names) = loop {
            let line = match lines.next() {
                Ok(Some(line)) => line.to_owned(),
                Ok(None) => return Err(nowhere(file, &before, layout)),
                Err(error) => return Err(bad(lines.number, error.to_string())),
            };
            let mut found = None;
            for (separator, cells) in &mut splitters {
                cells.split(uncommented(&line));
                match layout.find(cells.texts().collect()) {
                    Ok(None) => {}
                    Ok(Some(names)) => found = Some((*separator, names)),
                    Err(message) => return Err(bad(lines.number, message)),
                }
            }
            before.push(line);
            match found {
                Some(found) => break found,
                None if before.len() > BEFORE => return Err(nowhere(file, &before, layout)),
                None => {}
            }
        };
        let mut cells = Cells::new(separator);
        let own = before.pop().unwrap_or_default();
        let before: Vec<Vec<String>> = before
            .iter()
            .map(|line| {
                cells.split(line);
                cells.texts().collect()
            })
            .collect();
        let follows = lines.next().map(|line| line.map(<[u8]>::to_owned));
        let follows = follows.map_err(|error| bad(lines.number, error.to_string()))?;
        cells.split(follows.as_deref().unwrap_or_default());
        let below: Vec<String> = cells.texts().collect();
        let line = before.len() as u64 + 1;
        let columns =
            names.columns(layout, &before, &below).map_err(|message| bad(line, message))?;
        let labels = before.iter().rev().find(|line| is_labels(line)).cloned();
        let (units, waiting) = if columns.has_units { (follows, None) } else { (None, follows) };
        Ok(Self {
            file: file.to_owned(),
            units,
            labels,
            cells,
            numbers: Numbers::new(separator),
            layout: layout.clone(),
            names: own,
            waiting,
            empty_time: None,
            widths: heapless::Vec::new(),
            columns,
            lines,
        })
    }

    /// Takes the cells of the next line that is neither empty nor a comment.
    fn advance(&mut self) -> io::Result<Line> {
        loop {
            let number = self.lines.number + 1;
            let waiting = self.waiting.take();
            let line = match &waiting {
                Some(waiting) => Ok(Some(&waiting[..])),
                None => self.lines.next(),
            };
            match line {
                Ok(None) => return Ok(Line::End),
                Ok(Some(line)) if line == self.names => {
                    if let Some(units) = &self.units {
                        let follows = self.lines.next()?;
                        self.waiting = follows.filter(|line| line != units).map(<[u8]>::to_owned);
                    }
                    return Ok(Line::Names);
                }
                Ok(Some(line)) if line.is_empty() || line.starts_with(b"#") => {}
                Ok(Some(line)) => {
                    self.cells.split(line);
                    return Ok(Line::Other);
                }
                Err(error) => {
                    return Err(self.error(
                        number,
                        &format!("cannot be read: {error}: copy or export the table again"),
                    ));
                }
            }
        }
    }

    /// Skips what stands between two cuts, to behind the line of names.
    ///
    /// # Errors
    /// It is `fault` if that line does not come again or a row comes before, so that the line before was a row that is wrong; or the sampling
    /// period or the units are others.
    fn skip_to_names(&mut self, fault: io::Error) -> io::Result<()> {
        for _ in 0..BEFORE {
            self.check_header()?;
            match self.advance()? {
                Line::End => break,
                Line::Names => return Ok(()),
                Line::Other if matches!(self.row(), Ok(Some(_))) || self.has_time_again() => break,
                Line::Other => {}
            }
        }
        Err(fault)
    }

    /// Returns whether the present line has a time, of a table whose first row has none.
    fn has_time_again(&self) -> bool {
        self.empty_time.is_some_and(|place| {
            text(self.cells.get(place)).replacen(',', ".", 1).parse::<f64>().is_ok()
        })
    }

    /// Refuses the present line if it states another sampling period or other units for the next cut.
    fn check_header(&self) -> io::Result<()> {
        let cells: Vec<String> = self.cells.texts().collect();
        let error = |message: &str| Err(self.error(self.lines.number, message));
        let places = self.columns.all().map(|column| column.cell);
        match (self.columns.period_s, period_s(&cells, places)) {
            (_, Err(fault)) => return error(&fault),
            (Some(own), Ok(Some(other))) if (other / own - 1.0).abs() > DIFFERS => {
                return error(&two_rates(1.0 / own, 1.0 / other));
            }
            _ => {}
        }
        if is_labels(&cells) && self.labels.as_ref().is_some_and(|own| *own != cells) {
            return error(
                "has other units than the cut before: write the cut into a table of its own",
            );
        }
        Ok(())
    }

    /// Reads the row of the present line. Returns `None` if its cells are empty, as below the last row of a spreadsheet.
    fn row(&mut self) -> Result<Option<Row>, String> {
        let Self { cells, columns, numbers, layout, empty_time, .. } = self;
        let (count, knows_rate) = (cells.len(), columns.period_s.or(layout.rate_hz).is_some());
        if self.widths.is_empty()
            && knows_rate
            && columns.time.is_some_and(|own| cells.get(own.cell).is_empty())
        {
            // LabVIEW leaves the column of time empty where it is told to write none.
            *empty_time = columns.time.take().map(|column| column.cell);
        }
        // `Samples` of the next cut is above numbers too.
        if let Some(place) = *empty_time
            && !cells.get(place).is_empty()
        {
            return Err(format!(
                "column {:?} holds {:?}, and is empty in the first row: {MEND_TIME}",
                TIME.name,
                shown(cells, place)
            ));
        }
        let is_known = count == columns.cells || self.widths.contains(&count);
        let ends_empty = count == columns.cells + 1 && cells.get(count - 1).is_empty();
        let is_new = !self.widths.is_full() && (count < columns.cells || ends_empty);
        let reaches = |column: &Column| column.cell < count;
        if !(is_known || is_new) || !columns.axes.iter().flatten().all(reaches) {
            let names = columns.cells;
            return Err(format!(
                "has {count} cells, and the line of names {names}: is a cell missing, or are decimal commas taken for separators?"
            ));
        }
        numbers.settle(columns.all().map(|column| cells.get(column.cell)));
        let mut read = |column: &Column, name: &str, mend: &str| {
            let number = numbers.read(cells.get(column.cell)).map_err(|fault| {
                let (fault, mend) = match fault {
                    NoNumber::Text => ("and no number", mend),
                    NoNumber::Ambiguous => (
                        "whose comma may be decimal or separate thousands",
                        "export with decimal points, or with semicolons between the cells",
                    ),
                };
                format!("column {name:?} holds {:?}, {fault}: {mend}", shown(cells, column.cell))
            });
            Ok::<_, String>(number?.map_or(f64::NAN, |number| column.scale * number))
        };
        let time_s = columns.time.as_ref().map(|column| read(column, TIME.name, MEND_TIME));
        let time_s = time_s.transpose()?;
        let mut axes = [f32::NAN; 6];
        for ((value, column), name) in axes.iter_mut().zip(&columns.axes).zip(&layout.axes) {
            *value = match column {
                Some(column) => read(column, name, MEND)? as f32,
                None => 0.0,
            };
        }
        let mut joints = heapless::Vec::new();
        for (column, (name, _)) in columns.joints.iter().zip(&layout.joints) {
            let _ = joints.push(read(column, name, MEND)?);
        }
        if time_s.is_some_and(|time_s| !(-LATEST_S..=LATEST_S).contains(&time_s)) {
            let is_empty =
                axes.iter().zip(&columns.axes).all(|(value, own)| own.is_none() || value.is_nan());
            return if is_empty {
                Ok(None)
            } else {
                Err(format!("column {:?} holds no time: {MEND_TIME}", TIME.name))
            };
        }
        let _ = self.widths.push(count);
        Ok(Some(Row { line: self.lines.number, begins: false, time_s, axes, joints }))
    }
}

impl<R: Read + Send> RowSource for Rows<R> {
    fn period_s(&self) -> Option<f64> {
        self.columns.period_s
    }

    fn has_times(&self) -> bool {
        self.columns.time.is_some()
    }

    /// Returns the next row, or `None` at the end.
    ///
    /// # Errors
    /// The text cannot be read, or a line is neither a row nor between two cuts. The error is one line with the file, the line and the column.
    fn next(&mut self) -> io::Result<Option<Row>> {
        let mut begins = false;
        loop {
            match self.advance()? {
                Line::End => return Ok(None),
                Line::Names => begins = true,
                Line::Other => match self.row() {
                    Ok(Some(row)) => return Ok(Some(Row { begins, ..row })),
                    Ok(None) => {}
                    Err(fault) => {
                        let is_cut_off = !self.lines.has_end;
                        let cut_off = || format!("the last line is cut off: {MEND}");
                        let fault = if is_cut_off { cut_off() } else { fault };
                        let fault = self.error(self.lines.number, &fault);
                        self.skip_to_names(fault)?;
                        begins = true;
                    }
                },
            }
        }
    }

    fn error(&self, line: u64, message: &str) -> io::Error {
        let line = Some(line as usize);
        io::Error::other(BadInput { line, ..BadInput::new(&self.file, message) })
    }
}

/// The beginning of a cell, for people.
fn shown(cells: &Cells, place: usize) -> String {
    text(cells.get(place)).chars().take(SHOWN).collect()
}

fn texts(cells: &Cells) -> Vec<String> {
    cells.texts().collect()
}

/// A line that may be that of the names.
struct Candidate {
    /// Number of the names that it has; whether it stands above a line of numbers; number of its cells.
    rank: (usize, bool, usize),
    /// Number of the line, from 1.
    line: usize,
    cells: Cells,
}

/// Says what a table lacks none of whose lines has all names: what the line has that seems to be meant.
fn nowhere(file: &Path, lines: &[Vec<u8>], layout: &Layout) -> BadInput {
    let of_separator = |separator: u8| {
        let split = move |line: &Vec<u8>| {
            let mut cells = Cells::new(separator);
            cells.split(uncommented(line));
            cells
        };
        let is_of_numbers = move |cells: &Cells| {
            let mut numbers = Numbers::new(separator);
            (0..cells.len()).all(|cell| numbers.read(cells.get(cell)).is_ok())
        };
        lines.iter().enumerate().map(move |(index, line)| {
            let (cells, follows) = (split(line), lines.get(index + 1).map(split));
            let is_above =
                follows.is_some_and(|own| own.len() == cells.len() && is_of_numbers(&own));
            let is_above = cells.len() > 1 && is_above && !is_of_numbers(&cells);
            Candidate {
                rank: (layout.matches(&texts(&cells)), is_above, cells.len()),
                line: index + 1,
                cells,
            }
        })
    };
    let seems = |candidate: &Candidate| candidate.rank.0 > 0 || candidate.rank.1;
    let all = SEPARATORS.into_iter().flat_map(of_separator).filter(seems);
    // Of equal ones the first.
    let best = all.reduce(|best, own| if own.rank > best.rank { own } else { best });
    match best {
        Some(Candidate { line, cells, .. }) => {
            BadInput { line: Some(line), ..BadInput::new(file, layout.lacks(&texts(&cells))) }
        }
        None => {
            let names: Vec<&str> = layout.needed().collect();
            let names = names.join(", ");
            BadInput::new(
                file,
                format!(
                    "is no table: no line names the columns {names} of [signals]: write the names above the numbers, with the same separators"
                ),
            )
        }
    }
}
