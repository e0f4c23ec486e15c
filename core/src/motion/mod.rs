//! The nonlinear equation of motion: `M(q) q̈ + C(q, q̇) q̇ + G(q) + D q̇ + K q = Jᵀ F` (paper, section 3.1).
//!
//! It is the reference for the linear model, and the physics of the simulated robot. The drives hold the joint angles. q are
//! the coordinates of the bushings: per joint slides `tx ty tz` along the axes of the joint frame, then turns `rx ry rz`
//! about x, the new y and the new z. F acts on the moving TCP along axes that are fixed in space: those of the TCP at rest,
//! in the static equilibrium under gravity. Where the drives travel, the joint frames move as prescribed, and the rest is that of the robot that
//! stands at the pose of the moment ([`travel`]).
//!
//! | module         | holds                                                       |
//! | -------------- | ----------------------------------------------------------- |
//! | `kinematics`   | pose and motion subspace of a link on its bushing           |
//! | `inverse`      | loads from motion: recursive Newton-Euler                   |
//! | `forward`      | motion from loads: the articulated-body recursion           |
//! | `impedance`    | `s²M + sD + K` of the chain frozen in a posture, factorised |
//! | [`radau`]      | time integration                                            |
//! | [`sensors`]    | readings of the sensors, at any place on the last link      |
//! | [`travel`]     | joint frames that move as prescribed                        |

mod forward;
mod impedance;
mod inverse;
mod kinematics;
pub mod radau;
pub mod sensors;
pub mod travel;

use heapless::Vec;
use nalgebra::{Matrix3, Vector3, Vector6};

use crate::MAX_JOINTS;
use crate::chain::Chain;
use crate::chain::linearise::LinearisationError;
use crate::parameters::Bushing;
use kinematics::{Link, Placed};

/// One number per bushing coordinate, joint by joint from the base, `tx ty tz rx ry rz`. Entries of joints beyond the chain
/// are zero.
pub type Coordinates = [Vector6<f64>; MAX_JOINTS];

/// Elongations of the bushings, and their rates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Elongations q: m and rad.
    pub elongation: Coordinates,
    /// Rates q̇: m/s and rad/s.
    pub rate: Coordinates,
}

/// Loads on a robot beside those of its bushings' springs and dampers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loads {
    /// Force on the TCP, N, TCP axes at rest.
    pub force: Vector3<f64>,
    /// Load with which each bushing resists beside `K q + D q̇`, N and Nm.
    pub resistance: Coordinates,
}

impl From<&Vector3<f64>> for Loads {
    fn from(&force: &Vector3<f64>) -> Self {
        Self { force, resistance: Coordinates::default() }
    }
}

/// The equation of motion of a robot whose drives hold one pose, or travel through it.
#[derive(Clone, Debug, PartialEq)]
pub struct EquationOfMotion {
    links: Vec<Link, MAX_JOINTS>,
    /// Diagonal of K, N/m and Nm/rad.
    stiffness: Coordinates,
    /// Diagonal of D, Ns/m and Nms/rad.
    damping: Coordinates,
    /// Gravity along the base axes, m/s².
    gravity: Vector3<f64>,
    /// Pose of the TCP in the last link.
    tcp: Pose,
    /// Elongations at rest: the static equilibrium, or those given to [`EquationOfMotion::about`].
    rest: Coordinates,
    /// Axes of the TCP at rest, in base axes. The force and the readings of an inertial accelerometer refer to these axes.
    rest_axes: Matrix3<f64>,
    /// Position of the TCP at rest, base axes, m.
    rest_tcp: Vector3<f64>,
    /// Gravity's share in the reading of an accelerometer at rest, before any travel, TCP axes, m/s².
    felt_at_rest: Vector3<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Pose {
    axes: Matrix3<f64>,
    translation: Vector3<f64>,
}

impl EquationOfMotion {
    /// The equation of motion at joint angles `pose` (one per driven joint, rad or m) under `gravity` (base axes, m/s²). The TCP at
    /// rest is that of the static equilibrium.
    ///
    /// # Errors
    ///
    /// As [`Chain::linearise`].
    pub fn new(
        chain: &Chain,
        pose: &[f64],
        gravity: Vector3<f64>,
        bushings: &[Bushing],
    ) -> Result<Self, LinearisationError> {
        let mut rest = Coordinates::default();
        let equilibrium = chain.linearise(pose, gravity, bushings)?;
        for (rest, joint) in rest.iter_mut().zip(&equilibrium.joints) {
            *rest = joint.sag;
        }
        Self::about(chain, pose, gravity, bushings, rest)
    }

