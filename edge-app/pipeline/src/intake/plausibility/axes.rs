//! Checks whether the robot takes up energy from the cut, as everything passive does.
//!
//! With the force F and the velocity v of the tool, the power `p = Re(Fᴴ v)` is positive at each complex frequency s with `Re s ≥ 0`,
//! whatever force acts: the mobility of a passive system is positive real (Brune, "Synthesis of a finite two-terminal network", 1931).
//! No mass and no stiffness need be known for that. Axes that are swapped, or have the wrong sign, make the power negative in a part of
//! the band. All 48 ways to take three axes in another order and with other signs are tried, for either sensor. In few records several of
//! them may leave the power positive: then none is named.

use std::collections::VecDeque;

use flexid_core::mounting::Mounting;
use flexid_core::spectrum::{Experiment, Spectrum};
use flexid_wire::axes::{SignedAxis, WrongAxes};
use flexid_wire::warning::Warning;
use nalgebra::{Complex, Matrix3, Vector3};

use crate::record::MAX_EXPERIMENTS;

/// Ways to take three axes.
const WAYS: usize = 48;
/// Orders of three axes.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
/// Share of negative power from which on axes are looked for. Right axes of robots recorded or simulated have up to 0.02, also with an
/// accelerometer that is 0.3 m off; wrong ones have 0.05 and more in three records.
const NEGATIVE: f64 = 0.03;
/// Part of that share that other axes may leave at most. The right ones leave less than a tenth of it in these records.
const PART: f64 = 0.2;
/// Part of the share of the second best axes that the best ones may leave at most to be named. Chosen.
const CLEAR: f64 = 0.3;

/// Power that the robot takes up with each way to take the axes of either sensor.
#[derive(Clone, Debug)]
pub(crate) struct Axes {
    /// Turns the accelerometer's axes into the force sensor's.
    turn: Matrix3<f64>,
    /// Sums over the newest records: with the ways to take the axes of the force sensor, and those of the accelerometer.
    records: VecDeque<[[Power; WAYS]; 2]>,
}

/// Power over the bins of one record, or of several.
#[derive(Clone, Copy, Debug, Default)]
struct Power {
    /// Sum of the negative powers, without their sign.
    negative: f64,
    /// Sum of all, without their signs.
    absolute: f64,
}

impl Axes {
    pub(crate) fn new(mounting: &Mounting) -> Self {
        let turn = mounting.force_axes.inverse() * mounting.accelerometer_axes;
        Self { turn: turn.into_inner(), records: VecDeque::new() }
    }

    /// Adds the power of a record that starts at rest, and of whose acceleration all axes are measured. In the spectra of any other its motion
    /// before counts, too.
    pub(crate) fn note<const B: usize>(&mut self, experiment: &Experiment<B>) {
        let turn = self.turn.map(Complex::from);
        let [mut force, mut acceleration] = [[Power::default(); WAYS]; 2];
        let thinned = &experiment.thinned;
        if thinned.alpha == 0.0 || !(0..3).all(|axis| experiment.measures(axis)) {
            return;
        }
        for bin in 0..thinned.bins {
            let s = Complex::new(f64::from(thinned.alpha), f64::from(thinned.omega[bin]));
            let f = bin_of(&thinned.force, bin);
            let v = bin_of(&thinned.acceleration, bin) / s;
            // Re(Fᵢ* vⱼ) along the accelerometer's axes, and along the force sensor's.
            let along = |f: Vector3<Complex<f64>>, v: Vector3<Complex<f64>>| {
                (f.conjugate() * v.transpose()).map(|p: Complex<f64>| p.re)
            };
            add(&mut acceleration, &along(turn.transpose() * f, v));
            add(&mut force, &along(f, turn * v).transpose());
        }
        if self.records.len() == MAX_EXPERIMENTS {
            self.records.pop_front();
        }
        self.records.push_back([force, acceleration]);
    }

    /// Returns a warning if the robot gives off energy, and takes it up with other axes of a sensor.
    pub(crate) fn warning(&self) -> Option<Warning> {
        self.wrong().map(Warning::WrongAxes)
    }

    /// Returns whether the records say with which axes the robot would not give off energy.
    pub(crate) fn are_wrong(&self) -> bool {
        self.wrong().is_some_and(|axes| axes.force.is_some() || axes.acceleration.is_some())
    }

