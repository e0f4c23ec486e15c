//! Global sensitivity analysis: Sobol total-order indices.
//!
//! S_Ti is the share of an output's variance that remains when all parameters but the i-th are known. It contains the
//! parameter's own effect and all its interactions. The samples are those of A. Saltelli et al., "Variance based
//! sensitivity analysis of model output", Computer Physics Communications 181, 2010: two independent matrices A and B
//! of points, and A_B^(i), which is A with the i-th column of B. The estimator is that of M. J. W. Jansen, "Analysis
//! of variance designs for model output", Computer Physics Communications 117, 1999:
//!
//! ```text
//! S_Ti = 1/(2N) Σ (f(A) − f(A_B^(i)))² / Var f(A)
//! ```
//!
//! Total order needs no f(B), and the variance is that of f(A), so that there are N(P + 1) evaluations. A and B are
//! the two halves of one Owen-scrambled Sobol sequence of 2P dimensions. `sobol_burley`, made for rendering, has no
//! state, and hence no order of evaluation. N should be a power of two, for the sequence's balance.

use nalgebra::DMatrix;
use thiserror::Error;

/// Largest number of samples, the sequence's length.
pub const MAX_SAMPLES: u32 = 1 << 16;

/// Largest number of parameters. The sequence has two dimensions for each.
pub const MAX_PARAMETERS: usize = sobol_burley::NUM_DIMENSIONS as usize / 2;

/// Error of the analysis.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum SobolError {
    /// More samples than the sequence has, or fewer than a variance needs.
    #[error("{0} samples: must be 2 to {MAX_SAMPLES}")]
    Samples(u32),
    /// The sequence has too few dimensions.
    #[error("{0} parameters: must be at most {MAX_PARAMETERS}")]
    Parameters(usize),
    /// The model has no finite value somewhere in the cube.
    #[error("output {output} is {value} at evaluation {evaluation}: must be finite")]
    NotFinite {
        /// Index of the output, from 0.
        output: usize,
        /// Value of the output.
        value: f32,
        /// Index of the evaluation, from 0.
        evaluation: u64,
    },
}

/// The sensitivities, and their cost.
#[derive(Clone, Debug, PartialEq)]
pub struct TotalOrder {
    /// S_T, outputs × parameters; 0 for an output that is constant.
    pub indices: DMatrix<f64>,
    /// Number of evaluations of the model: samples × (parameters + 1).
    pub evaluations: u64,
}

/// Total-order indices of every output of `evaluate` to every parameter.
///
/// `evaluate` gets a point of the unit cube, and writes one value for each output. It is called `samples` ×
/// (`parameters` + 1) times, in this thread. The same seed gives the same points.
///
/// # Errors
/// More samples or parameters than the sequence has, fewer than two samples, an output that is not finite.
pub fn total_order(
    parameters: usize,
    outputs: usize,
    samples: u32,
    seed: u32,
    mut evaluate: impl FnMut(&[f32], &mut [f32]),
) -> Result<TotalOrder, SobolError> {
    if !(2..=MAX_SAMPLES).contains(&samples) {
        return Err(SobolError::Samples(samples));
    }
    if parameters > MAX_PARAMETERS {
        return Err(SobolError::Parameters(parameters));
    }
    let mut evaluations = 0;
    let mut model = |point: &[f32], values: &mut [f32]| {
        evaluate(point, values);
        let evaluation = evaluations;
        evaluations += 1;
        match values.iter().position(|value| !value.is_finite()) {
            Some(output) => {
                Err(SobolError::NotFinite { output, value: values[output], evaluation })
            }
            None => Ok(()),
        }
    };
    let coordinate =
        |sample, dimension: usize| sobol_burley::sample(sample, dimension as u32, seed);

    let mut squares = DMatrix::zeros(outputs, parameters);
    let mut spreads = vec![Spread::default(); outputs];
    let mut point = vec![0.0; parameters];
    let [mut at_a, mut at_ab] = [vec![0.0; outputs], vec![0.0; outputs]];
    for sample in 0..samples {
        for (i, x) in point.iter_mut().enumerate() {
            *x = coordinate(sample, i);
        }
        model(&point, &mut at_a)?;
        for (spread, &value) in spreads.iter_mut().zip(&at_a) {
            spread.add(value.into());
        }
        for i in 0..parameters {
            let a = std::mem::replace(&mut point[i], coordinate(sample, parameters + i));
            model(&point, &mut at_ab)?;
            point[i] = a;
            for (output, (&a, &ab)) in at_a.iter().zip(&at_ab).enumerate() {
                squares[(output, i)] += (f64::from(a) - f64::from(ab)).powi(2);
            }
        }
    }

    for (mut row, spread) in squares.row_iter_mut().zip(&spreads) {
        // A parameter that moves an output that is constant over A is too rare to be weighed.
        row *= if spread.sum_of_squares > 0.0 { 0.5 / spread.sum_of_squares } else { 0.0 };
    }
    Ok(TotalOrder { indices: squares, evaluations })
}

/// Running sum of squares about the mean: B. P. Welford, Technometrics 4, 1962. It is exactly zero for a constant.
#[derive(Clone, Default)]
struct Spread {
    count: f64,
    mean: f64,
    /// N times the variance.
    sum_of_squares: f64,
}

