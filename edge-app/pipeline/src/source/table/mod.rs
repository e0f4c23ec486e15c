//! Tables of force and acceleration with one clock, as a data acquisition unit exports them: a column per axis, a row per instant.
//!
//! ```text
//! time [s],Fx [N],Fy [N],Fz [N],ax [g],ay [g],az [g]
//! 0.0000,-0.1,0.2,0.0,0.001,0.000,1.000
//! ```
//!
//! Cells are separated by tabs, semicolons, commas or spaces, decimals by points or commas. Lines before the names are skipped, as LabVIEW and
//! others write them. The number of the row is the counter. The time is a column, or the sampling rate is known.
//!
//! Files that are no text become rows as well: bags of ROS, and files of channels.
//!
//! | module       | holds                                           |
//! | ------------ | ----------------------------------------------- |
//! | `row`        | what each kind of file gives                    |
//! | `bag`        | bags of ROS 2 (MCAP)                            |
//! | `bytes`      | numbers in either order of bytes                |
//! | `channels`   | columns of files that hold each in one piece    |
//! | `mat`        | variables of MATLAB                             |
//! | `mdf`        | MF4                                             |
//! | `tdms`       | LabVIEW and DAQmx                               |
//! | `lines`      | numbered lines, and their cells                 |
//! | `number`     | the number in a cell                            |
//! | `rates`      | when two rates differ                           |
//! | `layout`     | the columns and their units                     |
//! | `rows`       | lines as rows, and what stands between two cuts |
//! | `instants`   | counters and times of the rows                  |

mod bag;
mod bytes;
mod channels;
mod instants;
mod layout;
mod lines;
mod mat;
mod mdf;
mod number;
mod rates;
mod row;
mod rows;
mod tdms;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

use flexid_core::MAX_JOINTS;
use flexid_core::chain::Chain;
use flexid_core::statics::Gauge;
use flexid_core::stream::{Reading, Setup};

use super::{Arrival, Content, Flow, FrameSource, SourceHealth};
use crate::input::{BadInput, Binary};
use crate::poses::{Cut, Direction};
use bag::Bag;
use channels::{Channels, Group};
use instants::{Clock, Instant, Pace};
use layout::uncommented;
pub use layout::{Layout, Topics};
use lines::Cells;
use rates::DIFFERS;
use row::{Row, RowSource};
use rows::{Rows, SEPARATORS};

/// Rows that are read ahead, by which rate and steps of a table are judged: eight seconds of a fast force sensor (4 kHz).
const LOOK_AHEAD: usize = 32_768;
/// Rows that one read takes.
const BATCH: usize = 256;
/// A sensor is at another rate than the rows if it lacks one value in so many. With more missing samples no record can be used (`SHARE` in
/// `intake/obstacle.rs`).
const SHARE: usize = 10;
/// Longest time after which the angles of joints come again, s: that of a simulated bus, far below the slowest cycle that the stream takes
/// ([`flexid_core::stream::CYCLE_S`]).
const CYCLE_S: f64 = 0.1;

/// Rate and steps that the first rows of a table show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Sampling rate, Hz, by the column of time or by what stands before the columns. `None` if nothing says it.
    pub rate_hz: Option<f64>,
    /// Smallest step of force x, y, z, N, and of acceleration x, y, z, m/s²: the resolution of a converter. 0 for an axis that does not change.
    pub steps: [f32; 6],
    /// True if force and acceleration have clocks of their own.
    pub own_clocks: bool,
}

/// Reads a table row by row.
pub struct TableLog<'a> {
    file: PathBuf,
    rows: Box<dyn RowSource + 'a>,
    /// Rows that were read ahead.
    ahead: VecDeque<Row>,
    /// The error behind them.
    broken: Option<io::Error>,
    /// Rate and steps of these rows.
    shown: Shown,
    clock: Clock,
    /// Pose of each cut, and what else is stated of it, if the poses are not columns. Several cuts may have the same.
    cuts: Option<Vec<Cut>>,
    /// Directions of force and acceleration in the present cut, where each is of one channel.
    directions: [Option<Direction>; 2],
    angles: Angles,
    /// Time of the newest row, s.
    newest_s: Option<f64>,
    /// True for each axis of force and acceleration that has a column.
    measured: [[bool; 3]; 2],
    /// Chain from the base to the TCP, if the force is along the axes of the base.
    base: Option<Chain>,
    /// Angles and the axes of the base in those of the TCP.
    turned: Option<(Pose, [[f64; 3]; 3])>,
}

