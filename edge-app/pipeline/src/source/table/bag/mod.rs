//! Bags of ROS 2 in MCAP: force, acceleration and joint angles by their topics.
//!
//! Force and acceleration may have the same instants, as one driver stamps them: a message of one is paired with that of the other whose stamp is
//! nearest. Else each has a clock of its own, and a row holds one of them. Joint angles come at any rate.
//!
//! | module    | holds                     |
//! | --------- | ------------------------- |
//! | `cdr`     | messages                  |
//! | `records` | records of the file       |

mod cdr;
mod records;

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::layout::{Layout, Topics};
use super::rates::DIFFERS;
use super::row::{Row, RowSource};
use crate::input::BadInput;
use cdr::{Stamped, Vector};
use records::{Record, Records};

/// Messages of force and of acceleration by which it is judged how these go together: four seconds at 1 kHz.
const PROBED: usize = 4096;
/// Most messages of one that wait for the other, or for the first of all joints. A writer of chunks may keep a topic back for a second, and joints come
/// at 10 Hz and faster.
const WAITING: usize = 1 << 16;
/// Largest difference of both stamps, s, largest scatter of it, and largest change of its mean: the delay that is taken for typical
/// (`Accuracies::typical` in core).
const SCATTER_S: f64 = 20e-6;
/// Pairs over which that mean is taken.
const AVERAGED: u32 = 256;
/// Most topics that an error lists.
const LISTED: usize = 20;

/// What a topic holds.
#[derive(Clone, Copy, Debug)]
enum Content {
    Force(Vector),
    Acceleration(Vector),
    Joints,
}

/// Vectors of a topic that have not yet become rows, with their stamps, ns, oldest first.
type Waiting = VecDeque<(i64, [f64; 3])>;

/// The rows of a bag.
pub(super) struct Bag<R> {
    file: PathBuf,
    records: Records<R>,
    topics: Topics,
    /// Names of the joints, base first. Empty if their angles stand elsewhere.
    joints: Vec<String>,
    schemas: HashMap<u16, String>,
    contents: HashMap<u16, Content>,
    /// Topics of the bag and their types.
    present: BTreeMap<String, String>,
    /// Names of joints that came.
    named: BTreeSet<String>,
    force: Waiting,
    acceleration: Waiting,
    /// Angles, rad (m), with their stamps, ns.
    states: VecDeque<(i64, Vec<f64>)>,
    /// The newest of them.
    angles: Vec<f64>,
    period_ns: f64,
    /// Time by which the acceleration's stamp is later than the force's, ns.
    offset_ns: f64,
    /// True if the stamps of both are those of two clocks.
    has_own_clocks: bool,
    /// Sum of the changes of this difference, ns, and number of pairs.
    changes: (f64, u32),
    rows: u64,
    /// What comes behind all that waits: an error, once, or the end.
    end: Option<Option<io::Error>>,
    /// True once that error came.
    has_broken: bool,
}

impl<R: Read + Send> Bag<R> {
    /// Opens a bag, and reads enough of it to judge how force and acceleration go together.
    ///
    /// # Errors
    /// A topic is missing or of another type, or the stamps of force and acceleration do not go together.
    pub(super) fn open(file: &Path, bytes: R, layout: &Layout) -> Result<Self, BadInput> {
        let none = Topics { wrench: String::new(), acceleration: String::new(), joints: None };
        let joints: Vec<String> = layout.joints.iter().map(|(name, _)| name.clone()).collect();
        let mut bag = Self {
            file: file.to_owned(),
            records: Records::new(bytes),
            topics: layout.topics.clone().unwrap_or(none),
            angles: vec![f64::NAN; joints.len()],
            joints,
            schemas: HashMap::new(),
            contents: HashMap::new(),
            present: BTreeMap::new(),
            named: BTreeSet::new(),
            force: VecDeque::new(),
            acceleration: VecDeque::new(),
            states: VecDeque::new(),
            period_ns: 0.0,
            offset_ns: 0.0,
            has_own_clocks: false,
            changes: (0.0, 0),
            rows: 0,
            end: None,
            has_broken: false,
        };
        let is_probed = |bag: &Self| {
            let [one, other] = [&bag.force, &bag.acceleration].map(VecDeque::len);
            (one.min(other) >= PROBED && bag.has_joints()) || one.max(other) >= WAITING
        };
        while !is_probed(&bag) && bag.end.is_none() {
            bag.advance();
        }
        bag.judge(layout).map_err(|message| BadInput::new(file, message))?;
        Ok(bag)
    }