impl Spread {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        let distance = value - self.mean;
        self.mean += distance / self.count;
        self.sum_of_squares += distance * (value - self.mean);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// Ishigami's function over [-π, π]³ with a = 7, b = 0.1.
    fn ishigami(point: &[f32]) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|i| PI * (2.0 * f64::from(point[i]) - 1.0));
        (x.sin() + 7.0 * y.sin().powi(2) + 0.1 * z.powi(4) * x.sin()) as f32
    }

    /// Indices of Ishigami's function, from its known variances: T. Ishigami, T. Homma, ISUMA 1990.
    fn ishigami_indices() -> [f64; 3] {
        let (a, b) = (7.0_f64, 0.1_f64);
        let first = 0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2);
        let second = a * a / 8.0;
        let interaction = b * b * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
        [first + interaction, second, interaction].map(|v| v / (first + second + interaction))
    }

    /// Weights of the g-function, from a decisive parameter to one without effect.
    const G: [f64; 8] = [0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0];

    fn g_function(point: &[f32]) -> f32 {
        let factor = |(&x, a): (&f32, f64)| ((4.0 * f64::from(x) - 2.0).abs() + a) / (1.0 + a);
        point.iter().zip(G).map(factor).product::<f64>() as f32
    }

    fn g_indices() -> [f64; 8] {
        let partial = G.map(|a| 1.0 / (3.0 * (1.0 + a).powi(2)));
        let product: f64 = partial.iter().map(|v| 1.0 + v).product();
        partial.map(|v| v * product / (1.0 + v) / (product - 1.0))
    }

    #[test]
    fn ishigami_has_its_closed_form() {
        for seed in 0..4 {
            let found = total_order(3, 1, 4096, seed, |x, y| y[0] = ishigami(x)).unwrap();
            for (index, expected) in found.indices.iter().zip(ishigami_indices()) {
                assert!((index - expected).abs() < 0.01, "{index} is not {expected}");
            }
        }
    }

    #[test]
    fn the_g_function_has_its_closed_form() {
        for seed in 0..4 {
            let found = total_order(8, 1, 4096, seed, |x, y| y[0] = g_function(x)).unwrap();
            for (index, expected) in found.indices.iter().zip(g_indices()) {
                assert!((index - expected).abs() < 0.01, "{index} is not {expected}");
            }
        }
    }

    /// Σ c_i x_i has S_Ti = c_i² / Σ c². The test has many of the sequence's dimensions.
    #[test]
    fn a_sum_shares_its_variance() {
        let weight = |i: usize| (i % 4) as f32;
        let total: f32 = (0..84).map(|i| weight(i).powi(2)).sum();
        let sum = |x: &[f32], y: &mut [f32]| {
            y[0] = x.iter().enumerate().map(|(i, x)| weight(i) * x).sum();
        };
        let found = total_order(84, 1, 1024, 1, sum).unwrap();
        for (i, index) in found.indices.iter().enumerate() {
            let expected = f64::from(weight(i).powi(2) / total);
            assert!((index - expected).abs() < 0.003, "{index} is not {expected}");
        }
    }

    /// Two outputs at once have the indices of each alone. A constant output has zeros.
    #[test]
    fn outputs_are_rows() {
        let found = total_order(3, 3, 256, 1, |x, y| {
            y.copy_from_slice(&[ishigami(x), 0.1, x[1]]);
        })
        .unwrap();
        let alone = total_order(3, 1, 256, 1, |x, y| y[0] = ishigami(x)).unwrap();
        assert_eq!(found.indices.shape(), (3, 3));
        assert_eq!(found.indices.row(0), alone.indices.row(0));
        assert!(found.indices.row(1).iter().all(|&index| index == 0.0));
        assert_eq!((found.indices[(2, 0)], found.indices[(2, 2)]), (0.0, 0.0));
        assert!((found.indices[(2, 1)] - 1.0).abs() < 0.02);
    }

    #[test]
    fn evaluations_are_counted_and_seeded() {
        let run = |seed| {
            let mut count = 0;
            let found = total_order(3, 1, 64, seed, |x, y| {
                assert!(x.iter().all(|x| (0.0..1.0).contains(x)));
                count += 1;
                y[0] = ishigami(x);
            });
            let found = found.unwrap();
            assert_eq!((found.evaluations, count), (64 * 4, 64 * 4));
            found
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }

    #[test]
    fn what_cannot_be_had_is_refused() {
        let run = |parameters, samples, value| {
            total_order(parameters, 1, samples, 1, |_, y| y[0] = value).err()
        };
        assert_eq!(run(3, 1, 0.0), Some(SobolError::Samples(1)));
        assert_eq!(run(3, MAX_SAMPLES + 1, 0.0), Some(SobolError::Samples(MAX_SAMPLES + 1)));
        assert_eq!(run(129, 2, 0.0), Some(SobolError::Parameters(129)));
        assert_eq!(run(128, 2, 0.0), None);
        assert_eq!(
            run(3, 2, f32::INFINITY),
            Some(SobolError::NotFinite { output: 0, value: f32::INFINITY, evaluation: 0 })
        );
    }
}
