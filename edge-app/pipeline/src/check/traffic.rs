//! The frames of each identifier, or the readings of a table, counted on their way to the intake.

use std::collections::HashMap;
use std::io;
use std::time::Duration;

use embedded_can::Id;
use flexid_core::stream::{CYCLE_S, Reading, SILENCE_S};
use flexid_wire::misfits::FrameId;

use crate::config::Config;
use crate::intake::frame_id;
use crate::signals::SignalTable;
use crate::source::{Arrival, Content, Flow, Frame, FrameKind, FrameSource, SourceHealth};

/// Most identifiers without a signal that are told apart.
const MOST: usize = 256;

/// An identifier and its frames, or columns of a table and their readings.
#[derive(Clone, Debug, PartialEq)]
pub struct Identifier {
    /// The identifier. `None` of columns.
    pub id: Option<FrameId>,
    /// Names of the values that the DBC file has in it, as far as the config names them; names of the columns.
    pub signals: Vec<String>,
    /// True if its frames carry force or acceleration, and come at the sampling rate.
    pub is_sampled: bool,
    /// Frames that came.
    pub traffic: Traffic,
}

/// Frames of one identifier.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Number of frames, requests among them. Requests do not count for the rate.
    pub frames: u64,
    /// Number of intervals between frames, without silences.
    pub intervals: u64,
    /// Sum of these intervals, s.
    pub seconds: f64,
    /// Time of the newest frame, s.
    pub newest_s: f64,
    /// Number of silences of the whole bus before that.
    pub silences: u64,
    /// Number of frames of force or acceleration that came again, bit by bit, with their counter. They do not count for the rate.
    pub again: u64,
}

impl Traffic {
    fn note(&mut self, time_s: f64, silences: u64, longest_s: f64) {
        let interval = time_s - self.newest_s;
        let goes_on = self.frames > 0 && self.silences == silences;
        if goes_on && (0.0..=longest_s).contains(&interval) {
            self.intervals += 1;
            self.seconds += interval;
        }
        self.frames += 1;
        (self.newest_s, self.silences) = (time_s, silences);
    }

    /// Returns the mean rate, Hz, silences left out: 0.5 s without any frame, 0.5 s without one of force or acceleration, 2 s without one
    /// of another identifier. Returns `None` for fewer than two frames between silences.
    pub fn rate_hz(&self) -> Option<f64> {
        (self.seconds > 0.0).then(|| self.intervals as f64 / self.seconds)
    }
}

/// Returns each name once, without those of axes that are not measured.
fn named(names: &[String]) -> Vec<String> {
    let mut named: Vec<String> = names.iter().filter(|name| !name.is_empty()).cloned().collect();
    named.dedup();
    named
}

/// A source whose frames are counted.
pub(super) struct Watched<'a> {
    source: &'a mut dyn FrameSource,
    table: &'a SignalTable,
    expected: HashMap<Id, Traffic>,
    /// Readings of tables: force, acceleration, then the joints, base first.
    readings: Vec<Traffic>,
    /// Newest frame of each identifier that has a counter.
    newest: HashMap<Id, Frame>,
    unexpected: HashMap<Id, Traffic>,
    /// Time of the first frame, s.
    began_s: Option<f64>,
    /// Time of the newest frame, s.
    heard_s: Option<f64>,
    /// Number of times that no frame came.
    silences: u64,
}

impl<'a> Watched<'a> {
    /// Makes a source that has not read any frame.
    pub(super) fn new(config: &'a Config, source: &'a mut dyn FrameSource) -> Self {
        let table = &config.signals;
        let expected = table.identifiers().into_iter().map(|id| (id, Traffic::default())).collect();
        Self {
            source,
            table,
            expected,
            readings: vec![Traffic::default(); 2 + table.joints.len()],
            newest: HashMap::new(),
            unexpected: HashMap::new(),
            began_s: None,
            heard_s: None,
            silences: 0,
        }
    }

    /// Returns the identifiers of the table with their frames, in its order.
    pub(super) fn expected(&self) -> Vec<Identifier> {
        if self.table.is_of_columns() {
            return self.columns().collect();
        }
        let all = self.table.identifiers().into_iter();
        all.map(|id| self.identifier(id, self.expected.get(&id).copied().unwrap_or_default()))
            .collect()
    }

    /// Returns the columns of force, acceleration and joints with their readings.
    fn columns(&self) -> impl Iterator<Item = Identifier> {
        let (force, acceleration) = self.table.axes.split_at(3);
        let sensors = [(force, true), (acceleration, true)].into_iter();
        let joints = self.table.joints.iter().map(|joint| (std::slice::from_ref(joint), false));
        sensors.chain(joints).zip(&self.readings).map(|((names, is_sampled), traffic)| Identifier {
            id: None,
            signals: named(names),
            is_sampled,
            traffic: *traffic,
        })
    }

