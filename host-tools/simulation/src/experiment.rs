//! One cut from rest: force and motion at the TCP, at the instants that the sensors sample.

use flexid_core::chain::Chain;
use flexid_core::chain::linearise::LinearisationError;
use flexid_core::motion::radau::Radau;
use flexid_core::motion::sensors::Reading;
use flexid_core::motion::{Coordinates, EquationOfMotion};
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushing;
use flexid_core::sensors::Accelerometer;
use nalgebra::Vector3;
use rand_core::Rng;

use super::course::Course;
use super::course::guide::{Guide, Mount};
use super::force::{self, OVERSAMPLING};
use super::scenario::{Cutting, Experiment, Sampling};

/// Number of integration steps per sample. At 2 kHz, and with modes of up to 400 Hz, the error is 1e-6.
pub const STEPS: usize = 4;

/// Readings of the sensors and motion of the robot at the sensors' instants, without noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Response {
    /// Reading of the force sensor, less its reading at rest, along its axes, N.
    pub force: Vec<Vector3<f64>>,
    /// Displacement of the TCP from the static equilibrium at the joint angles of the moment, TCP axes at rest, m.
    pub displacement: Vec<Vector3<f64>>,
    /// Reading of the accelerometer, less its reading at rest, along its axes, m/s².
    pub acceleration: Vec<Vector3<f64>>,
}

/// A cut that applies the same force to one or more robots.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Joint angles at the start, rad (m).
    pub pose: Vec<f64>,
    /// Motion of the joints; `None` for a robot that stands.
    pub course: Option<Course>,
    /// Gravity, base axes, m/s².
    pub gravity: Vector3<f64>,
    /// Kind of the accelerometer.
    pub accelerometer: Accelerometer,
    /// Places of the sensors.
    pub mounting: Mounting,
    /// Sampling rate of the sensors, Hz.
    pub rate_hz: f64,
    /// Force on the robot, N, TCP axes at rest, [`OVERSAMPLING`] values per sample.
    pub force: Vec<Vector3<f64>>,
}

impl Cut {
    /// The cut of `experiment` without gravity, its roughness drawn from `rng`; the accelerometer is
    /// inertial, and both sensors sit at the TCP.
    pub fn new(
        experiment: &Experiment,
        cutting: &Cutting,
        sampling: &Sampling,
        rng: &mut impl Rng,
    ) -> Self {
        Self {
            pose: experiment.pose.clone(),
            course: experiment.course.clone(),
            gravity: Vector3::zeros(),
            accelerometer: Accelerometer::Inertial,
            mounting: Mounting::AT_TCP,
            rate_hz: sampling.rate_hz,
            force: force::milling(cutting, experiment, &experiment.sampling(sampling), rng),
        }
    }

    /// Response of a robot with `bushings`, one for each joint. It is NaN from the point at which the robot gives
    /// way: a bushing turns by 90°, or does not come to rest under gravity.
    pub fn response(&self, chain: &Chain, bushings: &[Bushing]) -> Response {
        self.response_telling(chain, bushings, |_| ())
    }

    /// The [`response`](Self::response), which calls `tell` with the share that is done, 0 to 1, after each sample.
    pub fn response_telling(
        &self,
        chain: &Chain,
        bushings: &[Bushing],
        tell: impl Fn(f64),
    ) -> Response {
        let equation = EquationOfMotion::new(chain, &self.pose, self.gravity, bushings);
        let guide = self.guide(chain, bushings);
        let (Ok(equation), Ok(guide)) = (equation, guide) else {
            let nothing = vec![Vector3::repeat(f64::NAN); self.force.len().div_ceil(OVERSAMPLING)];
            let [force, displacement, acceleration] = [nothing.clone(), nothing.clone(), nothing];
            return Response { force, displacement, acceleration };
        };
        let start = equation.rest();
        let mut robot = Radau::new(equation, start, 1.0 / (self.rate_hz * STEPS as f64));
        let mut stands = true;
        let mut response = Response::default();
        for (sample, &force) in self.force.iter().step_by(OVERSAMPLING).enumerate() {
            let (equation, state) = (robot.equation(), robot.state());
            let nothing = Vector3::repeat(f64::NAN);
            let (displacement, reading) = if stands {
                let reading = equation.reading(state, &force, self.accelerometer, &self.mounting);
                (equation.tcp_displacement(state), reading)
            } else {
                (nothing, Reading { force: nothing, acceleration: nothing })
            };
            response.force.push(reading.force);
            response.displacement.push(displacement);
            response.acceleration.push(reading.acceleration);
            for step in 0..STEPS {
                let at = |part: f64| sample as f64 + (step as f64 + part) / STEPS as f64;
                let force = |part| force::between(&self.force, at(part));
                let stepped = |robot: &mut Radau| match &guide {
                    None => robot.step(force),
                    Some(guide) => {
                        let travel = |part| guide.travel(at(part) / self.rate_hz);
                        robot.step_along(travel, force, |_, _| Coordinates::default())
                    }
                };
                stands = stands && stepped(&mut robot).is_ok();
            }
            tell((sample * OVERSAMPLING) as f64 / self.force.len() as f64);
        }
        response
    }

