//! The part of the model that the rows of a record need.

use heapless::Vec;

use crate::MAX_JOINTS;
use crate::chain::from_parent::FromParent;
use crate::chain::linearise::LinearChain;
use crate::chain::{Chain, Joint};
use crate::receptance::{Filter, Terms};

/// A model at the pose of a record.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub(super) terms: Terms<f64>,
    /// X of each joint.
    pub(super) from_parent: Vec<FromParent, MAX_JOINTS>,
    /// Degree of freedom of each joint's drive. `None` for a fixed joint.
    pub(super) drives: Vec<Option<usize>, MAX_JOINTS>,
    /// Gain of each axis of the force sensor, reading per force.
    pub(super) force_gain: [f64; 3],
    /// Filter of the force sensor.
    pub(super) force_filter: Filter<f64>,
    /// Filter of the accelerometer.
    pub(super) accelerometer_filter: Filter<f64>,
    /// Growth of the delay of the acceleration over a record.
    pub(super) drift: f64,
    /// Relative error η of the model that the weights of the residuals allow for.
    pub(super) relative_error: f64,
}

impl Model {
    /// A model with these terms of a chain, without errors of the sensors beside those of the terms.
    pub(super) fn perfect(terms: Terms<f64>, linear: &LinearChain, chain: &Chain) -> Self {
        Self {
            terms,
            from_parent: linear.joints.iter().map(|joint| joint.from_parent).collect(),
            drives: chain.joints().iter().map(Joint::drive).collect(),
            force_gain: [1.0; 3],
            force_filter: Filter::default(),
            accelerometer_filter: Filter::default(),
            drift: 0.0,
            relative_error: 0.0,
        }
    }
}
