//! Readings of the sensors, at any place on the last link.

use nalgebra::Vector3;

use super::{EquationOfMotion, Loads, State};
use crate::mounting::Mounting;
use crate::sensors::Accelerometer;

/// Readings of both sensors at one instant, less their readings at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Force along the force sensor's axes, N.
    pub force: Vector3<f64>,
    /// Acceleration along the accelerometer's axes, m/s².
    pub acceleration: Vector3<f64>,
}

impl EquationOfMotion {
    /// Reading of an accelerometer at the TCP under `force` (N, TCP axes at rest), less its reading at rest, m/s². An
    /// inertial accelerometer reads along the TCP's axes at rest, a strapdown accelerometer along its own axes.
    pub fn tcp_acceleration(
        &self,
        state: &State,
        force: &Vector3<f64>,
        accelerometer: Accelerometer,
    ) -> Vector3<f64> {
        self.reading(state, force, accelerometer, &Mounting::AT_TCP).acceleration
    }

    /// Readings of the sensors under `loads`. An inertial accelerometer keeps its axes at rest; a strapdown accelerometer turns
    /// with the tool. The force sensor measures the cut along its axes at rest, and the inertia and weight of the tool along
    /// its turned axes. The reading at rest that is taken away is that before any travel: a tool that turns with its path turns in gravity,
    /// which an inertial accelerometer does not feel.
    pub fn reading(
        &self,
        state: &State,
        loads: impl Into<Loads>,
        accelerometer: Accelerometer,
        mounting: &Mounting,
    ) -> Reading {
        let loads = loads.into();
        let placed = self.placed(&state.elongation);
        let motion = self.link_motions(state, &placed, &loads)[self.links.len() - 1];
        // Acceleration along the TCP's axes, less gravity.
        let felt = |point: &Vector3<f64>| {
            let point = self.tcp.translation + self.tcp.axes * point;
            self.tcp.axes.tr_mul(&motion.acceleration_of(&point))
        };
        let acceleration = match accelerometer {
            Accelerometer::Strapdown => felt(&mounting.accelerometer) - self.felt_at_rest,
            Accelerometer::Inertial => {
                let axes = self.tcp_pose(&placed).axes;
                let moved = self.rest_axes.tr_mul(&(axes * felt(&mounting.accelerometer)));
                moved - self.rest_axes.tr_mul(&-self.gravity)
            }
        };
        let taken = mounting.tool_mass * (felt(&mounting.tool_centre) - self.felt_at_rest);
        Reading {
            force: mounting.force_axes.inverse() * (loads.force - taken),
            acceleration: mounting.accelerometer_axes.inverse() * acceleration,
        }
    }
}
