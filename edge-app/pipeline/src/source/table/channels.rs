//! Files of channels: MAT, MF4 and TDMS. Each channel has a name, perhaps a unit, and all its values; those of a group belong to the same instants.
//!
//! A channel is a column: names and units follow the rules of a table. A group in which all names stand is a cut. If none is, the columns may stand
//! in several groups, as long as these have the same instants.

use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use flexid_core::imperfection::Accuracies;

use super::layout::{Column, Columns, Layout, PERIOD, UNITS, is_named};
use super::rates::{DIFFERS, two_rates};
use super::row::{Row, RowSource};
use crate::input::BadInput;

/// Largest file that is read, bytes: an hour and a half of nine channels at 10 kHz. It is held in memory, since a channel may stand in one piece.
pub(super) const LARGEST: u64 = 4 << 30;
/// A channel of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Channel {
    pub(super) name: String,
    /// Empty if the file gives none.
    pub(super) unit: String,
    /// The values, or one that holds for all instants. None of a channel that is not wanted.
    pub(super) values: Vec<f64>,
    /// Sampling period, s.
    pub(super) period_s: Option<f64>,
    /// Time at which the values begin, s on a clock of the file.
    pub(super) begins_s: Option<f64>,
}

/// Channels that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Group {
    /// Empty in a file without groups.
    pub(super) name: String,
    pub(super) channels: Vec<Channel>,
}

/// Reads a file as `of` does.
///
/// # Errors
/// `of` gives one, or the file is larger than [`LARGEST`].
pub(super) fn bounded<T>(
    bytes: impl Read,
    of: impl FnOnce(&mut dyn Read) -> Result<T, String>,
) -> Result<T, String> {
    let mut bytes = BufReader::new(bytes.take(LARGEST + 1));
    let own = of(&mut bytes);
    if bytes.get_ref().limit() == 0 {
        return Err("has more than 4 GiB: cut it".into());
    }
    own
}

/// The rows of a file of channels.
pub(super) struct Channels {
    file: PathBuf,
    cuts: std::vec::IntoIter<Cut>,
    cut: Option<Cut>,
    has_times: bool,
    period_s: Option<f64>,
    /// Number of rows so far, of the file and of the cut.
    rows: u64,
    row: usize,
}

/// Columns of a cut.
struct Cut {
    time: Option<Vec<f64>>,
    /// 0 along an axis that is not measured.
    axes: [Vec<f64>; 6],
    joints: Vec<Vec<f64>>,
    period_s: Option<f64>,
    begins_s: Option<f64>,
    rows: usize,
}

impl Channels {
    /// Takes the columns of `layout` from the groups of `file`.
    ///
    /// # Errors
    /// A name is missing or there twice, a unit is none, or channels have different instants. The error names the file, the channel and the mend.
    pub(super) fn new(file: &Path, groups: Vec<Group>, layout: &Layout) -> Result<Self, BadInput> {
        let bad = |message: String| BadInput::new(file, message);
        let mut cuts = Vec::new();
        for group in &groups {
            let own: Vec<Place> = group.channels.iter().map(|own| (group, own)).collect();
            if let Some(cut) = Cut::of(&own, layout).map_err(bad)? {
                cuts.push((&*group.name, cut));
            }
        }
        if cuts.is_empty() {
            let all =
                groups.iter().flat_map(|group| group.channels.iter().map(move |own| (group, own)));
            let all: Vec<Place> = of_one_time(all.collect(), layout);
            let names: Vec<String> = all.iter().map(|place| name(place, layout)).collect();
            let cut = Cut::of(&all, layout).map_err(bad)?;
            cuts.push(("", cut.ok_or_else(|| bad(layout.lacks(&names)))?));
        }
        cuts.sort_by(|(_, one), (_, other)| {
            one.begins_s.unwrap_or_default().total_cmp(&other.begins_s.unwrap_or_default())
        });
        for pair in cuts.windows(2) {
            let [(one, before), (other, after)] = pair else { continue };
            if !before.ends_before(after) {
                return Err(bad(format!(
                    "has the columns of [signals] in the groups {one:?} and {other:?}, and does not say that one was recorded after the other: \
                     name the group in [signals], as in {:?}",
                    format!("{one}/{}", layout.needed().next().unwrap_or_default())
                )));
            }
            before.has_rate_of(after).map_err(|message| {
                bad(format!("has the groups {one:?} and {other:?}: the second {message}"))
            })?;
        }
        let cuts: Vec<Cut> = cuts.into_iter().map(|(_, cut)| cut).collect();
        let has_times = cuts.first().is_some_and(|cut| cut.time.is_some());
        let period_s = cuts.first().and_then(|cut| cut.period_s);
        let (cuts, file) = (cuts.into_iter(), file.to_owned());
        Ok(Self { file, cuts, cut: None, has_times, period_s, rows: 0, row: 0 })
    }
}

