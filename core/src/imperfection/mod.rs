//! Imperfections: what is off by a little in every plant, beside the nuisances that a fit seeks. `refine::plant` fits them.
//!
//! A plant is never quite the one that the configuration describes: a mass, a mounting angle or a joint angle differs by a little.
//! Each [`Imperfection`] has a value p, whose prior is a normal distribution about zero; [`Accuracies`] give its standard deviation. Of
//! those that [cannot be negative](Imperfection::is_positive) only the half above zero counts.
//! A fit projects the imperfections out with their priors, as it projects out the seams. Where the data determine an imperfection,
//! it is thereby sought; where they do not, it widens the intervals of the parameters that it affects (a _considered_ parameter:
//! Schmidt, "Application of state-space methods to navigation problems", 1966; Bierman, _Factorization Methods for Discrete
//! Sequential Estimation_, 1977, chapter 8).

mod accuracies;
mod correction;

use heapless::Vec;

pub use accuracies::{Accuracies, SensorAccuracies};
pub(crate) use correction::Correction;

use crate::chain::spread::SPREADS;
use crate::chain::{Chain, JointKind};
use crate::search::MAX_EXPERIMENTS;
use crate::{DOF, MAX_JOINTS};

/// Frequency at which stiffness and damping are stated where they depend on it, Hz, whatever the band. Chosen: on a logarithmic scale the
/// middle of the modes of a milling robot's drives and tool, 8 to 50 Hz, and of the usual band, 2 to 200 Hz.
pub const REFERENCE_HZ: f64 = 20.0;
/// Number of kinds of imperfections.
pub(crate) const KINDS: usize = 32;
/// Largest number of imperfections of a chain.
pub const MAX_IMPERFECTIONS: usize = OF_SENSORS
    + OF_HOSE
    + OF_JOINTS * MAX_JOINTS
    + OF_BUSHINGS
    + OF_GROUND
    + OF_RECORDS * MAX_EXPERIMENTS;
/// Imperfections of the sensors and of the tool.
const OF_SENSORS: usize = 2 + 6 + 12 + 9 + 6 + 4 + OF_LAG;
/// Imperfections of a lag that is that of a filter.
const OF_LAG: usize = 2;
/// Imperfections of what hangs on the tool.
const OF_HOSE: usize = 2;
/// Imperfections of each joint and its link.
const OF_JOINTS: usize = 1 + 3 + 1 + 3 + SPREADS + 1;
/// Imperfections of all bushings.
const OF_BUSHINGS: usize = 2;
/// Imperfections of the ground.
const OF_GROUND: usize = 2 * DOF + 1;
/// Mass of a base over that of what moves. The published file of a KUKA iiwa 14 has 0.29, that of a Universal Robots UR10e 0.14.
pub const BASE_OVER_MOVING: f64 = 0.2;
/// Damping of the ground over its stiffness, s. Chosen: a loss factor of 3 % at 50 Hz, as of bolted steel and of concrete on soil.
const GROUND_LAG: f64 = 1e-4;
/// Standard deviation of a compliance of the ground, and of its damping, in its prior, over its accuracy. None is negative, so that those along
/// several axes add up in a stiffness of the first joint. The magnitudes of three normal values of deviation 1 add up to 2.4 ± 1.04, and 95 % of
/// such sums lie within 1.96 × 1.3 √3 of zero.
const PRIOR_OVER_ACCURACY: f64 = 1.3;
/// Standard deviation of an error of a link's spread over the accuracy that is stated for its inertia. The moment about an axis is the sum of
/// two second moments: of alike ones with independent errors, its logarithm has 1/√2 of their deviation.
pub const SPREAD_OVER_INERTIA: f64 = core::f64::consts::SQRT_2;
/// Imperfections of each record.
const OF_RECORDS: usize = 2;

/// A sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum Sensor {
    /// The force sensor.
    Force,
    /// The accelerometer.
    Accelerometer,
}

