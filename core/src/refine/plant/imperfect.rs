//! The model of an imperfect plant at one pose.

use core::f64::consts::TAU;

use heapless::Vec;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};

use super::super::model::Model;
use super::super::problem::Problem;
use super::places::Places;
use crate::chain::linearise::{LinearChain, LinearisationError};
use crate::chain::spread::spread_by;
use crate::chain::{Chain, Joint, JointKind};
use crate::imperfection::{BASE_OVER_MOVING, Imperfection, REFERENCE_HZ, Sensor};
use crate::parameters::Bushings;
use crate::receptance::{Filter, Ground, Growth, Hose, Hysteresis, Terms};
use crate::sensors::Sensors;
use crate::sought::Coordinates;
use crate::spectrum::Site;
use crate::statics::{Deflection, StaticTest};
use crate::{DOF, MAX_JOINTS};

/// Least compliance of ground that gives way, m/N and rad/Nm. Chosen: a millionth of that of the stiffest ground.
const RIGID: f64 = 1e-16;
/// Least part of a stiffness that is left at rest. Chosen: the law of hysteresis holds for small losses, and would leave an overdamped bushing none.
const LEAST_AT_REST: f64 = 0.1;

/// Number of a record that no imperfection knows.
pub(in crate::refine) const NO_RECORD: usize = usize::MAX;

/// A value of each degree of freedom of each joint.
pub(in crate::refine) type PerDof = [[f64; DOF]; MAX_JOINTS];

/// A model that imperfections change.
#[derive(Clone, Debug)]
pub(in crate::refine) struct Imperfect {
    chain: Chain,
    sensors: Sensors,
    /// Gain of each axis of the force sensor, reading per force.
    force_gain: [f64; 3],
    pose: Vec<f64, MAX_JOINTS>,
    /// Rates of the joint angles, rad/s (m/s); empty where the robot stands.
    rates: Vec<f64, MAX_JOINTS>,
    accelerometer_filter: Filter<f64>,
    force_filter: Filter<f64>,
    /// Reading of each sensor's axes per signal along them, apart from the gains.
    accelerometer_crosstalk: Matrix3<f64>,
    force_crosstalk: Matrix3<f64>,
    hysteresis: Hysteresis<f64>,
    /// Relative growth of the stiffness of each drive with the frequency.
    servo: [f64; MAX_JOINTS],
    /// Relative growth of the stiffness of the drives with the load, 1/Nm.
    load: f64,
    /// Factor on all stiffnesses.
    stiffness: f64,
    /// Compliances and dampings are 0 where the ground is rigid.
    ground: Ground<f64>,
    /// Stiffness, N/m, and damping, Ns/m, of what hangs on the tool.
    hose: [f64; 2],
    /// Growth of the delay of the acceleration over a record.
    drift: f64,
    /// Number of the record.
    record: usize,
}

impl Imperfect {
    /// The model at the site of a record, of this number, with those imperfections that are sought at these coordinates, and with `others`, each with
    /// its value.
    pub(in crate::refine) fn new(
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        others: impl Iterator<Item = (Imperfection, f64)>,
        site: Site<'_>,
        record: usize,
    ) -> Self {
        let sensors = problem.measurement.sensors(&site);
        let chain = problem.chain.clone();
        let all = problem.sought.imperfections_at(coordinates).chain(others);
        let rates = site.rates.iter().copied().take(MAX_JOINTS).collect();
        Self { rates, ..Self::of(chain, sensors, REFERENCE_HZ, site.pose, record) }.with(all)
    }

    /// The robot with these imperfections, each with its value, at rest at the joint angles `pose`, in no record.
    pub(in crate::refine) fn at_rest(
        problem: &Problem<'_>,
        pose: &[f64],
        imperfections: impl Iterator<Item = (Imperfection, f64)>,
    ) -> Self {
        let chain = problem.chain.clone();
        Self::of(chain, Sensors::default(), REFERENCE_HZ, pose, NO_RECORD).with(imperfections)
    }

    /// Adds these imperfections, each with its value.
    fn with(mut self, imperfections: impl Iterator<Item = (Imperfection, f64)>) -> Self {
        let counting = imperfections.filter(|(_, value)| *value != 0.0);
        counting.for_each(|(imperfection, value)| self.add(imperfection, value));
        self
    }

    /// A chain with these sensors at a pose, without imperfections, in the record of this number. Stiffness and damping are those
    /// at `reference_hz` where they depend on the frequency.
    pub(super) fn of(
        chain: Chain,
        sensors: Sensors,
        reference_hz: f64,
        pose: &[f64],
        record: usize,
    ) -> Self {
        let mass = BASE_OVER_MOVING * chain.joints.iter().map(|joint| joint.link.mass).sum::<f64>();
        Self {
            chain,
            sensors,
            force_gain: [1.0; 3],
            pose: pose.iter().copied().take(MAX_JOINTS).collect(),
            rates: Vec::new(),
            accelerometer_filter: Filter::default(),
            force_filter: Filter::default(),
            accelerometer_crosstalk: Matrix3::identity(),
            force_crosstalk: Matrix3::identity(),
            hysteresis: Hysteresis { part: 0.0, reference: TAU * reference_hz },
            servo: [0.0; MAX_JOINTS],
            load: 0.0,
            stiffness: 1.0,
            ground: Ground { compliance: [0.0; DOF], damping: [0.0; DOF], mass },
            hose: [0.0; 2],
            drift: 0.0,
            record,
        }
    }