    fn wrong(&self) -> Option<WrongAxes> {
        let [force, acceleration] = [0, 1].map(|sensor| self.sums(sensor));
        let best = [&force, &acceleration].map(best);
        let named = |ways: &[Power; WAYS], best: Option<usize>| {
            best.filter(|&best| is_clear(ways, best)).map(axes)
        };
        best.iter().any(Option::is_some).then(|| WrongAxes {
            share: force[0].share(),
            force: named(&force, best[0]),
            acceleration: named(&acceleration, best[1]),
        })
    }

    /// Power over all records with the ways of one sensor.
    fn sums(&self, sensor: usize) -> [Power; WAYS] {
        std::array::from_fn(|way| {
            let of_records = self.records.iter().map(|record| record[sensor][way]);
            of_records.fold(Power::default(), |sum, own| Power {
                negative: sum.negative + own.negative,
                absolute: sum.absolute + own.absolute,
            })
        })
    }
}

impl Power {
    /// Share of negative power; 0 without power.
    fn share(&self) -> f64 {
        if self.absolute > 0.0 { self.negative / self.absolute } else { 0.0 }
    }
}

fn bin_of<const B: usize>(spectrum: &Spectrum<B>, bin: usize) -> Vector3<Complex<f64>> {
    let part = |part: &[heapless::Vec<f32, B>; 3], axis: usize| f64::from(part[axis][bin]);
    Vector3::from_fn(|axis, _| Complex::new(part(&spectrum.re, axis), part(&spectrum.im, axis)))
}

/// Adds one bin. `power[(i, j)]` is that of the axis i of the other sensor with the axis j of this one.
fn add(ways: &mut [Power; WAYS], power: &Matrix3<f64>) {
    for (way, sums) in ways.iter_mut().enumerate() {
        let p: f64 = (0..3).map(|i| sign(way, i) * power[(i, ORDERS[way / 8][i])]).sum();
        sums.negative += (-p).max(0.0);
        sums.absolute += p.abs();
    }
}

/// Sign of the axis i in a way to take the axes.
fn sign(way: usize, i: usize) -> f64 {
    if way >> i & 1 == 0 { 1.0 } else { -1.0 }
}

/// The way that leaves the least negative power, if that of the configuration, the first, leaves much.
fn best(ways: &[Power; WAYS]) -> Option<usize> {
    let own = ways[0].share();
    let best = (0..WAYS).min_by(|&a, &b| ways[a].share().total_cmp(&ways[b].share()))?;
    (own > NEGATIVE && ways[best].share() < PART * own).then_some(best)
}

/// Returns whether all other ways leave much more negative power than the best one.
fn is_clear(ways: &[Power; WAYS], best: usize) -> bool {
    let mut others = (0..WAYS).filter(|&way| way != best);
    others.all(|way| ways[best].share() < CLEAR * ways[way].share())
}

