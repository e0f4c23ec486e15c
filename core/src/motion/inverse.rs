//! Inverse dynamics: the loads that a motion needs (recursive Newton-Euler; Featherstone, _Rigid Body Dynamics Algorithms_,
//! chapter 5), in link axes and with the acceleration of each link's origin, in O(J).
//!
//! Gravity enters as an upward acceleration of the base.

use heapless::Vec;
use nalgebra::{Vector3, Vector6};

use super::kinematics::{Link, Placed, halves, joined};
use super::{Coordinates, EquationOfMotion, Loads, State};
use crate::MAX_JOINTS;

/// Motion of a link, in its own axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LinkMotion {
    /// Spin ω, rad/s.
    pub(super) spin: Vector3<f64>,
    /// Rate of the spin ω̇, rad/s².
    pub(super) spin_rate: Vector3<f64>,
    /// Acceleration of the link's origin, less gravity, m/s².
    pub(super) acceleration: Vector3<f64>,
}

/// Residual of the equation of motion.
pub(super) struct Imbalance {
    /// Load on each coordinate that remains, N and Nm.
    pub(super) load: Coordinates,
    /// Sum of the magnitudes of the loads that should cancel.
    pub(super) size: f64,
}

impl LinkMotion {
    /// Acceleration of the link at `point`, less gravity, m/s².
    pub(super) fn acceleration_of(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.acceleration + self.spin_rate.cross(point) + self.spin.cross(&self.spin.cross(point))
    }

    /// Motion of the next link if this link, or the [carrier](Self::carrier) on it, moves so and the bushing between them has the constant rates `rate`.
    pub(super) fn outward(&self, link: &Link, placed: &Placed, rate: &Vector6<f64>) -> Self {
        let (slide, turn) = halves(rate);
        let (carried, turning) = (placed.rotation.tr_mul(&self.spin), placed.turns * turn);
        let origin =
            self.acceleration_of(&placed.lever) + 2.0 * self.spin.cross(&(link.axes * slide));
        Self {
            spin: carried + turning,
            spin_rate: placed.rotation.tr_mul(&self.spin_rate)
                + carried.cross(&turning)
                + placed.turns_rate(turn) * turn,
            acceleration: placed.rotation.tr_mul(&origin),
        }
    }

    /// Force and torque about the origin that the link needs for this motion, N and Nm.
    fn load(&self, link: &Link) -> (Vector3<f64>, Vector3<f64>) {
        let force = link.mass * self.acceleration_of(&link.centre);
        let torque = link.inertia * self.spin_rate
            + self.spin.cross(&(link.inertia * self.spin))
            + link.mass * link.centre.cross(&self.acceleration);
        (force, torque)
    }
}

impl EquationOfMotion {
    /// `M q̈ + C(q, q̇) q̇ + G(q) + D q̇ + K q − Jᵀ F`, N and Nm: further loads on the coordinates that this `acceleration`
    /// (m/s² and rad/s²) needs under `force` on the TCP (N, TCP axes at rest).
    pub fn inverse_dynamics(
        &self,
        state: &State,
        acceleration: &Coordinates,
        force: &Vector3<f64>,
    ) -> Coordinates {
        self.imbalance(state, acceleration, &force.into()).load
    }

    pub(super) fn imbalance(
        &self,
        state: &State,
        acceleration: &Coordinates,
        loads: &Loads,
    ) -> Imbalance {
        let mut placed: Vec<Placed, MAX_JOINTS> = Vec::new();
        let mut inertial: Vec<(Vector3<f64>, Vector3<f64>), MAX_JOINTS> = Vec::new();
        let mut motion = self.base();
        let mut push = self.rest_axes * loads.force;
        let mut size = push.norm();
        for (index, link) in self.links.iter().enumerate() {
            let place = link.placed(&state.elongation[index]);
            let (slide, turn) = halves(&acceleration[index]);
            motion = motion.carrier(link).outward(link, &place, &state.rate[index]);
            motion.acceleration += place.turned.tr_mul(&slide);
            motion.spin_rate += place.turns * turn;
            push = place.rotation.tr_mul(&push);
            let load = motion.load(link);
            size += load.0.norm() + load.1.norm();
            // A chain has no more joints than the vectors hold.
            let _ = (inertial.push(load), placed.push(place));
        }

        let mut imbalance = Coordinates::default();
        let mut passed = (-push, -self.tcp.translation.cross(&push));
        for (index, (place, load)) in placed.iter().zip(&inertial).enumerate().rev() {
            let (force, torque) = (passed.0 + load.0, passed.1 + load.1);
            let bushing = self.bushing_load(state, index) + loads.resistance[index];
            size += bushing.norm();
            imbalance[index] = bushing + joined(place.turned * force, place.turns.tr_mul(&torque));
            let force = place.rotation * force;
            passed = (force, place.rotation * torque + place.lever.cross(&force));
        }
        Imbalance { load: imbalance, size }
    }

    /// Motion of the base: it is at rest, and gravity is an upward acceleration.
    pub(super) fn base(&self) -> LinkMotion {
        LinkMotion { acceleration: -self.gravity, ..LinkMotion::default() }
    }
}
