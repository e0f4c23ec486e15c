//! Kinds of imperfections. A row of [`FACTS`] holds all that is known of a kind, but for its physics (`refine::plant`) and its advice to people
//! (`flexid_wire::accuracy`).

use super::accuracies::{Accuracies, Entry, entry};
use crate::chain::JointKind;
use crate::chain::spread::SPREADS;
use crate::search::MAX_EXPERIMENTS;
use crate::{DOF, MAX_JOINTS};

/// Damping of the ground over its stiffness, s. Chosen: a loss factor of 3 % at 50 Hz, as of bolted steel and of concrete on soil.
pub const GROUND_LAG: f64 = 1e-4;
/// Standard deviation of a compliance of the ground, and of its damping, in its prior, over its accuracy. None is negative, so that those along
/// several axes add up in a stiffness of the first joint. The magnitudes of three normal values of deviation 1 add up to 2.4 ± 1.04, and 95 % of
/// such sums lie within 1.96 × 1.3 √3 of zero.
const PRIOR_OVER_ACCURACY: f64 = 1.3;
/// Standard deviation of an error of a link's spread over the accuracy that is stated for its inertia. The moment about an axis is the sum of
/// two second moments: of alike ones with independent errors, its logarithm has 1/√2 of their deviation.
pub const SPREAD_OVER_INERTIA: f64 = core::f64::consts::SQRT_2;

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
    /// Turn from the configured axes of a sensor to the true ones, about each of its axes after those before, rad.
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
    /// the frequency. Stiffness and damping are then those at [`REFERENCE_HZ`](super::REFERENCE_HZ).
    Hysteresis,
    /// Relative growth of the stiffness of a drive, along or about the axis of its joint, from below 10 Hz to above.
    Servo(usize),
    /// Relative growth of the stiffness of all drives with the magnitude of the load of gravity on them, 1/Nm (or 1/N).
    Load,
    /// Compliance 1/k of the ground along (0 to 2) or about (3 to 5) an axis of the base, at its origin, m/N or rad/Nm. The base, which the
    /// model lacks, is a point of [`BASE_OVER_MOVING`](super::BASE_OVER_MOVING) of the robot's mass there. A robot whose first joint is
    /// fixed has none: that joint is the ground's own.
    Ground(usize),
    /// Damping of the ground over the square of its stiffness, `d/k²`, along the same, m s/N or rad s/Nm.
    GroundDamping(usize),
    /// Delay of the acceleration in one record, by its number from 0, beside [`Imperfection::Delay`], s.
    RecordDelay(usize),
    /// Logarithm of all stiffnesses in one record, by its number from 0.
    RecordStiffness(usize),
    /// Logarithm of the mass of the base over [`BASE_OVER_MOVING`](super::BASE_OVER_MOVING) of the robot's. It has an effect where the ground
    /// gives way.
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
    /// Delay of the joint angles after the force, s: the true angles are those reported and this times their rates.
    JointDelay,
}

/// Place of an imperfection among those of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// It is the only one.
    Only,
    /// An axis, 0 to 2.
    Axis(usize),
    /// An axis whose reading has a part of another's, and that other one.
    Pair(usize, usize),
    /// A joint or its link, from 0, base first.
    Joint(usize),
    /// A joint or its link, and an axis or an entry of its spread.
    InJoint(usize, usize),
    /// A degree of freedom, 0 to 5.
    Dof(usize),
    /// A record, from 0.
    Record(usize),
}

/// Part of a robot, of its surroundings or of their readings that an imperfection changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// The reading of a sensor along each axis by itself.
    Reading,
    /// Axes and place of a sensor.
    Mounting,
    /// Masses and places of the robot and its tool.
    Geometry,
    /// Springs and dampers, with frequency or load.
    Impedance,
    /// The ground below the robot.
    Ground,
    /// Hoses and cables on the tool.
    Hose,
    /// A single record.
    Record,
}

/// Statement that gives a kind its accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stated {
    /// Its entry.
    ByEntry,
    /// The entry of another kind, from which it follows.
    ByAnother,
    /// Likewise, and a report names the other kind alone.
    WithAnother,
}