impl RowSource for Channels {
    fn next(&mut self) -> io::Result<Option<Row>> {
        let mut begins = false;
        while self.cut.as_ref().is_none_or(|cut| self.row >= cut.rows) {
            begins = self.rows > 0;
            self.row = 0;
            self.cut = self.cuts.next();
            if self.cut.is_none() {
                return Ok(None);
            }
        }
        let Some(cut) = &self.cut else { return Ok(None) };
        let at = |values: &Vec<f64>| match values[..] {
            [only] => only,
            _ => values.get(self.row).copied().unwrap_or(f64::NAN),
        };
        let time_s = cut.time.as_ref().map(at);
        if let Some(time_s) = time_s.filter(|time_s| !time_s.is_finite()) {
            return Err(self.error(
                self.rows + 1,
                &format!("has {time_s} for its time: export or record the file again"),
            ));
        }
        let axes = cut.axes.each_ref().map(|values| at(values) as f32);
        let axes = axes.map(|value| if value.is_finite() { value } else { f32::NAN });
        let joints =
            cut.joints.iter().map(at).map(|value| if value.is_finite() { value } else { f64::NAN });
        let joints = joints.collect();
        (self.rows, self.row) = (self.rows + 1, self.row + 1);
        Ok(Some(Row { line: self.rows, begins, time_s, axes, joints }))
    }

    fn error(&self, row: u64, message: &str) -> io::Error {
        io::Error::other(BadInput::new(&self.file, format!("row {row} {message}")))
    }

    fn has_times(&self) -> bool {
        self.has_times
    }

    fn period_s(&self) -> Option<f64> {
        self.period_s
    }
}

/// A channel and its group.
type Place<'a> = (&'a Group, &'a Channel);

/// Returns what the config calls a channel: its name, or its group and its name.
fn name(&(group, channel): &Place, layout: &Layout) -> String {
    let whole = format!("{}/{}", group.name, channel.name);
    if layout.needed().any(|own| is_named(&whole, own)) { whole } else { channel.name.clone() }
}

/// Returns the places without the times of other groups than that of the first axis, which need not have its instants.
fn of_one_time<'a>(mut all: Vec<Place<'a>>, layout: &Layout) -> Vec<Place<'a>> {
    let is = |place: &Place, own: &str| is_named(&name(place, layout), own);
    let first = layout.needed().next();
    let first = all.iter().find(|place| first.is_some_and(|own| is(place, own)));
    let Some(group) = first.map(|place| place.0) else { return all };
    let is_needed = |place: &Place| layout.needed().any(|own| is(place, own));
    all.retain(|own| std::ptr::eq(own.0, group) || !layout.is_time(&own.1.name) || is_needed(own));
    all
}