/// An error of a plant. Axes are numbered 0 to 2, joints and links from 0, base first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum Imperfection {
    /// Delay of the acceleration after the force, s; at the start of a record, if it drifts.
    Delay,
    /// Logarithm of the gain of an axis of a sensor.
    Gain(Sensor, usize),
    /// Part of the signal along the second axis in the reading along the first.
    Crosstalk(Sensor, usize, usize),
    /// Rotation vector from the configured axes of a sensor to the true ones, along the configured axes, rad.
    Turn(Sensor, usize),
    /// Rotation vector from the configured axes of the tool, both sensors included, to the true ones, along the TCP's axes, rad.
    ToolTurn(usize),
    /// True place of the TCP less the configured one, along the TCP's axes, m. The sensors keep their places.
    ToolCentrePoint(usize),
    /// True place of the accelerometer less the configured one, along the TCP's axes, m.
    AccelerometerPlace(usize),
    /// `1/ω²`, s²: the sensor has a natural frequency ω far above the band, so that its reading is the signal over `1 + s²/ω²`.
    Resonance(Sensor),
    /// ω, rad/s: the sensor has a high-pass of this corner frequency far below the band, so that its reading is the signal over
    /// `1 + ω/s`.
    HighPass(Sensor),
    /// Logarithm of the mass and inertia of a link.
    Mass(usize),
    /// True centre of mass of a link less the modelled one, along an axis of its joint, m.
    CentreOfMass(usize, usize),
    /// True joint angle less the reported one, rad (or m).
    JointAngle(usize),
    /// Place of a bushing less that of its joint's origin, along an axis of the link, m.
    ElasticCentre(usize, usize),
    /// Error of the spread of a link's mass about its centre of mass, beside that of its mass: the logarithm of the second moment along an axis of the
    /// link (0 to 2) that does not go with those before, and its shear between two axes (3 to 5), as `chain::spread` has them. They act one after the
    /// other. The same along all axes is the logarithm of the inertia.
    Inertia(usize, usize),
    /// Part of all dampings that is hysteretic: it dissipates the same at each frequency, and the stiffness grows with the logarithm of
    /// the frequency. Stiffness and damping are then those at [`REFERENCE_HZ`].
    Hysteresis,
    /// Relative growth of the stiffness of a drive, along or about the axis of its joint, from below 10 Hz to above.
    Servo(usize),
    /// Relative growth of the stiffness of all drives with the magnitude of the load of gravity on them, 1/Nm (or 1/N).
    Load,
    /// Compliance 1/k of the ground along (0 to 2) or about (3 to 5) an axis of the base, at its origin, m/N or rad/Nm. The base, which the
    /// model lacks, is a point of [`BASE_OVER_MOVING`] of the robot's mass there. A robot whose first joint is fixed has none: that joint is
    /// the ground's own.
    Ground(usize),
    /// Damping of the ground over the square of its stiffness, `d/k²`, along the same, m s/N or rad s/Nm.
    GroundDamping(usize),
    /// Delay of the acceleration in one record, by its number from 0, beside [`Imperfection::Delay`], s.
    RecordDelay(usize),
    /// Logarithm of all stiffnesses in one record, by its number from 0.
    RecordStiffness(usize),
    /// Logarithm of the mass of the base over [`BASE_OVER_MOVING`] of the robot's. It has an effect where the ground gives way.
    BaseMass,
    /// Stiffness k of hoses and cables between the ground and the TCP, the same along all axes, N/m: they pull with `k + s d` times the
    /// displacement of the TCP.
    Hose,
    /// Damping d of the same, Ns/m.
    HoseDamping,
    /// Growth of [`Imperfection::Delay`] over a record, s/s: how much slower the clock of the force sensor is than that of the accelerometer.
    DelayDrift,
    /// c, s³: a low-pass above the band turns the phase of the acceleration beside its delay, so that the reading is the signal over
    /// `1 − c s³ + e s⁴`. A plant has it where its accuracy of the delay is contradicted.
    Dispersion,
    /// e of the same, s⁴: the low-pass makes the reading smaller.
    RollOff,
}

