//! What the sensors read of the motion, wherever on the last link they sit.

use nalgebra::Vector3;

use super::{EquationOfMotion, State};
use crate::mounting::Mounting;
use crate::spectrum::Accelerometer;

/// What both sensors read at one instant, less their readings at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Along the force sensor's axes, N.
    pub force: Vector3<f64>,
    /// Along the accelerometer's axes, m/s².
    pub acceleration: Vector3<f64>,
}

impl EquationOfMotion {
    /// What the accelerometer at the TCP reads under `force`, less its reading at rest, m/s²: along the
    /// axes at rest if inertial, along its own if strapdown.
    pub fn tcp_acceleration(
        &self,
        state: &State,
        force: &Vector3<f64>,
        accelerometer: Accelerometer,
    ) -> Vector3<f64> {
        self.reading(state, force, accelerometer, &Mounting::AT_TCP).acceleration
    }

    /// What the sensors read under `force` on the TCP (N, TCP axes at rest). An inertial accelerometer keeps its axes at
    /// rest, a strapdown one turns with the tool. The force sensor sees the cut along its axes at rest, and what lies beyond
    /// it as it turns.
    pub fn reading(
        &self,
        state: &State,
        force: &Vector3<f64>,
        accelerometer: Accelerometer,
        mounting: &Mounting,
    ) -> Reading {
        let placed = self.placed(&state.elongation);
        let motion = self.link_motions(state, &placed, force)[self.links.len() - 1];
        let at_rest = self.rest_axes.tr_mul(&-self.gravity);
        // Along the TCP's axes, gravity felt.
        let felt = |point: &Vector3<f64>| {
            let point = self.tcp.translation + self.tcp.axes * point;
            self.tcp.axes.tr_mul(&motion.acceleration_of(&point))
        };
        let acceleration = match accelerometer {
            Accelerometer::Strapdown => felt(&mounting.accelerometer),
            Accelerometer::Inertial => {
                let axes = self.tcp_pose(&placed).axes;
                self.rest_axes.tr_mul(&(axes * felt(&mounting.accelerometer)))
            }
        } - at_rest;
        let taken = mounting.tool_mass * (felt(&mounting.tool_centre) - at_rest);
        Reading {
            force: mounting.force_axes.inverse() * (force - taken),
            acceleration: mounting.accelerometer_axes.inverse() * acceleration,
        }
    }
}
