//! The model of an imperfect plant at one pose.

use heapless::Vec;
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::super::Problem;
use crate::MAX_JOINTS;
use crate::calibration::Calibration;
use crate::chain::linearise::LinearisationError;
use crate::chain::{Chain, Joint, JointKind};
use crate::imperfection::{Imperfection, Sensor};
use crate::parameters::Bushings;
use crate::receptance::Terms;
use crate::sensors::Sensors;

/// A model that imperfections change.
#[derive(Clone, Debug)]
pub(super) struct Imperfect {
    chain: Chain,
    sensors: Sensors,
    pose: Vec<f64, MAX_JOINTS>,
}

impl Imperfect {
    /// The model without imperfections at a pose.
    pub(super) fn new(problem: &Problem<'_>, calibration: &Calibration, pose: &[f64]) -> Self {
        let chain = if problem.sought.seeks_masses() {
            problem.chain.weighing(&calibration.mass)
        } else {
            problem.chain.clone()
        };
        Self {
            chain,
            sensors: problem.measurement.sensors(calibration),
            pose: pose.iter().copied().take(MAX_JOINTS).collect(),
        }
    }

    /// Adds an imperfection of this value. One that is not [of the model](Imperfection::is_of_model) changes nothing, but for delay
    /// and gains.
    pub(super) fn add(&mut self, imperfection: Imperfection, value: f64) {
        let along = |axis: usize| Vector3::ith(axis, value);
        let Self { chain, sensors, pose } = self;
        let Sensors { mounting, calibration, .. } = sensors;
        match imperfection {
            Imperfection::Delay => calibration.delay += value,
            Imperfection::Gain(Sensor::Accelerometer, axis) => {
                calibration.acceleration_gain[axis] *= libm::exp(value);
            }
            Imperfection::Gain(Sensor::Force, axis) => {
                calibration.force_gain[axis] *= libm::exp(value);
            }
            Imperfection::Turn(Sensor::Force, axis) => {
                mounting.force_axes *= Rotation3::new(along(axis));
            }
            Imperfection::Turn(Sensor::Accelerometer, axis) => {
                mounting.accelerometer_axes *= Rotation3::new(along(axis));
            }
            Imperfection::ToolTurn(axis) => {
                chain.tcp *= UnitQuaternion::new(along(axis));
            }
            Imperfection::ToolCentrePoint(axis) => {
                chain.tcp *= Translation3::from(along(axis));
                mounting.accelerometer -= along(axis);
                mounting.tool_centre -= along(axis);
            }
            Imperfection::AccelerometerPlace(axis) => mounting.accelerometer += along(axis),
            Imperfection::Mass(link) => {
                let mut scale = [1.0; MAX_JOINTS];
                scale[link] = libm::exp(value);
                *chain = chain.weighing(&scale);
            }
            Imperfection::CentreOfMass(link, axis) => {
                chain.joints[link].link.centre_of_mass += along(axis);
            }
            Imperfection::JointAngle(joint) => pose[joint] += value,
            Imperfection::ElasticCentre(joint, axis) => {
                move_bushing(chain, joint, pose[joint], &along(axis));
            }
            Imperfection::Crosstalk(..)
            | Imperfection::Resonance(_)
            | Imperfection::HighPass(_) => {}
        }
    }

    /// Nuisances of the sensors.
    pub(super) fn calibration(&self) -> &Calibration {
        &self.sensors.calibration
    }

    /// Its terms with these bushings.
    pub(super) fn terms(
        &self,
        problem: &Problem<'_>,
        bushings: &Bushings,
    ) -> Result<Terms<f64>, LinearisationError> {
        let gravity = problem.measurement.gravity();
        Terms::new(&self.chain.linearise(&self.pose, gravity, bushings)?, bushings, &self.sensors)
    }
}

/// Moves the bushing of a joint away from the joint's origin, along the axes of the link at joint angle `q`. All that the joint
/// carries keeps its place.
fn move_bushing(chain: &mut Chain, joint: usize, q: f64, by: &Vector3<f64>) {
    let back: Isometry3<f64> = Translation3::from(-by).into();
    let Joint { origin, axis, kind, link } = &mut chain.joints[joint];
    let before_drive = match kind {
        JointKind::Revolute => Rotation3::from_axis_angle(axis, q) * by,
        JointKind::Prismatic => *by,
    };
    *origin *= Translation3::from(before_drive);
    link.centre_of_mass -= by;
    match chain.joints.get_mut(joint + 1) {
        Some(next) => next.origin = back * next.origin,
        None => chain.tcp = back * chain.tcp,
    }
}