impl Imperfection {
    /// Returns whether a robot of this chain can have it, in one of the records that a fit takes.
    pub fn is_of(self, chain: &Chain) -> bool {
        let joints = chain.joints();
        let has_drive =
            |joint: usize| joints.get(joint).is_some_and(|joint| joint.kind != JointKind::Fixed);
        match self {
            Self::Delay
            | Self::DelayDrift
            | Self::Dispersion
            | Self::RollOff
            | Self::Resonance(_)
            | Self::HighPass(_)
            | Self::Hysteresis
            | Self::Load
            | Self::Hose
            | Self::HoseDamping => true,
            Self::Gain(_, axis)
            | Self::Turn(_, axis)
            | Self::ToolTurn(axis)
            | Self::ToolCentrePoint(axis)
            | Self::AccelerometerPlace(axis) => axis < 3,
            Self::Crosstalk(_, of, by) => of < 3 && by < 3 && of != by,
            Self::Mass(link) => link < joints.len(),
            Self::Inertia(link, entry) => link < joints.len() && entry < SPREADS,
            Self::CentreOfMass(link, axis) | Self::ElasticCentre(link, axis) => {
                link < joints.len() && axis < 3
            }
            Self::JointAngle(joint) | Self::Servo(joint) => has_drive(joint),
            Self::Ground(dof) | Self::GroundDamping(dof) => dof < DOF && has_drive(0),
            Self::BaseMass => has_drive(0),
            Self::RecordDelay(record) | Self::RecordStiffness(record) => record < MAX_EXPERIMENTS,
        }
    }

    /// Standard deviation of its prior over its accuracy.
    pub fn prior_over_accuracy(self) -> f64 {
        match self {
            Self::Ground(_) | Self::GroundDamping(_) => PRIOR_OVER_ACCURACY,
            _ => 1.0,
        }
    }

    /// Returns whether it cannot be less than zero.
    pub fn is_positive(self) -> bool {
        matches!(
            self,
            Self::HighPass(_)
                | Self::Ground(_)
                | Self::GroundDamping(_)
                | Self::Hose
                | Self::HoseDamping
        )
    }

    /// The sign with which its value is the exponent of what a force, as read, moves in proportion to; 0 where it is no logarithm. Compliances, inverse
    /// masses and gains that are larger by one factor leave the readings what they are.
    pub(crate) fn exponent(self) -> f64 {
        match self {
            Self::Gain(Sensor::Force, _) => 1.0,
            Self::Gain(Sensor::Accelerometer, _) | Self::Mass(_) | Self::BaseMass => -1.0,
            _ => 0.0,
        }
    }

    /// Returns whether it changes how far the robot gives way to a load that rests. Inertias and dampings do not, nor does a drive that is stiffer
    /// at high frequencies.
    pub(crate) fn shows_at_rest(self) -> bool {
        matches!(
            self,
            Self::ToolTurn(_)
                | Self::ToolCentrePoint(_)
                | Self::Mass(_)
                | Self::CentreOfMass(..)
                | Self::JointAngle(_)
                | Self::ElasticCentre(..)
                | Self::Hysteresis
                | Self::Load
                | Self::Ground(_)
                | Self::Hose
        )
    }

    /// Returns whether it changes how the robot moves, and not only what its sensors read or a single record.
    pub fn is_of_robot(self) -> bool {
        match self {
            Self::ToolTurn(_)
            | Self::ToolCentrePoint(_)
            | Self::Mass(_)
            | Self::CentreOfMass(..)
            | Self::JointAngle(_)
            | Self::ElasticCentre(..)
            | Self::Inertia(..)
            | Self::Hysteresis
            | Self::Servo(_)
            | Self::Load
            | Self::Ground(_)
            | Self::GroundDamping(_)
            | Self::BaseMass
            | Self::Hose
            | Self::HoseDamping => true,
            Self::Delay
            | Self::DelayDrift
            | Self::Dispersion
            | Self::RollOff
            | Self::Gain(..)
            | Self::Crosstalk(..)
            | Self::Turn(..)
            | Self::AccelerometerPlace(_)
            | Self::Resonance(_)
            | Self::HighPass(_)
            | Self::RecordDelay(_)
            | Self::RecordStiffness(_) => false,
        }
    }
}