    /// Returns whether all joints came that are taken from a topic, or as many others as an error lists.
    fn has_joints(&self) -> bool {
        self.topics.joints.is_none()
            || self.named.len() >= LISTED
            || self.joints.iter().all(|name| self.named.contains(name))
    }

    /// Takes the next record.
    fn advance(&mut self) {
        let taken = match self.records.next() {
            Ok(Some(record)) => self.take(record),
            Ok(None) => {
                self.end = Some(None);
                Ok(())
            }
            // It has its mend.
            Err(error) if error.kind() == io::ErrorKind::Unsupported => Err(error.to_string()),
            Err(error) => Err(format!("{error}: copy or record it again")),
        };
        if let Err(message) = taken {
            self.end = Some(Some(io::Error::other(BadInput::new(&self.file, message))));
        }
    }

    fn take(&mut self, record: Record) -> Result<(), String> {
        match record {
            Record::Schema { id, name } => drop(self.schemas.insert(id, name)),
            Record::Channel { id, schema, topic, encoding } => {
                let name = self.schemas.get(&schema).cloned().unwrap_or_default();
                let content = self.content(&topic, &name)?;
                if let Some(content) = content {
                    if encoding != "cdr" {
                        return Err(format!(
                            "has {topic} in the encoding {encoding:?}, and cdr is read: convert the bag with `pip install rosbags; rosbags-convert`"
                        ));
                    }
                    self.contents.insert(id, content);
                }
                self.present.insert(topic, name);
            }
            Record::Message { channel, log_ns, data } => {
                let Some(content) = self.contents.get(&channel).copied() else { return Ok(()) };
                let at = |stamp_ns: Option<u64>| i64::try_from(stamp_ns.unwrap_or(log_ns));
                let taken = match content {
                    Content::Force(vector) => {
                        vector.read(&data).and_then(|Stamped { stamp_ns, value }| {
                            self.force.push_back((at(stamp_ns).ok()?, value));
                            Some(())
                        })
                    }
                    Content::Acceleration(vector) => {
                        vector.read(&data).and_then(|Stamped { stamp_ns, value }| {
                            self.acceleration.push_back((at(stamp_ns).ok()?, value));
                            Some(())
                        })
                    }
                    Content::Joints => {
                        cdr::joints(&data, &self.joints).and_then(|Stamped { stamp_ns, value }| {
                            if self.named.len() < LISTED {
                                self.named.extend(cdr::joint_names(&data)?);
                            }
                            // Of the angles before the first force the newest are enough.
                            if self.force.is_empty() && self.states.len() >= WAITING {
                                self.take_state();
                            }
                            self.states.push_back((at(stamp_ns).ok()?, value));
                            Some(())
                        })
                    }
                };
                taken.ok_or(
                    "has a message that is shorter than its type, or is no CDR: record it again",
                )?;
            }
        }
        Ok(())
    }

    /// Returns what is taken from a topic of this type.
    fn content(&self, topic: &str, name: &str) -> Result<Option<Content>, String> {
        let Topics { wrench, acceleration, joints } = &self.topics;
        let (known, own) = if topic == wrench {
            (
                "wrench must be geometry_msgs/WrenchStamped",
                Vector::of_force(name).map(Content::Force),
            )
        } else if topic == acceleration {
            let own = Vector::of_acceleration(name).map(Content::Acceleration);
            ("acceleration must be sensor_msgs/Imu or geometry_msgs/AccelStamped", own)
        } else if joints.as_deref() == Some(topic) {
            (
                "joints must be sensor_msgs/JointState",
                cdr::is_of_joints(name).then_some(Content::Joints),
            )
        } else {
            return Ok(None);
        };
        own.map(Some).ok_or_else(|| {
            format!("has messages of type {name} on {topic}: [topics] {known}: name another topic")
        })
    }