    /// Joint angles after `time` seconds, rad (m), base first.
    pub fn angles(&self, time: f64) -> Vec<f64> {
        match &self.course {
            Some(course) => course.at(time)[..self.pose.len()].iter().map(|own| own[0]).collect(),
            None => self.pose.clone(),
        }
    }

    /// The motion of the joint frames of a robot that feeds.
    fn guide(
        &self,
        chain: &Chain,
        bushings: &[Bushing],
    ) -> Result<Option<Guide<'_>>, LinearisationError> {
        let rest = |pose: &[f64]| Ok(chain.linearise(pose, self.gravity, bushings)?.elongations());
        let guide = |course| Guide::new(course, Mount::of(chain), rest);
        self.course.as_ref().map(guide).transpose()
    }
}

impl Response {
    /// Returns whether the robot has withstood the cut.
    pub fn is_finite(&self) -> bool {
        self.displacement.last().is_none_or(|last| last.iter().all(|x| x.is_finite()))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::Translation3;
    use rand_core::SeedableRng as _;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::reference::mill3;
    use crate::validation::displacement_error;

    /// The reference robot with joints that its weight turns over, and a cut under gravity.
    pub(crate) fn limp() -> (Chain, [Bushing; 3], Cut) {
        let (scenario, chain) = mill3();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let (experiment, sampling) = (&scenario.experiments[0], &scenario.measurement);
        let cut = Cut::new(experiment, &scenario.cutting, sampling, &mut rng);
        let gravity = Vector3::new(0.0, 0.0, -9.80665);
        (chain, [Bushing { stiffness: [1e3; 6], damping: [1e3; 6] }; 3], Cut { gravity, ..cut })
    }

    /// The reference is the same cut with sixteen times as many steps.
    #[test]
    fn four_steps_a_sample_are_enough() {
        let (scenario, chain) = mill3();
        let sampling = &scenario.measurement;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let cut = Cut::new(&scenario.experiments[1], &scenario.cutting, sampling, &mut rng);
        let found = cut.response(&chain, &scenario.truth).displacement;
        let equation =
            EquationOfMotion::new(&chain, &cut.pose, cut.gravity, &scenario.truth).unwrap();
        let start = equation.rest();
        let steps = 16 * STEPS;
        let mut robot = Radau::new(equation, start, 1.0 / (cut.rate_hz * steps as f64));
        let mut exact = Vec::new();
        for sample in 0..found.len() {
            exact.push(robot.equation().tcp_displacement(robot.state()));
            for step in 0..steps {
                let at = |part: f64| sample as f64 + (step as f64 + part) / steps as f64;
                robot.step(|part| force::between(&cut.force, at(part))).unwrap();
            }
        }
        let error = displacement_error(&exact, &found, cut.rate_hz, sampling.band_hz);
        assert!(error.iter().all(|&error| error < 1e-6), "{error:?}");
    }

    #[test]
    fn a_robot_that_gravity_leaves_no_rest_is_not_a_number() {
        let (chain, limp, cut) = limp();
        let response = cut.response(&chain, &limp);
        let samples = mill3().0.measurement.samples();
        assert!(!response.is_finite() && response.displacement.len() == samples);
    }

    #[test]
    fn a_robot_that_gives_way_is_not_a_number() {
        let (_, chain) = mill3();
        // The arm turns in a plane, straight to the direction of the force.
        let mut joint = chain.joints()[2];
        joint.link.centre_of_mass = Vector3::x();
        let arm = Chain::new(&[joint], Translation3::new(1.0, 0.0, 0.0).into()).unwrap();
        let soft = Bushing { stiffness: [1e6, 1e6, 1e6, 1e6, 10.0, 1e6], damping: [100.0; 6] };
        let cut = Cut {
            pose: vec![0.0],
            course: None,
            gravity: Vector3::zeros(),
            accelerometer: Accelerometer::Inertial,
            mounting: Mounting::AT_TCP,
            rate_hz: 2000.0,
            force: vec![Vector3::new(0.0, 0.0, 1e4); 1000 * OVERSAMPLING],
        };
        let response = cut.response(&arm, &[soft]);
        assert!(response.displacement[10].norm() > 0.0);
        assert!(!response.is_finite());
        assert_eq!(response.displacement.len(), 1000);
    }
}
