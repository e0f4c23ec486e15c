//! Parameters of a fit at another frequency than the one that they are stated at.
//!
//! With hysteresis a bushing has the impedance `k + d ((1 − h) i ω + h ω_r (i + 2/π ln (ω/ω_r)))`, k and d being those at ω_r. At ω' in its
//! place they are
//!
//! ```text
//! k' = k + 2/π h d ω_r ln (ω'/ω_r)        d' = d (1 − h + h ω_r/ω')
//! ```
//!
//! The uncertainty of h is in them, too, to first order.

use std::f64::consts::{FRAC_2_PI, TAU};

use flexid_core::imperfection::Imperfection;
use flexid_wire::report::JointReport;
use nalgebra::DMatrix;

use crate::document::Found;
use flexid_pipeline::dynamics::OF_JOINT;

/// Parameters of a fit, with the covariance of their logarithms and of the imperfections.
pub(crate) struct Restated {
    pub(crate) joints: Vec<JointReport>,
    pub(crate) covariance: DMatrix<f64>,
}

/// The parameters of a fit at `hz`. They stay where there is no hysteresis, and where it leaves none.
pub(crate) fn at(found: &Found, hz: f64) -> Restated {
    let (mut joints, covariance) = (found.joints.clone(), found.robot.covariance().clone());
    let from = found.robot.reference_hz();
    let mut imperfections = found.robot.found().imperfections.iter();
    let place = imperfections.position(|own| own.imperfection == Imperfection::Hysteresis);
    let Some(place) = place.filter(|_| from != hz) else { return Restated { joints, covariance } };
    let part = found.robot.found().imperfections[place].value;
    let (ratio, hysteresis) = (from / hz, OF_JOINT * joints.len() + place);
    let loss = 1.0 + part * (ratio - 1.0);
    let per_damping = FRAC_2_PI * TAU * from * (hz / from).ln();
    let mut jacobian = DMatrix::identity(covariance.nrows(), covariance.ncols());
    for (index, joint) in joints.iter_mut().enumerate() {
        for dof in 0..OF_JOINT / 2 {
            let (k, d) = (OF_JOINT * index + dof, OF_JOINT * index + OF_JOINT / 2 + dof);
            let (stiffness, damping) = (joint.stiffness[dof], joint.damping[dof]);
            let restated = stiffness + part * per_damping * damping;
            if restated > 0.0 && loss > 0.0 {
                jacobian[(k, k)] = stiffness / restated;
                jacobian[(k, d)] = part * per_damping * damping / restated;
                jacobian[(k, hysteresis)] = per_damping * damping / restated;
                jacobian[(d, hysteresis)] = (ratio - 1.0) / loss;
                (joint.stiffness[dof], joint.damping[dof]) = (restated, loss * damping);
            }
        }
    }
    let after = &jacobian * &covariance * jacobian.transpose();
    for (index, (joint, before)) in joints.iter_mut().zip(&found.joints).enumerate() {
        for dof in 0..OF_JOINT / 2 {
            let wider = |own: usize| {
                let [before, after] = [&covariance, &after].map(|all| all[(own, own)]);
                if before > 0.0 { (after / before).sqrt() } else { 1.0 }
            };
            let (k, d) = (OF_JOINT * index + dof, OF_JOINT * index + OF_JOINT / 2 + dof);
            let by = wider(k) * joint.stiffness[dof] / before.stiffness[dof];
            joint.stiffness_std[dof] = before.stiffness_std[dof].map(|std| by * std);
            let by = wider(d) * joint.damping[dof] / before.damping[dof];
            joint.damping_std[dof] = before.damping_std[dof].map(|std| by * std);
        }
    }
    Restated { joints, covariance: after }
}
