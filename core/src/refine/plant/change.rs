//! Derivative of the linearised model by one imperfection.
//!
//! The sag is held; [`sag`](super::sag) adds what follows from its change. The change of the stiffness due to gravity is left out.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use super::super::model::Model;
use crate::chain::from_parent::FromParent;
use crate::chain::linearise::LinearChain;
use crate::receptance::{Hose, Loads, Observation, Terms, ToolTerms};
use crate::{DOF, MAX_JOINTS};

/// Step of a difference, in standard deviations of the imperfection, or of the logarithm of a sag. Chosen: rounding changes a derivative by less
/// than 1e-6 of it, and curvature by a thousandth of what it changes over a standard deviation.
pub(in crate::refine) const STEP: f64 = 1e-3;

/// Rows of a 3×3 matrix.
pub(super) type Block = [[f64; 3]; 3];

/// Derivatives of the parts of a model by one imperfection.
#[derive(Clone, Debug)]
pub(in crate::refine) struct Change {
    /// Derivative of the inertia of a link: the number of its joint, and rows.
    pub(super) inertia: Option<(usize, [[f64; DOF]; DOF])>,
    /// Derivatives of the transformations X from a link to the next: the number of the joint between them, and blocks.
    pub(super) from_parent: Vec<(usize, FromParentChange), MAX_JOINTS>,
    /// Derivative of the loads on the last link.
    pub(super) tip: Option<Tip>,
    /// Derivatives of the stiffnesses of the bushings.
    pub(super) stiffness: Option<[[f64; DOF]; MAX_JOINTS]>,
}

/// Derivatives of the blocks of X.
#[derive(Clone, Copy, Debug)]
pub(super) struct FromParentChange {
    pub(super) rotation: Block,
    pub(super) lever: Block,
    pub(super) turns: Block,
}

/// Derivatives of the loads on the last link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tip {
    pub(super) force: Loads<f64>,
    /// Its delay and filter are those of the model.
    pub(super) observation: Observation<f64>,
    pub(super) tool: Option<ToolTerms<f64>>,
    /// Its stiffness and damping are those of the model.
    pub(super) hose: Option<Hose<f64>>,
}

impl Change {
    /// No change.
    pub(super) const NONE: Self =
        Self { inertia: None, from_parent: Vec::new(), tip: None, stiffness: None };

    /// Difference of two models, which an imperfection differs in by `step`. An imperfection changes the inertia of one link and the
    /// transformations at its two ends at most, or all of them: a delay of the joint angles.
    pub(super) fn between(
        [from, to]: [&LinearChain; 2],
        [from_terms, to_terms]: [&Terms<f64>; 2],
        step: f64,
    ) -> Self {
        let mut change = Self::NONE;
        for (joint, (from, to)) in from.joints.iter().zip(&to.joints).enumerate() {
            if from.inertia != to.inertia {
                let rate = (to.inertia - from.inertia) / step;
                let rows = core::array::from_fn(|i| core::array::from_fn(|j| rate[(i, j)]));
                change.inertia = Some((joint, rows));
            }
            if from.from_parent != to.from_parent {
                let rate = FromParentChange::between(&from.from_parent, &to.from_parent, step);
                // There is room for all of them.
                let _ = change.from_parent.push((joint, rate));
            }
        }
        let loads =
            |terms: &Terms<f64>| (terms.force_loads, terms.observation, terms.tool, terms.hose);
        if loads(from_terms) != loads(to_terms) {
            change.tip = Some(Tip::between(from_terms, to_terms, step));
        }
        let mut rates = [[0.0; DOF]; MAX_JOINTS];
        for (rates, (from, to)) in
            rates.iter_mut().zip(from_terms.joints.iter().zip(&to_terms.joints))
        {
            *rates = core::array::from_fn(|dof| (to.stiffness[dof] - from.stiffness[dof]) / step);
        }
        change.stiffness = rates.as_flattened().iter().any(|rate| *rate != 0.0).then_some(rates);
        change
    }
}

impl Change {
    /// Change of a model by time, 1/s, if its pose moves from the one to the other in so many seconds. It turns joints, and axes of sensors.
    pub(super) fn of_pose([start, end]: [&Model; 2], seconds: f64) -> Self {
        let both = start.from_parent.iter().zip(&end.from_parent);
        let rates = both.map(|(start, end)| FromParentChange::between(start, end, seconds));
        let tip = Tip::between(&start.terms, &end.terms, seconds);
        Self { from_parent: rates.enumerate().collect(), tip: Some(tip), ..Self::NONE }
    }

    /// Spin of each link of a model that changes so by time, along its own axes, rad/s: with the rotation R from the link before,
    /// `Ṙ Rᵀ = −[ω×]` is that relative to it.
    pub(super) fn spins(&self, model: &Model) -> Vec<Vector3<f64>, MAX_JOINTS> {
        let mut spin = Vector3::zeros();
        let of_link = |(x, (_, change)): (&FromParent, &(usize, FromParentChange))| {
            let rate = Matrix3::from_fn(|i, j| change.rotation[i][j]);
            let turn = -rate * x.rotation.transpose();
            let twice = Vector3::new(
                turn[(2, 1)] - turn[(1, 2)],
                turn[(0, 2)] - turn[(2, 0)],
                turn[(1, 0)] - turn[(0, 1)],
            );
            spin = x.rotation * spin + 0.5 * twice;
            spin
        };
        model.from_parent.iter().zip(&self.from_parent).map(of_link).collect()
    }
}

impl FromParentChange {
    fn between(from: &FromParent, to: &FromParent, step: f64) -> Self {
        let rate = |from: &Matrix3<f64>, to: &Matrix3<f64>| {
            core::array::from_fn(|i| core::array::from_fn(|j| (to[(i, j)] - from[(i, j)]) / step))
        };
        Self {
            rotation: rate(&from.rotation, &to.rotation),
            lever: rate(&from.lever, &to.lever),
            turns: rate(&from.turns, &to.turns),
        }
    }
}

impl Tip {
    fn between(from: &Terms<f64>, to: &Terms<f64>, step: f64) -> Self {
        Self {
            force: rate(&from.force_loads, &to.force_loads, step),
            observation: match (&from.observation, &to.observation) {
                (
                    Observation::Acceleration { translation, gravity, delay, filter },
                    Observation::Acceleration {
                        translation: to_translation,
                        gravity: to_gravity,
                        ..
                    },
                ) => Observation::Acceleration {
                    translation: rate(translation, to_translation, step),
                    gravity: gravity.zip(*to_gravity).map(|(from, to)| rate(&from, &to, step)),
                    delay: *delay,
                    filter: *filter,
                },
                // Records hold no displacements.
                (observation, _) => *observation,
            },
            tool: from.tool.zip(to.tool).map(|(from, to)| ToolTerms {
                inertia: rate(&from.inertia, &to.inertia, step),
                weight: rate(&from.weight, &to.weight, step),
            }),
            hose: from.hose.zip(to.hose).map(|(from, to)| Hose {
                spread: core::array::from_fn(|k| (to.spread[k] - from.spread[k]) / step),
                ..from
            }),
        }
    }
}

fn rate(from: &Loads<f64>, to: &Loads<f64>, step: f64) -> Loads<f64> {
    core::array::from_fn(|j| core::array::from_fn(|i| (to[j][i] - from[j][i]) / step))
}