/// Angles of the joints, rad (m), base first.
type Pose = heapless::Vec<f64, MAX_JOINTS>;

/// The newest angles of the joints, rad (m). NaN before the first.
#[derive(Clone, Debug)]
struct Angles {
    values: Pose,
    /// Time at which each came last, s.
    came_s: [f64; MAX_JOINTS],
}

impl<'a> TableLog<'a> {
    /// Opens the text `file`, whose columns are those of `layout`, and reads its first rows. `cuts` are what is stated of its cuts if the poses are not columns.
    ///
    /// # Errors
    /// The columns are not found, a row is wrong, or the table has no rate or another one than the config. The error is one line that names the
    /// file, the line, the column and the correction.
    pub fn open(
        file: &Path,
        text: impl Read + Send + 'a,
        layout: &Layout,
        cuts: Option<Vec<Cut>>,
    ) -> Result<Self, BadInput> {
        Self::of(file, Box::new(Rows::open(file, text, layout)?), layout, cuts)
    }

    /// [`TableLog::open`] for a file that is no text, in a format that [`is_read`] names.
    ///
    /// # Errors
    /// The errors are those of [`TableLog::open`], or the file is damaged.
    pub fn open_binary(
        file: &Path,
        format: Binary,
        bytes: impl Read + Send + 'a,
        layout: &Layout,
        cuts: Option<Vec<Cut>>,
    ) -> Result<Self, BadInput> {
        let rows: Box<dyn RowSource + 'a> = match format {
            Binary::Mcap => Box::new(Bag::open(file, bytes, layout)?),
            Binary::Mat => channels(file, mat::read(bytes, layout), layout)?,
            Binary::Mdf => channels(file, mdf::read(bytes, layout), layout)?,
            Binary::Tdms => channels(file, tdms::read(bytes, layout), layout)?,
            _ => return Err(BadInput::new(file, "is of a format that is not read")),
        };
        Self::of(file, rows, layout, cuts)
    }

    /// Makes a table of the rows of `file`.
    fn of(
        file: &Path,
        mut rows: Box<dyn RowSource + 'a>,
        layout: &Layout,
        cuts: Option<Vec<Cut>>,
    ) -> Result<Self, BadInput> {
        let (mut ahead, mut broken) = (VecDeque::new(), None);
        while ahead.len() < LOOK_AHEAD {
            match rows.next() {
                Ok(Some(row)) => ahead.push_back(row),
                Ok(None) => break,
                Err(error) if rows.is_early_end() && !ahead.is_empty() => {
                    broken = Some(error);
                    break;
                }
                Err(error) => return Err(bad_input(file, &error)),
            }
        }
        let bad = |message: String| BadInput::new(file, message);
        if ahead.is_empty() {
            return Err(bad(
                "has no row of numbers below the names of its columns: export it again".into(),
            ));
        }
        let own_clocks = rows.has_own_clocks();
        if !own_clocks {
            check_rates(&ahead, layout).map_err(bad)?;
        }
        let pace = pace(&ahead, &*rows, layout).map_err(bad)?;
        let rate_hz = pace.map(|pace| 1.0 / pace.period_s);
        // Without any rate the config refuses the table.
        let pace = pace.unwrap_or(Pace::even(1.0 / layout.rate_hz.unwrap_or(1.0)));
        let shown = Shown { rate_hz, steps: steps(&ahead), own_clocks };
        let angles = Angles { values: heapless::Vec::new(), came_s: [0.0; MAX_JOINTS] };
        Ok(Self {
            file: file.to_owned(),
            rows,
            ahead,
            broken,
            shown,
            clock: if own_clocks { Clock::of_arrivals() } else { Clock::new(pace) },
            cuts,
            measured: [0, 1]
                .map(|sensor| [0, 1, 2].map(|axis| !layout.axes[3 * sensor + axis].is_empty())),
            directions: [None; 2],
            angles,
            newest_s: None,
            base: layout.base.clone(),
            turned: None,
        })
    }

    /// Returns what the first rows show.
    pub fn shown(&self) -> Shown {
        self.shown
    }

    /// Takes the next row. Returns false at the end.
    fn take(&mut self, batch: &mut Vec<Arrival>) -> io::Result<bool> {
        let row = match (self.ahead.pop_front(), self.broken.take()) {
            (Some(row), broken) => {
                self.broken = broken;
                Some(row)
            }
            (None, Some(broken)) => return Err(broken),
            (None, None) => self.rows.next()?,
        };
        let Some(row) = row else { return Ok(false) };
        let instant =
            self.clock.next(&row).map_err(|message| self.rows.error(row.line, &message))?;
        if let Some(cut) = instant.begins {
            self.repeat_angles(batch);
            let own = self.cut(cut).map_err(|message| self.rows.error(row.line, &message))?;
            let Cut { pose, directions, point } = own.cloned().unwrap_or_default();
            self.angles.values = pose.into_iter().collect();
            self.directions = directions;
            let measured = |sensor: usize| {
                [0, 1, 2].map(|axis| {
                    let is_along = |own: Direction| own.axis == axis;
                    self.measured[sensor][axis] && directions[sensor].is_none_or(is_along)
                })
            };
            let setup = Setup { point, force: measured(0), acceleration: measured(1) };
            let setup = Content::Reading(Reading::Setup(setup));
            batch.push(Arrival { time_s: instant.time_s, content: setup });
        }
        self.note_angles(&row, &instant, batch);
        let Instant { counter, time_s, .. } = instant;
        let [fx, fy, fz, ax, ay, az] = row.axes;
        // One channel is read as each of the three axes.
        let along = |direction: Option<Direction>, [x, y, z]: [f32; 3]| {
            direction.map_or([x, y, z], |own| own.vector(x))
        };
        let [of_force, of_acceleration] = self.directions;
        let force = self.along_tcp(along(of_force, [fx, fy, fz]));
        let acceleration = along(of_acceleration, [ax, ay, az]);
        let is_whole = |value: &[f32; 3]| value.iter().all(|axis| axis.is_finite());
        // What is missing is lost, and the counter shows it.
        let readings = [
            is_whole(&force).then_some(Reading::Force { counter, value: force }),
            is_whole(&acceleration)
                .then_some(Reading::Acceleration { counter, value: acceleration }),
        ];
        let readings = readings.into_iter().flatten();
        batch
            .extend(readings.map(|reading| Arrival { time_s, content: Content::Reading(reading) }));
        self.newest_s = Some(time_s);
        Ok(true)
    }

    /// Returns a force along the axes of the TCP. It is not known while an angle is missing.
    fn along_tcp(&mut self, force: [f32; 3]) -> [f32; 3] {
        let Some(chain) = &self.base else { return force };
        let pose = &self.angles.values;
        if pose.is_empty() || pose.iter().any(|angle| angle.is_nan()) {
            return [f32::NAN; 3];
        }
        let known = self.turned.take().filter(|(own, _)| own == pose);
        let (_, axes) = self.turned.insert(
            known.unwrap_or_else(|| (pose.clone(), Gauge::default().along_base(chain, pose).axes)),
        );
        let along =
            |axis: usize| (0..3).map(|of| axes[of][axis] * f64::from(force[of])).sum::<f64>();
        std::array::from_fn(|axis| along(axis) as f32)
    }

    /// Returns what is stated of a cut.
    fn cut(&self, cut: usize) -> Result<Option<&Cut>, String> {
        match self.cuts.as_deref() {
            None => Ok(None),
            Some([only]) => Ok(Some(only)),
            Some(cuts) => cuts.get(cut).map(Some).ok_or_else(|| {
                format!(
                    "begins cut {} of this table, and [recording] poses has {} lines of it: write a line for each cut, in their order",
                    cut + 1,
                    cuts.len()
                )
            }),
        }
    }

    /// Refuses poses of cuts that the table does not have: then those of the cuts may be others.
    fn check_poses(&self) -> Result<(), String> {
        let (cuts, poses) = (self.clock.cuts(), self.cuts.as_ref().map_or(0, Vec::len));
        if poses <= 1 || poses == cuts {
            return Ok(());
        }
        Err(format!(
            "number of its cuts is {cuts}, and [recording] poses has {poses} lines of it: write a line for each cut; a cut begins where the time begins anew or makes a long pause, and below a line of names"
        ))
    }

    /// Passes on the angles of a row that differ from those before, and one that has stayed the same in a cycle. An empty cell repeats none: the joint
    /// may have moved since.
    fn note_angles(&mut self, row: &Row, instant: &Instant, batch: &mut Vec<Arrival>) {
        let Angles { values, came_s } = &mut self.angles;
        if !row.joints.is_empty() && values.is_empty() {
            values.resize(row.joints.len(), f64::NAN).ok();
        }
        for (index, (value, came_s)) in values.iter_mut().zip(came_s).enumerate() {
            // A pose that is stated of the cut holds in all rows.
            let angle = row.joints.get(index).copied().unwrap_or(*value);
            let is_due = !angle.is_nan() && instant.time_s - *came_s >= CYCLE_S;
            let changes = !angle.is_nan() && angle != *value;
            if changes {
                *value = angle;
            }
            if (instant.begins.is_some() || is_due || changes) && !value.is_nan() {
                *came_s = instant.time_s;
                batch.push(joint(instant.time_s, index as u8, *value));
            }
        }
    }

    /// Passes on the newest angles again, with the newest row: they hold until there.
    fn repeat_angles(&self, batch: &mut Vec<Arrival>) {
        let Some(time_s) = self.newest_s else { return };
        let known = (0..).zip(&self.angles.values).filter(|(_, value)| !value.is_nan());
        batch.extend(known.map(|(index, value)| joint(time_s, index, *value)));
    }
}

