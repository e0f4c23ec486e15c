//! Derivatives of a reading by the imperfections of a plant, by the dense model.
//!
//! The prediction is `A = R (s²M + sD + K)⁻¹ P F`: the measured force F pushes, and the accelerometer reads `R = s² R₂ + R₀`. With the
//! elongations q of the perfect plant, an imperfection of the matrices adds
//!
//! ```text
//! δA = δR q + R Z⁻¹ (δP F − δZ q)      Z = s²M + sD + K
//! ```
//!
//! The matrices' changes are differences of those of the simulator's robots, whose plants differ in this imperfection alone. A sensor's
//! imperfections are multiples of its signal. What the imperfections mean, [`Imperfection`] says.

use std::f64::consts::{FRAC_2_PI, TAU};

use anyhow::{Result, anyhow};
use flexid_core::chain::{Chain, JointKind};
use flexid_core::imperfection::{Imperfection, Sensor};
use flexid_simulation::experiment::Cut;
use flexid_simulation::plant::Plant;
use nalgebra::{Complex, DMatrix, DVector, Isometry3, Matrix3, Translation3, Vector3};

use crate::bound::{Column, Milled};
use crate::linear::Equation;
use crate::plants::with;

/// Step of a difference, in standard deviations. Chosen: curvature and rounding change a difference by less than 1e-4 of it.
const STEP: f64 = 1e-2;
/// Rate from which on a drive is stiffer, 1/s.
const SERVO: f64 = TAU * 10.0;

/// Derivative of the reading of record `number` by an imperfection, in its standard deviation.
pub(crate) fn column(
    milled: &Milled<'_>,
    number: usize,
    imperfection: Imperfection,
    deviation: f64,
) -> Result<Column> {
    use Imperfection as I;
    let column: Column = match imperfection {
        I::Delay => of_reading(|s| -s),
        I::DelayDrift => Box::new(|bin| -bin.rate_by_time),
        I::Dispersion => of_reading(|s| s * s * s),
        I::RollOff => of_reading(|s| -(s * s * s * s)),
        I::RecordDelay(record) if record == number => of_reading(|s| -s),
        I::RecordDelay(_) => of_reading(|_| Complex::ZERO),
        I::Resonance(Sensor::Accelerometer) => of_reading(|s| -(s * s)),
        I::Resonance(Sensor::Force) => of_force(|s| s * s),
        I::HighPass(Sensor::Accelerometer) => of_reading(|s| -s.inv()),
        I::HighPass(Sensor::Force) => of_force(|s| s.inv()),
        I::Gain(sensor, axis) => mixed(sensor, axis, axis),
        I::Crosstalk(sensor, of, by) => mixed(sensor, of, by),
        I::Hysteresis => hysteresis(milled),
        I::Servo(joint) => {
            let drive = 6 * joint + drive(milled.chain, joint);
            let growth = |s: Complex<f64>| s / (s + SERVO);
            softened(on(milled, drive, stiffnesses(milled)[drive]), growth)
        }
        I::Load => softened(loads(milled)?, |_| Complex::ONE),
        I::Ground(dof) => ground(milled, dof)?,
        I::GroundDamping(dof) => {
            let of_compliance = ground(milled, dof)?;
            Box::new(move |bin| of_compliance(bin) * -bin.s)
        }
        I::RecordStiffness(record) if record == number => {
            softened(stiffnesses(milled), |_| Complex::ONE)
        }
        I::RecordStiffness(_) => of_reading(|_| Complex::ZERO),
        // On rigid ground it has no effect.
        I::BaseMass => of_reading(|_| Complex::ZERO),
        // The robot stands.
        I::JointDelay => of_reading(|_| Complex::ZERO),
        I::Hose => hose(milled, |_| Complex::ONE),
        I::HoseDamping => hose(milled, |s| s),
        I::Turn(..)
        | I::ToolTurn(_)
        | I::ToolCentrePoint(_)
        | I::AccelerometerPlace(_)
        | I::Mass(_)
        | I::CentreOfMass(..)
        | I::JointAngle(_)
        | I::ElasticCentre(..)
        | I::Inertia(..) => of_matrices(milled, imperfection, STEP * deviation)?,
    };
    Ok(Box::new(move |bin| column(bin) * Complex::from(deviation)))
}

