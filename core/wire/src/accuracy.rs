//! The entries of `[accuracy]`, and where to look if one is contradicted.

use postcard_schema::Schema;
use serde::de::value::{Error, StrDeserializer};
use serde::{Deserialize, Serialize};

/// An entry of `[accuracy]`, and what it speaks of. In JSON each has the name of its entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Accuracy {
    /// Delay of the acceleration after the force.
    DelayS,
    /// Gain of each axis of the force sensor.
    ForceGain,
    /// Gain of each axis of the accelerometer.
    AccelerationGain,
    /// Crosstalk between axes of the force sensor.
    ForceCrosstalk,
    /// Crosstalk between axes of the accelerometer.
    AccelerationCrosstalk,
    /// Mounting angles of the force sensor.
    ForceAngleRad,
    /// Mounting angles of the accelerometer.
    AccelerometerAngleRad,
    /// Natural frequency of the mounted force sensor.
    ForceResonanceHz,
    /// Natural frequency of the mounted accelerometer.
    AccelerometerResonanceHz,
    /// High-pass of the force.
    ForceHighPassHz,
    /// High-pass of the acceleration.
    AccelerometerHighPassHz,
    /// Mounting angles of the whole tool.
    ToolAngleRad,
    /// Place of the TCP.
    TcpM,
    /// Place of the accelerometer.
    AccelerometerPlaceM,
    /// Masses of the links.
    LinkMass,
    /// Centres of mass of the links.
    CentreOfMassM,
    /// Joint angles.
    JointAngleRad,
    /// Elastic centres of the joints.
    ElasticCentreM,
    /// Inertias of the links beside their masses.
    LinkInertia,
    /// Hysteretic part of the dampings.
    Hysteresis,
    /// Growth of the drives' stiffness with frequency.
    DriveGrowth,
    /// Growth of the drives' stiffness with load.
    DriveGrowthPerKnm,
    /// Delay of each record.
    DelayOfRecordS,
    /// Stiffness of each record.
    StiffnessOfRecord,
    /// Compliance of the ground along each axis.
    GroundMPerN,
    /// Compliance of the ground about each axis.
    GroundRadPerNm,
    /// Mass of what stands on the ground.
    BaseMass,
    /// Stiffness of hoses at the tool.
    HoseNPerM,
    /// Damping of hoses at the tool.
    HoseNsPerM,
    /// Growth of the delay over a record.
    DelayDrift,
    /// Delay of the joint angles.
    JointDelayS,
}

/// Facts of an entry.
struct Facts {
    key: &'static str,
    advice: &'static str,
    is_factor: bool,
    is_filter: bool,
}

const fn error(key: &'static str, advice: &'static str) -> Facts {
    Facts { key, advice, is_factor: false, is_filter: false }
}

const fn factor(key: &'static str, advice: &'static str) -> Facts {
    Facts { is_factor: true, ..error(key, advice) }
}

const fn filter(key: &'static str, advice: &'static str) -> Facts {
    Facts { is_filter: true, ..error(key, advice) }
}

impl Accuracy {
    /// The entry with this key in `[accuracy]`.
    pub fn of_key(key: &str) -> Option<Self> {
        Self::deserialize(StrDeserializer::<Error>::new(key)).ok()
    }