impl FrameSource for TableLog<'_> {
    fn read(&mut self, batch: &mut Vec<Arrival>, _timeout: Duration) -> io::Result<Flow> {
        for _ in 0..BATCH {
            match self.take(batch) {
                Ok(true) => {}
                end => {
                    self.repeat_angles(batch);
                    end?;
                    self.check_poses()
                        .map_err(|message| io::Error::other(BadInput::new(&self.file, message)))?;
                    return Ok(Flow::Ended);
                }
            }
        }
        Ok(Flow::Open)
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}

impl Shown {
    /// Returns what two tables show together.
    ///
    /// # Errors
    /// They have different rates, Hz.
    pub fn and(self, other: Self) -> Result<Self, [f64; 2]> {
        if let (Some(own), Some(other)) = (self.rate_hz, other.rate_hz)
            && (other / own - 1.0).abs() > DIFFERS
        {
            return Err([own, other]);
        }
        let step = |axis: usize| match [self.steps[axis], other.steps[axis]] {
            [0.0, step] | [step, 0.0] => step,
            [own, other] => own.min(other),
        };
        Ok(Self {
            rate_hz: self.rate_hz.or(other.rate_hz),
            steps: std::array::from_fn(step),
            own_clocks: self.own_clocks || other.own_clocks,
        })
    }
}

