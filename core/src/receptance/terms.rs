//! The linearised chain and its bushings in the precision of the recursion.

use heapless::Vec;
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3};

use super::complex::Complex;
use super::filter::Filter;
use super::lanes::{Lanes, Scalar};
use super::law::{Hysteresis, Rates};
use super::observation::{Loads, Observation};
use super::symmetric::{PACKED, at};
use super::to_parent::{ToParent, rows};
use super::tool::ToolTerms;
use crate::chain::linearise::{LinearChain, LinearJoint, LinearisationError};
use crate::mounting::{Gauge, tilts};
use crate::parameters::Bushing;
use crate::sensors::Sensors;
use crate::{DOF, MAX_JOINTS};

/// One joint in the form that the recursion needs. Fields without a comment are those of [`LinearJoint`] and [`Bushing`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct JointTerms<T> {
    /// Y: transforms the displacement that carries this bushing to the link before.
    pub(crate) to_parent: ToParent<T>,
    pub(crate) inertia: [T; PACKED],
    pub(crate) gravity_turns: [[T; 3]; 3],
    pub(crate) gravity_coupling: [[T; 3]; DOF],
    pub(crate) stiffness: [T; DOF],
    pub(crate) damping: [T; DOF],
    /// Growth of the stiffness of the drive with the frequency.
    pub(crate) growth: Option<Growth<T>>,
}

/// Growth of the stiffness of a drive with the frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Growth<T> {
    /// Degree of freedom along or about the axis of the drive.
    pub(crate) dof: usize,
    /// g, from low to high frequencies.
    pub(crate) part: T,
}

/// Ground that gives way along and about each axis of the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ground<T> {
    /// c: 1/k, m/N and rad/Nm, not 0.
    pub(crate) compliance: [T; DOF],
    /// e: `d/k²`, m s/N and rad s/Nm.
    pub(crate) damping: [T; DOF],
    /// m: mass of what stands on the ground and does not move with the first link, kg. It is taken for a point at the base.
    pub(crate) mass: T,
}

impl<T: Scalar> Ground<T> {
    /// `a = c − s e`, which is `1/(k + s d)` for small dampings.
    #[inline(always)]
    fn without_mass<V: Lanes<Scalar = T>>(&self, s: Complex<V>, dof: usize) -> Complex<V> {
        let damped = s.scale(s.re.fill(self.damping[dof]));
        let mut compliance = Complex::zero(s.re);
        compliance.re = s.re.fill(self.compliance[dof]);
        compliance - damped
    }

    /// Dynamic stiffness of ground and mass: `1/a + s² m` along an axis, `1/a` about one.
    #[inline(always)]
    pub(crate) fn stiffness<V: Lanes<Scalar = T>>(&self, s: Complex<V>, dof: usize) -> Complex<V> {
        let stiffness = self.without_mass(s, dof).reciprocal();
        if dof < 3 { stiffness + (s * s).scale(s.re.fill(self.mass)) } else { stiffness }
    }

    /// Displacement per load: `a/(1 + s² m a)` along an axis, `a` about one.
    #[inline(always)]
    pub(crate) fn at<V: Lanes<Scalar = T>>(&self, s: Complex<V>, dof: usize) -> Complex<V> {
        if dof < 3 { self.stiffness(s, dof).reciprocal() } else { self.without_mass(s, dof) }
    }

    /// Derivative of the displacement per load by a: `1/(1 + s² m a)²` along an axis, 1 about one.
    #[inline(always)]
    pub(crate) fn per_compliance<V: Lanes<Scalar = T>>(
        &self,
        s: Complex<V>,
        dof: usize,
    ) -> Complex<V> {
        let part = self.at(s, dof) * self.without_mass(s, dof).reciprocal();
        part * part
    }
}

/// A hose between the ground and the TCP, `Z ← Z + (k + s d) T Tᵀ` with the loads T of unit forces at the TCP on the last link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hose<T> {
    /// k, N/m.
    pub(crate) stiffness: T,
    /// d, Ns/m.
    pub(crate) damping: T,
    /// `T Tᵀ`, the displacement of the TCP in energy: packed, 1, m and m².
    pub(crate) spread: [T; PACKED],
}

impl<T: Scalar> Hose<T> {
    /// A hose at the TCP of a chain.
    pub(crate) fn new(chain: &LinearChain, stiffness: f64, damping: f64) -> Self {
        let spread = packed(&(chain.tip_force * chain.tip_force.transpose()));
        Self { stiffness: T::from_f64(stiffness), damping: T::from_f64(damping), spread }
    }

