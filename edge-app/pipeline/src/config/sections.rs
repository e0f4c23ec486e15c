//! Sections and keys of `EDGE.toml`, not yet checked.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use flexid_core::sensors::Accelerometer;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::bounds::BoundsSection;
use super::stated::AccuracySection;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) model: ModelSection,
    #[serde(default)]
    pub(super) bounds: BoundsSection,
    pub(super) bus: Option<BusSection>,
    pub(super) signals: Option<SignalsSection>,
    pub(super) topics: Option<TopicsSection>,
    #[serde(default)]
    pub(super) recording: RecordingSection,
    pub(super) measurement: Option<MeasurementSection>,
    #[serde(default)]
    pub(super) mounting: MountingSection,
    #[serde(rename = "static")]
    pub(super) statics: Option<StaticSection>,
    pub(super) receptance: Option<ReceptanceSection>,
    #[serde(default)]
    pub(super) accuracy: AccuracySection,
    #[serde(default)]
    pub(super) calibration: CalibrationSection,
    #[serde(default)]
    pub(super) parameters: ParametersSection,
    #[serde(default)]
    pub(super) search: SearchSection,
    #[serde(default)]
    pub(super) server: ServerSection,
    pub(super) state: Option<StateSection>,
    pub(super) history: Option<HistorySection>,
    pub(super) simulation: Option<SimulationSection>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModelSection {
    pub(super) file: PathBuf,
    #[serde(default = "ModelSection::standard_gravity")]
    pub(super) gravity_m_per_s2: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BusSection {
    pub(super) interface: String,
    pub(super) dbc: PathBuf,
}

/// Names of signals in the DBC file, or of columns in a table. A name that occurs in several messages is written with its message,
/// `Message.signal`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalsSection {
    /// Signals of the force along x, y, z of the TCP.
    #[serde(default)]
    pub force: Axes,
    /// Unit of the force where the DBC file has none, and of what a matrix gives (N if left out).
    pub force_unit: Option<String>,
    /// Signal that counts the instants, in a message of the force or in one of its own. Without it the samples are counted. A table has none:
    /// the number of the row counts.
    pub force_counter: Option<String>,
    /// Axes of the force. A table may have it along those of the base.
    #[serde(default)]
    pub force_axes: ForceAxes,
    /// Signals of the acceleration along x, y, z of the TCP, as those of the force.
    #[serde(default)]
    pub acceleration: Axes,
    /// Unit of the acceleration, as that of the force (m/s^2).
    pub acceleration_unit: Option<String>,
    /// Signal that counts the instants of the acceleration, as that of the force. Both may be the same.
    pub acceleration_counter: Option<String>,
    /// Clocks of force and acceleration. If left out, one that is common to both if both have a counter, else each its own.
    pub clocks: Option<ClocksKey>,
    /// Signals of the angle or stroke of each joint, base first. Tables may have their poses in a file of their own.
    pub joints: Option<Vec<String>>,
}

/// Signals of a sensor: those of its axes, or channels that give them.
#[derive(Clone, Debug, Default)]
pub struct Axes {
    /// Signals along x, y, z. In a table, an axis that is not measured has an empty name. One name alone, or three equal ones, are a channel whose
    /// direction each cut states. Empty where channels give the axes, or where `[topics]` names those of a bag.
    pub names: [String; 3],
    /// Channels that give the axes.
    pub channels: Option<ChannelsSection>,
}

/// Channels of a sensor, and the affine map from them to its axes.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelsSection {
    /// Signals of the channels, as the DBC file scales them; their units are not used.
    pub channels: Vec<String>,
    /// A row for each of x, y, z, with a number for each channel. Three further rows, of moments, are left out.
    pub matrix: Vec<Vec<f64>>,
    /// What is added to x, y, z; nothing if left out.
    pub offset: Option<[f64; 3]>,
}

impl From<[String; 3]> for Axes {
    fn from(names: [String; 3]) -> Self {
        Self { names, channels: None }
    }
}

impl<'de> Deserialize<'de> for Axes {
    /// Reads the names of three signals, one that counts as three, or channels.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Names;
        impl<'de> Visitor<'de> for Names {
            type Value = Axes;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the names of three signals, that of one whose direction [recording] poses states, or channels with a matrix")
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<Self::Value, E> {
                Ok([name; 3].map(str::to_owned).into())
            }

            fn visit_seq<A: SeqAccess<'de>>(self, names: A) -> Result<Self::Value, A::Error> {
                <[String; 3]>::deserialize(SeqAccessDeserializer::new(names)).map(Axes::from)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                let channels = ChannelsSection::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Axes { channels: Some(channels), ..Axes::default() })
            }
        }
        deserializer.deserialize_any(Names)
    }
}

impl Axes {
    /// Returns the names of its axes or channels.
    pub(crate) fn all(&self) -> impl Iterator<Item = &String> {
        let names = if self.channels.is_some() { &[][..] } else { &self.names };
        names.iter().chain(self.channels.iter().flat_map(|map| &map.channels))
    }
}

/// Clocks by which force and acceleration are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClocksKey {
    /// Equal counters count the same instant.
    Common,
    /// Each sensor has its own.
    Own,
}

