//! Errors of a plant, one at a time, each with a size.

use flexid_core::imperfection::Sensor::{Accelerometer, Force};
use flexid_core::imperfection::{Accuracies, Imperfection as I};
use flexid_simulation::plant::robot::{Bending, Hose, Pedestal};
use flexid_simulation::plant::{Plant, Sensor};

/// An error of a plant.
pub(crate) struct Error {
    pub(crate) name: &'static str,
    /// Returns whether an imperfection is this error, or one that has nearly the same effect; `None` if the fit has no such imperfection, or if
    /// its accuracy allows for the error, as that of the ground does for the pedestal.
    pub(crate) is: Option<fn(I) -> bool>,
    /// Gives a plant the error, in its accuracy or typical size.
    pub(crate) apply: fn(&mut Plant, f64),
}

const fn error(name: &'static str, is: Option<fn(I) -> bool>, apply: fn(&mut Plant, f64)) -> Error {
    Error { name, is, apply }
}

/// A vector of this size along each axis.
fn three(size: f64) -> [f64; 3] {
    [size, -size, size]
}

fn factors(size: f64) -> [f64; 3] {
    three(size).map(f64::exp)
}

/// Corner of a resonance whose `1/ω²` is so many times that of 3 kHz, Hz.
fn resonance(times: f64) -> f64 {
    3000.0 / times.sqrt()
}

fn typical() -> Accuracies {
    Accuracies::typical()
}