    /// Its key in `[accuracy]`.
    pub fn key(self) -> &'static str {
        self.facts().key
    }

    /// Place to look at on the robot.
    pub(crate) fn advice(self) -> &'static str {
        self.facts().advice
    }

    /// Returns whether the imperfections of this entry are factors, of which a report gives the deviation from 1.
    pub fn is_factor(self) -> bool {
        self.facts().is_factor
    }

    /// Returns whether it speaks of the filter of a sensor: what is stated is that there is none.
    pub fn is_filter(self) -> bool {
        self.facts().is_filter
    }

    fn facts(self) -> Facts {
        const GAIN: &str = "calibrate the sensor axis by axis, or seek its gains in [calibration]";
        const CROSSTALK: &str = "apply the sensor's calibration matrix";
        const ANGLE: &str = "measure how the sensor is mounted and correct [mounting]";
        const RESONANCE: &str =
            "stiffen the mounting of the sensor, or lower the upper end of band_hz";
        const HIGH_PASS: &str =
            "lower the corner of the amplifier, or raise the lower end of band_hz";
        const GROUND: &str =
            "look at what the robot stands on, or seek it: `flexid model import --pedestal`";
        const HOSE: &str = "hang hoses and cables so that they do not pull at the tool";
        match self {
            Self::DelayS => error(
                "delay_s",
                "give both sensors the same filter and one clock, or seek delay_s in [calibration]",
            ),
            Self::ForceGain => factor("force_gain", GAIN),
            Self::AccelerationGain => factor("acceleration_gain", GAIN),
            Self::ForceCrosstalk => error("force_crosstalk", CROSSTALK),
            Self::AccelerationCrosstalk => error("acceleration_crosstalk", CROSSTALK),
            Self::ForceAngleRad => error("force_angle_rad", ANGLE),
            Self::AccelerometerAngleRad => error("accelerometer_angle_rad", ANGLE),
            Self::ForceResonanceHz => filter("force_resonance_hz", RESONANCE),
            Self::AccelerometerResonanceHz => filter("accelerometer_resonance_hz", RESONANCE),
            Self::ForceHighPassHz => filter("force_high_pass_hz", HIGH_PASS),
            Self::AccelerometerHighPassHz => filter("accelerometer_high_pass_hz", HIGH_PASS),
            Self::ToolAngleRad => {
                error("tool_angle_rad", "measure the axes of the tool and correct the model's TCP")
            }
            Self::TcpM => error("tcp_m", "measure the TCP and correct it in the model"),
            Self::AccelerometerPlaceM => error(
                "accelerometer_place_m",
                "measure where the accelerometer is and correct [mounting]",
            ),
            Self::LinkMass => factor(
                "link_mass",
                "check the masses of the model and loads on the links, or seek link_mass in [calibration]",
            ),
            Self::CentreOfMassM => {
                error("centre_of_mass_m", "check the centres of mass of the model")
            }
            Self::JointAngleRad => error(
                "joint_angle_rad",
                "check the zeros of the joints and the signals of their angles",
            ),
            Self::ElasticCentreM => error(
                "elastic_centre_m",
                "look where the bearing is, and move the joint's origin there (below the first joint: model the pedestal, see --pedestal)",
            ),
            Self::LinkInertia => error("link_inertia", "check the inertias of the model"),
            Self::Hysteresis => error(
                "hysteresis",
                "nothing need be wrong: bolted and geared joints damp like that",
            ),
            Self::DriveGrowth => error(
                "drive_growth",
                "look for friction if it is negative; else nothing need be wrong: position loops stiffen with frequency",
            ),
            Self::DriveGrowthPerKnm => error(
                "drive_growth_per_knm",
                "nothing need be wrong: gears stiffen with their load",
            ),
            Self::DelayOfRecordS => {
                error("delay_of_record_s", "start both sensors by one trigger in each record")
            }
            Self::StiffnessOfRecord => {
                factor("stiffness_of_record", "warm the robot up, and cut all records alike")
            }
            Self::GroundMPerN => error("ground_m_per_n", GROUND),
            Self::GroundRadPerNm => error("ground_rad_per_nm", GROUND),
            Self::BaseMass => factor("base_mass", GROUND),
            Self::HoseNPerM => error("hose_n_per_m", HOSE),
            Self::HoseNsPerM => error("hose_ns_per_m", HOSE),
            Self::DelayDrift => error(
                "delay_drift",
                "let one clock sample both sensors, or synchronise their clocks",
            ),
            Self::JointDelayS => error(
                "joint_delay_s",
                "give the angles the time of their measurement, or feed more slowly",
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_have_the_names_of_their_keys() {
        for number in 0..u8::MAX {
            let Ok(entry) = postcard::from_bytes::<Accuracy>(&[number]) else {
                assert_eq!(number, 31);
                break;
            };
            assert_eq!(serde_json::to_value(entry).unwrap(), entry.key());
        }
    }
}