impl Cut {
    /// Takes the columns from channels. Returns `None` if a name is missing.
    fn of(places: &[Place], layout: &Layout) -> Result<Option<Self>, String> {
        let cells = std::iter::once(String::new());
        let cells = cells.chain(places.iter().map(|place| name(place, layout))).collect();
        let Some(names) = layout.find(cells)? else { return Ok(None) };
        // The lines before the columns in a file of LabVIEW say the same.
        let of_all = |label: &[u8], of: &dyn Fn(&Channel) -> String| {
            let label = String::from_utf8_lossy(label).into_owned();
            std::iter::once(label).chain(places.iter().map(|(_, own)| of(own))).collect()
        };
        let used: Vec<usize> = names.places().collect();
        let period_s = |own: &Channel| {
            let is_used = used.iter().any(|place| std::ptr::eq(places[place - 1].1, own));
            own.period_s.filter(|_| is_used).map_or(String::new(), |own| own.to_string())
        };
        let lines: [Vec<String>; 2] =
            [of_all(UNITS, &|own| own.unit.clone()), of_all(PERIOD, &period_s)];
        let Columns { time, axes, joints, period_s, .. } = names.columns(layout, &lines, &[])?;
        let of = |column: &Column| places[column.cell - 1];
        let scaled = |column: &Column| {
            of(column).1.values.iter().map(|value| value * column.scale).collect::<Vec<f64>>()
        };
        let Some(first) = axes.iter().flatten().next().map(of) else { return Ok(None) };
        let rows = first.1.values.len();
        for column in axes.iter().flatten().chain(&joints).chain(&time) {
            let (group, own) = of(column);
            let (count, may_hold) = (own.values.len(), joints.contains(column));
            if count != rows && !(may_hold && count == 1) {
                return Err(format!(
                    "column {:?} has {count} values, and {:?} has {rows}: export them at one rate, and at the same instants",
                    own.name, first.1.name
                ));
            }
            let instants =
                if may_hold { Ok(()) } else { simultaneous((group, own), first, layout) };
            instants.map_err(|message| {
                format!(
                    "columns {:?} of the group {:?} and {:?} of {:?} {message}",
                    own.name, group.name, first.1.name, first.0.name
                )
            })?;
        }
        Ok(Some(Self {
            time: time.as_ref().map(scaled),
            begins_s: time
                .as_ref()
                .map(scaled)
                .and_then(|own| own.first().copied())
                .or(first.1.begins_s),
            axes: axes.each_ref().map(|own| own.as_ref().map_or(vec![0.0], scaled)),
            joints: joints.iter().map(scaled).collect(),
            period_s,
            rows,
        }))
    }

    /// Returns whether the file says that another cut was recorded after this one.
    fn ends_before(&self, other: &Self) -> bool {
        let lasts_s = match &self.time {
            Some(time) => time.last().zip(time.first()).map(|(last, first)| last - first),
            None => self.period_s.map(|period_s| period_s * self.rows as f64),
        };
        let ends_s = self.begins_s.zip(lasts_s).map(|(begins_s, lasts_s)| begins_s + lasts_s);
        ends_s.zip(other.begins_s).is_some_and(|(ends_s, begins_s)| ends_s <= begins_s)
    }

    /// Checks that another cut states its instants as this one does: one reader takes the instants of both.
    ///
    /// # Errors
    /// Its period is another one, or only one of both has a period or times. The error names the mend.
    fn has_rate_of(&self, other: &Self) -> Result<(), String> {
        match (self.period_s, other.period_s) {
            (Some(one), Some(own)) if (own / one - 1.0).abs() > DIFFERS => {
                return Err(two_rates(1.0 / one, 1.0 / own));
            }
            (Some(_), Some(_)) | (None, None) if self.time.is_some() == other.time.is_some() => {}
            _ => {
                return Err(
                    "states its instants in another way: give both a sampling period, or both a column of times"
                        .into(),
                );
            }
        }
        Ok(())
    }
}

