//! One cut by a robot that is not as modelled: motion in time, then the readings of both sensors.

use flexid_core::chain::linearise::{LinearChain, LinearJoint};
use flexid_core::chain::{Chain, Jacobian};
use flexid_core::motion::radau::Radau;
use flexid_core::motion::sensors::Reading;
use flexid_core::motion::{Coordinates, EquationOfMotion, Loads, State};
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushing;
use flexid_core::sensors::Accelerometer;
use nalgebra::{Vector3, Vector6};
use rand_core::Rng;

use super::chain::TrueChain;
use super::elements::{self, Element, Place};
use super::{Hose, Plant, Sensor};
use crate::course::guide::Guide;
use crate::experiment::{Cut, Response, STEPS};
use crate::force::{self, OVERSAMPLING};

/// White noise and the spindle of a cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    /// Standard deviation of the white noise of a force sample, N.
    pub force_noise: f64,
    /// Standard deviation of the white noise of an acceleration sample, m/s².
    pub acceleration_noise: f64,
    /// Angle of the spindle at each sample, rad.
    pub spindle: Vec<f64>,
}

/// One cut, and the robot as modelled.
#[derive(Clone, Copy, Debug)]
pub struct Work<'a> {
    /// The cut.
    pub cut: &'a Cut,
    /// The robot as modelled.
    pub model: &'a Chain,
    /// Its bushings, one per joint.
    pub bushings: &'a [Bushing],
    /// Number of cuts done before.
    pub number: u64,
}

/// A robot in motion.
struct Machine<'a> {
    robot: Radau,
    step_s: f64,
    /// Steps made.
    steps: usize,
    /// Elongations at rest where the drives stand or creep.
    rest: Coordinates,
    /// Motion of the drives along a path.
    guide: Option<Guide<'a>>,
    elements: Vec<Element>,
    hose: Option<(Hose, Jacobian)>,
    mounting: Mounting,
    /// Gravity along the axes of the TCP, m/s².
    gravity_at_tip: Vector3<f64>,
}

impl Plant {
    /// Readings of both sensors in one cut, in place of the noise-free [`Cut::response_telling`]. `None` if the robot gives way. The response
    /// has no displacements.
    pub fn readings(
        &self,
        work: Work<'_>,
        surroundings: &Surroundings,
        rng: &mut impl Rng,
        tell: impl Fn(f64),
    ) -> Option<Response> {
        let [force, acceleration] = self.signals(work, tell)?;
        let Surroundings { force_noise, acceleration_noise, spindle } = surroundings;
        let rate = work.cut.rate_hz;
        let mut read = |sensor: &Sensor, signal: &[Vector3<f64>], white: f64| {
            sensor.read(signal, STEPS, rate, white, spindle, rng)
        };
        Some(Response {
            force: read(&self.force_sensor, &force, *force_noise),
            displacement: Vec::new(),
            acceleration: read(&self.accelerometer, &acceleration, *acceleration_noise),
        })
    }

    /// True force and acceleration along the true axes of the sensors, less those at the start, [`STEPS`] values per sample.
    fn signals(&self, work: Work<'_>, tell: impl Fn(f64)) -> Option<[Vec<Vector3<f64>>; 2]> {
        let cut = work.cut;
        let creeps = self.robot.feed_rad_per_s.iter().any(|rate| *rate != 0.0);
        let mut machine = Machine::new(self, work)?;
        let at_start = machine.gravity_at_tip;
        let steps = cut.force.len().div_ceil(OVERSAMPLING) * STEPS;
        let mut signals = [Vec::with_capacity(steps), Vec::with_capacity(steps)];
        for step in 0..steps {
            if creeps && step > 0 && step % STEPS == 0 {
                machine.creep(self, work, step as f64 * machine.step_s)?;
            }
            let time = step as f64 / STEPS as f64;
            let force = force::between(&cut.force, time);
            let reading = machine.reading(force, cut.accelerometer);
            let Reading { mut force, mut acceleration } = reading;
            // The reading at rest is that before the cut. A tool that turns with the feed turns in gravity.
            let (mounting, turned) = (&machine.mounting, at_start - machine.gravity_at_tip);
            force -= mounting.force_axes.inverse() * (mounting.tool_mass * turned);
            if cut.accelerometer == Accelerometer::Strapdown {
                acceleration += mounting.accelerometer_axes.inverse() * turned;
            }
            signals[0].push(force);
            signals[1].push(acceleration);
            machine.step(|part| force::between(&cut.force, time + part / STEPS as f64))?;
            tell(step as f64 / steps as f64);
        }
        Some(signals)
    }
}

impl<'a> Machine<'a> {
    fn new(plant: &Plant, work: Work<'a>) -> Option<Self> {
        let step_s = 1.0 / (work.cut.rate_hz * STEPS as f64);
        let Still { true_chain, linear, bushings } = still(plant, work, 0.0)?;
        let rest = sag(&linear);
        let start = State { elongation: rest, rate: Coordinates::default() };
        let robot = Radau::new(equation(&true_chain, work.cut, rest)?, start, step_s);
        let viscous: Vec<_> = bushings.iter().map(|one| plant.joints.viscous(one)).collect();
        let rest_at = |pose: &[f64]| {
            let pose = plant.true_pose(pose, 0.0);
            Some(sag(&linear_at(plant, work, &pose, &viscous)?.1))
        };
        let guide = |course| {
            Guide::new(course, true_chain.mounts.clone(), |pose| rest_at(pose).ok_or(())).ok()
        };
        let guide = match &work.cut.course {
            Some(course) => Some(guide(course)?),
            None => None,
        };
        Some(Self {
            robot,
            step_s,
            steps: 0,
            rest,
            guide,
            elements: plant.joints.elements(work.model, &bushings, &true_chain.index, &rest),
            hose: plant.hose.map(|hose| (hose, linear.jacobian())),
            mounting: true_chain.mounting,
            gravity_at_tip: linear.gravity_at_tip,
        })
    }