/// All errors, apart from drives that stiffen with their load: the scenario has no gravity. A size of 1 is an accuracy, or else a small
/// typical size: of an error without one, of inertias (0.4 of it), hysteresis (0.1), drives (0.06) and stiffness from cut to cut (0.5).
pub(crate) const MENU: [Error; 43] = [
    error(
        "force sensor turned",
        Some(|it| matches!(it, I::Turn(Force, _) | I::Crosstalk(Force, ..) | I::ToolTurn(_))),
        |plant, times| {
            plant.force_sensor.angle_rad = three(times * typical().force.angle);
        },
    ),
    error(
        "accelerometer turned",
        Some(|it| {
            matches!(
                it,
                I::Turn(Accelerometer, _) | I::Crosstalk(Accelerometer, ..) | I::ToolTurn(_)
            )
        }),
        |plant, times| {
            plant.accelerometer.angle_rad = three(times * typical().accelerometer.angle);
        },
    ),
    error(
        "tool turned",
        Some(|it| matches!(it, I::ToolTurn(_) | I::Turn(..) | I::Crosstalk(..))),
        |plant, times| {
            plant.tool.angle_rad = three(times * typical().tool_angle);
        },
    ),
    error("TCP", Some(|it| matches!(it, I::ToolCentrePoint(_))), |plant, times| {
        plant.tool.tcp_m = three(times * typical().tool_centre_point);
    }),
    error(
        "accelerometer's place",
        Some(|it| matches!(it, I::AccelerometerPlace(_))),
        |plant, times| {
            plant.accelerometer.offset_m = three(times * typical().accelerometer_place);
        },
    ),
    error("force gain", Some(|it| matches!(it, I::Gain(Force, _))), |plant, times| {
        plant.force_sensor.gain = factors(times * typical().force.gain);
    }),
    error(
        "acceleration gain",
        Some(|it| matches!(it, I::Gain(Accelerometer, _))),
        |plant, times| {
            plant.accelerometer.gain = factors(times * typical().accelerometer.gain);
        },
    ),
    error("all gains of the force", None, |plant, times| {
        plant.force_sensor.gain = [(times * typical().force.gain).exp(); 3];
    }),
    error("force crosstalk", Some(|it| matches!(it, I::Crosstalk(Force, ..))), |plant, times| {
        plant.force_sensor.crosstalk = times * typical().force.crosstalk;
    }),
    error(
        "acceleration crosstalk",
        Some(|it| matches!(it, I::Crosstalk(Accelerometer, ..))),
        |plant, times| {
            plant.accelerometer.crosstalk = times * typical().accelerometer.crosstalk;
        },
    ),
    error("force resonance", Some(|it| matches!(it, I::Resonance(_))), |plant, times| {
        plant.force_sensor.resonance_hz = resonance(times)
    }),
    error("acceleration resonance", Some(|it| matches!(it, I::Resonance(_))), |plant, times| {
        plant.accelerometer.resonance_hz = resonance(times);
    }),
    error("force high-pass", Some(|it| matches!(it, I::HighPass(_))), |plant, times| {
        plant.force_sensor.high_pass_hz = 0.1 * times
    }),
    error("acceleration high-pass", Some(|it| matches!(it, I::HighPass(_))), |plant, times| {
        plant.accelerometer.high_pass_hz = 0.1 * times;
    }),
    error("acceleration low-pass", Some(|it| matches!(it, I::Delay)), |plant, times| {
        plant.accelerometer.low_pass_hz = 9000.0 / times;
    }),
    error("delay", Some(|it| matches!(it, I::Delay)), |plant, times| {
        plant.accelerometer.clock.late_s = times * typical().delay
    }),
    error("delay from cut to cut", Some(|it| matches!(it, I::RecordDelay(_))), |plant, times| {
        plant.accelerometer.clock.late_spread_s = times * 5e-6;
    }),
    error("drift of the clock", Some(|it| matches!(it, I::DelayDrift)), |plant, times| {
        plant.accelerometer.clock.ppm = 2.0 * times;
    }),
    error("jitter", None, |plant, times| plant.accelerometer.clock.jitter_s = 1e-6 * times),
    error("pink noise", None, |plant, times| {
        plant.accelerometer.noise.pink_below_hz = times;
        plant.force_sensor.noise.pink_below_hz = times;
    }),
    error("hum", None, |plant, times| {
        let Sensor { noise, .. } = &mut plant.accelerometer;
        (noise.hum_hz, noise.hum) = (50.0, 0.005 * times);
    }),
    error("spindle lines", None, |plant, times| {
        let Sensor { noise, .. } = &mut plant.accelerometer;
        (noise.spindle_orders, noise.spindle) = (vec![1.0, 3.57], 0.01 * times);
    }),
    error("spikes", None, |plant, times| {
        let Sensor { noise, .. } = &mut plant.accelerometer;
        (noise.spikes_per_s, noise.spike) = (0.03 * times, 20.0);
    }),
    error("clipping", None, |plant, times| plant.accelerometer.limit = 60.0 / times),
    error("resolution", None, |plant, times| plant.accelerometer.quantum = 0.002 * times),
    error("mass", Some(|it| matches!(it, I::Mass(_))), |plant, times| {
        plant.robot.mass = factors(times * typical().mass).to_vec()
    }),
    error("all masses", Some(|it| matches!(it, I::Mass(_))), |plant, times| {
        plant.robot.mass = vec![(times * typical().mass).exp(); 3];
    }),
    error("inertia", Some(|it| matches!(it, I::Inertia(..))), |plant, times| {
        plant.robot.inertia = factors(times * 0.02).to_vec()
    }),
    error("centre of mass", Some(|it| matches!(it, I::CentreOfMass(..))), |plant, times| {
        plant.robot.centre_of_mass_m = vec![three(times * typical().centre_of_mass); 3];
    }),
    error("joint angle", Some(|it| matches!(it, I::JointAngle(_))), |plant, times| {
        plant.robot.joint_angle_rad = three(times * typical().joint_angle).to_vec();
    }),
    error("elastic centre", Some(|it| matches!(it, I::ElasticCentre(..))), |plant, times| {
        plant.robot.elastic_centre_m = vec![three(times * typical().elastic_centre); 3];
    }),
    error("feed", None, |plant, times| plant.robot.feed_rad_per_s = three(3e-6 * times).to_vec()),
    error("pedestal", None, |plant, times| {
        plant.pedestal = Some(Pedestal {
            mass_kg: 500.0,
            stiffness: [3e10 / times; 6],
            damping: [3e6 / times; 6],
        });
    }),
    error("bending", None, |plant, times| {
        plant.bending = Some(Bending {
            joint: 2,
            at: 0.5,
            stiffness: [3e10 / times; 6],
            damping: [3e6 / times; 6],
        });
    }),
    error("hose", Some(|it| matches!(it, I::Hose | I::HoseDamping)), |plant, times| {
        plant.hose = Some(Hose { stiffness_n_per_m: 200.0 * times, damping_ns_per_m: 5.0 * times });
    }),
    // The middle of the band, 2 to 200 Hz: what is found are stiffness and damping there.
    error("hysteretic damping", Some(|it| matches!(it, I::Hysteresis)), |plant, times| {
        (plant.joints.hysteretic, plant.joints.hysteretic_at_hz) = (0.03 * times, 20.0);
    }),
    error("servo", Some(|it| matches!(it, I::Servo(_))), |plant, times| {
        plant.joints.servo = 0.003 * times
    }),
    error("friction", None, |plant, times| plant.joints.friction = times),
    error("backlash", None, |plant, times| plant.joints.backlash = 1e-6 * times),
    error("cubic springs", None, |plant, times| plant.joints.cubic_rad = 0.03 / times),
    error("warm-up", Some(|it| matches!(it, I::RecordStiffness(_))), |plant, times| {
        plant.joints.warm_up_per_cut = -0.0005 * times
    }),
    error("another sign of the force", None, |plant, _| plant.force_sensor.gain = [-1.0, 1.0, 1.0]),
    error("acceleration in g", None, |plant, _| plant.accelerometer.gain = [1.0 / 9.80665; 3]),
];