    /// Adds an imperfection of this value.
    pub(in crate::refine) fn add(&mut self, imperfection: Imperfection, value: f64) {
        let along = |axis: usize| Vector3::ith(axis, value);
        let Self { chain, sensors, pose, rates, .. } = self;
        let Sensors { mounting, delay, acceleration_gain, .. } = sensors;
        match imperfection {
            Imperfection::Delay => *delay += value,
            Imperfection::DelayDrift => self.drift += value,
            Imperfection::Dispersion => self.accelerometer_filter.dispersion += value,
            Imperfection::RollOff => self.accelerometer_filter.roll_off += value,
            Imperfection::Gain(Sensor::Accelerometer, axis) => {
                acceleration_gain[axis] *= libm::exp(value);
            }
            Imperfection::Gain(Sensor::Force, axis) => {
                self.force_gain[axis] *= libm::exp(value);
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
            Imperfection::JointAngle(joint) => {
                if let Some(place) = chain.place_in_pose(joint) {
                    pose[place] += value;
                }
            }
            Imperfection::JointDelay => {
                pose.iter_mut().zip(rates).for_each(|(angle, rate)| *angle += value * *rate);
            }
            Imperfection::ElasticCentre(joint, axis) => {
                let q = chain.angles(pose).nth(joint).unwrap_or_default();
                move_bushing(chain, joint, q, &along(axis));
            }
            Imperfection::Crosstalk(Sensor::Accelerometer, of, by) => {
                self.accelerometer_crosstalk[(of, by)] += value;
            }
            Imperfection::Crosstalk(Sensor::Force, of, by) => {
                self.force_crosstalk[(of, by)] += value;
            }
            Imperfection::Resonance(Sensor::Accelerometer) => {
                self.accelerometer_filter.resonance += value;
            }
            Imperfection::Resonance(Sensor::Force) => self.force_filter.resonance += value,
            Imperfection::HighPass(Sensor::Accelerometer) => {
                self.accelerometer_filter.high_pass += value;
            }
            Imperfection::HighPass(Sensor::Force) => self.force_filter.high_pass += value,
            Imperfection::Inertia(link, entry) => {
                let inertia = &mut chain.joints[link].link.inertia;
                *inertia = spread_by(inertia, entry, value);
            }
            Imperfection::Hysteresis => self.hysteresis.part += value,
            Imperfection::Servo(joint) => self.servo[joint] += value,
            Imperfection::Load => self.load += value,
            Imperfection::Ground(dof) => self.ground.compliance[dof] += value,
            Imperfection::GroundDamping(dof) => self.ground.damping[dof] += value,
            Imperfection::BaseMass => {
                self.ground.mass *= libm::exp(value);
            }
            Imperfection::Hose => self.hose[0] += value,
            Imperfection::HoseDamping => self.hose[1] += value,
            Imperfection::RecordDelay(record) if record == self.record => *delay += value,
            Imperfection::RecordStiffness(record) if record == self.record => {
                self.stiffness *= libm::exp(value);
            }
            Imperfection::RecordDelay(_) | Imperfection::RecordStiffness(_) => {}
        }
    }

    /// Returns the places of the parts.
    pub(super) fn into_places(self) -> Places {
        Places { chain: self.chain, pose: self.pose, base_mass: self.ground.mass }
    }

    /// The chain about its static equilibrium with these bushings.
    pub(in crate::refine) fn linearise(
        &self,
        problem: &Problem<'_>,
        bushings: &Bushings,
    ) -> Result<LinearChain, LinearisationError> {
        self.linearise_under(problem.measurement.gravity(), bushings)
    }

    /// The chain about its static equilibrium with these bushings, under `gravity`, base axes, m/s².
    pub(in crate::refine) fn linearise_under(
        &self,
        gravity: Vector3<f64>,
        bushings: &Bushings,
    ) -> Result<LinearChain, LinearisationError> {
        self.chain.linearise(&self.pose, gravity, bushings)
    }

    /// The chain about these elongations of its bushings, m and rad.
    pub(in crate::refine) fn linearise_at(
        &self,
        problem: &Problem<'_>,
        sag: &[Vector6<f64>; MAX_JOINTS],
    ) -> LinearChain {
        self.chain.linearise_at(&self.pose, problem.measurement.gravity(), sag)
    }

    /// Loads of gravity on these elongations of the bushings, N and Nm.
    pub(super) fn gravity_loads(
        &self,
        problem: &Problem<'_>,
        sag: &[Vector6<f64>; MAX_JOINTS],
    ) -> [Vector6<f64>; MAX_JOINTS] {
        self.chain.gravity_loads(&self.pose, problem.measurement.gravity(), sag)
    }

    /// Returns the part of the model that the rows of a record need, whose chain is linearised as `linear`.
    pub(in crate::refine) fn model(
        &self,
        linear: &LinearChain,
        bushings: &Bushings,
    ) -> Result<Model, LinearisationError> {
        // The gains act behind the crosstalk; the terms have them in front.
        let gains = self.sensors.acceleration_gain;
        let gain = Matrix3::from_diagonal(&gains.into());
        let inverse = Matrix3::from_diagonal(&gains.map(|gain| 1.0 / gain).into());
        let of_accelerometer = gain * self.accelerometer_crosstalk * inverse;
        let bushings = self.loaded(linear, bushings);
        let terms = self.terms(linear, &bushings, &self.sensors)?.with_sensor_errors(
            self.accelerometer_filter,
            [&of_accelerometer, &self.force_crosstalk],
        );
        Ok(Model {
            force_gain: self.force_gain,
            force_filter: self.force_filter,
            accelerometer_filter: self.accelerometer_filter,
            drift: self.drift,
            ..Model::perfect(terms, linear, &self.chain)
        })
    }
}

impl Imperfect {
    /// The terms of the chain with these bushings and sensors.
    pub(super) fn terms(
        &self,
        linear: &LinearChain,
        bushings: &Bushings,
        sensors: &Sensors,
    ) -> Result<Terms<f64>, LinearisationError> {
        let mut terms = Terms::new(linear, bushings, sensors)?;
        terms.hysteresis = self.hysteresis;
        self.add_surroundings(&mut terms, linear);
        for ((terms, joint), part) in
            terms.joints.iter_mut().zip(&self.chain.joints).zip(self.servo)
        {
            terms.growth = joint.drive().filter(|_| part != 0.0).map(|dof| Growth { dof, part });
        }
        Ok(terms)
    }

