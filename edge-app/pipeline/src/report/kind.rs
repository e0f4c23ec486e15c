//! Kinds of imperfections: name, unit, and entry of `[accuracy]`.

use flexid_core::imperfection::{Imperfection, Sensor};
use flexid_wire::accuracy::Accuracy;
use flexid_wire::text::{Label, clipped};

use crate::model::{Kind, Model};
use crate::names::{DOF_NAMES, joint_name};

const AXES: [&str; 3] = ["x", "y", "z"];
const SPREADS: [&str; 6] = ["x", "y", "z", "xy", "xz", "yz"];

/// Returns whether an entry states its accuracy. That of the ground's damping follows from the ground's compliance, and those of a low-pass from the
/// delay.
pub(super) fn has_entry(imperfection: Imperfection) -> bool {
    !matches!(
        imperfection,
        Imperfection::GroundDamping(_) | Imperfection::Dispersion | Imperfection::RollOff
    )
}

/// Returns whether a report names it. What a low-pass does beside its delay belongs to the delay.
pub(super) fn is_listed(imperfection: Imperfection) -> bool {
    !matches!(imperfection, Imperfection::Dispersion | Imperfection::RollOff)
}

/// Returns whether an imperfection is the logarithm of a factor.
pub(super) fn is_factor(imperfection: Imperfection) -> bool {
    matches!(
        imperfection,
        Imperfection::Gain(..)
            | Imperfection::Mass(_)
            | Imperfection::RecordStiffness(_)
            | Imperfection::BaseMass
    )
}

/// Returns the name of an imperfection, for example `force sensor turned about x`.
pub(super) fn name(imperfection: Imperfection, model: &Model) -> Label {
    let joint = |joint| joint_name(model, joint);
    match imperfection {
        Imperfection::Delay => clipped("delay"),
        Imperfection::Gain(of, axis) => clipped(format_args!("{} gain {}", sensor(of), AXES[axis])),
        Imperfection::Crosstalk(of, into, from) => clipped(format_args!(
            "{} crosstalk from {} into {}",
            sensor(of),
            AXES[from],
            AXES[into]
        )),
        Imperfection::Turn(of, axis) => {
            clipped(format_args!("{} turned about {}", sensor(of), AXES[axis]))
        }
        Imperfection::ToolTurn(axis) => clipped(format_args!("tool turned about {}", AXES[axis])),
        Imperfection::ToolCentrePoint(axis) => clipped(format_args!("TCP {}", AXES[axis])),
        Imperfection::AccelerometerPlace(axis) => {
            clipped(format_args!("accelerometer place {}", AXES[axis]))
        }
        Imperfection::Resonance(of) => clipped(format_args!("{} 1/omega^2", sensor(of))),
        Imperfection::HighPass(of) => clipped(format_args!("{} high-pass", sensor(of))),
        Imperfection::Mass(link) => clipped(format_args!("mass of {}'s link", joint(link))),
        Imperfection::CentreOfMass(link, axis) => {
            clipped(format_args!("centre of mass {} of {}", AXES[axis], joint(link)))
        }
        Imperfection::JointAngle(of) => clipped(format_args!("angle of {}", joint(of))),
        Imperfection::ElasticCentre(of, axis) => {
            clipped(format_args!("elastic centre {} of {}", AXES[axis], joint(of)))
        }
        Imperfection::Inertia(link, entry) => {
            clipped(format_args!("spread {} of {}'s link", SPREADS[entry], joint(link)))
        }
        Imperfection::Hysteresis => clipped("hysteretic part of dampings"),
        Imperfection::Servo(of) => {
            clipped(format_args!("drive of {}: growth above 10 Hz", joint(of)))
        }
        Imperfection::Load => clipped("drives: growth with load"),
        Imperfection::Ground(dof) => clipped(format_args!("ground {}", DOF_NAMES[dof])),
        Imperfection::GroundDamping(dof) => {
            clipped(format_args!("damping of ground {}", DOF_NAMES[dof]))
        }
        Imperfection::BaseMass => clipped("mass of the base"),
        Imperfection::Hose => clipped("hose at the tool"),
        Imperfection::HoseDamping => clipped("damping of hose at the tool"),
        Imperfection::DelayDrift => clipped("drift of delay"),
        Imperfection::Dispersion => clipped("low-pass beside its delay: phase"),
        Imperfection::RollOff => clipped("low-pass beside its delay: magnitude"),
        Imperfection::RecordDelay(record) => {
            clipped(format_args!("delay of record {}", record + 1))
        }
        Imperfection::RecordStiffness(record) => {
            clipped(format_args!("stiffness of record {}", record + 1))
        }
    }
}

