//! A robot as it is exported.

use flexid_core::chain::Chain;
use flexid_core::imperfection::Imperfection;
use flexid_pipeline::model::Model;
use flexid_pipeline::names::DOF_NAMES;
use flexid_wire::report::JointReport;
use flexid_wire::text::{Name, clipped};

use crate::error::ExportError;
use crate::remark;

/// A robot as it is exported.
#[derive(Clone, Copy, Debug)]
pub struct Robot<'a> {
    /// Joints, links and the TCP.
    pub model: &'a Model,
    /// Parameters of each joint of the model, base first.
    pub joints: &'a [JointReport],
    /// Gravity along the axes of the base, m/s².
    pub gravity_m_per_s2: [f64; 3],
    /// Angle (rad) or stroke (m) of each driven joint, base first. The drives are locked there.
    pub pose: &'a [f64],
    /// Imperfections that the fit has found, each in its unit.
    pub imperfections: &'a [(Imperfection, f64)],
    /// Band that was fitted, Hz.
    pub band_hz: [f64; 2],
    /// Frequency at which the parameters are stated where they depend on it, Hz.
    pub reference_hz: f64,
    /// Frequency at which springs and dampers are as they are exported, Hz. Of a robot without hysteresis whose drives do not stiffen
    /// they are so at any.
    pub at_hz: f64,
    /// Acceptance of the fit in words, one line.
    pub verdict: &'a str,
    /// One more line for the head of a file.
    pub note: Option<&'a str>,
}

/// Checks that the parts of the robot are numbers, and of one robot.
pub(crate) fn check(robot: &Robot, chain: &Chain) -> Result<(), ExportError> {
    let (fit, model) = (robot.joints.len(), robot.model.joints.len());
    if fit != model {
        return Err(ExportError::JointCount { fit, model });
    }
    for (report, joint) in robot.joints.iter().zip(&robot.model.joints) {
        let name: Name = clipped(&joint.name);
        if report.name != name {
            let (fit, model) = (report.name.to_string(), joint.name.clone());
            return Err(ExportError::JointName { fit, model });
        }
        for kind in remark::kinds(report) {
            let is_wrong = |value: &f64| !(value.is_finite() && *value >= 0.0);
            if let Some(dof) = kind.values.iter().position(is_wrong) {
                let (joint, value) = (joint.name.clone(), kind.values[dof]);
                let (kind, dof) = (kind.name, DOF_NAMES[dof]);
                return Err(ExportError::Parameter { joint, kind, dof, value });
            }
        }
    }
    let (angles, driven) = (robot.pose.len(), chain.driven());
    if angles != driven {
        return Err(ExportError::AngleCount { angles, driven });
    }
    let is_right = |(own, value): &(Imperfection, f64)| {
        own.is_of(chain) && value.is_finite() && !(own.is_positive() && *value < 0.0)
    };
    if let Some(wrong) = robot.imperfections.iter().position(|own| !is_right(own)) {
        return Err(ExportError::Imperfection(wrong));
    }
    if !robot.pose.iter().all(|angle| angle.is_finite()) {
        return Err(ExportError::NotFinite("pose"));
    }
    if !robot.gravity_m_per_s2.iter().all(|g| g.is_finite()) {
        return Err(ExportError::NotFinite("gravity"));
    }
    Ok(())
}