/// Makes rows of the groups of a file.
fn channels(
    file: &Path,
    groups: Result<Vec<Group>, String>,
    layout: &Layout,
) -> Result<Box<dyn RowSource>, BadInput> {
    let groups = groups.map_err(|message| BadInput::new(file, message))?;
    Ok(Box::new(Channels::new(file, groups, layout)?))
}

/// Returns whether files of a format that is no text are read as tables.
pub fn is_read(format: Binary) -> bool {
    matches!(format, Binary::Mcap | Binary::Mat | Binary::Mdf | Binary::Tdms)
}

/// Returns whether the beginning of a file has a line of the names of `layout`.
pub fn has_names(head: &[u8], layout: &Layout) -> bool {
    SEPARATORS.into_iter().any(|separator| {
        let mut cells = Cells::new(separator);
        head.split(|byte| *byte == b'\n').any(|line| {
            cells.split(uncommented(line.strip_suffix(b"\r").unwrap_or(line)));
            !matches!(layout.find(cells.texts().collect()), Ok(None))
        })
    })
}

/// Returns whether the beginning of a file looks like a table, whatever its columns are called: two lines in a row have as many separators.
pub fn is_like(head: &[u8]) -> bool {
    let count = |line: &[u8], separator| line.iter().filter(|byte| **byte == separator).count();
    let lines: Vec<&[u8]> = head.split(|byte| *byte == b'\n').collect();
    str::from_utf8(head).is_ok()
        && [b'\t', b';', b','].into_iter().any(|separator| {
            let is_of_table = |pair: &[&[u8]]| {
                let [first, second] = [pair[0], pair[1]].map(|line| count(line, separator));
                first >= 2 && first == second
            };
            lines.windows(2).any(is_of_table)
        })
}

