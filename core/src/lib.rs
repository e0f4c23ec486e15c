//! Identification of the joint stiffness and damping of a robot that bends while it mills.
//!
//! The crate holds the mathematics of flexid and the stream from samples to estimate. It needs neither the standard library
//! nor an allocator: the daemon, the offline tool and a microcontroller run the same code.
//!
//! All quantities are in SI units and all angles in rad; only quantities whose names end in `_hz` are in Hz. The degrees of
//! freedom of a joint have the order `tx ty tz rx ry rz`: along and about the axes of the joint frame.
//!
//! # Example
//!
//! A robot of one joint is cut with a force that sweeps the band along each axis. Its readings become a record, the record
//! becomes spectra, and the fit to them gives each parameter a verdict and an interval that holds the truth.
//!
//! ```
//! use fearless_simd::Level;
//! use flexid_core::MAX_JOINTS;
//! use flexid_core::chain::{Chain, Joint, JointKind, Link};
//! use flexid_core::identify::{Identifier, Phase};
//! use flexid_core::motion::{EquationOfMotion, radau::Radau};
//! use flexid_core::mounting::Mounting;
//! use flexid_core::parameters::{Bounds, Bushing};
//! use flexid_core::sensors::Accelerometer;
//! use flexid_core::spectrum::{Experiment, Measurement};
//! use flexid_core::stream::{AngleSignal, Reading, Stream, StreamConfig};
//! use flexid_core::verdict::Verdict;
//! use nalgebra::{Isometry3, Matrix3, Vector3};
//! use rand_xoshiro::Xoshiro256PlusPlus;
//! use rand_xoshiro::rand_core::{Rng, SeedableRng};
//!
//! const RATE_HZ: f64 = 1000.0;
//! const SAMPLES: usize = 2048;
//!
//! // The robot: an arm of 0.9 m on one joint, whose bushing is to be identified.
//! let link = Link {
//!     mass: 300.0,
//!     centre_of_mass: Vector3::new(0.4, 0.05, -0.1),
//!     inertia: Matrix3::from_diagonal(&Vector3::new(20.0, 30.0, 25.0)),
//! };
//! let joint = Joint {
//!     origin: Isometry3::identity(),
//!     axis: Vector3::z_axis(),
//!     kind: JointKind::Revolute,
//!     link,
//! };
//! let chain = Chain::new(&[joint], Isometry3::translation(0.9, 0.1, -0.2))?;
//! let truth = Bushing {
//!     stiffness: [3.0e7, 2.0e7, 4.0e7, 2.5e6, 3.0e6, 4.0e6],
//!     damping: [3.0e4, 2.0e4, 4.0e4, 1.0e3, 2.0e3, 3.0e3],
//! };
//!
//! // The sensors: both at the TCP, with white noise; gravity is left out.
//! let measurement = Measurement {
//!     band_hz: [5.0, 150.0],
//!     gravity: [0.0; 3],
//!     accelerometer: Accelerometer::Inertial,
//!     mounting: Mounting::AT_TCP,
//! };
//! let mut generator = Xoshiro256PlusPlus::seed_from_u64(1);
//! let uniform = |generator: &mut Xoshiro256PlusPlus| generator.next_u64() as f64 / 2f64.powi(64) - 0.5;
//!
//! // The cut, along the TCP's axes: quiet for half a second, then a sweep along each axis, that fades in and out.
//! let force = |time_s: f64| {
//!     let part = ((time_s - 0.5) / 1.5).clamp(0.0, 1.0);
//!     let turn = core::f64::consts::TAU * 1.5 * part;
//!     let fade = (core::f64::consts::PI * part).sin().powi(2);
//!     let (up, down, middle) = (5.0 + 75.0 * part, 160.0 - 80.0 * part, 30.0 + 40.0 * part);
//!     500.0 * fade * Vector3::new((turn * up).sin(), (turn * down).sin(), (turn * middle).sin())
//! };
//!
//! // Readings to a record.
//! let mut stream = Stream::<SAMPLES>::new(StreamConfig {
//!     rate_hz: RATE_HZ,
//!     record_samples: SAMPLES,
//!     joints: 1,
//!     counter_bits: 16,
//!     force_resolution: 1e-3,
//!     acceleration_resolution: 1e-5,
//!     angles: [AngleSignal::FINE; MAX_JOINTS],
//! })?;
//! let mut records = Vec::new();
//! let equation = EquationOfMotion::new(&chain, &[0.3], Vector3::zeros(), &[truth])?;
//! let rest = equation.rest();
//! let mut robot = Radau::new(equation, rest, 1.0 / RATE_HZ);
//! for counter in 0..SAMPLES as u32 {
//!     let time_s = f64::from(counter) / RATE_HZ;
//!     let sensed = robot.equation().reading(
//!         robot.state(),
//!         &force(time_s),
//!         measurement.accelerometer,
//!         &measurement.mounting,
//!     );
//!     let mut noisy = |value: &Vector3<f64>, noise: f64| {
//!         std::array::from_fn(|axis| (value[axis] + noise * uniform(&mut generator)) as f32)
//!     };
//!     let (force_noise, acceleration_noise) = (0.5, 0.02);
//!     for reading in [
//!         Reading::Joint { index: 0, value: 0.3 },
//!         Reading::Force { counter, value: noisy(&sensed.force, force_noise) },
//!         Reading::Acceleration { counter, value: noisy(&sensed.acceleration, acceleration_noise) },
//!     ] {
//!         stream.push(time_s, reading, |record| records.push(record.clone()));
//!     }
//!     robot.step(|part| force(time_s + part / RATE_HZ))?;
//! }
//! stream.finish(|record| records.push(record.clone()));
//!
//! // Records to experiments.
//! let mut buffer = [0.0; SAMPLES];
//! let mut experiments = Vec::new();
//! for record in &records {
//!     experiments.push(Experiment::<512>::new(&chain, &measurement, record, &mut buffer)?);
//! }
//! assert_eq!(experiments.len(), 1);
//!
//! // Experiments to an estimate, within bounds that follow from the masses.
//! let bounds = Bounds::of(&chain);
//! let mut identifier = Identifier::new(chain, bounds, measurement, Level::new(), generator);
//! identifier.renew(&experiments);
//! while identifier.step(&mut experiments) != Phase::Settled {}
//! let estimate = identifier.estimate().expect("a settled identifier has an estimate");
//!
//! // The verdicts, and the truth.
//! let (found, deviations) = (estimate.bushings[0], estimate.standard_deviations[0]);
//! for dof in 0..6 {
//!     for (found, deviation, truth) in [
//!         (found.stiffness[dof], deviations.stiffness[dof], truth.stiffness[dof]),
//!         (found.damping[dof], deviations.damping[dof], truth.damping[dof]),
//!     ] {
//!         let (verdict, deviation) = estimate.trust().verdict(found, deviation);
//!         let deviation = deviation.expect("the sweeps excite every mode");
//!         assert_eq!(verdict, Verdict::Identified);
//!         assert!((found - truth).abs() < 4.0 * deviation, "{found} ± {deviation}, not {truth}");
//!     }
//! }
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod chain;
pub(crate) mod chi_square;
pub(crate) mod continuation;
pub mod identify;
pub mod imperfection;
pub(crate) mod linear;
pub mod loss;
pub mod motion;
pub mod mounting;
pub mod noise;
pub mod parameters;
pub mod receptance;
pub mod refine;
pub mod search;
pub mod sensors;
pub mod sought;
pub mod spectrum;
pub mod statics;
pub mod stream;
pub mod verdict;

/// Largest number of joints of a chain.
pub const MAX_JOINTS: usize = 7;
/// Largest number of imperfections that are sought with the parameters: a delay, three gains of each of two sensors, three angles, and a mass
/// per link.
pub const MAX_SOUGHT: usize = 10 + MAX_JOINTS;
/// Largest number of coordinates, and of unknowns of a fit.
pub const MAX_UNKNOWNS: usize = parameters::MAX_PARAMETERS + MAX_SOUGHT;
/// Number of degrees of freedom of a bushing: `tx ty tz rx ry rz`.
pub const DOF: usize = 6;
/// Names of these degrees of freedom.
pub const DOF_NAMES: [&str; DOF] = ["tx", "ty", "tz", "rx", "ry", "rz"];

/// Units of the stiffnesses of a joint, in the order of [`DOF_NAMES`].
pub const STIFFNESS_UNITS: [&str; DOF] = ["N/m", "N/m", "N/m", "Nm/rad", "Nm/rad", "Nm/rad"];

/// Units of the dampings of a joint, in the order of [`DOF_NAMES`].
pub const DAMPING_UNITS: [&str; DOF] = ["Ns/m", "Ns/m", "Ns/m", "Nms/rad", "Nms/rad", "Nms/rad"];
