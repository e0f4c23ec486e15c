//! Which loss tells of which parameter (paper, section 4).

use heapless::Vec;

use crate::DOF;
use crate::chain::jacobian::Jacobian;
use crate::parameters::MAX_PARAMETERS;

/// Most experiments that the search weighs, 3 losses each.
pub const MAX_EXPERIMENTS: usize = 16;
/// Most losses of one sample: C·E.
pub const MAX_LOSSES: usize = 3 * MAX_EXPERIMENTS;

/// How the C·E losses of a sample become the loss by which a parameter's value is chosen.
#[derive(Clone, Debug, Default)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box it with")]
pub enum Weighing {
    /// Their mean, the same for every parameter: a sample is taken whole.
    #[default]
    Mean,
    /// `L·S`, for every parameter its own: each is taken from the sample that served it best.
    Sensitivities(Sensitivities),
}

/// S: per parameter one weight for each of the C·E losses; their sum is 1.
#[derive(Clone, Debug)]
pub struct Sensitivities {
    weights: [Vec<f32, MAX_LOSSES>; MAX_PARAMETERS],
}

impl Weighing {
    /// The loss of each parameter's value in a sample with these `losses`.
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
    /// From any matrix of `losses` rows (C·E) and `parameters` columns: `entry(row, column)`, of which the magnitude
    /// counts. Columns are normalised; one without entries weighs all losses alike. Rows beyond [`MAX_LOSSES`] and
    /// columns beyond [`MAX_PARAMETERS`] do not count.
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

    /// Jacobian sensitivities: the Jacobians of the experiments, one above the other (paper, section 4.1), of a
    /// chain of `joints`. Stiffness and damping of a degree of freedom share a column.
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
