//! What one finding says of the parameters, and of the errors that it shares with others.

use nalgebra::{DMatrix, DVector};

/// What a fit says of parameters and shared errors, its priors of the errors included.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Place of each error among those of all findings.
    pub columns: Vec<usize>,
    /// Standard deviation of each prior in the common unit of the error.
    pub priors: Vec<f64>,
    /// Most likely values of the errors, in units of these priors.
    pub errors: DVector<f64>,
    /// Logarithm of each parameter, and its standard deviation as the fit states it. `None` of what the fit does not determine.
    pub logarithms: Vec<Option<(f64, f64)>>,
    /// Lower triangular factor of the covariance of errors, in units of these priors, and of logarithms.
    pub factor: DMatrix<f64>,
    /// By how many times the noise is larger than the factor has it, as a standard deviation.
    pub widening: f64,
}

/// What a finding says, the errors apart.
///
/// ```text
/// ln θ = y + A ν + e        e ~ N(0, S)        information on ν beside its prior: Λ, and Λν̂ = λ
/// ```
#[derive(Clone, Debug)]
pub struct Epoch {
    /// y and the variance of e, by parameter. `None` of what the finding does not determine.
    pub(crate) values: Vec<Option<(f64, f64)>>,
    /// A: a row for each parameter, a column for each error of all findings.
    pub(crate) slopes: DMatrix<f64>,
    /// Λ.
    pub(crate) information: DMatrix<f64>,
    /// λ.
    pub(crate) vector: DVector<f64>,
}

impl Epoch {
    /// Takes the errors and their priors out of what a finding says. `errors` is the number of those of all findings. `None` if the factor
    /// is singular in the errors.
    pub fn new(posterior: &Posterior, errors: usize) -> Option<Self> {
        let Posterior { columns, priors, errors: own, logarithms, factor, widening } = posterior;
        let (count, all) = (columns.len(), logarithms.len());
        let of_errors = factor.view((0, 0), (count, count));
        let crossed = factor.view((count, 0), (all, count));
        let of_logarithms = factor.view((count, count), (all, all));
        let inverse = of_errors.solve_lower_triangular(&DMatrix::identity(count, count))?;
        let slopes = crossed * &inverse;
        let noise = (widening * widening).recip();
        let precision = inverse.transpose() * &inverse;
        let vector = &precision * own * noise;
        let information = (precision - DMatrix::identity(count, count)) * noise;
        let shift = &slopes * own;
        let values = logarithms.iter().enumerate().map(|(row, own)| {
            let (logarithm, std) = (*own)?;
            let beside = of_logarithms.row(row).norm_squared();
            let whole = beside + crossed.row(row).norm_squared();
            // What the fit states wider, as by the scatter of its records, is noise.
            let wider = (std * std / whole).max(widening * widening);
            Some((logarithm - shift[row], beside * wider))
        });
        let values = values.map(|own| own.filter(|(y, s)| y.is_finite() && *s > 0.0)).collect();
        let mut of_all = Self {
            values,
            slopes: DMatrix::zeros(all, errors),
            information: DMatrix::zeros(errors, errors),
            vector: DVector::zeros(errors),
        };
        for (i, (&column, prior)) in columns.iter().zip(priors).enumerate() {
            of_all.slopes.set_column(column, &(slopes.column(i) / *prior));
            of_all.vector[column] = vector[i] / prior;
            for (j, (&other, theirs)) in columns.iter().zip(priors).enumerate() {
                of_all.information[(column, other)] = information[(i, j)] / (prior * theirs);
            }
        }
        Some(of_all)
    }
}

/// What findings say together of the errors that they share, priors of variance 1 taken once.
#[derive(Clone, Debug)]
pub(crate) struct Pool {
    information: DMatrix<f64>,
    vector: DVector<f64>,
    /// Lower triangular factor of the information, and the most likely errors, of the findings so far.
    factor: DMatrix<f64>,
    pub(crate) errors: DVector<f64>,
}

impl Pool {
    /// That of no finding.
    pub(crate) fn new(errors: usize) -> Self {
        Self {
            information: DMatrix::identity(errors, errors),
            vector: DVector::zeros(errors),
            factor: DMatrix::identity(errors, errors),
            errors: DVector::zeros(errors),
        }
    }

    /// Adds a finding. Information that is none, as of a file that was changed, leaves the errors where they were.
    pub(crate) fn add(&mut self, epoch: &Epoch) {
        self.information += &epoch.information;
        self.vector += &epoch.vector;
        if let Some(cholesky) = self.information.clone().cholesky() {
            self.errors = cholesky.solve(&self.vector);
            self.factor = cholesky.unpack();
        }
    }

    /// Variance of these slopes times the errors.
    pub(crate) fn variance(&self, slopes: &DVector<f64>) -> f64 {
        self.factor.solve_lower_triangular(slopes).map_or(f64::INFINITY, |own| own.norm_squared())
    }
}
