//! Forward dynamics: the motion due to loads, in O(J).
//!
//! This is the articulated-body recursion, which bushings simplify. A joint that can move in all six directions has a square
//! motion subspace S. The articulated inertia `I − I S (Sᵀ I S)⁻¹ Sᵀ I` that it passes to the link before is 0. The load that
//! it passes is `S⁻ᵀ τ`, that of its springs and dampers. Each link is therefore a free body under loads that depend on the
//! state alone.

use nalgebra::{Vector3, Vector6};

use super::inverse::LinkMotion;
use super::kinematics::{Link, Placed, halves, joined};
use super::{Coordinates, EquationOfMotion, Loads, State};
use crate::MAX_JOINTS;

impl EquationOfMotion {
    /// Acceleration `q̈` under `force` on the TCP (N, TCP axes at rest), m/s² and rad/s². It is not finite if a bushing has
    /// turned to `ry = ±90°`.
    pub fn forward_dynamics(&self, state: &State, force: &Vector3<f64>) -> Coordinates {
        let placed = self.placed(&state.elongation);
        let motions = self.link_motions(state, &placed, &force.into());
        let mut acceleration = [Vector6::zeros(); MAX_JOINTS];
        let mut before = self.base();
        for (index, link) in self.links.iter().enumerate() {
            let (place, motion) = (&placed[index], motions[index]);
            let carried = before.carrier(link).outward(link, place, &state.rate[index]);
            acceleration[index] = joined(
                place.turned * (motion.acceleration - carried.acceleration),
                place.turns_inverse() * (motion.spin_rate - carried.spin_rate),
            );
            before = motion;
        }
        acceleration
    }

    /// Motion of the links under the loads of the state and `loads`.
    pub(super) fn link_motions(
        &self,
        state: &State,
        placed: &[Placed; MAX_JOINTS],
        loads: &Loads,
    ) -> [LinkMotion; MAX_JOINTS] {
        let mut motions = [LinkMotion::default(); MAX_JOINTS];
        let mut spin = Vector3::zeros();
        let mut push = self.rest_axes * loads.force;
        for index in 0..self.links.len() {
            let (_, turn_rate) = halves(&state.rate[index]);
            if let Some(drive) = &self.links[index].drive {
                spin += drive.spin;
            }
            spin = placed[index].rotation.tr_mul(&spin) + placed[index].turns * turn_rate;
            push = placed[index].rotation.tr_mul(&push);
            motions[index].spin = spin;
        }
        let mut passed = (push, self.tcp.translation.cross(&push));
        for (index, link) in self.links.iter().enumerate().rev() {
            let place = &placed[index];
            let bushing = self.bushing_load(state, index) + loads.resistance[index];
            let (slide, turn) = halves(&-bushing);
            let held = (place.turned.tr_mul(&slide), place.turns_inverse().tr_mul(&turn));
            motions[index].accelerate(link, passed.0 + held.0, passed.1 + held.1);
            let force = place.rotation * held.0;
            passed = (-force, -(place.rotation * held.1 + place.lever.cross(&force)));
        }
        motions
    }
}

impl LinkMotion {
    /// Equations of Newton and Euler for a free body with this spin, under a force and a torque about its origin.
    fn accelerate(&mut self, link: &Link, force: Vector3<f64>, torque: Vector3<f64>) {
        let gyroscopic = self.spin.cross(&(link.central_inertia * self.spin));
        self.spin_rate = link.central_mobility * (torque - link.centre.cross(&force) - gyroscopic);
        // `self.acceleration` is still 0, so that `acceleration_of` gives only the acceleration due to the spin.
        self.acceleration = force / link.mass - self.acceleration_of(&link.centre);
    }
}
