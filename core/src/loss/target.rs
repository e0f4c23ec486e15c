//! The chain at the pose of a record, which the loss of a sample is evaluated with.

use crate::chain::linearise::LinearisationError;
use crate::chain::{Chain, Jacobian};
use crate::parameters::{Bushing, Bushings};
use crate::receptance::Terms;
use crate::spectrum::{Measurement, Site};

/// Stiffness of bushings that do not give way to the weight of any robot, N/m and Nm/rad.
const RIGID: f64 = 1e15;

/// Target of the search in one experiment: the chain at its pose, under gravity, before it sags. The random search has no
/// stiffnesses by which the chain could sag.
#[derive(Clone, Debug)]
pub struct Target {
    /// The chain with rigid bushings.
    terms: Terms<f32>,
    /// Maps elongations to the translation of the accelerometer's place along its axes.
    pub jacobian: Jacobian,
}

impl Target {
    /// Target of an experiment at its site.
    ///
    /// # Errors
    ///
    /// Returns an error if there is not one angle per driven joint.
    pub fn new(
        chain: &Chain,
        measurement: &Measurement,
        site: Site<'_>,
    ) -> Result<Self, LinearisationError> {
        let rigid = Bushing { stiffness: [RIGID; 6], damping: [RIGID; 6] };
        let bushings: Bushings = chain.joints().iter().map(|_| rigid).collect();
        let linear = chain.linearise(site.pose, measurement.gravity(), &bushings)?;
        let sensors = measurement.sensors(&site);
        let terms = Terms::new(&linear, &bushings, &sensors)?;
        Ok(Self { terms, jacobian: linear.jacobian_of(measurement.mounting.readings(&linear)) })
    }

    /// The chain with these bushings, one per joint.
    pub(crate) fn terms(&self, bushings: &[Bushing]) -> Terms<f32> {
        let mut terms = self.terms.clone();
        terms.set_bushings(bushings);
        terms
    }
}
