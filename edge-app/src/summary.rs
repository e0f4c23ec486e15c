//! What was identified, as a table for people.

use std::fmt;

use flexid_wire::report::{JointReport, Report, Verdict};

const DOF: [&str; 6] = ["tx", "ty", "tz", "rx", "ry", "rz"];

/// Prints a report with one line for each stiffness and damping.
pub(crate) struct Summary<'a>(pub(crate) &'a Report);

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Report { joints, fit, warnings } = self.0;
        let (stiffness, damping) = ("stiffness (N/m, Nm/rad)", "damping (Ns/m, Nms/rad)");
        writeln!(f, "{:<24}  {stiffness:<26}  {damping}", "joint")?;
        for joint in joints {
            for (dof, name) in DOF.iter().enumerate() {
                let [stiffness, damping] = cells(joint, dof);
                writeln!(f, "{:<21} {name}  {stiffness:<26}  {damping}", joint.name)?;
            }
        }
        writeln!(
            f,
            "{} records, {} frames, {} lost; SSP median {:.4}, largest {:.4}; chi^2/dof {:.3}",
            fit.records, fit.frames, fit.frames_lost, fit.ssp, fit.ssp_max, fit.consistency
        )?;
        warnings.iter().try_for_each(|warning| writeln!(f, "warning: {warning}"))
    }
}

fn cells(joint: &JointReport, dof: usize) -> [String; 2] {
    let cell = |value: f64, deviation: Option<f64>, verdict: Verdict| match (deviation, verdict) {
        (Some(deviation), Verdict::Identified) => {
            format!("{value:.3e} ± {:.2} %", 100.0 * deviation / value)
        }
        (Some(deviation), _) => format!("{value:.1e} ± {:.0} %, weak", 100.0 * deviation / value),
        (None, _) => "not observable".to_string(),
    };
    [
        cell(joint.stiffness[dof], joint.stiffness_std[dof], joint.stiffness_verdict[dof]),
        cell(joint.damping[dof], joint.damping_std[dof], joint.damping_verdict[dof]),
    ]
}