/// The matrices of a prediction, or their derivatives.
struct Matrices {
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    /// P, N×3.
    pushed: DMatrix<f64>,
    /// R₂ and R₀, 3×N.
    read: [DMatrix<f64>; 2],
}

impl Matrices {
    fn of(plant: &Plant, milled: &Milled<'_>) -> Result<Self> {
        let Milled { chain, bushings, cut, .. } = *milled;
        let pose = plant.true_pose(&cut.pose, 0.0);
        let robot = plant.robot(chain, &pose, bushings, &cut.mounting);
        let robot = robot.map_err(|error| anyhow!("no robot has this plant: {error:?}"))?;
        let still = Cut { pose: vec![0.0; pose.len()], course: None, force: Vec::new(), ..*cut };
        let at_tcp = Equation::new(&robot.chain, bushings, &still);
        let place = Translation3::from(robot.mounting.accelerometer);
        let sensor: Isometry3<f64> = robot.chain.tcp() * place;
        let sensing = Chain::new(robot.chain.joints(), sensor);
        let sensing = sensing.map_err(|error| anyhow!("no chain has this sensor: {error:?}"))?;
        let at_sensor = Equation::new(&sensing, bushings, &still);
        let along =
            |axes: &nalgebra::Rotation3<f64>| -> Matrix3<f64> { axes.inverse().into_inner() };
        let axes = along(&robot.mounting.accelerometer_axes);
        let pushed = along(&robot.mounting.force_axes) * &at_tcp.tip;
        let read = [at_sensor.tip, at_sensor.tilt].map(|of| dense(axes * of));
        let Equation { mass, stiffness, .. } = at_tcp;
        Ok(Self { mass, stiffness, pushed: dense(pushed).transpose(), read })
    }
}

fn dense(of: nalgebra::Matrix3xX<f64>) -> DMatrix<f64> {
    DMatrix::from_column_slice(3, of.ncols(), of.as_slice())
}

fn of_matrices(milled: &Milled<'_>, imperfection: Imperfection, step: f64) -> Result<Column> {
    let joints = milled.chain.joints().len();
    let plant = |value: f64| with(|plant| plant.add(imperfection, value, joints));
    let at = |value: f64| Matrices::of(&plant(value), milled);
    let (up, down) = (at(step)?, at(-step)?);
    let slope = |of: &dyn Fn(&Matrices) -> &DMatrix<f64>| {
        ((of(&up) - of(&down)) / (2.0 * step)).map(Complex::from)
    };
    let (mass, stiffness) = (slope(&|it| &it.mass), slope(&|it| &it.stiffness));
    let pushed = slope(&|it| &it.pushed);
    let read = [slope(&|it| &it.read[0]), slope(&|it| &it.read[1])];
    Ok(Box::new(move |bin| {
        let q = &bin.elongation;
        let squared = bin.s * bin.s;
        let load = &pushed * bin.force - &mass * q * squared - &stiffness * q;
        three(&read[0] * q * squared + &read[1] * q + &bin.per_load * load)
    }))
}

fn three(vector: DVector<Complex<f64>>) -> Vector3<Complex<f64>> {
    Vector3::from_fn(|axis, _| vector[axis])
}

/// The reading times a transfer function.
fn of_reading(factor: fn(Complex<f64>) -> Complex<f64>) -> Column {
    Box::new(move |bin| bin.reading * factor(bin.s))
}

/// The force times a transfer function.
fn of_force(factor: fn(Complex<f64>) -> Complex<f64>) -> Column {
    Box::new(move |bin| three(&bin.accelerance * bin.force * factor(bin.s)))
}

/// A part of axis `by` of a sensor, in the reading of axis `of`. The true force has it less.
fn mixed(sensor: Sensor, of: usize, by: usize) -> Column {
    Box::new(move |bin| match sensor {
        Sensor::Accelerometer => Vector3::ith(of, bin.reading[by]),
        Sensor::Force => three(bin.accelerance.column(of) * -bin.force[by]),
    })
}