    /// Force per displacement, `k + s d`.
    #[inline(always)]
    pub(crate) fn impedance<V: Lanes<Scalar = T>>(&self, s: Complex<V>) -> Complex<V> {
        let mut impedance = s.scale(s.re.fill(self.damping));
        impedance.re = impedance.re + s.re.fill(self.stiffness);
        impedance
    }
}

/// A chain at one pose with its bushings, ready for the recursion.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms<T> {
    /// Joints, base first.
    pub(crate) joints: Vec<JointTerms<T>, MAX_JOINTS>,
    /// Loads on the last link per unit of each force of a response: a force at its point along an axis of the force sensor. In a
    /// static test the first is the whole wrench, and there are no others.
    pub(crate) force_loads: Loads<T>,
    /// The observation.
    pub(crate) observation: Observation<T>,
    /// Part of the force that the force sensor does not measure; `None` if no mass is beyond it.
    pub(crate) tool: Option<ToolTerms<T>>,
    /// True if both sensors measure at the same place, along the same axes and at the same time, and the accelerometer
    /// measures nothing else: the receptance is then sufficient.
    pub(crate) collocated: bool,
    /// True if the stiffness due to gravity enters.
    pub(crate) gravity: bool,
    /// Hysteresis of all bushings.
    pub(crate) hysteresis: Hysteresis<T>,
    /// The ground under the first joint. `None` if it is rigid.
    pub(crate) ground: Option<Ground<T>>,
    /// Hoses and cables at the tool. `None` in a model without imperfections.
    pub(crate) hose: Option<Hose<T>>,
}

impl<T: Scalar> Terms<T> {
    /// Terms of a linearised chain with one bushing per joint, base first, that observe the accelerometer's reading. A strapdown
    /// accelerometer reads `a + θ × g`, less its reading at rest.
    ///
    /// # Errors
    ///
    /// Returns an error if there is not one bushing per joint.
    pub fn new(
        chain: &LinearChain,
        bushings: &[Bushing],
        sensors: &Sensors,
    ) -> Result<Self, LinearisationError> {
        let Sensors { accelerometer, mounting, delay, acceleration_gain, point } = sensors;
        let gain = Matrix3::from_diagonal(&(*acceleration_gain).into());
        let reading = mounting.readings(chain) * gain;
        let force = mounting.forces(chain, point);
        let feels_gravity = accelerometer.feels(&chain.gravity_at_tip);
        let tilt = || columns(&(tilts(chain, &mounting.accelerometer_axes) * gain));
        let observation = Observation::Acceleration {
            translation: columns(&reading),
            gravity: feels_gravity.then(tilt),
            delay: T::from_f64(*delay),
            filter: Filter::default(),
        };
        let tool = (mounting.tool_mass > 0.0).then(|| ToolTerms {
            inertia: columns(&(mounting.centres(chain) * mounting.tool_mass)),
            weight: columns(&(tilts(chain, &mounting.force_axes) * mounting.tool_mass)),
        });
        Ok(Self {
            collocated: reading == force && tool.is_none() && !feels_gravity && *delay == 0.0,
            tool,
            ..Self::observing(observation, &force, chain, bushings)?
        })
    }

    /// Terms of a static test: the force of 1 along the first axis is the wrench (N and Nm on the TCP, along its axes), and
    /// the displacement at the gauge is observed, whose loads are those of a unit force there:
    ///
    /// ```text
    /// P e_a + T (g × e_a)          P, T: loads of unit forces and unit torques at the TCP
    /// ```
    pub(crate) fn static_test(
        chain: &LinearChain,
        bushings: &[Bushing],
        wrench: &[f64; 6],
        gauge: &Gauge,
    ) -> Result<Self, LinearisationError> {
        let [fx, fy, fz, mx, my, mz] = *wrench;
        let load = chain.tip_force * Vector3::new(fx, fy, fz)
            + chain.tip_torque * Vector3::new(mx, my, mz);
        let mut force = SMatrix::<f64, 6, 3>::zeros();
        force.set_column(0, &load);
        let axes = Matrix3::from_columns(&gauge.axes.map(Vector3::from));
        let turns = Vector3::from(gauge.place).cross_matrix() * axes;
        let read = chain.tip_force * axes + chain.tip_torque * turns;
        let observation = Observation::Displacement(columns(&read));
        Self::observing(observation, &force, chain, bushings)
    }

