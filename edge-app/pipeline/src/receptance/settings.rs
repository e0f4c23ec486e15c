//! How modal tests were made.

use std::collections::BTreeMap;

use super::unit::Unit;

/// Fewest averages of which a coherence says something: that of one is 1.
const FEWEST: f64 = 2.0;

/// How modal tests were made.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of averages of each response.
    pub averages: Option<f64>,
    /// Standard deviation of each magnitude beside that of the coherence, relative.
    pub relative_floor: f64,
    /// The same, absolute, of the acceleration per force, 1/kg.
    pub absolute_floor: f64,
    /// Decay of the exponential window, 1/s.
    pub decay: f64,
    /// Unit of the responses. `None`: the files state it.
    pub unit: Option<Unit>,
    /// The axis of the TCP along which each axis of the test lies, and 1 or −1.
    pub axes: [(usize, f64); 3],
    /// Node of the accelerometer. `None`: the only one of the responses.
    pub response_node: Option<i64>,
    /// Places of nodes that are struck, from the TCP, TCP axes, m.
    pub points: BTreeMap<i64, [f64; 3]>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            averages: None,
            relative_floor: 0.0,
            absolute_floor: 0.0,
            decay: 0.0,
            unit: None,
            axes: [(0, 1.0), (1, 1.0), (2, 1.0)],
            response_node: None,
            points: BTreeMap::new(),
        }
    }
}

impl Settings {
    /// Checks what is said of all files.
    pub(crate) fn check(&self) -> Result<(), String> {
        for (key, value) in [
            ("relative_floor", self.relative_floor),
            ("absolute_floor_per_kg", self.absolute_floor),
            ("decay_per_s", self.decay),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(format!("[receptance] {key} is {value}: must be 0 or larger"));
            }
        }
        if self.relative_floor > 1.0 {
            return Err(format!(
                "[receptance] relative_floor is {}: parts are fractions, 0.02 for 2 %",
                self.relative_floor
            ));
        }
        match self.averages {
            Some(averages) if !(averages >= FEWEST && averages.is_finite()) => Err(format!(
                "[receptance] averages is {averages}: the coherence of fewer than 2 is 1, and says nothing; leave it out, and state relative_floor"
            )),
            _ => Ok(()),
        }
    }
}