    /// Checks what was read so far, and finds period and offset.
    fn judge(&mut self, layout: &Layout) -> Result<(), String> {
        if layout.topics.is_none() {
            return Err(format!(
                "is a bag of ROS 2, and the configuration does not name its topics: it has {}: \
                 add [topics] wrench = \"...\", acceleration = \"...\", and joints = \"...\" or [recording] poses",
                self.listed()
            ));
        }
        let Topics { wrench, acceleration, joints } = &self.topics;
        let joints = joints.iter().filter(|_| !self.joints.is_empty());
        let is_there = |topic: &String| self.present.contains_key(topic);
        // Of a bag that is damaged at once, the damage is the reason.
        let whole = |message: String| match &self.end {
            Some(Some(error)) => {
                match error.get_ref().and_then(|own| own.downcast_ref::<BadInput>()) {
                    Some(own) => own.message.clone(),
                    None => message,
                }
            }
            _ => message,
        };
        if let Some(topic) =
            [wrench, acceleration].into_iter().chain(joints.clone()).find(|own| !is_there(own))
        {
            return Err(whole(format!(
                "has no topic {topic}: it has {}: correct [topics], or record it too",
                self.listed()
            )));
        }
        for (topic, is_empty) in
            [(wrench, self.force.is_empty()), (acceleration, self.acceleration.is_empty())]
        {
            if is_empty {
                return Err(whole(format!("has no message on {topic}: record it again")));
            }
        }
        if let Some(topic) = joints.clone().next() {
            let is_missing = |name: &&String| !self.named.contains(*name);
            if let Some(name) =
                self.joints.iter().find(is_missing).filter(|_| self.named.len() < LISTED)
            {
                let has: Vec<&str> = self.named.iter().map(String::as_str).collect();
                let within = if self.end.is_none() {
                    format!(" in its first {WAITING} messages of force or acceleration")
                } else {
                    String::new()
                };
                return Err(format!(
                    "has no joint {name:?} on {topic}{within}: it has {}: name its joints in [signals] joints, base first",
                    if has.is_empty() { "no message".to_owned() } else { has.join(", ") }
                ));
            }
        }
        let periods = [&self.force, &self.acceleration].map(period_ns);
        let [Some(one), Some(other)] = periods else {
            return Err(format!(
                "has stamps on {wrench} or {acceleration} that do not go on: let the driver set header.stamp"
            ));
        };
        self.period_ns = one;
        let mut apart = differences(&self.force, &self.acceleration, one / 2.0);
        if apart.len() * 2 < self.force.len().min(self.acceleration.len()) {
            return Err(format!(
                "has stamps on {wrench} and {acceleration} of other times: record both at once, and let one driver set header.stamp"
            ));
        }
        self.offset_ns = median(&mut apart);
        let mut scatter: Vec<f64> = apart.iter().map(|own| (own - self.offset_ns).abs()).collect();
        let scatter_s = 1e-9 * median(&mut scatter);
        // A delay of 0.45 ms is 32 degrees at 200 Hz: it would be taken for damping.
        self.has_own_clocks = (other / one - 1.0).abs() > DIFFERS
            || scatter_s > SCATTER_S
            || 1e-9 * self.offset_ns.abs() > SCATTER_S;
        if self.has_own_clocks {
            self.period_ns = one.max(other);
        }
        Ok(())
    }

    /// Lists the topics and their types.
    fn listed(&self) -> String {
        let all: Vec<String> =
            self.present.iter().take(LISTED).map(|(own, name)| format!("{own} ({name})")).collect();
        let more = self.present.len().saturating_sub(LISTED);
        match (all.is_empty(), more) {
            (true, _) => "none".to_owned(),
            (false, 0) => all.join(", "),
            (false, more) => format!("{} and {more} more", all.join(", ")),
        }
    }

    /// Returns force and acceleration of the next instant, ns, NaN where one is missing. Returns `None` while the other may come.
    fn pair(&mut self) -> Result<Option<(i64, [f64; 6])>, String> {
        let is_over = self.end.is_some();
        let may_come = |one: &Waiting| !is_over && one.len() < WAITING;
        let (force_ns, acceleration_ns) = match (self.force.front(), self.acceleration.front()) {
            (Some(_), None) if may_come(&self.force) => return Ok(None),
            (None, Some(_)) if may_come(&self.acceleration) => return Ok(None),
            (force, acceleration) => (force.map(|own| own.0), acceleration.map(|own| own.0)),
        };
        let missing = [f64::NAN; 3];
        let late_ns =
            force_ns.zip(acceleration_ns).map(|(force, own)| (own - force) as f64 - self.offset_ns);
        let half_ns = 0.5 * self.period_ns;
        let [has_force, has_acceleration] = match late_ns {
            Some(late_ns) if self.has_own_clocks => {
                let is_later = late_ns + self.offset_ns > 0.0;
                [is_later, !is_later]
            }
            Some(late_ns) => [late_ns >= -half_ns, late_ns <= half_ns],
            None => [force_ns.is_some(), acceleration_ns.is_some()],
        };
        let force = if has_force { self.force.pop_front() } else { None };
        let acceleration = if has_acceleration { self.acceleration.pop_front() } else { None };
        if let (Some(_), Some(_), Some(late_ns)) = (force, acceleration, late_ns) {
            let (sum, pairs) = (self.changes.0 + late_ns, self.changes.1 + 1);
            self.changes = if pairs == AVERAGED { (0.0, 0) } else { (sum, pairs) };
            let mean_s = 1e-9 * (sum / f64::from(pairs)).abs();
            if pairs == AVERAGED && mean_s > SCATTER_S {
                return Err(of_two_clocks(&self.topics, mean_s));
            }
        }
        let time_ns = match (force, acceleration) {
            (Some((own, _)), _) => own,
            (None, Some((own, _))) if self.has_own_clocks => own,
            (None, Some((own, _))) => own.saturating_sub(self.offset_ns as i64),
            (None, None) => return Ok(None),
        };
        let [[fx, fy, fz], [ax, ay, az]] =
            [force, acceleration].map(|own| own.map_or(missing, |own| own.1));
        Ok(Some((time_ns, [fx, fy, fz, ax, ay, az])))
    }

