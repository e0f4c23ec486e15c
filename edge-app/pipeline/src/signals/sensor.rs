//! A sensor that the config describes: its axes or channels, its counter, and the frames of a sample.

use std::collections::BTreeMap;

use embedded_can::Id;

use super::lookup::{Found, Lookup, Named, STEPS};
use super::map::{MOST_CHANNELS, Map};
use super::message::{Content, Part};
use super::{FINEST, Sensor, SignalTable};
use crate::config::{Axes, ChannelsSection};
use crate::input::BadInput;
use crate::units::Quantity;

/// What the config says of a sensor.
pub(super) struct Keys<'a> {
    /// 0: force, 1: acceleration.
    pub(super) sensor: usize,
    pub(super) key: &'static str,
    pub(super) axes: &'a Axes,
    pub(super) counter: Option<&'a String>,
    pub(super) unit: Option<&'a String>,
    pub(super) quantity: Quantity,
}

/// A sensor that was looked up.
pub(super) struct Looked<'a> {
    pub(super) sensor: Sensor,
    /// Names of the axes.
    pub(super) axes: [String; 3],
    /// Step of the coarsest axis, SI units.
    pub(super) resolution: f32,
    /// Width of the counter, bits.
    pub(super) counter_bits: Option<u32>,
    /// Its channels, and behind them the signals of its counter.
    pub(super) named: Vec<Named<'a>>,
    /// Number of the signals of its counter.
    pub(super) counters: usize,
}