/// The effect of these further stiffnesses, times a transfer function.
fn softened(further: DVector<f64>, factor: fn(Complex<f64>) -> Complex<f64>) -> Column {
    Box::new(move |bin| {
        let load = further.map(Complex::from).component_mul(&bin.elongation);
        three(&bin.per_load * load * -factor(bin.s))
    })
}

/// Each damper `s d` gives way to `d ω₀ (i + 2/π ln(ω/ω₀))`, with ω₀ the middle of the band.
fn hysteresis(milled: &Milled<'_>) -> Column {
    let [lowest, highest] = milled.study.measurement.band_hz;
    let middle = TAU * (lowest * highest).sqrt();
    let dampings = milled.bushings.iter().flat_map(|bushing| bushing.damping);
    let dampings = DVector::from_iterator(6 * milled.bushings.len(), dampings).map(Complex::from);
    Box::new(move |bin| {
        let elastic = FRAC_2_PI * (bin.s.im / middle).ln();
        let excess = Complex::new(elastic, 1.0) * middle - bin.s;
        three(&bin.per_load * dampings.component_mul(&bin.elongation) * -excess)
    })
}

fn stiffnesses(milled: &Milled<'_>) -> DVector<f64> {
    let all = milled.bushings.iter().flat_map(|bushing| bushing.stiffness);
    DVector::from_iterator(6 * milled.bushings.len(), all)
}

/// A value on one degree of freedom, and none on the others.
fn on(milled: &Milled<'_>, dof: usize, value: f64) -> DVector<f64> {
    let mut on = DVector::zeros(6 * milled.bushings.len());
    on[dof] = value;
    on
}

/// Stiffness of each drive times the load of gravity on it.
fn loads(milled: &Milled<'_>) -> Result<DVector<f64>> {
    let Milled { chain, bushings, cut, .. } = *milled;
    let still = chain.linearise(&cut.pose, cut.gravity, bushings);
    let still = still.map_err(|error| anyhow!("gravity leaves no rest: {error:?}"))?;
    let mut loads = DVector::zeros(6 * bushings.len());
    for (joint, (bushing, at_rest)) in bushings.iter().zip(&still.joints).enumerate() {
        let drive = drive(chain, joint);
        let stiffness = bushing.stiffness[drive];
        loads[6 * joint + drive] = stiffness * (stiffness * at_rest.sag[drive]).abs();
    }
    Ok(loads)
}

/// Ground in series with the first joint: `e_outᵀ Z x xᵀ Z q`, with x the displacement at the joint by one of the base, and Z the
/// impedance of its bushing.
fn ground(milled: &Milled<'_>, dof: usize) -> Result<Column> {
    let Milled { chain, bushings, cut, .. } = *milled;
    let still = chain.linearise(&cut.pose, cut.gravity, bushings);
    let still = still.map_err(|error| anyhow!("gravity leaves no rest: {error:?}"))?;
    let x = still.joints[0].from_parent.matrix().column(dof).map(Complex::from);
    let bushing = bushings[0];
    Ok(Box::new(move |bin| {
        let z = |i: usize| bin.s * bushing.damping[i] + bushing.stiffness[i];
        let through: DVector<_> = DVector::from_fn(6, |i, _| x[i] * z(i));
        let load = through.dot(&bin.elongation.rows(0, 6));
        three(bin.per_load.columns(0, 6) * through * load)
    }))
}

/// A hose at the TCP, whose force per displacement is this transfer function: `−e_outᵀ T Tᵀ q`.
fn hose(milled: &Milled<'_>, factor: fn(Complex<f64>) -> Complex<f64>) -> Column {
    let Milled { chain, bushings, cut, .. } = *milled;
    let tip = dense(Equation::new(chain, bushings, cut).tip).map(Complex::from);
    Box::new(move |bin| {
        let pull = &tip * &bin.elongation * -factor(bin.s);
        three(&bin.per_load * (tip.transpose() * pull))
    })
}

/// Degree of freedom of a drive.
fn drive(chain: &Chain, joint: usize) -> usize {
    let joint = &chain.joints()[joint];
    let first = if joint.kind == JointKind::Prismatic { 0 } else { 3 };
    first + joint.axis.iamax()
}

#[cfg(test)]
mod tests;