/// All imperfections that have an accuracy, each with its standard deviation, of a robot with these joints, base first, and so many
/// records. A fixed joint has no angle and no drive.
pub(crate) fn all(
    accuracies: &Accuracies,
    joints: &[JointKind],
    records: usize,
) -> Vec<(Imperfection, f64), MAX_IMPERFECTIONS> {
    use Imperfection as I;
    use Sensor::{Accelerometer, Force};
    let axes = || 0..3_usize;
    let links = joints.iter().take(MAX_JOINTS).enumerate();
    let Accuracies { force, accelerometer, .. } = accuracies;
    let sensors = || [(Force, force), (Accelerometer, accelerometer)].into_iter();
    let pairs =
        || axes().flat_map(move |of| axes().filter(move |&by| by != of).map(move |by| (of, by)));
    let of_sensors = sensors().flat_map(|(sensor, own)| {
        let gains = axes().map(move |axis| (I::Gain(sensor, axis), own.gain));
        let crosstalk = pairs().map(move |(of, by)| (I::Crosstalk(sensor, of, by), own.crosstalk));
        let turns = axes().map(move |axis| (I::Turn(sensor, axis), own.angle));
        gains.chain(crosstalk).chain(turns).chain([(I::Resonance(sensor), own.resonance)])
    });
    let of_amplifiers = sensors().map(|(sensor, own)| (I::HighPass(sensor), own.high_pass));
    let of_tool = axes().flat_map(|axis| {
        [
            (I::ToolTurn(axis), accuracies.tool_angle),
            (I::ToolCentrePoint(axis), accuracies.tool_centre_point),
            (I::AccelerometerPlace(axis), accuracies.accelerometer_place),
        ]
    });
    let of_links = links.flat_map(|(link, kind)| {
        let of_axes = axes().flat_map(move |axis| {
            [
                (I::CentreOfMass(link, axis), accuracies.centre_of_mass),
                (I::ElasticCentre(link, axis), accuracies.elastic_centre),
            ]
        });
        let spread = SPREAD_OVER_INERTIA * accuracies.inertia;
        let of_spread = (0..SPREADS).map(move |entry| (I::Inertia(link, entry), spread));
        let of_drive =
            [(I::JointAngle(link), accuracies.joint_angle), (I::Servo(link), accuracies.servo)];
        let is_driven = *kind != JointKind::Fixed;
        let of_drive = of_drive.into_iter().filter(move |_| is_driven);
        core::iter::once((I::Mass(link), accuracies.mass))
            .chain(of_spread)
            .chain(of_drive)
            .chain(of_axes)
    });
    let of_hose = [(I::Hose, accuracies.hose), (I::HoseDamping, accuracies.hose_damping)];
    let of_bushings = [(I::Hysteresis, accuracies.hysteresis), (I::Load, accuracies.load)];
    let is_on_ground = joints.first() != Some(&JointKind::Fixed);
    let of_ground = (0..DOF).filter(move |_| is_on_ground).flat_map(|dof| {
        let Accuracies { ground_translation, ground_rotation, .. } = accuracies;
        let accuracy = if dof < 3 { *ground_translation } else { *ground_rotation };
        let compliance = PRIOR_OVER_ACCURACY * accuracy;
        [(I::Ground(dof), compliance), (I::GroundDamping(dof), GROUND_LAG * compliance)]
    });
    let gives_way = is_on_ground && accuracies.ground_translation > 0.0;
    let of_base = gives_way.then_some((I::BaseMass, accuracies.base_mass));
    let of_records = (0..records.min(MAX_EXPERIMENTS)).flat_map(|record| {
        // Those of a single record are taken as the robot's.
        let differ = records > 1;
        [
            (I::RecordDelay(record), accuracies.record_delay),
            (I::RecordStiffness(record), accuracies.record_stiffness),
        ]
        .into_iter()
        .filter(move |_| differ)
    });
    core::iter::once((I::Delay, accuracies.delay))
        .chain([(I::DelayDrift, accuracies.delay_drift)])
        .chain(of_sensors)
        .chain(of_tool)
        .chain(of_links)
        .chain(of_bushings)
        .chain(of_base)
        .chain(of_records)
        // Those that are positive come last: a step eliminates the others once.
        .chain(of_amplifiers)
        .chain(of_ground)
        .chain(of_hose)
        .filter(|(_, deviation)| *deviation > 0.0 && deviation.is_finite())
        .collect()
}