    /// Adds the ground and the hose.
    fn add_surroundings(&self, terms: &mut Terms<f64>, linear: &LinearChain) {
        terms.ground = self.ground();
        let [stiffness, damping] = self.hose;
        terms.hose = Some(Hose::new(linear, stiffness, damping));
    }

    /// Displacement in a static test, of the chain that is linearised as `linear` with these bushings. Stiffnesses are those at rest; the second
    /// value is the part of each that goes with its damping, `∂ ln k/∂ ln d`.
    pub(in crate::refine) fn deflection(
        &self,
        linear: &LinearChain,
        bushings: &Bushings,
        test: &StaticTest,
    ) -> Result<(Deflection, PerDof), LinearisationError> {
        let mut resting = self.loaded(linear, bushings);
        let mut parts = [[0.0; DOF]; MAX_JOINTS];
        let per_damping = self.hysteresis.at_rest();
        for (bushing, parts) in resting.iter_mut().zip(&mut parts) {
            for dof in 0..DOF {
                let stiffness = bushing.stiffness[dof];
                let lost = per_damping * bushing.damping[dof];
                let least = LEAST_AT_REST * stiffness;
                bushing.stiffness[dof] = (stiffness + lost).max(least);
                if stiffness + lost > least {
                    parts[dof] = lost / (stiffness + lost);
                }
            }
        }
        let mut terms = Terms::static_test(linear, &resting, &test.wrench, &test.gauge)?;
        self.add_surroundings(&mut terms, linear);
        Ok((Deflection::of(&terms), parts))
    }

    /// The bushings as stiff as they are under the load of gravity in this record.
    pub(super) fn loaded(&self, linear: &LinearChain, bushings: &Bushings) -> Bushings {
        let mut loaded = bushings.clone();
        let joints = self.chain.joints.iter().zip(&linear.joints);
        for (bushing, (joint, linear)) in loaded.iter_mut().zip(joints) {
            if let Some(drive) = joint.drive() {
                let load = linear.sag[drive] * bushing.stiffness[drive];
                bushing.stiffness[drive] *= 1.0 + self.load * load.abs();
            }
            bushing.stiffness.iter_mut().for_each(|stiffness| *stiffness *= self.stiffness);
        }
        loaded
    }

    /// The ground. `None` if it is rigid.
    fn ground(&self) -> Option<Ground<f64>> {
        let Ground { compliance, damping, mass } = self.ground;
        let gives_way = compliance.iter().chain(&damping).any(|value| *value != 0.0);
        let compliance = compliance.map(|c| c.max(RIGID));
        gives_way.then_some(Ground { compliance, damping, mass })
    }
}

/// Moves the bushing of a joint away from the joint's origin, along the axes of the link at joint angle `q`. All that the joint
/// carries keeps its place.
fn move_bushing(chain: &mut Chain, joint: usize, q: f64, by: &Vector3<f64>) {
    let back: Isometry3<f64> = Translation3::from(-by).into();
    let Joint { origin, axis, kind, link } = &mut chain.joints[joint];
    let before_drive = match kind {
        JointKind::Revolute => Rotation3::from_axis_angle(axis, q) * by,
        JointKind::Prismatic | JointKind::Fixed => *by,
    };
    *origin *= Translation3::from(before_drive);
    link.centre_of_mass -= by;
    match chain.joints.get_mut(joint + 1) {
        Some(next) => next.origin = back * next.origin,
        None => chain.tcp = back * chain.tcp,
    }
}