fn axes(way: usize) -> [SignedAxis; 3] {
    std::array::from_fn(|i| SignedAxis {
        axis: ORDERS[way / 8][i] as u8,
        negative: sign(way, i) < 0.0,
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use flexid_core::chain::{Chain, Joint, JointKind, Link};
    use flexid_core::motion::EquationOfMotion;
    use flexid_core::motion::radau::Radau;
    use flexid_core::noise::NoiseShape;
    use flexid_core::parameters::Bushing;
    use flexid_core::sensors::Accelerometer;
    use flexid_core::spectrum::Measurement;
    use flexid_core::stream::Record;
    use nalgebra::Isometry3;

    use super::*;

    const SAMPLES: usize = 2048;
    const RATE_HZ: f64 = 2000.0;

    /// Reading of an arm of one joint that is pushed from rest with a sweep along each axis; the signals are those of `axes`.
    fn swept(axes: [usize; 3]) -> Axes {
        let link = Link {
            mass: 300.0,
            centre_of_mass: Vector3::new(0.4, 0.05, -0.1),
            inertia: Matrix3::from_diagonal(&Vector3::new(20.0, 30.0, 25.0)),
        };
        let origin = Isometry3::identity();
        let joint = Joint { origin, axis: Vector3::z_axis(), kind: JointKind::Revolute, link };
        let chain = Chain::new(&[joint], Isometry3::translation(0.9, 0.1, -0.2)).unwrap();
        let bushing = Bushing {
            stiffness: [3.0e7, 2.0e7, 4.0e7, 2.5e6, 3.0e6, 4.0e6],
            damping: [3.0e4, 2.0e4, 4.0e4, 1.0e3, 2.0e3, 3.0e3],
        };
        let mounting = Mounting::AT_TCP;
        let equation = EquationOfMotion::new(&chain, &[0.3], Vector3::zeros(), &[bushing]).unwrap();
        let rest = equation.rest();
        let mut robot = Radau::new(equation, rest, 1.0 / RATE_HZ);
        let mut record = Record::<SAMPLES> {
            start_s: 0.0,
            pose: [0.3].into_iter().collect(),
            path: Default::default(),
            since_s: 0.0,
            rate_hz: RATE_HZ,
            has_doubtful_rate: false,
            force: Default::default(),
            acceleration: Default::default(),
            force_noise: [0.5; 3],
            acceleration_noise: [0.02; 3],
            force_noise_shape: [NoiseShape::WHITE; 3],
            acceleration_noise_shape: [NoiseShape::WHITE; 3],
            starts_at_rest: true,
            point: [0.0; 3],
        };
        let duration = SAMPLES as f64 / RATE_HZ;
        let force = |time: f64| {
            let part = time / duration;
            let turn = TAU * duration * part;
            let [up, down, middle] = [5.0 + 70.0 * part, 150.0 - 70.0 * part, 20.0 + 40.0 * part];
            let fade = 500.0 * (PI * part).sin().powi(2);
            fade * Vector3::new((turn * up).sin(), (turn * down).sin(), (turn * middle).sin())
        };
        for sample in 0..SAMPLES {
            let time = sample as f64 / RATE_HZ;
            let equation = robot.equation();
            let sensed =
                equation.reading(robot.state(), &force(time), Accelerometer::Inertial, &mounting);
            for axis in 0..3 {
                record.force[axis].push(sensed.force[axis] as f32).unwrap();
                record.acceleration[axis].push(sensed.acceleration[axes[axis]] as f32).unwrap();
            }
            robot.step(|part| force(time + part / RATE_HZ)).unwrap();
        }
        let measurement = Measurement {
            band_hz: [5.0, 150.0],
            gravity: [0.0; 3],
            accelerometer: Accelerometer::Inertial,
            mounting,
        };
        let mut buffer = [0.0; SAMPLES];
        let mut axes = Axes::new(&mounting);
        axes.note(&Experiment::<256>::new(&chain, &measurement, &record, &mut buffer).unwrap());
        axes
    }

    /// One record of one joint does not say which axes are swapped.
    #[test]
    fn swapped_axes_of_a_record_give_off_energy() {
        assert_eq!(swept([0, 1, 2]).warning(), None);
        let Some(Warning::WrongAxes(swapped)) = swept([0, 2, 1]).warning() else {
            panic!("no warning")
        };
        assert!(swapped.share > 0.5, "{swapped:?}");
        assert_eq!((swapped.force, swapped.acceleration), (None, None));
    }

    /// Power of a robot with a mobility, pushed along many directions, whose velocity has the signals of this way.
    fn sums(way: usize) -> [Power; WAYS] {
        let mut ways = [Power::default(); WAYS];
        let mobility = Matrix3::new(1.0, 0.3, -0.2, 0.3, 0.6, 0.1, -0.2, 0.1, 1.5);
        for bin in 0..64 {
            let part = |step: f64| (step * f64::from(bin)).sin();
            let f = Vector3::new(part(1.3), part(2.1), part(3.7));
            let v = mobility * f;
            let mut signals = Vector3::zeros();
            (0..3).for_each(|i| signals[ORDERS[way / 8][i]] = sign(way, i) * v[i]);
            add(&mut ways, &(f * signals.transpose()));
        }
        ways
    }

    #[test]
    fn the_way_that_leaves_the_power_positive_is_found() {
        assert_eq!(best(&sums(0)), None);
        let mut wrong = 0;
        for way in 1..WAYS {
            let ways = sums(way);
            if ways[0].share() > NEGATIVE {
                assert_eq!(best(&ways), Some(way));
                assert!(is_clear(&ways, way), "{way}");
                wrong += 1;
            }
        }
        assert!(wrong >= 44, "{wrong} of 47 ways leave negative power");
        assert_eq!(best(&[Power::default(); WAYS]), None);
    }

    #[test]
    fn axes_are_not_named_where_several_ways_leave_the_power_positive() {
        let mut ways = sums(9);
        ways[17] = ways[9];
        assert_eq!(best(&ways), Some(9));
        assert!(!is_clear(&ways, 9));
    }

    #[test]
    fn axes_are_named_with_their_signs() {
        let named = |way| axes(way).map(|axis| axis.to_string()).join(" ");
        assert_eq!(named(0), "x y z");
        assert_eq!(named(8 + 2), "x -z y");
        assert_eq!(named(16 + 5), "-y x -z");
    }
}