/// Returns the name of a sensor.
pub(super) fn sensor(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Force => "force sensor",
        Sensor::Accelerometer => "accelerometer",
    }
}

/// Returns the unit of an imperfection.
pub(super) fn unit(imperfection: Imperfection, model: &Model) -> &'static str {
    let slides = |joint: usize| model.joints[joint].kind == Kind::Prismatic;
    match imperfection {
        Imperfection::JointAngle(joint) if slides(joint) => "m",
        Imperfection::Delay | Imperfection::RecordDelay(_) => "s",
        Imperfection::Load => "1/Nm",
        Imperfection::Ground(..3) => "m/N",
        Imperfection::Ground(_) => "rad/Nm",
        Imperfection::GroundDamping(..3) => "m s/N",
        Imperfection::GroundDamping(_) => "rad s/Nm",
        Imperfection::Gain(..)
        | Imperfection::Crosstalk(..)
        | Imperfection::Mass(_)
        | Imperfection::Inertia(..)
        | Imperfection::Hysteresis
        | Imperfection::Servo(_)
        | Imperfection::RecordStiffness(_)
        | Imperfection::BaseMass => "",
        Imperfection::Turn(..) | Imperfection::ToolTurn(_) | Imperfection::JointAngle(_) => "rad",
        Imperfection::ToolCentrePoint(_)
        | Imperfection::AccelerometerPlace(_)
        | Imperfection::CentreOfMass(..)
        | Imperfection::ElasticCentre(..) => "m",
        Imperfection::Resonance(_) => "s^2",
        Imperfection::HighPass(_) => "rad/s",
        Imperfection::Hose => "N/m",
        Imperfection::HoseDamping => "Ns/m",
        Imperfection::DelayDrift => "s/s",
        Imperfection::Dispersion => "s^3",
        Imperfection::RollOff => "s^4",
    }
}

/// The entry of `[accuracy]` that speaks of an imperfection.
pub(super) fn entry(imperfection: Imperfection) -> Accuracy {
    use Sensor::{Accelerometer, Force};
    match imperfection {
        Imperfection::Delay | Imperfection::Dispersion | Imperfection::RollOff => Accuracy::DelayS,
        Imperfection::Gain(Force, _) => Accuracy::ForceGain,
        Imperfection::Gain(Accelerometer, _) => Accuracy::AccelerationGain,
        Imperfection::Crosstalk(Force, ..) => Accuracy::ForceCrosstalk,
        Imperfection::Crosstalk(Accelerometer, ..) => Accuracy::AccelerationCrosstalk,
        Imperfection::Turn(Force, _) => Accuracy::ForceAngleRad,
        Imperfection::Turn(Accelerometer, _) => Accuracy::AccelerometerAngleRad,
        Imperfection::ToolTurn(_) => Accuracy::ToolAngleRad,
        Imperfection::ToolCentrePoint(_) => Accuracy::TcpM,
        Imperfection::AccelerometerPlace(_) => Accuracy::AccelerometerPlaceM,
        Imperfection::Resonance(Force) => Accuracy::ForceResonanceHz,
        Imperfection::Resonance(Accelerometer) => Accuracy::AccelerometerResonanceHz,
        Imperfection::HighPass(Force) => Accuracy::ForceHighPassHz,
        Imperfection::HighPass(Accelerometer) => Accuracy::AccelerometerHighPassHz,
        Imperfection::Mass(_) => Accuracy::LinkMass,
        Imperfection::CentreOfMass(..) => Accuracy::CentreOfMassM,
        Imperfection::JointAngle(_) => Accuracy::JointAngleRad,
        Imperfection::ElasticCentre(..) => Accuracy::ElasticCentreM,
        Imperfection::Inertia(..) => Accuracy::LinkInertia,
        Imperfection::Hysteresis => Accuracy::Hysteresis,
        Imperfection::Servo(_) => Accuracy::DriveGrowth,
        Imperfection::Load => Accuracy::DriveGrowthPerKnm,
        Imperfection::Ground(..3) | Imperfection::GroundDamping(..3) => Accuracy::GroundMPerN,
        Imperfection::Ground(_) | Imperfection::GroundDamping(_) => Accuracy::GroundRadPerNm,
        Imperfection::BaseMass => Accuracy::BaseMass,
        Imperfection::Hose => Accuracy::HoseNPerM,
        Imperfection::HoseDamping => Accuracy::HoseNsPerM,
        Imperfection::DelayDrift => Accuracy::DelayDrift,
        Imperfection::RecordDelay(_) => Accuracy::DelayOfRecordS,
        Imperfection::RecordStiffness(_) => Accuracy::StiffnessOfRecord,
    }
}
