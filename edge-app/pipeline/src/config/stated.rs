//! Section `[accuracy]` as it stands in the file.

use std::collections::BTreeMap;
use std::fmt;

use flexid_core::imperfection::{ENTRIES, Entry};
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// Key that is no accuracy.
const ASSUME: &str = "assume";
/// All keys.
const KEYS: [&str; ENTRIES.len() + 1] = {
    let (mut keys, mut place) = ([ASSUME; ENTRIES.len() + 1], 0);
    while place < ENTRIES.len() {
        keys[place + 1] = ENTRIES[place].key;
        place += 1;
    }
    keys
};

/// Accuracies that are assumed where the section does not state them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Assumed {
    /// Those of a careful integrator.
    #[default]
    Typical,
    /// Nothing is off.
    Perfect,
}

/// Standard deviations of what may be off.
#[derive(Default)]
pub(super) struct AccuracySection {
    pub(super) assume: Assumed,
    /// By the keys of [`ENTRIES`].
    pub(super) stated: BTreeMap<&'static str, f64>,
}

/// A key of the section; `None` of [`ASSUME`].
struct Key(Option<&'static Entry>);

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfKey;

        impl Visitor<'_> for OfKey {
            type Value = Key;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("field identifier")
            }

            fn visit_str<E: de::Error>(self, key: &str) -> Result<Key, E> {
                let entry = ENTRIES.iter().find(|entry| entry.key == key);
                if entry.is_none() && key != ASSUME {
                    return Err(E::unknown_field(key, &KEYS));
                }
                Ok(Key(entry))
            }
        }

        deserializer.deserialize_identifier(OfKey)
    }
}

impl<'de> Deserialize<'de> for AccuracySection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfSection;

        impl<'de> Visitor<'de> for OfSection {
            type Value = AccuracySection;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("struct AccuracySection")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<AccuracySection, A::Error> {
                let mut section = AccuracySection::default();
                while let Some(Key(entry)) = map.next_key()? {
                    match entry {
                        None => section.assume = map.next_value()?,
                        Some(entry) => {
                            section.stated.insert(entry.key, map.next_value()?);
                        }
                    }
                }
                Ok(section)
            }
        }

        deserializer.deserialize_struct("AccuracySection", &KEYS, OfSection)
    }
}
