//! Places and axes of sensors that are not at the TCP and along its axes.
//!
//! The sensors move with the last link, so that the accelerometer at p has the acceleration `a + α × p + ω × (ω × p)`. The cut
//! acts at the TCP; a hammer may strike beside it, at the point of its record. What lies between the cut and the force sensor has inertia and
//! weight. The sensor reads
//!
//! ```text
//! F_measured = F_cut − m (a_c + θ × g)
//! ```
//!
//! with the acceleration a_c of the tool's centre of mass c, and the turn θ of the tool in gravity. The tool's weight at rest has
//! been removed. The sensor sees the cut itself turned by θ, which is of second order and left out.

use nalgebra::{Isometry3, Matrix3, Rotation3, SMatrix, Vector3, Vector6};

use crate::chain::Chain;
use crate::chain::linearise::LinearChain;

/// Mounting of the sensors on the last link. The default has both at the TCP, along its axes, and no mass beyond the force sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// Position of the accelerometer from the TCP, TCP axes, m.
    pub accelerometer: Vector3<f64>,
    /// Turns the TCP's axes into the accelerometer's. The columns are the accelerometer's axes, along the TCP's.
    pub accelerometer_axes: Rotation3<f64>,
    /// Turns the TCP's axes into the force sensor's. The columns are the force sensor's axes, along the TCP's.
    pub force_axes: Rotation3<f64>,
    /// Mass beyond the force sensor, a part of the last link, kg.
    pub tool_mass: f64,
    /// Centre of that mass from the TCP, TCP axes, m.
    pub tool_centre: Vector3<f64>,
}

impl Mounting {
    /// Both sensors at the TCP, along its axes; the default.
    pub const AT_TCP: Self = Self {
        accelerometer: Vector3::new(0.0, 0.0, 0.0),
        accelerometer_axes: ALONG,
        force_axes: ALONG,
        tool_mass: 0.0,
        tool_centre: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Loads on the last link whose displacements are those of the accelerometer along its axes.
    pub(crate) fn readings(&self, chain: &LinearChain) -> SMatrix<f64, 6, 3> {
        loads(chain, &self.accelerometer, &self.accelerometer_axes)
    }

    /// Loads on the last link of unit forces at a point, from the TCP, along the force sensor's axes.
    pub(crate) fn forces(&self, chain: &LinearChain, point: &Vector3<f64>) -> SMatrix<f64, 6, 3> {
        loads(chain, point, &self.force_axes)
    }

    /// Loads on the last link whose displacements are those of the tool's centre along the force sensor's axes.
    pub(crate) fn centres(&self, chain: &LinearChain) -> SMatrix<f64, 6, 3> {
        loads(chain, &self.tool_centre, &self.force_axes)
    }
}

impl Default for Mounting {
    fn default() -> Self {
        Self::AT_TCP
    }
}

/// No turn.
const ALONG: Rotation3<f64> =
    Rotation3::from_matrix_unchecked(Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));

/// Loads on the last link of unit forces at `point` along each of `axes`.
fn loads(chain: &LinearChain, point: &Vector3<f64>, axes: &Rotation3<f64>) -> SMatrix<f64, 6, 3> {
    let mut loads = SMatrix::<f64, 6, 3>::zeros();
    for axis in 0..3 {
        let force: Vector3<f64> = axes.matrix().column(axis).into();
        let load: Vector6<f64> = chain.tip_force * force + chain.tip_torque * point.cross(&force);
        loads.set_column(axis, &load);
    }
    loads
}

/// Loads on the last link whose displacements are the turn of gravity along each of `axes`: `θ × g`, m/s².
pub(crate) fn tilts(chain: &LinearChain, axes: &Rotation3<f64>) -> SMatrix<f64, 6, 3> {
    chain.tip_torque * chain.gravity_at_tip.cross_matrix() * axes.matrix()
}

/// Place of a measured displacement, in the axes of the TCP of the unloaded robot. By default at the TCP and along its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    /// Point of the tool that is measured, from the TCP, m.
    pub place: [f64; 3],
    /// Unit vectors along which the displacement is read.
    pub axes: [[f64; 3]; 3],
}

impl Default for Gauge {
    fn default() -> Self {
        Self { place: [0.0; 3], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }
}

impl Gauge {
    /// The gauge as it reads along the axes of the base at this pose (rad or m, one per driven joint). The turn of the tool by gravity,
    /// a few mrad, is left out.
    pub fn along_base(self, chain: &Chain, pose: &[f64]) -> Self {
        let joints = chain.joints().iter().zip(chain.angles(pose));
        let tip = joints.fold(Isometry3::identity(), |tip, (joint, q)| tip * joint.frame(q));
        let to_tcp = (tip * chain.tcp()).rotation.inverse();
        let along = |axis| (to_tcp * Vector3::ith(axis, 1.0)).into();
        Self { axes: [0, 1, 2].map(along), ..self }
    }
}