    /// Terms without a tool.
    fn observing(
        observation: Observation<T>,
        force: &SMatrix<f64, 6, 3>,
        chain: &LinearChain,
        bushings: &[Bushing],
    ) -> Result<Self, LinearisationError> {
        if chain.joints.len() != bushings.len() {
            return Err(LinearisationError::Bushings(bushings.len()));
        }
        let joints = chain.joints.iter().zip(bushings);
        Ok(Self {
            joints: joints.map(|(joint, bushing)| JointTerms::new(joint, bushing)).collect(),
            force_loads: columns(force),
            observation,
            tool: None,
            collocated: false,
            gravity: chain.gravity_at_tip != Vector3::zeros(),
            hysteresis: Hysteresis::default(),
            ground: None,
            hose: None,
        })
    }

    /// Returns whether gravity shows in what is observed.
    pub(crate) fn feels_gravity(&self) -> bool {
        matches!(self.observation, Observation::Acceleration { gravity: Some(_), .. })
    }

    /// Whether the bushings are springs and dampers, the same at all frequencies.
    pub(crate) fn has_plain_bushings(&self) -> bool {
        let has_growth = self.joints.iter().any(|joint| joint.growth.is_some());
        self.hysteresis.part.to_f64() == 0.0 && !has_growth
    }

    /// σ and ψ of the bushings at the complex frequency `s`.
    #[inline(always)]
    pub(super) fn rates<V: Lanes<Scalar = T>>(&self, s: Complex<V>) -> Rates<V> {
        let has_growth = self.joints.iter().any(|joint| joint.growth.is_some());
        Rates::new(&self.hysteresis, has_growth, s)
    }

    /// These terms, of an accelerometer with this filter, which reads `M a`, and a force sensor which reads `N F`.
    pub(crate) fn with_sensor_errors(
        mut self,
        filter: Filter<T>,
        [m, n]: [&Matrix3<f64>; 2],
    ) -> Self {
        self.collocated = false;
        if let Observation::Acceleration { translation, gravity, filter: own, .. } =
            &mut self.observation
        {
            *own = filter;
            *translation = combined(translation, &m.transpose());
            *gravity = gravity.map(|gravity| combined(&gravity, &m.transpose()));
        }
        // P F = (P N⁻¹) (N F). The identity where N is singular.
        let inverse = n.try_inverse().unwrap_or_else(Matrix3::identity);
        self.force_loads = combined(&self.force_loads, &inverse);
        self.tool = self.tool.map(|ToolTerms { inertia, weight }| ToolTerms {
            inertia: combined(&inertia, &n.transpose()),
            weight: combined(&weight, &n.transpose()),
        });
        self
    }

    /// Replaces the bushings, one per joint; the sag stays that of the bushings of the linearisation. Joints without an entry
    /// keep their bushing.
    pub fn set_bushings(&mut self, bushings: &[Bushing]) {
        for (terms, bushing) in self.joints.iter_mut().zip(bushings) {
            terms.stiffness = bushing.stiffness.map(T::from_f64);
            terms.damping = bushing.damping.map(T::from_f64);
        }
    }
}

impl<T: Scalar> JointTerms<T> {
    fn new(joint: &LinearJoint, bushing: &Bushing) -> Self {
        Self {
            to_parent: ToParent::inverse_of(&joint.from_parent),
            inertia: packed(&joint.inertia),
            gravity_turns: rows(&joint.gravity_turns),
            gravity_coupling: rows(&joint.gravity_coupling),
            stiffness: bushing.stiffness.map(T::from_f64),
            damping: bushing.damping.map(T::from_f64),
            growth: None,
        }
    }
}

/// Lower triangle of a symmetric matrix.
fn packed<T: Scalar>(matrix: &Matrix6<f64>) -> [T; PACKED] {
    let mut packed = [T::default(); PACKED];
    for i in 0..DOF {
        for j in 0..=i {
            packed[at(i, j)] = T::from_f64(matrix[(i, j)]);
        }
    }
    packed
}

/// `L m` of loads L, by columns.
fn combined<T: Scalar>(loads: &Loads<T>, m: &Matrix3<f64>) -> Loads<T> {
    core::array::from_fn(|j| {
        core::array::from_fn(|i| {
            T::from_f64((0..3).map(|k| loads[k][i].to_f64() * m[(k, j)]).sum())
        })
    })
}

fn columns<T: Scalar>(matrix: &SMatrix<f64, 6, 3>) -> Loads<T> {
    core::array::from_fn(|j| core::array::from_fn(|i| T::from_f64(matrix[(i, j)])))
}
