//! The objects of a file: their properties, and the values of channels.

use std::collections::HashMap;

use super::super::bytes::{Order, Reader};
use super::super::channels::{Channel, Group};
use super::super::layout::Layout;
use super::chunk::{Block, Index, values};
use super::properties::{Properties, Property};
use super::scales::scale;

/// Codes of the description of an object: without values in this segment, and with values as in the segment before.
const NO_DATA: u32 = u32::MAX;
const AS_BEFORE: u32 = 0;
/// Properties that say at which instants values are.
const INSTANTS: [&str; 3] = ["wf_start_time", "wf_start_offset", "wf_increment"];

/// How the values of a segment stand in its chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrangement {
    /// Each channel in one piece.
    Pieces,
    /// The values of an instant together.
    Together,
    /// In the buffers of DAQmx.
    Buffers,
}

/// The objects so far, and those of the present segment in the order of their values.
#[derive(Default)]
pub(super) struct Objects {
    all: Vec<Object>,
    /// Places of the objects by their paths.
    places: HashMap<String, usize>,
    present: Vec<usize>,
}

/// The file, a group or a channel.
#[derive(Default)]
struct Object {
    /// Group and channel. `None` of another object.
    name: Option<(String, String)>,
    is_wanted: bool,
    properties: Properties,
    index: Option<Index>,
    values: Vec<f64>,
}

impl Objects {
    /// Takes the description of a segment. Its objects are others than those of the segment before if `is_new`.
    ///
    /// # Errors
    /// It is cut off, has a type that is not known, or gives new instants to values that came.
    pub(super) fn describe(
        &mut self,
        reader: &mut Reader,
        is_new: bool,
        layout: &Layout,
    ) -> Result<(), String> {
        if is_new {
            self.present.clear();
        }
        for _ in 0..reader.u32()? {
            let path = String::from_utf8_lossy(reader.text()?).into_owned();
            let place = *self.places.entry(path.clone()).or_insert(self.all.len());
            if place == self.all.len() {
                let name = names(&path);
                let is_wanted = name.as_ref().is_some_and(|(group, own)| layout.wants(group, own));
                self.all.push(Object { name, is_wanted, ..Object::default() });
            }
            let object = &mut self.all[place];
            let has_data = match reader.u32()? {
                NO_DATA => false,
                AS_BEFORE => object.index.is_some(),
                code => {
                    object.index = Some(Index::read(code, reader)?);
                    true
                }
            };
            self.present.retain(|own| *own != place || has_data);
            if has_data && !self.present.contains(&place) {
                self.present.push(place);
            }
            for _ in 0..reader.u32()? {
                let name = String::from_utf8_lossy(reader.text()?).into_owned();
                let value = Property::read(reader)?;
                object.keeps_instants(&name, &value)?;
                object.properties.insert(name, value);
            }
        }
        Ok(())
    }

    /// Takes the values of a segment. Returns false if its last chunk is not whole, and bytes are left over.
    ///
    /// # Errors
    /// The description and the values contradict each other.
    pub(super) fn take(
        &mut self,
        data: &[u8],
        arrangement: Arrangement,
        order: Order,
    ) -> Result<bool, String> {
        let index = |place: &usize| Some((*place, self.all[*place].index.as_ref()?));
        let present: Vec<(usize, &Index)> = self.present.iter().filter_map(index).collect();
        let mut blocks = match arrangement {
            _ if data.is_empty() => return Ok(true),
            Arrangement::Pieces => Block::pieces(&present)?,
            Arrangement::Together => Block::together(&present)?,
            Arrangement::Buffers => Block::buffers(&present)?,
        };
        blocks.iter_mut().for_each(|block| block.retain(|place| self.all[place].is_wanted));
        Ok(values(data, &blocks, order, |place, value| self.all[place].values.push(value)))
    }

    /// Returns the channels in their groups, scaled.
    ///
    /// # Errors
    /// A scale is not read. The error names the channel.
    pub(super) fn groups(self) -> Result<Vec<Group>, String> {
        let mut groups: Vec<Group> = Vec::new();
        for Object { name, properties, index, mut values, .. } in self.all {
            let Some((group, name)) = name else { continue };
            let place = match groups.iter().position(|own| own.name == group) {
                Some(place) => place,
                None => {
                    groups.push(Group { name: group, ..Group::default() });
                    groups.len() - 1
                }
            };
            let raw = match index {
                Some(Index::Raw(raw)) => Some(raw.scale),
                _ => None,
            };
            scale(&mut values, &properties, raw)
                .map_err(|message| format!("channel {name:?} {message}"))?;
            let number = |key: &str| properties.number(key);
            let units = ["unit_string", "NI_UnitDescription"].map(|key| properties.text(key));
            let unit = units.into_iter().flatten().find(|unit| !unit.is_empty());
            let period_s = number("wf_increment").filter(|own| *own > 0.0 && own.is_finite());
            let begins_s = number("wf_start_time")
                .map(|own| own + number("wf_start_offset").unwrap_or_default());
            let unit = unit.unwrap_or_default().to_owned();
            groups[place].channels.push(Channel { name, unit, values, period_s, begins_s });
        }
        Ok(groups)
    }
}

impl Object {
    /// Checks that a property does not give new instants to values that came: those before and behind a pause are two recordings.
    fn keeps_instants(&self, key: &str, value: &Property) -> Result<(), String> {
        let (Some(before), Property::Number(own)) = (self.properties.number(key), value) else {
            return Ok(());
        };
        if !INSTANTS.contains(&key) || self.values.is_empty() || before == *own {
            return Ok(());
        }
        let (group, name) = self.name.clone().unwrap_or_default();
        Err(format!(
            "channel {name:?} of the group {group:?} has another {key} after its first values: write each recording into a group of its own"
        ))
    }
}

/// Returns group and channel of a path, `/'cut'/'Fx'`. A quote in a name stands twice. `None` of another object.
fn names(path: &str) -> Option<(String, String)> {
    let inner = path.strip_prefix("/'")?.strip_suffix('\'')?;
    let (group, channel) = inner.split_once("'/'")?;
    Some((group.replace("''", "'"), channel.replace("''", "'")))
}