fn joint(time_s: f64, index: u8, value: f64) -> Arrival {
    Arrival { time_s, content: Content::Reading(Reading::Joint { index, value }) }
}

/// Returns the error of a row as one of the file.
fn bad_input(file: &Path, error: &io::Error) -> BadInput {
    let own = error.get_ref().and_then(|own| own.downcast_ref::<BadInput>());
    own.cloned().unwrap_or_else(|| BadInput::new(file, error))
}

/// Refuses rows of which a sensor lacks many values: it has another rate than the other.
fn check_rates(rows: &VecDeque<Row>, layout: &Layout) -> Result<(), String> {
    for (axis, name) in layout.axes.iter().enumerate() {
        let missing = rows.iter().filter(|row| row.axes[axis].is_nan()).count();
        if missing * SHARE > rows.len() {
            return Err(format!(
                "column {name:?} has no number in {missing} of the first {} rows: export force and acceleration at one rate",
                rows.len()
            ));
        }
    }
    Ok(())
}

/// Returns the pace of the rows: by the column of time, by what stands before the columns, or by the config. `None` if nothing says it.
fn pace(
    rows: &VecDeque<Row>,
    table: &dyn RowSource,
    layout: &Layout,
) -> Result<Option<Pace>, String> {
    let stated = layout.rate_hz.map(|rate_hz| Pace::even(1.0 / rate_hz));
    let of_table = table.period_s().map(Pace::even);
    let Some(own) = (match table.has_times() {
        true if rows.len() > 1 => {
            let stands = || {
                "its time does not go on: export the time of each row in s, or leave it out and state [measurement] rate_hz".to_owned()
            };
            Some(Pace::of(rows.iter()).ok_or_else(stands)?)
        }
        _ => of_table,
    }) else {
        return Ok(stated);
    };
    match layout.rate_hz {
        Some(rate_hz) if (rate_hz * own.period_s - 1.0).abs() > DIFFERS => Err(format!(
            "its rows come at {:.1} Hz, and [measurement] rate_hz is {rate_hz}: correct the unit of the time or rate_hz",
            1.0 / own.period_s
        )),
        _ => Ok(Some(own)),
    }
}

/// Returns the smallest step of each axis.
fn steps(rows: &VecDeque<Row>) -> [f32; 6] {
    std::array::from_fn(|axis| {
        // A row of one sensor lacks the other one.
        let values = rows.iter().map(|row| row.axes[axis]).filter(|value| !value.is_nan());
        let steps =
            values.clone().zip(values.skip(1)).map(|(before, after)| (after - before).abs());
        let least = steps.filter(|step| *step > 0.0).fold(f32::INFINITY, f32::min);
        if least.is_finite() { least } else { 0.0 }
    })
}
