//! Comments on parameters that the data do not determine.

use flexid_pipeline::names::{DAMPING_UNITS, DOF_NAMES, STIFFNESS_UNITS};
use flexid_wire::report::{JointReport, Verdict};

/// One kind of parameters of a joint, in the order of the degrees of freedom.
pub(crate) struct Kind<'a> {
    /// `stiffness` or `damping`.
    pub(crate) name: &'static str,
    /// Values.
    pub(crate) values: &'a [f64; 6],
    /// Units of the values.
    pub(crate) units: [&'static str; 6],
    /// Standard deviations in the units of the values.
    pub(crate) stds: &'a [Option<f64>; 6],
    /// Verdicts.
    pub(crate) verdicts: &'a [Verdict; 6],
}

/// Returns the stiffnesses and the dampings of a joint.
pub(crate) fn kinds(report: &JointReport) -> [Kind<'_>; 2] {
    [
        Kind {
            name: "stiffness",
            values: &report.stiffness,
            units: STIFFNESS_UNITS,
            stds: &report.stiffness_std,
            verdicts: &report.stiffness_verdict,
        },
        Kind {
            name: "damping",
            values: &report.damping,
            units: DAMPING_UNITS,
            stds: &report.damping_std,
            verdicts: &report.damping_verdict,
        },
    ]
}

/// Returns one line for each parameter of this degree of freedom that is not identified.
pub(crate) fn of_dof(report: &JointReport, dof: usize) -> Vec<String> {
    let remark = |kind: Kind| {
        let meaning = match kind.verdicts[dof] {
            Verdict::Identified => return None,
            Verdict::Weak => weak(kind.values[dof], kind.stds[dof]),
            Verdict::NotObservable => {
                "not observable: the data do not determine this value".to_string()
            }
            Verdict::Fixed => "fixed by the user: not identified".to_string(),
        };
        Some(format!("{} {} is {meaning}", DOF_NAMES[dof], kind.name))
    };
    kinds(report).into_iter().filter_map(remark).collect()
}

/// Returns one line for each parameter of this joint that is not identified.
pub(crate) fn of_joint(report: &JointReport) -> Vec<String> {
    (0..6).flat_map(|dof| of_dof(report, dof)).collect()
}

fn weak(value: f64, std: Option<f64>) -> String {
    match std {
        Some(std) if value > 0.0 => {
            format!("weak: its standard deviation is {:.0} %", 100.0 * std / value)
        }
        _ => "weak".to_string(),
    }
}