/// The effects of a low-pass beside its delay, each with its standard deviation, where the delay has this one, s. Those of a Butterworth low-pass of
/// second order, whose delay is τ, are τ³/6 and τ⁴/8. Chosen: one and a half times those of a delay of 2.3 standard deviations, from which
/// on its accuracy is contradicted.
pub(crate) fn of_low_pass(delay: f64) -> [(Imperfection, f64); OF_LAG] {
    let square = delay * delay;
    [
        (Imperfection::Dispersion, 3.0 * square * delay),
        (Imperfection::RollOff, 5.0 * square * square),
    ]
}

impl Imperfection {
    /// Number of the kind, 0 to [`KINDS`]: all imperfections of a kind have the same accuracy.
    pub(crate) fn kind(self) -> usize {
        let of = |sensor| usize::from(sensor == Sensor::Accelerometer);
        match self {
            Self::Delay => 0,
            Self::Gain(sensor, _) => 1 + of(sensor),
            Self::Crosstalk(sensor, ..) => 3 + of(sensor),
            Self::Turn(sensor, _) => 5 + of(sensor),
            Self::Resonance(sensor) => 7 + of(sensor),
            Self::HighPass(sensor) => 9 + of(sensor),
            Self::ToolTurn(_) => 11,
            Self::ToolCentrePoint(_) => 12,
            Self::AccelerometerPlace(_) => 13,
            Self::Mass(_) => 14,
            Self::CentreOfMass(..) => 15,
            Self::JointAngle(_) => 16,
            Self::ElasticCentre(..) => 17,
            Self::Inertia(..) => 18,
            Self::Hysteresis => 19,
            Self::Servo(_) => 20,
            Self::Load => 21,
            Self::RecordDelay(_) => 22,
            Self::RecordStiffness(_) => 23,
            Self::Ground(_) => 24,
            Self::GroundDamping(_) => 25,
            Self::BaseMass => 26,
            Self::Hose => 27,
            Self::HoseDamping => 28,
            Self::DelayDrift => 29,
            Self::Dispersion => 30,
            Self::RollOff => 31,
        }
    }

    /// Returns whether it is one of record number `record` alone.
    pub(crate) fn is_of_record(self, record: usize) -> bool {
        matches!(self, Self::RecordDelay(own) | Self::RecordStiffness(own) if own == record)
    }

    /// Returns whether it is one of all stiffnesses in a record other than number `record`.
    pub(crate) fn is_of_another_record(self, record: usize) -> bool {
        matches!(self, Self::RecordStiffness(own) if own != record)
    }

    /// Returns whether its derivative is that of the model's matrices. Else its derivative is a multiple of readings, forces or impedances.
    pub(crate) fn is_of_model(self) -> bool {
        matches!(
            self,
            Self::Crosstalk(..)
                | Self::Turn(..)
                | Self::ToolTurn(_)
                | Self::ToolCentrePoint(_)
                | Self::AccelerometerPlace(_)
                | Self::Mass(_)
                | Self::CentreOfMass(..)
                | Self::JointAngle(_)
                | Self::ElasticCentre(..)
                | Self::Inertia(..)
                | Self::Load
                | Self::RecordStiffness(_)
        )
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Matrix3, Unit, Vector3};

