//! The covariance of all that a fit leaves uncertain.

use flexid_core::identify::{Estimate, PlantEstimate};
use flexid_core::imperfection::{FoundImperfection, Imperfection};
use flexid_core::parameters::Bounds;
use flexid_core::refine::{Plant, PlantInformation};
use flexid_core::sought::{Coordinate, Sought};
use nalgebra::DMatrix;

use crate::config::Config;

/// Smallest eigenvalue of a scaled information matrix that is more than rounding: a hundred unknowns, each with the rounding of a double.
const ROUNDING: f64 = 1e-14;

/// What a fit leaves uncertain.
pub(crate) struct Posterior {
    /// The covariance: logarithms of parameters, and imperfections in units of their priors. Noise explains the residuals.
    pub(crate) covariance: DMatrix<f64>,
    /// Factor on standard deviations, since noise does not explain them all.
    pub(crate) widening: f64,
    /// Row of each parameter, joint by joint the stiffnesses and the dampings. `None` of one that does not vary.
    pub(crate) parameters: Vec<Option<usize>>,
    /// The imperfections.
    pub(crate) imperfections: Vec<Uncertain>,
}

/// An imperfection, and its row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Uncertain {
    pub(crate) imperfection: Imperfection,
    /// Most likely value, in its unit.
    pub(crate) value: f64,
    /// Standard deviation of its prior, in its unit.
    pub(crate) prior: f64,
    pub(crate) row: usize,
}

impl Posterior {
    /// That of an estimate, with the information of the fit to a `plant` that gave it, unless that is perfect. The plant must stand where
    /// this fit has ended.
    pub(crate) fn new(
        config: &Config,
        sought: &Sought,
        estimate: &Estimate,
        plant: Option<(&Plant, &PlantEstimate)>,
    ) -> Self {
        let unknowns = Unknowns { sought, bounds: &config.bounds };
        let (covariance, widening) = match plant {
            Some((plant, found)) => {
                (unknowns.covariance_on_plant(&plant.information()), found.widening)
            }
            None => (unknowns.covariance(estimate), estimate.consistency.max(1.0).sqrt()),
        };
        let mut imperfections = Vec::new();
        if let Some((plant, found)) = plant {
            let information = plant.information();
            let all = found.imperfections.iter().zip(information.imperfections());
            imperfections.extend(all.enumerate().map(|(row, (found, (_, prior)))| {
                let FoundImperfection { imperfection, value, .. } = *found;
                Uncertain { imperfection, value, prior: *prior, row }
            }));
        }
        let before = imperfections.len();
        for &FoundImperfection { imperfection, value, prior, .. } in &estimate.imperfections {
            if let Some(unknown) = sought.unknown(Coordinate::Imperfection(imperfection)) {
                imperfections.push(Uncertain { imperfection, value, prior, row: before + unknown });
            }
        }
        let parameters = (0..config.model.joints.len()).flat_map(coordinates);
        let parameters =
            parameters.map(|own| sought.unknown(own).map(|unknown| before + unknown)).collect();
        Self { covariance, widening, parameters, imperfections }
    }
}

/// Unknowns of a fit.
struct Unknowns<'a> {
    sought: &'a Sought,
    bounds: &'a Bounds,
}

/// Parameters of a joint: stiffnesses, then dampings.
fn coordinates(joint: usize) -> impl Iterator<Item = Coordinate> {
    let stiffnesses = (0..6).map(move |dof| Coordinate::Stiffness { joint, dof });
    stiffnesses.chain((0..6).map(move |dof| Coordinate::Damping { joint, dof }))
}

impl Unknowns<'_> {
    /// Variance of the logarithm of a parameter that may lie anywhere within its bounds: that of a uniform distribution. `None` of what
    /// has no bounds.
    fn anywhere(&self, unknown: usize) -> Option<f64> {
        let of = |joint: usize| self.bounds.joints.get(joint);
        let [lower, upper] = match self.sought.coordinate(unknown)? {
            Coordinate::Stiffness { joint, dof } => of(joint)?.stiffness[dof],
            Coordinate::Damping { joint, dof } => of(joint)?.damping[dof],
            _ => return None,
        };
        let width = (upper / lower).ln();
        (width > 0.0 && width.is_finite()).then_some(width * width / 12.0)
    }

    /// The inverse of the information about imperfections and unknowns, and of that of the bounds.
    fn covariance_on_plant(&self, information: &PlantInformation<'_>) -> DMatrix<f64> {
        let (size, count) = (information.size(), information.imperfections().len());
        let mut all = DMatrix::from_fn(size, size, |i, j| information.get(i, j));
        for unknown in 0..size - count {
            if let Some(variance) = self.anywhere(unknown) {
                all[(count + unknown, count + unknown)] += 1.0 / variance;
            }
        }
        // Scaled to a unit diagonal: information spans twenty decades.
        let scale: Vec<f64> = (0..size)
            .map(|i| if all[(i, i)] > 0.0 { all[(i, i)].sqrt().recip() } else { 0.0 })
            .collect();
        let scaled = DMatrix::from_fn(size, size, |i, j| match i == j {
            true => 1.0,
            false => all[(i, j)] * scale[i] * scale[j],
        });
        let mut eigen = scaled.symmetric_eigen();
        eigen.eigenvalues.apply(|value| *value = value.max(ROUNDING).recip());
        let inverse = eigen.recompose();
        DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] * scale[i] * scale[j])
    }

    /// The covariance of the unknowns alone.
    fn covariance(&self, estimate: &Estimate) -> DMatrix<f64> {
        let covariance = &estimate.covariance;
        let size = covariance.unknowns();
        let deviation = |unknown: usize| {
            let most = self.anywhere(unknown).map_or(f64::INFINITY, f64::sqrt);
            let own = covariance.deviation(unknown).min(most);
            if own.is_finite() { own } else { 0.0 }
        };
        DMatrix::from_fn(size, size, |i, j| {
            let correlation = if i == j { 1.0 } else { covariance.correlation(i, j) };
            correlation * deviation(i) * deviation(j)
        })
    }
}