    /// Moves the drives to where the feed has led them after `seconds`. The bushings keep their elongations and rates.
    fn creep(&mut self, plant: &Plant, work: Work<'_>, seconds: f64) -> Option<()> {
        let Still { true_chain, linear, .. } = still(plant, work, seconds)?;
        self.rest = sag(&linear);
        let equation = equation(&true_chain, work.cut, self.rest)?;
        self.robot = Radau::new(equation, *self.robot.state(), self.step_s);
        self.gravity_at_tip = linear.gravity_at_tip;
        Some(())
    }

    fn reading(&self, force: Vector3<f64>, accelerometer: Accelerometer) -> Reading {
        let state = self.robot.state();
        let place = place(&self.guide, &self.rest, self.steps as f64 * self.step_s);
        let resistance = resistance(&self.elements, &self.hose, &place, state, 0.0);
        let loads = Loads { force, resistance };
        self.robot.equation().reading(state, loads, accelerometer, &self.mounting)
    }

    fn step(&mut self, force: impl Fn(f64) -> Vector3<f64>) -> Option<()> {
        let Self { robot, step_s, steps, rest, guide, elements, hose, .. } = self;
        let time = |part: f64| (*steps as f64 + part) * *step_s;
        let place = |part: f64| place(guide, rest, time(part));
        let resistance = |part: f64, state: &State| {
            if elements.is_empty() && hose.is_none() {
                return Coordinates::default();
            }
            resistance(elements, hose, &place(part), state, part * *step_s)
        };
        match &*guide {
            Some(guide) => robot.step_along(|part| guide.travel(time(part)), force, resistance),
            None => robot.step_against(force, resistance),
        }
        .ok()?;
        let end = place(1.0);
        elements::advance(elements, &end, robot.state(), *step_s);
        *steps += 1;
        Some(())
    }
}

/// Where a robot is after `seconds`; `standing` are its elongations at rest without a path.
fn place(guide: &Option<Guide<'_>>, standing: &Coordinates, seconds: f64) -> Place {
    match guide {
        Some(guide) => Place { rest: guide.rest(seconds), driven: guide.driven(seconds) },
        None => Place { rest: *standing, ..Place::default() },
    }
}

/// Loads of the elements and of the hose, `seconds` after the last step.
fn resistance(
    elements: &[Element],
    hose: &Option<(Hose, Jacobian)>,
    place: &Place,
    state: &State,
    seconds: f64,
) -> Coordinates {
    let mut loads = Coordinates::default();
    elements::add_loads(elements, place, state, seconds, &mut loads);
    if let Some((hose, jacobian)) = hose {
        let columns = || {
            let joints = jacobian.iter().enumerate();
            joints.flat_map(|(j, dofs)| {
                dofs.iter().enumerate().map(move |(i, column)| (j, i, Vector3::from(*column)))
            })
        };
        let mut pull = Vector3::zeros();
        for (j, i, column) in columns() {
            let moved = state.elongation[j][i] - place.rest[j][i];
            pull += (hose.stiffness_n_per_m * moved + hose.damping_ns_per_m * state.rate[j][i])
                * column;
        }
        for (j, i, column) in columns() {
            loads[j][i] += pull.dot(&column);
        }
    }
    loads
}

/// A robot at rest.
struct Still {
    true_chain: TrueChain,
    linear: LinearChain,
    /// Its bushings, one per joint of the model, all dampers viscous.
    bushings: Vec<Bushing>,
}

/// The robot that moves, `seconds` after the start of the cut.
fn still(plant: &Plant, work: Work<'_>, seconds: f64) -> Option<Still> {
    let Work { cut, model, bushings, number } = work;
    let pose = plant.true_pose(&cut.pose, seconds);
    let modelled = model.linearise(&pose, cut.gravity, bushings).ok()?;
    let load = |(joint, bushing): (&LinearJoint, &Bushing)| {
        joint.sag.component_mul(&Vector6::from(bushing.stiffness))
    };
    let loads: Vec<_> = modelled.joints.iter().zip(bushings).map(load).collect();
    let bushings = plant.joints.bushings(model, bushings, &loads, number);
    let viscous: Vec<_> = bushings.iter().map(|one| plant.joints.viscous(one)).collect();
    let (true_chain, linear) = linear_at(plant, work, &pose, &viscous)?;
    Some(Still { true_chain, linear, bushings })
}

/// The robot with these bushings at rest at the true joint angles `pose`.
fn linear_at(
    plant: &Plant,
    work: Work<'_>,
    pose: &[f64],
    bushings: &[Bushing],
) -> Option<(TrueChain, LinearChain)> {
    let Work { cut, model, .. } = work;
    let true_chain = plant.robot(model, pose, bushings, &cut.mounting).ok()?;
    let none = vec![0.0; true_chain.bushings.len()];
    let linear = true_chain.chain.linearise(&none, cut.gravity, &true_chain.bushings).ok()?;
    Some((true_chain, linear))
}

fn equation(robot: &TrueChain, cut: &Cut, rest: Coordinates) -> Option<EquationOfMotion> {
    let none = vec![0.0; robot.bushings.len()];
    EquationOfMotion::about(&robot.chain, &none, cut.gravity, &robot.bushings, rest).ok()
}

fn sag(linear: &LinearChain) -> Coordinates {
    let mut rest = Coordinates::default();
    rest.iter_mut().zip(&linear.joints).for_each(|(rest, joint)| *rest = joint.sag);
    rest
}
