//! Derivatives of a reading through the sag of the bushings under gravity.
//!
//! At rest a bushing is elongated by `σ = P/k` along each degree of freedom, P the load of gravity. The derivatives by stiffnesses and
//! imperfections hold σ. What they leave out of the reading A is
//!
//! ```text
//! dA = Σ ∂A/∂ln σ (d ln P − d ln k)
//! ```
//!
//! The load does not depend on the stiffness: neither does the stiffness of a drive that grows with it. Left out are the changes of a load
//! by the other sags, and of the stiffness due to gravity.
//!
//! In the minimum that is sought all of this is small. In a wrong one a bushing may be so soft that the records contradict its sag more than its
//! resonances: without these derivatives a fit stays there.

use heapless::Vec;
use nalgebra::Vector6;

use super::super::model::Model;
use super::super::problem::Problem;
use super::change::{Change, STEP};
use super::imperfect::Imperfect;
use crate::chain::linearise::{LinearChain, LinearisationError};
use crate::imperfection::MAX_IMPERFECTIONS;
use crate::parameters::Bushings;
use crate::sought::Coordinate;
use crate::{DOF, MAX_JOINTS};

/// Least sag that counts, m and rad. Chosen: a smaller one changes a reading by hardly more than a ten-thousandth. Of drawn six-joint arms
/// bushings sag by up to 8e-4, and in wrong minima by 1e-3 to 1e-2.
const LEAST: f64 = 1e-4;

/// Sag of one bushing along one degree of freedom.
#[derive(Clone, Debug)]
pub(in crate::refine) struct Sag {
    joint: usize,
    dof: usize,
    /// Load of gravity, N or Nm.
    load: f64,
    /// Derivative of the model by ln σ, with the stiffnesses held.
    pub(super) change: Change,
    /// Derivative of the stiffnesses by ln P: those of drives may depend on their load.
    pub(super) stiffness: Option<[[f64; DOF]; MAX_JOINTS]>,
    /// Unknown of its stiffness; `None` if it is not sought.
    pub(super) unknown: Option<usize>,
    /// `∂ ln P` by each imperfection of the model, in its standard deviation.
    pub(super) by_imperfection: Vec<f64, MAX_IMPERFECTIONS>,
}

/// The sags that count.
pub(super) type Sags = Vec<Sag, { DOF * MAX_JOINTS }>;

/// Finds those of a plant with these bushings that count, where `linear` is its chain at rest, and `model` its model.
pub(super) fn renew(
    sags: &mut Sags,
    problem: &Problem<'_>,
    imperfect: &Imperfect,
    linear: &LinearChain,
    model: &Model,
    bushings: &Bushings,
) -> Result<(), LinearisationError> {
    let elongations = linear.elongations();
    let loads = imperfect.gravity_loads(problem, &elongations);
    sags.clear();
    for joint in 0..linear.joints.len() {
        for dof in (0..DOF).filter(|&dof| elongations[joint][dof].abs() >= LEAST) {
            let mut more = elongations;
            more[joint][dof] *= 1.0 + STEP;
            let there = imperfect.linearise_at(problem, &more);
            let terms = imperfect.model(&there, bushings)?.terms;
            let mut change = Change::between([linear, &there], [&model.terms, &terms], STEP);
            let stiffness = change.stiffness.take();
            // There is room for all of them.
            let _ = sags.push(Sag {
                joint,
                dof,
                load: loads[joint][dof],
                change,
                stiffness,
                unknown: problem.sought.unknown(Coordinate::Stiffness { joint, dof }),
                by_imperfection: Vec::new(),
            });
        }
    }
    Ok(())
}

impl Sag {
    /// Adds the derivative by an imperfection, with which gravity has these loads where it is [`STEP`] larger.
    pub(super) fn push(&mut self, loads: &[Vector6<f64>; MAX_JOINTS]) {
        let rate = (loads[self.joint][self.dof] / self.load - 1.0) / STEP;
        let _ = self.by_imperfection.push(rate);
    }

    /// Adds the derivative by an imperfection that does not change the loads.
    pub(super) fn push_none(&mut self) {
        let _ = self.by_imperfection.push(0.0);
    }
}

#[cfg(test)]
mod tests;