    /// Returns the other identifiers, the most frequent first, and equally frequent ones in ascending order.
    pub(super) fn unexpected(&self) -> Vec<Identifier> {
        let all = self.unexpected.iter().map(|(id, traffic)| self.identifier(*id, *traffic));
        let mut all: Vec<_> = all.collect();
        all.sort_by_key(|other| (u64::MAX - other.traffic.frames, other.id));
        all
    }

    fn identifier(&self, id: Id, traffic: Traffic) -> Identifier {
        Identifier {
            id: Some(frame_id(id)),
            signals: self.table.names(id).into_iter().map(str::to_owned).collect(),
            is_sampled: self.table.is_sampled(id),
            traffic,
        }
    }

    /// Returns the time of the first frame, s.
    pub(super) fn began_s(&self) -> Option<f64> {
        self.began_s
    }

    /// Returns the identifiers of the table that came on another bus, with its name.
    pub(super) fn elsewhere(&self) -> Vec<(FrameId, String)> {
        let mut all = self.source.health().elsewhere;
        all.retain(|other| self.expected.contains_key(&other.id));
        all.sort_by_key(|other| u64::MAX - other.frames);
        all.into_iter().map(|other| (frame_id(other.id), other.bus)).collect()
    }

    fn note(&mut self, Arrival { time_s, content }: &Arrival) {
        if matches!(content, Content::Frame(frame) if frame.kind == FrameKind::Error) {
            return;
        }
        self.began_s.get_or_insert(*time_s);
        let before_s = self.heard_s.replace(*time_s).unwrap_or(*time_s);
        self.silences += u64::from(!(0.0..=SILENCE_S).contains(&(time_s - before_s)));
        let silences = self.silences;
        let frame = match content {
            Content::Frame(frame) => frame,
            Content::Reading(reading) => {
                let (place, longest_s) = match reading {
                    Reading::Force { .. } => (0, SILENCE_S),
                    Reading::Acceleration { .. } => (1, SILENCE_S),
                    Reading::Joint { index, .. } => (2 + usize::from(*index), CYCLE_S),
                    Reading::Setup(_) => return,
                };
                if let Some(traffic) = self.readings.get_mut(place) {
                    traffic.note(*time_s, silences, longest_s);
                }
                return;
            }
        };
        if let Some(traffic) = self.expected.get_mut(&frame.id) {
            let is_sampled = self.table.is_sampled(frame.id);
            if frame.kind == FrameKind::Remote || frame.data().is_empty() {
                // A request. The answer follows.
                traffic.frames += 1;
                return;
            }
            let is_counted = self.table.is_counted(frame.id);
            if is_counted && self.newest.insert(frame.id, *frame) == Some(*frame) {
                traffic.frames += 1;
                traffic.again += 1;
                return;
            }
            traffic.note(*time_s, silences, if is_sampled { SILENCE_S } else { CYCLE_S });
        } else if self.unexpected.contains_key(&frame.id) || self.unexpected.len() < MOST {
            self.unexpected.entry(frame.id).or_default().note(*time_s, silences, CYCLE_S);
        }
    }
}

impl FrameSource for Watched<'_> {
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        let before = batch.len();
        let flow = self.source.read(batch, timeout);
        batch[before..].iter().for_each(|arrival| self.note(arrival));
        flow
    }

    fn health(&self) -> SourceHealth {
        self.source.health()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_leaves_out_silences() {
        let mut traffic = Traffic::default();
        assert_eq!(traffic.rate_hz(), None);
        for start in [100.0, 200.0, 50.0] {
            for sample in 0..1001 {
                traffic.note(start + 0.001 * f64::from(sample), 0, SILENCE_S);
            }
        }
        assert_eq!(traffic.frames, 3003);
        let rate = traffic.rate_hz().unwrap();
        assert!((rate - 1000.0).abs() < 1e-6, "{rate}");
        // Joint angles come every 0.1 s, and the bus is silent for 1 s.
        let mut traffic = Traffic::default();
        for (silences, start) in [(0, 0.0), (1, 2.0)] {
            for reading in 0..11 {
                traffic.note(start + 0.1 * f64::from(reading), silences, CYCLE_S);
            }
        }
        let rate = traffic.rate_hz().unwrap();
        assert!((rate - 10.0).abs() < 1e-6, "{rate}");
    }
}