    /// Returns the angles at a time, if newer ones than before came.
    fn angles(&mut self, time_ns: i64) -> &[f64] {
        while self.states.front().is_some_and(|(own, _)| *own <= time_ns) {
            self.take_state();
        }
        &self.angles
    }

    /// Takes the oldest angles.
    fn take_state(&mut self) {
        for (angle, own) in
            self.angles.iter_mut().zip(self.states.pop_front().into_iter().flat_map(|own| own.1))
        {
            if own.is_finite() {
                *angle = own;
            }
        }
    }
}

impl<R: Read + Send> RowSource for Bag<R> {
    fn next(&mut self) -> io::Result<Option<Row>> {
        loop {
            let pair = self.pair().map_err(|message| self.error(self.rows + 1, &message))?;
            if let Some((time_ns, axes)) = pair {
                self.rows += 1;
                let axes =
                    axes.map(|value| if value.is_finite() { value as f32 } else { f32::NAN });
                let joints = self.angles(time_ns).iter().copied().collect();
                let time_s = Some(1e-9 * time_ns as f64);
                return Ok(Some(Row { line: self.rows, begins: false, time_s, axes, joints }));
            }
            match &mut self.end {
                None => self.advance(),
                Some(end) => {
                    let broken = end.take();
                    self.has_broken = broken.is_some();
                    return broken.map_or(Ok(None), Err);
                }
            }
        }
    }

    fn error(&self, row: u64, message: &str) -> io::Error {
        io::Error::other(BadInput::new(
            &self.file,
            format!("message {row} of the force: {message}"),
        ))
    }

    fn has_times(&self) -> bool {
        !self.has_own_clocks
    }

    fn has_own_clocks(&self) -> bool {
        self.has_own_clocks
    }

    fn period_s(&self) -> Option<f64> {
        Some(1e-9 * self.period_ns)
    }

    fn is_early_end(&self) -> bool {
        self.has_broken
    }
}

/// Returns the period of stamps, ns: the median over pairs that are some apart, since arrivals come in bursts. `None` if they do not go on.
fn period_ns(waiting: &Waiting) -> Option<f64> {
    let apart = (waiting.len() / 8).max(1);
    let pairs = waiting.iter().zip(waiting.iter().skip(apart));
    let steps = pairs.map(|(one, next)| (next.0 - one.0) as f64 / apart as f64);
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    (2 * steps.len() >= waiting.len().saturating_sub(apart) && !steps.is_empty())
        .then(|| median(&mut steps))
}

/// Returns the differences of the stamps that are within `most` ns of each other.
fn differences(one: &Waiting, other: &Waiting, most: f64) -> Vec<f64> {
    let (mut one, mut other) = (one.iter().peekable(), other.iter().peekable());
    let mut all = Vec::new();
    while let (Some((before, _)), Some((after, _))) = (one.peek(), other.peek()) {
        let apart = (after - before) as f64;
        if apart.abs() <= most {
            all.push(apart);
        }
        if apart <= most {
            other.next();
        }
        if apart >= -most {
            one.next();
        }
    }
    all
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

fn of_two_clocks(topics: &Topics, scatter_s: f64) -> String {
    format!(
        "the stamps of {} and {} change by {:.0} us against each other: they have clocks of their own; let one driver read both sensors and set header.stamp",
        topics.wrench,
        topics.acceleration,
        1e6 * scatter_s
    )
}