    use super::*;
    use crate::chain::{Joint, Link};

    #[test]
    fn there_is_room_for_all() {
        let joints = [JointKind::Revolute; MAX_JOINTS];
        let mut all = all(&Accuracies::typical(), &joints, MAX_EXPERIMENTS);
        all.extend(of_low_pass(1e-3));
        assert_eq!(all.len(), MAX_IMPERFECTIONS);
        let mut counts = [0; KINDS];
        for (imperfection, _) in &all {
            counts[imperfection.kind()] += 1;
        }
        let (joints, records) = (MAX_JOINTS, MAX_EXPERIMENTS);
        let of_sensors = [1, 3, 3, 6, 6, 3, 3, 1, 1, 1, 1, 3, 3, 3];
        let others = [
            joints,
            3 * joints,
            joints,
            3 * joints,
            SPREADS * joints,
            1,
            joints,
            1,
            records,
            records,
            6,
            6,
            1,
            1,
            1,
            1,
            1,
            1,
        ];
        assert_eq!(counts[..14], of_sensors);
        assert_eq!(counts[14..], others);
        assert!(
            super::all(&Accuracies::default(), &[JointKind::Revolute], MAX_EXPERIMENTS).is_empty()
        );
    }

    /// Tests a robot with as many joints as there may be, and of one on a fixed joint.
    #[test]
    fn a_robot_can_have_what_all_of_it_are() {
        let typical = Accuracies::typical();
        let whole = all(&typical, &[JointKind::Revolute; MAX_JOINTS], MAX_EXPERIMENTS);
        for kinds in
            [&[JointKind::Revolute; MAX_JOINTS][..], &[JointKind::Fixed, JointKind::Revolute]]
        {
            let chain = chain(kinds);
            let own = all(&typical, kinds, MAX_EXPERIMENTS);
            for (imperfection, _) in &whole {
                let expected = own.iter().any(|(other, _)| other == imperfection);
                assert_eq!(imperfection.is_of(&chain), expected, "{imperfection:?}");
            }
        }
        let chain = chain(&[JointKind::Revolute; 2]);
        for beyond in [
            Imperfection::Gain(Sensor::Force, 3),
            Imperfection::Crosstalk(Sensor::Force, 1, 1),
            Imperfection::CentreOfMass(1, 3),
            Imperfection::Inertia(1, SPREADS),
            Imperfection::Inertia(2, 0),
            Imperfection::Ground(6),
            Imperfection::RecordDelay(MAX_EXPERIMENTS),
        ] {
            assert!(!beyond.is_of(&chain), "{beyond:?}");
        }
    }

    fn chain(kinds: &[JointKind]) -> Chain {
        let joint = |&kind: &JointKind| Joint {
            origin: Isometry3::identity(),
            axis: Unit::new_normalize(Vector3::z()),
            kind,
            link: Link {
                mass: 3.0,
                centre_of_mass: Vector3::zeros(),
                inertia: Matrix3::identity(),
            },
        };
        let joints: std::vec::Vec<Joint> = kinds.iter().map(joint).collect();
        Chain::new(&joints, Isometry3::identity()).unwrap()
    }

    #[test]
    fn a_fixed_joint_has_a_body_and_a_bushing_alone() {
        let of = |kind| all(&Accuracies::typical(), &[JointKind::Revolute, kind], 2);
        let of_drive = [Imperfection::JointAngle(1), Imperfection::Servo(1)];
        let mut expected = of(JointKind::Revolute);
        expected.retain(|(imperfection, _)| !of_drive.contains(imperfection));
        assert_eq!(of(JointKind::Fixed), expected);
    }
}
