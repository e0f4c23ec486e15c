//! Properties of the objects of TDMS files: a name, and a number or a text.

use std::collections::HashMap;

use super::super::bytes::Reader;
use super::kind::Kind;

/// The value of a property.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Property {
    Number(f64),
    Text(String),
}

/// The newest properties of an object.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Properties(HashMap<String, Property>);

impl Property {
    /// Reads type and value.
    ///
    /// # Errors
    /// The file is cut off, or the type is not known.
    pub(super) fn read(reader: &mut Reader) -> Result<Self, String> {
        let code = reader.u32()?;
        let kind = Kind::of(code)
            .ok_or_else(|| format!("is damaged: a property is of type {code:#x}: copy it again"))?;
        Ok(match kind.size() {
            Some(size) => Self::Number(kind.value(reader.take(size)?, reader.order())),
            None => Self::Text(String::from_utf8_lossy(reader.text()?).into_owned()),
        })
    }
}

impl Properties {
    pub(super) fn insert(&mut self, name: String, value: Property) {
        self.0.insert(name, value);
    }

    pub(super) fn number(&self, name: &str) -> Option<f64> {
        match self.0.get(name) {
            Some(Property::Number(own)) => Some(*own),
            _ => None,
        }
    }

    pub(super) fn text(&self, name: &str) -> Option<&str> {
        match self.0.get(name) {
            Some(Property::Text(own)) => Some(own),
            _ => None,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}