    /// The equation of motion with the elongations `rest` as the state of rest. A very soft robot has no equilibrium under gravity, but it
    /// still moves.
    ///
    /// # Errors
    ///
    /// Returns an error if there is not one angle per driven joint and one bushing per joint.
    pub fn about(
        chain: &Chain,
        pose: &[f64],
        gravity: Vector3<f64>,
        bushings: &[Bushing],
        rest: Coordinates,
    ) -> Result<Self, LinearisationError> {
        if pose.len() != chain.driven() {
            return Err(LinearisationError::Angles(pose.len()));
        }
        if bushings.len() != chain.joints().len() {
            return Err(LinearisationError::Bushings(bushings.len()));
        }
        let per_joint = |of: fn(&Bushing) -> [f64; 6]| {
            let mut all = Coordinates::default();
            all.iter_mut().zip(bushings).for_each(|(one, bushing)| *one = of(bushing).into());
            all
        };
        let tcp = chain.tcp();
        let mut equation = Self {
            links: chain
                .joints()
                .iter()
                .zip(chain.angles(pose))
                .map(|(joint, q)| Link::new(joint, q))
                .collect(),
            stiffness: per_joint(|bushing| bushing.stiffness),
            damping: per_joint(|bushing| bushing.damping),
            gravity,
            tcp: Pose {
                axes: tcp.rotation.to_rotation_matrix().into_inner(),
                translation: tcp.translation.vector,
            },
            rest,
            rest_axes: Matrix3::identity(),
            rest_tcp: Vector3::zeros(),
            felt_at_rest: Vector3::zeros(),
        };
        equation.place_rest();
        equation.felt_at_rest = equation.rest_axes.tr_mul(&-gravity);
        Ok(equation)
    }

    /// Sets the pose of the TCP at rest.
    fn place_rest(&mut self) {
        let tcp = self.tcp_pose(&self.placed(&self.rest));
        (self.rest_axes, self.rest_tcp) = (tcp.axes, tcp.translation);
    }

    /// State at rest: the static equilibrium under gravity, or the elongations given to [`EquationOfMotion::about`].
    pub fn rest(&self) -> State {
        State { elongation: self.rest, rate: Coordinates::default() }
    }

    /// Number of joints of the chain.
    pub fn joints(&self) -> usize {
        self.links.len()
    }

    /// Displacement of the TCP from its position at rest, along its axes at rest, m.
    pub fn tcp_displacement(&self, state: &State) -> Vector3<f64> {
        let tcp = self.tcp_pose(&self.placed(&state.elongation));
        self.rest_axes.tr_mul(&(tcp.translation - self.rest_tcp))
    }

    /// `K q + D q̇` of one joint, N and Nm.
    fn bushing_load(&self, state: &State, joint: usize) -> Vector6<f64> {
        self.stiffness[joint].component_mul(&state.elongation[joint])
            + self.damping[joint].component_mul(&state.rate[joint])
    }

    fn placed(&self, elongation: &Coordinates) -> [Placed; MAX_JOINTS] {
        let mut placed = [Placed::default(); MAX_JOINTS];
        for ((placed, link), elongation) in placed.iter_mut().zip(&self.links).zip(elongation) {
            *placed = link.placed(elongation);
        }
        placed
    }

    /// Pose of the TCP in the base.
    fn tcp_pose(&self, placed: &[Placed; MAX_JOINTS]) -> Pose {
        let mut pose = Pose { axes: Matrix3::identity(), translation: Vector3::zeros() };
        for place in &placed[..self.links.len()] {
            pose.translation += pose.axes * place.lever;
            pose.axes *= place.rotation;
        }
        pose.translation += pose.axes * self.tcp.translation;
        pose.axes *= self.tcp.axes;
        pose
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::chain::{self, Joint, JointKind};

    /// The equation of motion of a robot with three joints.
    pub(super) fn equation() -> EquationOfMotion {
        let joint = |x: f64, axis, kind| Joint {
            origin: Isometry3::new(Vector3::new(x, 0.3, -0.2), Vector3::new(0.4, x, -0.7)),
            axis,
            kind,
            link: chain::Link {
                mass: 30.0 * x,
                centre_of_mass: Vector3::new(0.2, -0.1, x),
                inertia: Matrix3::from_diagonal(&Vector3::new(3.0, 4.0, 2.5)),
            },
        };
        let joints = [
            joint(0.5, Vector3::z_axis(), JointKind::Revolute),
            joint(0.9, Vector3::y_axis(), JointKind::Prismatic),
            joint(0.3, Vector3::x_axis(), JointKind::Revolute),
        ];
        let chain = Chain::new(&joints, Isometry3::translation(0.4, 0.1, 0.2)).unwrap();
        let bushing = Bushing {
            stiffness: [2e7, 3e7, 1e7, 5e6, 2e6, 4e6],
            damping: [2e4, 1e4, 3e4, 4e3, 5e3, 1e3],
        };
        EquationOfMotion::new(&chain, &[0.4, -0.3, 1.1], Vector3::zeros(), &[bushing; 3]).unwrap()
    }
}