/// Kinds. The discriminant is the number of the kind. All imperfections of a kind have the same accuracy.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Delay,
    ForceGain,
    AccelerationGain,
    ForceCrosstalk,
    AccelerationCrosstalk,
    ForceTurn,
    AccelerometerTurn,
    ForceResonance,
    AccelerometerResonance,
    ForceHighPass,
    AccelerometerHighPass,
    ToolTurn,
    ToolCentrePoint,
    AccelerometerPlace,
    Mass,
    CentreOfMass,
    JointAngle,
    ElasticCentre,
    Inertia,
    Hysteresis,
    Servo,
    Load,
    RecordDelay,
    RecordStiffness,
    Ground,
    GroundDamping,
    BaseMass,
    Hose,
    HoseDamping,
    DelayDrift,
    Dispersion,
    RollOff,
    JointDelay,
}

/// Facts of a kind of imperfections.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    kind: Kind,
    /// Name, with the place of an imperfection in braces: `{axis}`, `{from}`, `{joint}`, `{spread}`, `{dof}`, `{record}`.
    pub name: &'static str,
    /// SI units of those along an axis, and of those about one. Empty for a part, and for the logarithm of a factor or of a spread.
    pub units: [&'static str; 2],
    entries: [&'static Entry; 2],
    /// Part that it changes.
    pub group: Group,
    /// Largest number of imperfections of the kind.
    pub(super) most: usize,
    /// True if it cannot be less than zero.
    pub is_positive: bool,
    /// True if it is the logarithm of a factor, of which people are told the factor.
    pub is_factor: bool,
    /// True if its derivative is that of the model's matrices. Else its derivative is a multiple of readings, forces or impedances.
    pub(super) is_of_model: bool,
    /// True if it has no effect on a robot that rests.
    pub(super) moves_only: bool,
    /// Statement of its accuracy.
    pub stated: Stated,
    /// Its accuracy over what the entry states.
    times: f64,
    /// Standard deviation of its prior over its accuracy.
    pub prior_over_accuracy: f64,
}

/// Number of kinds of imperfections.
pub(crate) const KINDS: usize = Kind::JointDelay as usize + 1;

/// All kinds, in the order of their numbers.
#[rustfmt::skip]
pub const FACTS: &[Facts; KINDS] = &[
    row(Kind::Delay, 1, Group::Reading, "delay_s", "s", "delay"),
    row(Kind::ForceGain, 3, Group::Reading, "force_gain", "", "force sensor gain {axis}").factor(),
    row(Kind::AccelerationGain, 3, Group::Reading, "acceleration_gain", "", "accelerometer gain {axis}").factor(),
    row(Kind::ForceCrosstalk, 6, Group::Mounting, "force_crosstalk", "", "force sensor crosstalk from {from} into {axis}"),
    row(Kind::AccelerationCrosstalk, 6, Group::Mounting, "acceleration_crosstalk", "", "accelerometer crosstalk from {from} into {axis}"),
    row(Kind::ForceTurn, 3, Group::Mounting, "force_angle_rad", "rad", "force sensor turned about {axis}"),
    row(Kind::AccelerometerTurn, 3, Group::Mounting, "accelerometer_angle_rad", "rad", "accelerometer turned about {axis}"),
    row(Kind::ForceResonance, 1, Group::Reading, "force_resonance_hz", "s^2", "force sensor 1/omega^2"),
    row(Kind::AccelerometerResonance, 1, Group::Reading, "accelerometer_resonance_hz", "s^2", "accelerometer 1/omega^2"),
    row(Kind::ForceHighPass, 1, Group::Reading, "force_high_pass_hz", "rad/s", "force sensor high-pass").positive(),
    row(Kind::AccelerometerHighPass, 1, Group::Reading, "accelerometer_high_pass_hz", "rad/s", "accelerometer high-pass").positive(),
    row(Kind::ToolTurn, 3, Group::Geometry, "tool_angle_rad", "rad", "tool turned about {axis}"),
    row(Kind::ToolCentrePoint, 3, Group::Geometry, "tcp_m", "m", "TCP {axis}"),
    row(Kind::AccelerometerPlace, 3, Group::Mounting, "accelerometer_place_m", "m", "accelerometer place {axis}"),
    row(Kind::Mass, MAX_JOINTS, Group::Geometry, "link_mass", "", "mass of {joint}'s link").factor(),
    row(Kind::CentreOfMass, 3 * MAX_JOINTS, Group::Geometry, "centre_of_mass_m", "m", "centre of mass {axis} of {joint}"),
    row(Kind::JointAngle, MAX_JOINTS, Group::Geometry, "joint_angle_rad", "rad", "angle of {joint}").along("joint_angle_rad", "m"),
    row(Kind::ElasticCentre, 3 * MAX_JOINTS, Group::Geometry, "elastic_centre_m", "m", "elastic centre {axis} of {joint}"),
    row(Kind::Inertia, SPREADS * MAX_JOINTS, Group::Geometry, "link_inertia", "", "spread {spread} of {joint}'s link").times(SPREAD_OVER_INERTIA).in_motion(),
    row(Kind::Hysteresis, 1, Group::Impedance, "hysteresis", "", "hysteretic part of dampings"),
    row(Kind::Servo, MAX_JOINTS, Group::Impedance, "drive_growth", "", "drive of {joint}: growth above 10 Hz").in_motion(),
    row(Kind::Load, 1, Group::Impedance, "drive_growth_per_knm", "1/Nm", "drives: growth with load").of_model(),
    row(Kind::RecordDelay, MAX_EXPERIMENTS, Group::Record, "delay_of_record_s", "s", "delay of record {record}"),
    row(Kind::RecordStiffness, MAX_EXPERIMENTS, Group::Record, "stiffness_of_record", "", "stiffness of record {record}").factor().of_model(),
    row(Kind::Ground, DOF, Group::Ground, "ground_rad_per_nm", "rad/Nm", "ground {dof}").along("ground_m_per_n", "m/N").positive().wider(),
    row(Kind::GroundDamping, DOF, Group::Ground, "ground_rad_per_nm", "rad s/Nm", "damping of ground {dof}").along("ground_m_per_n", "m s/N")
        .positive().wider().times(GROUND_LAG).stated(Stated::ByAnother).in_motion(),
    row(Kind::BaseMass, 1, Group::Ground, "base_mass", "", "mass of the base").factor().in_motion(),
    row(Kind::Hose, 1, Group::Hose, "hose_n_per_m", "N/m", "hose at the tool").positive(),
    row(Kind::HoseDamping, 1, Group::Hose, "hose_ns_per_m", "Ns/m", "damping of hose at the tool").positive().in_motion(),
    row(Kind::DelayDrift, 1, Group::Reading, "delay_drift", "s/s", "drift of delay"),
    row(Kind::Dispersion, 1, Group::Reading, "delay_s", "s^3", "low-pass beside its delay: phase").stated(Stated::WithAnother),
    row(Kind::RollOff, 1, Group::Reading, "delay_s", "s^4", "low-pass beside its delay: magnitude").stated(Stated::WithAnother),
    row(Kind::JointDelay, 1, Group::Reading, "joint_delay_s", "s", "delay of the joint angles").of_model(),
];

// Each row stands at the number of its kind.
const _: () = {
    let mut number = 0;
    while number < KINDS {
        assert!(FACTS[number].kind as usize == number);
        number += 1;
    }
};

/// A row of [`FACTS`], with at most so many imperfections.
const fn row(
    kind: Kind,
    most: usize,
    group: Group,
    key: &str,
    unit: &'static str,
    name: &'static str,
) -> Facts {
    Facts {
        kind,
        name,
        units: [unit; 2],
        entries: [entry(key); 2],
        group,
        most,
        is_positive: false,
        is_factor: false,
        is_of_model: matches!(group, Group::Mounting | Group::Geometry),
        moves_only: false,
        stated: Stated::ByEntry,
        times: 1.0,
        prior_over_accuracy: 1.0,
    }
}

impl Facts {
    /// With this entry and unit of those along an axis.
    const fn along(mut self, key: &str, unit: &'static str) -> Self {
        self.entries[0] = entry(key);
        self.units[0] = unit;
        self
    }

    const fn positive(self) -> Self {
        Self { is_positive: true, ..self }
    }

    const fn factor(self) -> Self {
        Self { is_factor: true, ..self }
    }

    const fn of_model(self) -> Self {
        Self { is_of_model: true, ..self }
    }

    const fn in_motion(self) -> Self {
        Self { moves_only: true, ..self }
    }

    const fn wider(self) -> Self {
        Self { prior_over_accuracy: PRIOR_OVER_ACCURACY, ..self }
    }

    const fn times(self, times: f64) -> Self {
        Self { times, ..self }
    }

    const fn stated(self, stated: Stated) -> Self {
        Self { stated, ..self }
    }
}

impl Imperfection {
    /// Its kind, and its place among those of it.
    const fn parts(self) -> (Kind, Place) {
        use Sensor::{Accelerometer, Force};
        match self {
            Self::Delay => (Kind::Delay, Place::Only),
            Self::Gain(Force, axis) => (Kind::ForceGain, Place::Axis(axis)),
            Self::Gain(Accelerometer, axis) => (Kind::AccelerationGain, Place::Axis(axis)),
            Self::Crosstalk(Force, into, from) => (Kind::ForceCrosstalk, Place::Pair(into, from)),
            Self::Crosstalk(Accelerometer, into, from) => {
                (Kind::AccelerationCrosstalk, Place::Pair(into, from))
            }
            Self::Turn(Force, axis) => (Kind::ForceTurn, Place::Axis(axis)),
            Self::Turn(Accelerometer, axis) => (Kind::AccelerometerTurn, Place::Axis(axis)),
            Self::Resonance(Force) => (Kind::ForceResonance, Place::Only),
            Self::Resonance(Accelerometer) => (Kind::AccelerometerResonance, Place::Only),
            Self::HighPass(Force) => (Kind::ForceHighPass, Place::Only),
            Self::HighPass(Accelerometer) => (Kind::AccelerometerHighPass, Place::Only),
            Self::ToolTurn(axis) => (Kind::ToolTurn, Place::Axis(axis)),
            Self::ToolCentrePoint(axis) => (Kind::ToolCentrePoint, Place::Axis(axis)),
            Self::AccelerometerPlace(axis) => (Kind::AccelerometerPlace, Place::Axis(axis)),
            Self::Mass(link) => (Kind::Mass, Place::Joint(link)),
            Self::CentreOfMass(link, axis) => (Kind::CentreOfMass, Place::InJoint(link, axis)),
            Self::JointAngle(joint) => (Kind::JointAngle, Place::Joint(joint)),
            Self::ElasticCentre(joint, axis) => (Kind::ElasticCentre, Place::InJoint(joint, axis)),
            Self::Inertia(link, entry) => (Kind::Inertia, Place::InJoint(link, entry)),
            Self::Hysteresis => (Kind::Hysteresis, Place::Only),
            Self::Servo(joint) => (Kind::Servo, Place::Joint(joint)),
            Self::Load => (Kind::Load, Place::Only),
            Self::RecordDelay(record) => (Kind::RecordDelay, Place::Record(record)),
            Self::RecordStiffness(record) => (Kind::RecordStiffness, Place::Record(record)),
            Self::Ground(dof) => (Kind::Ground, Place::Dof(dof)),
            Self::GroundDamping(dof) => (Kind::GroundDamping, Place::Dof(dof)),
            Self::BaseMass => (Kind::BaseMass, Place::Only),
            Self::Hose => (Kind::Hose, Place::Only),
            Self::HoseDamping => (Kind::HoseDamping, Place::Only),
            Self::DelayDrift => (Kind::DelayDrift, Place::Only),
            Self::Dispersion => (Kind::Dispersion, Place::Only),
            Self::RollOff => (Kind::RollOff, Place::Only),
            Self::JointDelay => (Kind::JointDelay, Place::Only),
        }
    }

    /// Number of the kind, 0 to [`KINDS`].
    pub(crate) fn kind(self) -> usize {
        self.parts().0 as usize
    }

    /// Facts of its kind.
    pub fn facts(self) -> &'static Facts {
        &FACTS[self.kind()]
    }

    /// Place among those of its kind.
    pub fn place(self) -> Place {
        self.parts().1
    }

    /// The entry of `[accuracy]` that speaks of it.
    pub fn entry(self) -> &'static Entry {
        let [along, about] = self.facts().entries;
        if matches!(self.place(), Place::Dof(..3)) { along } else { about }
    }

    /// Its accuracy.
    pub fn accuracy(self, accuracies: &Accuracies) -> f64 {
        self.facts().times * self.entry().of(accuracies)
    }

    /// Standard deviation of its prior.
    pub(super) fn prior(self, accuracies: &Accuracies) -> f64 {
        let Facts { times, prior_over_accuracy, .. } = self.facts();
        times * (prior_over_accuracy * self.entry().of(accuracies))
    }
}

