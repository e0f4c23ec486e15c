//! Sensitivity of each loss to each parameter (paper, section 4).

use heapless::Vec;

use crate::DOF;
use crate::chain::Jacobian;
use crate::parameters::MAX_PARAMETERS;

/// Largest number of experiments that a search weighs, 3 losses each, and whose seams and agreements are kept.
pub const MAX_EXPERIMENTS: usize = 16;
/// Largest number of losses of one sample: C·E.
pub const MAX_LOSSES: usize = 3 * MAX_EXPERIMENTS;

/// Weighing that turns the C·E losses of a sample into the loss by which the search chooses a parameter's value.
#[derive(Clone, Debug, Default)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box it with")]
pub enum Weighing {
    /// Mean of the losses, the same for every parameter: the next centre is one whole sample.
    #[default]
    Mean,
    /// `L·S`, separate for every parameter: the next centre takes each parameter from the sample with its smallest loss.
    Sensitivities(Sensitivities),
}

/// Matrix S: for each parameter one weight for each of the C·E losses. The weights of a parameter sum to 1.
#[derive(Clone, Debug)]
pub struct Sensitivities {
    weights: [Vec<f32, MAX_LOSSES>; MAX_PARAMETERS],
}

impl Weighing {
    /// Loss of the value of `parameter` in a sample with these `losses`.
    pub(super) fn loss(&self, losses: &[f32], parameter: usize) -> f32 {
        match self {
            Self::Mean => mean(losses),
            Self::Sensitivities(Sensitivities { weights }) => {
                weights[parameter].iter().zip(losses).map(|(weight, loss)| weight * loss).sum()
            }
        }
    }
}

impl Sensitivities {
    /// Sensitivities from the magnitudes of a matrix `entry(row, column)` of `losses` rows (C·E) and `parameters` columns.
    /// Each column is normalised; a column of zeros weighs all losses equally. Rows beyond [`MAX_LOSSES`] and columns beyond
    /// [`MAX_PARAMETERS`] are ignored.
    pub fn new(losses: usize, parameters: usize, entry: impl Fn(usize, usize) -> f32) -> Self {
        let mut weights = [const { Vec::new() }; MAX_PARAMETERS];
        for (column, weights) in weights.iter_mut().enumerate().take(parameters) {
            *weights = (0..losses.min(MAX_LOSSES)).map(|row| entry(row, column).abs()).collect();
            let sum: f32 = weights.iter().sum();
            let equal = 1.0 / weights.len() as f32;
            for weight in weights.iter_mut() {
                *weight = if sum > 0.0 { *weight / sum } else { equal };
            }
        }
        Self { weights }
    }

    /// Jacobian sensitivities of a chain of `joints` joints: the Jacobians of the experiments, one above the other (paper,
    /// section 4.1). The stiffness and the damping of a degree of freedom have the same column.
    pub fn jacobian<'a>(jacobians: impl IntoIterator<Item = &'a Jacobian>, joints: usize) -> Self {
        let jacobians: Vec<_, MAX_EXPERIMENTS> =
            jacobians.into_iter().take(MAX_EXPERIMENTS).collect();
        Self::new(3 * jacobians.len(), 2 * DOF * joints, |loss, parameter| {
            let (joint, dof) = (parameter / (2 * DOF), parameter % DOF);
            jacobians[loss / 3][joint][dof][loss % 3] as f32
        })
    }
}

pub(super) fn mean(losses: &[f32]) -> f32 {
    losses.iter().sum::<f32>() / losses.len() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_sum_to_one_and_weigh_the_losses() {
        let mut jacobians = [[[[0.0; 3]; DOF]; crate::MAX_JOINTS]; 2];
        jacobians[0][1][2] = [1.0, 0.0, -3.0];
        jacobians[1][1][2] = [0.0, 4.0, 0.0];
        let weighing = Weighing::Sensitivities(Sensitivities::jacobian(&jacobians, 2));
        let losses = [1.0, 10.0, 100.0, 1e3, 1e4, 1e5];
        for parameter in [12 + 2, 12 + DOF + 2] {
            let loss = weighing.loss(&losses, parameter);
            assert_eq!(loss, (1.0 + 3.0 * 100.0 + 4.0 * 1e4) / 8.0, "parameter {parameter}");
        }
        let unmoved = weighing.loss(&losses, 0);
        assert!((unmoved - Weighing::Mean.loss(&losses, 0)).abs() < 1e-2, "{unmoved}");
    }
}