impl<'a> Lookup<'a> {
    /// Looks up a sensor, and adds the frames of its samples to the table.
    pub(super) fn sensor(
        &self,
        keys: &Keys<'a>,
        table: &mut SignalTable,
    ) -> Result<Looked<'a>, BadInput> {
        let &Keys { sensor, key, axes, unit, ref quantity, .. } = keys;
        let channels: Vec<Named> = match &axes.channels {
            Some(map) => {
                let channel = |name: &'a String| {
                    let found = self.find(key, name)?;
                    Ok(Named { name, found, layout: self.layout(found)? })
                };
                map.channels.iter().map(channel).collect::<Result<_, BadInput>>()?
            }
            None => {
                let axis = |name: &'a String| {
                    let found = self.find(key, name)?;
                    let layout = self.scaled(found, quantity, Some((key, unit)))?;
                    Ok(Named { name, found, layout })
                };
                axes.names.iter().map(axis).collect::<Result<_, BadInput>>()?
            }
        };
        let map = axes.channels.as_ref().map(|map| self.map(keys, map)).transpose()?;
        let steps: Vec<f64> = channels.iter().map(|channel| channel.layout.step()).collect();
        let steps = map.as_ref().map_or_else(|| steps.clone(), |map| map.steps(&steps).to_vec());
        let resolution = steps.into_iter().fold(FINEST.into(), f64::max);
        if !STEPS.contains(&resolution) {
            return Err(self.bad_config(format!(
                "[signals] {key}: its step is {resolution:e} {}: no {key} is measured so",
                quantity.known()
            )));
        }
        let resolution = resolution as f32;
        let names = match &axes.channels {
            Some(_) => ["x", "y", "z"].map(|axis| format!("{key} {axis}")),
            None => {
                let mut names = channels.iter().map(|axis| axis.found.signal.name.clone());
                std::array::from_fn(|_| names.next().unwrap_or_default())
            }
        };
        let counters = self.counters(keys, &channels)?;
        let counter_bits = counters.first().map(|counter| counter.layout.length.into());

        // The frames of a sample, in the order of their identifiers.
        let mut parts: BTreeMap<Id, &can_dbc::Message> = BTreeMap::new();
        for own in channels.iter().chain(&counters) {
            parts.insert(self.id(own.found.message)?, own.found.message);
        }
        let is_in = |message: &can_dbc::Message| {
            let id = message.id;
            move |own: &&Named| own.found.message.id == id
        };
        for (number, &message) in parts.values().enumerate() {
            let counter = counters.iter().find(is_in(message));
            let own = channels.iter().enumerate().filter(|(_, own)| is_in(message)(own));
            let mut shown: Vec<&String> =
                own.clone().map(|(_, own)| &own.found.signal.name).collect();
            if shown.is_empty() {
                shown.extend(counter.map(|counter| &counter.found.signal.name));
            }
            let part = Part {
                sensor,
                number,
                counter: counter.map(|counter| counter.layout),
                channels: own.map(|(channel, own)| (channel, own.layout)).collect(),
            };
            self.add(message, Content::Part(part), &shown, table)?;
        }
        let sensor = Sensor { parts: parts.len(), is_counted: counters.len() == parts.len(), map };
        let of_counters = counters.len();
        let named = channels.into_iter().chain(counters).collect();
        Ok(Looked { sensor, axes: names, resolution, counter_bits, named, counters: of_counters })
    }

    /// Looks up the counter of a sensor with these `channels`. It is one signal, or a signal of this name in each frame of a sample.
    fn counters(&self, keys: &Keys<'a>, channels: &[Named]) -> Result<Vec<Named<'a>>, BadInput> {
        let Some(name) = keys.counter else { return Ok(Vec::new()) };
        let counter = |found| Ok(Named { name, found, layout: self.counter(found)? });
        let has_channel = |found: &Found| {
            channels.iter().any(|channel| std::ptr::eq(channel.found.message, found.message))
        };
        let of_name: Vec<Found> = self.all().filter(|found| found.signal.name == *name).collect();
        let is_in_each = channels.iter().all(|channel| {
            let is_beside = |found: &&Found| std::ptr::eq(found.message, channel.found.message);
            of_name.iter().filter(is_beside).count() == 1
        });
        if of_name.len() == 1 || !is_in_each {
            return Ok(vec![counter(self.find(&format!("{}_counter", keys.key), name)?)?]);
        }
        let counters = of_name.into_iter().filter(has_channel).map(counter);
        let counters: Vec<Named> = counters.collect::<Result<_, BadInput>>()?;
        if counters.iter().any(|counter| counter.layout.length != counters[0].layout.length) {
            return Err(self.bad_dbc(format!(
                "counter {name} has several widths: one counts the frames of a sample"
            )));
        }
        Ok(counters)
    }

    /// Returns the map from the channels of a sensor to its axes, SI units.
    fn map(&self, keys: &Keys, map: &ChannelsSection) -> Result<Map, BadInput> {
        let Keys { key, quantity, unit, .. } = keys;
        let bad = |message: String| self.bad_config(format!("[signals] {key}: {message}"));
        let size = match unit {
            Some(unit) => self.size(key, unit, quantity)?,
            None => 1.0,
        };
        let channels = map.channels.len();
        if !(3..=MOST_CHANNELS).contains(&channels) {
            return Err(bad(format!(
                "channels names {channels}: three axes follow from 3 to {MOST_CHANNELS}"
            )));
        }
        let rows = map.matrix.len();
        let (3 | 6, Some([x, y, z])) = (rows, map.matrix.first_chunk()) else {
            return Err(bad(format!(
                "matrix has {rows} rows: must have three, that give x, y and z, or three further ones, that give moments and are left out"
            )));
        };
        if let Some(row) = map.matrix.iter().find(|row| row.len() != channels) {
            return Err(bad(format!(
                "matrix has a row of {} numbers, and there are {channels} channels: write a number for each",
                row.len()
            )));
        }
        let offset = map.offset.unwrap_or_default();
        if !map.matrix.iter().flatten().chain(&offset).all(|number| number.is_finite()) {
            return Err(bad("matrix or offset has a number that is not finite".into()));
        }
        let columns = (0..channels).map(|channel| [x, y, z].map(|row| size * row[channel]));
        Map::new(columns.collect(), offset.map(|axis| size * axis)).ok_or_else(|| {
            bad("matrix does not tell x, y and z apart: its first three rows depend on each other".into())
        })
    }
}