/// All imperfections that a robot with these joints, base first, can have in so many records, but for what is [stated with
/// another](Stated::WithAnother). A fixed joint has no angle and no drive. Those that are positive come last: a step eliminates the others once.
pub fn possible(joints: &[JointKind], records: usize) -> impl Iterator<Item = Imperfection> {
    use Imperfection as I;
    let axes = || 0..3_usize;
    let sensors = || [Sensor::Force, Sensor::Accelerometer].into_iter();
    let of_sensors = sensors().flat_map(move |sensor| {
        let others = move |into| axes().filter(move |from| *from != into);
        let pairs = axes().flat_map(move |into| others(into).map(move |from| (into, from)));
        let gains = axes().map(move |axis| I::Gain(sensor, axis));
        let crosstalk = pairs.map(move |(into, from)| I::Crosstalk(sensor, into, from));
        let turns = axes().map(move |axis| I::Turn(sensor, axis));
        gains.chain(crosstalk).chain(turns).chain([I::Resonance(sensor)])
    });
    let of_tool = axes().flat_map(|axis| {
        [I::ToolTurn(axis), I::ToolCentrePoint(axis), I::AccelerometerPlace(axis)]
    });
    let links = joints.iter().take(MAX_JOINTS).enumerate();
    let of_links = links.flat_map(move |(link, kind)| {
        let of_spread = (0..SPREADS).map(move |entry| I::Inertia(link, entry));
        let is_driven = *kind != JointKind::Fixed;
        let of_drive = is_driven.then_some([I::JointAngle(link), I::Servo(link)]);
        let of_axes = axes()
            .flat_map(move |axis| [I::CentreOfMass(link, axis), I::ElasticCentre(link, axis)]);
        let of_drive = of_drive.into_iter().flatten();
        core::iter::once(I::Mass(link)).chain(of_spread).chain(of_drive).chain(of_axes)
    });
    let is_driven = joints.iter().any(|kind| *kind != JointKind::Fixed);
    // A fixed first joint is the ground's own.
    let is_on_ground = joints.first() != Some(&JointKind::Fixed);
    let of_ground = (0..if is_on_ground { DOF } else { 0 })
        .flat_map(|dof| [I::Ground(dof), I::GroundDamping(dof)]);
    // Those of a single record are taken as the robot's.
    let records = if records > 1 { records.min(MAX_EXPERIMENTS) } else { 0 };
    let of_records =
        (0..records).flat_map(|record| [I::RecordDelay(record), I::RecordStiffness(record)]);
    [I::Delay, I::DelayDrift]
        .into_iter()
        .chain(of_sensors)
        .chain(of_tool)
        .chain(of_links)
        .chain(is_driven.then_some(I::JointDelay))
        .chain([I::Hysteresis, I::Load])
        .chain(is_on_ground.then_some(I::BaseMass))
        .chain(of_records)
        .chain(sensors().map(I::HighPass))
        .chain(of_ground)
        .chain([I::Hose, I::HoseDamping])
}
