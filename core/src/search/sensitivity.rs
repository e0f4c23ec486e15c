//! Jacobian sensitivities (paper, section 4): which loss tells of which parameter.

use heapless::Vec;

use crate::chain::jacobian::Jacobian;
use crate::{DOF, MAX_JOINTS};

/// Most experiments that the search weighs, 3 losses each.
pub const MAX_EXPERIMENTS: usize = 16;

/// S, transposed: per degree of freedom one weight for each of the C·E losses; their sum is 1. Stiffness and
/// damping of a degree of freedom share it.
#[derive(Clone, Debug, Default)]
pub struct Sensitivities {
    weights: [[Vec<f32, { 3 * MAX_EXPERIMENTS }>; DOF]; MAX_JOINTS],
}

impl Sensitivities {
    /// Column-normalised magnitudes of the Jacobians stacked over the experiments. A degree of freedom that moves the
    /// TCP nowhere weighs all losses alike. Experiments beyond [`MAX_EXPERIMENTS`] do not count.
    pub fn new<'a>(jacobians: impl Iterator<Item = &'a Jacobian> + Clone) -> Self {
        let mut sensitivities = Self::default();
        for joint in 0..MAX_JOINTS {
            for dof in 0..DOF {
                let weights = &mut sensitivities.weights[joint][dof];
                for jacobian in jacobians.clone().take(MAX_EXPERIMENTS) {
                    for entry in jacobian[joint][dof] {
                        let _ = weights.push(entry.abs() as f32);
                    }
                }
                let sum: f32 = weights.iter().sum();
                let equal = 1.0 / weights.len() as f32;
                for weight in weights.iter_mut() {
                    *weight = if sum > 0.0 { *weight / sum } else { equal };
                }
            }
        }
        sensitivities
    }

    /// `L·S` for one degree of freedom: `losses` direction by direction, experiment by experiment.
    pub fn loss(&self, losses: &[f32], joint: usize, dof: usize) -> f32 {
        self.weights[joint][dof].iter().zip(losses).map(|(weight, loss)| weight * loss).sum()
    }
}