/// Topics of bags of ROS 2.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TopicsSection {
    pub(super) wrench: String,
    pub(super) acceleration: String,
    /// The names of the joints are those of the model, or in `[signals] joints`.
    pub(super) joints: Option<String>,
}

/// Axes along which a table has the force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ForceAxes {
    /// Those of the TCP, or of the sensor that `[mounting]` describes.
    #[default]
    Tcp,
    /// Those of the base, as controllers of robots write the force.
    Base,
}

/// Contents that a recording lacks.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct RecordingSection {
    /// Joint angles of each table.
    pub(super) poses: Option<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeasurementSection {
    /// May be left out where tables have a column of time.
    pub(super) rate_hz: Option<f64>,
    pub(super) band_hz: [f64; 2],
    #[serde(default = "MeasurementSection::mounted_on_the_tool", with = "AccelerometerKey")]
    pub(super) accelerometer: Accelerometer,
    pub(super) record_samples: Option<usize>,
}

/// Names of the variants of [`Accelerometer`].
#[derive(Deserialize)]
#[serde(remote = "Accelerometer", rename_all = "lowercase")]
enum AccelerometerKey {
    Inertial,
    Strapdown,
}

/// Position and axes of the sensors, in TCP axes. By default the sensors sit at the TCP and along its axes.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MountingSection {
    #[serde(default)]
    pub(super) accelerometer_xyz_m: [f64; 3],
    #[serde(default)]
    pub(super) accelerometer_rpy_rad: [f64; 3],
    #[serde(default)]
    pub(super) force_rpy_rad: [f64; 3],
    pub(super) tool_mass_kg: Option<f64>,
    pub(super) tool_centre_m: Option<[f64; 3]>,
}

/// Imperfections that are sought with the parameters, each with the standard deviation of its prior.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CalibrationSection {
    pub(super) delay_s: Option<f64>,
    pub(super) acceleration_gain: Option<f64>,
    pub(super) force_gain: Option<f64>,
    pub(super) misalignment_rad: Option<f64>,
    pub(super) link_mass: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ParametersSection {
    /// Values of the fixed parameters, by the parameter's name.
    #[serde(default)]
    pub(super) fixed: BTreeMap<String, f64>,
    /// Groups of parameters that share one value.
    #[serde(default)]
    pub(super) tied: Vec<Vec<String>>,
    /// True if one stiffness per joint is sought, that of its drive.
    #[serde(default)]
    pub(super) drive_only: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StaticSection {
    pub(super) file: PathBuf,
}

/// Frequency responses of modal tests.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReceptanceSection {
    /// List of the files with their poses.
    pub(super) file: PathBuf,
    pub(super) averages: Option<f64>,
    #[serde(default)]
    pub(super) relative_floor: f64,
    #[serde(default)]
    pub(super) absolute_floor_per_kg: f64,
    #[serde(default)]
    pub(super) decay_per_s: f64,
    pub(super) unit: Option<String>,
    /// Axis of the TCP along which each axis of the test lies.
    pub(super) axes: Option<[String; 3]>,
    pub(super) response_node: Option<i64>,
    /// Places of nodes that are struck, by their numbers.
    #[serde(default)]
    pub(super) points_m: BTreeMap<String, [f64; 3]>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SearchSection {
    #[serde(default)]
    pub(super) seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ServerSection {
    #[serde(default = "ServerSection::beside_the_file")]
    pub(super) listen: Vec<String>,
    pub(super) socket_mode: Option<u32>,
    pub(super) socket_group: Option<String>,
}

/// File in which the daemon keeps its state. By default it lies in systemd's state directory, if there is one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StateSection {
    pub(super) file: PathBuf,
}

/// Epochs of the daemon, of which each has a finding of its own. Without the section all of life is one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HistorySection {
    /// Duration of an epoch.
    pub(super) epoch: Option<String>,
    /// Number of records of an epoch.
    pub(super) records: Option<u64>,
    pub(super) folder: Option<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SimulationSection {
    pub(super) scenario: PathBuf,
}

impl SignalsSection {
    /// Returns the names of the joints' signals, base first.
    pub(crate) fn joints(&self) -> &[String] {
        self.joints.as_deref().unwrap_or_default()
    }

    /// Returns every name with its key.
    pub(crate) fn all(&self) -> impl Iterator<Item = (&'static str, &String)> {
        let with = |key| move |name| (key, name);
        // One counter may be that of both.
        let own = |name: &&String| self.force_counter.as_ref() != Some(*name);
        (self.force.all().map(with("force")))
            .chain(self.acceleration.all().map(with("acceleration")))
            .chain(self.joints().iter().map(with("joints")))
            .chain(self.force_counter.iter().map(with("force_counter")))
            .chain(self.acceleration_counter.iter().filter(own).map(with("acceleration_counter")))
    }
}

impl ModelSection {
    fn standard_gravity() -> [f64; 3] {
        [0.0, 0.0, -9.80665]
    }
}

impl MeasurementSection {
    fn mounted_on_the_tool() -> Accelerometer {
        Accelerometer::Strapdown
    }
}

impl ServerSection {
    fn beside_the_file() -> Vec<String> {
        vec!["unix:flexid.sock".to_string()]
    }
}

impl Default for ServerSection {
    fn default() -> Self {
        Self { listen: Self::beside_the_file(), socket_mode: None, socket_group: None }
    }
}