/// Checks that the values of two channels belong to the same instants. Those of one group do, unless they begin at different times.
///
/// # Errors
/// They do not, or nothing says so. The error names the mend.
fn simultaneous(one: Place, other: Place, layout: &Layout) -> Result<(), String> {
    const MEND: &str = "record them in one group, started at once by one clock";
    let time = |group: &Group| {
        group.channels.iter().find(|own| layout.is_time(&own.name)).map(|own| own.values.clone())
    };
    // Such a difference is a delay of the record, and the fit allows for one of this size.
    let most_s = Accuracies::typical().record_delay;
    let is_same = |one: f64, other: f64| (one - other).abs() <= most_s;
    let begin = one.1.begins_s.zip(other.1.begins_s);
    let is_one = std::ptr::eq(one.0, other.0);
    let are_same = match (time(one.0), time(other.0)) {
        _ if begin.is_some_and(|(one, other)| !is_same(one, other)) => false,
        _ if is_one => true,
        (Some(one), Some(other)) => {
            one.len() == other.len()
                && one.iter().zip(&other).all(|(one, other)| is_same(*one, *other))
        }
        (None, None) if begin.is_some() => true,
        _ => return Err(format!("do not both state their times: {MEND}")),
    };
    if are_same { Ok(()) } else { Err(format!("have different instants: {MEND}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(joints: &[&str]) -> Layout {
        let axes = ["Fx", "Fy", "Fz", "ax", "ay", "az"].map(str::to_owned);
        let joints = joints.iter().map(|name| (name.to_string(), false)).collect();
        Layout { axes, joints, rate_hz: None, base: None, topics: None }
    }

    fn channel(name: &str, unit: &str, values: &[f64]) -> Channel {
        Channel {
            name: name.to_owned(),
            unit: unit.to_owned(),
            values: values.to_vec(),
            period_s: Some(1e-3),
            begins_s: None,
        }
    }

    /// The channels of force, kN, and acceleration, each 0, 1, 2.
    fn group(name: &str, names: &[&str], begins_s: Option<f64>) -> Group {
        let unit = |name: &str| if name.starts_with('F') { "kN" } else { "g" };
        let own = |own: &&str| channel(own, unit(own), &[0.0, 1.0, 2.0]);
        let channels = names.iter().map(|name| Channel { begins_s, ..own(name) }).collect();
        Group { name: name.to_owned(), channels }
    }

    const ALL: [&str; 6] = ["Fx", "Fy", "Fz", "ax", "ay", "az"];

    fn rows(groups: &[Group], layout: &Layout) -> Result<Vec<Row>, String> {
        let mut channels = Channels::new(Path::new("cut"), groups.to_vec(), layout)
            .map_err(|error| error.to_string())?;
        let mut rows = Vec::new();
        while let Some(row) = channels.next().map_err(|error| error.to_string())? {
            rows.push(row);
        }
        Ok(rows)
    }

    #[test]
    fn channels_are_columns_with_the_units_of_the_file() {
        let mut own = group("cut", &ALL, None);
        own.channels.push(channel("q1", "deg", &[90.0]));
        own.channels[3].values[1] = f64::INFINITY;
        let rows = rows(&[own], &layout(&["q1"])).unwrap();
        assert_eq!(rows.len(), 3);
        assert_eq!((rows[2].axes[0], rows[2].axes[3]), (2000.0, 2.0 * 9.80665));
        assert!(rows[1].axes[3].is_nan());
        assert_eq!(rows[2].joints[0], 90_f64.to_radians());
    }

    #[test]
    fn groups_are_cuts_or_parts_of_one() {
        let of = |groups: &[Group]| rows(groups, &layout(&[]));
        let begins: Vec<_> = of(&[group("b", &ALL, Some(20.0)), group("a", &ALL, Some(0.0))])
            .unwrap()
            .into_iter()
            .map(|row| row.begins)
            .collect();
        assert_eq!(begins, [false, false, false, true, false, false]);
        for begins_s in [None, Some(0.0)] {
            let error = of(&[group("raw", &ALL, begins_s), group("filtered", &ALL, begins_s)]);
            assert!(error.unwrap_err().ends_with("name the group in [signals], as in \"raw/Fx\""));
        }
        let parts =
            |late_s| [group("a", &ALL[..3], Some(0.0)), group("b", &ALL[3..], Some(late_s))];
        assert_eq!(of(&parts(1e-6)).unwrap().len(), 3);
        let error = of(&parts(1e-4)).unwrap_err();
        assert!(
            error.contains("\"ax\" of the group \"b\" and \"Fx\" of \"a\" have different instants"),
            "{error}"
        );
        // Nothing says that these began at once.
        let error = of(&[group("a", &ALL[..3], None), group("b", &ALL[3..], None)]).unwrap_err();
        assert!(
            error.contains("do not both state their times: record them in one group"),
            "{error}"
        );
        let mut late = group("a", &ALL, Some(0.0));
        late.channels[4].begins_s = Some(0.01);
        let error = of(&[late]).unwrap_err();
        assert!(
            error.contains("\"ay\" of the group \"a\" and \"Fx\" of \"a\" have different"),
            "{error}"
        );
        let named = Layout { axes: ALL.map(|name| format!("raw/{name}")), ..layout(&[]) };
        let both = [group("raw", &ALL, None), group("filtered", &ALL, None)];
        assert_eq!(rows(&both, &named).unwrap().len(), 3);
    }

    #[test]
    fn cuts_have_one_rate() {
        let with = |period_s: Option<f64>| {
            let mut own = group("b", &ALL, Some(20.0));
            own.channels.iter_mut().for_each(|own| own.period_s = period_s);
            own
        };
        let first = || group("a", &ALL, Some(0.0));
        let of = |own: Group| rows(&[first(), own], &layout(&[]));
        assert_eq!(of(with(Some(1e-3))).unwrap().len(), 6);
        let error = of(with(Some(2e-3))).unwrap_err();
        let expected = "cut: has the groups \"a\" and \"b\": the second comes at 500.0 Hz, and what is before at 1000.0 Hz";
        assert!(error.starts_with(expected), "{error}");
        let error = of(with(None)).unwrap_err();
        assert!(error.contains("the second states its instants in another way: "), "{error}");
        let mut timed = with(Some(1e-3));
        timed.channels.push(channel("time", "s", &[20.0, 20.001, 20.002]));
        let error = of(timed).unwrap_err();
        assert!(error.contains("the second states its instants in another way: "), "{error}");
    }

    #[test]
    fn time_is_that_of_the_group_of_the_first_axis() {
        let with_time = |mut own: Group, times: &[f64]| {
            own.channels.insert(0, channel("time", "s", times));
            own
        };
        let times = [0.0, 1e-3, 2e-3];
        let groups = [
            with_time(Group { name: "rpm".into(), ..Group::default() }, &[0.0]),
            with_time(group("F", &ALL[..3], None), &times),
            with_time(group("a", &ALL[3..], None), &times),
        ];
        let rows = rows(&groups, &layout(&[])).unwrap();
        assert_eq!(rows.iter().filter_map(|row| row.time_s).collect::<Vec<_>>(), times);
    }

    #[test]
    fn mistakes_are_named() {
        let of = |change: &dyn Fn(&mut Group)| {
            let mut own = group("cut", &ALL, None);
            change(&mut own);
            rows(&[own], &layout(&[])).unwrap_err()
        };
        for (change, expected) in [
            (
                &(|own: &mut Group| own.channels[2].name = "F_z".into()) as &dyn Fn(&mut Group),
                "cut: has no column \"Fz\": it has \"Fx\", \"Fy\", \"F_z\", \"ax\"",
            ),
            (
                &|own| own.channels[3].unit = "V".into(),
                "cut: column \"ax\" has unit \"V\": acceleration must be in one of m/s^2",
            ),
            (
                &|own| own.channels[3].unit.clear(),
                "cut: column \"ax\" has no unit, and another axis has",
            ),
            (
                &|own| own.channels[4].values.truncate(2),
                "cut: column \"ay\" has 2 values, and \"Fx\" has 3: ",
            ),
            (
                &|own| own.channels[5].period_s = Some(2e-3),
                "cut: comes at 500.0 Hz, and what is before at 1000.0 Hz",
            ),
            (
                &|own| own.channels.push(channel("time", "s", &[0.0, f64::NAN, 1.0])),
                "cut: row 2 has NaN for its time",
            ),
            (
                &|own| own.channels.push(own.channels[0].clone()),
                "cut: column \"Fx\" is there twice: ",
            ),
        ] {
            let error = of(change);
            assert!(error.starts_with(expected), "{error}\n{expected}");
        }
    }
}
