//! A table of the parameters: one row for each stiffness and each damping.

use std::io;

use flexid_pipeline::names::DOF_NAMES;
use flexid_wire::report::Verdict;

use crate::assembly::Assembly;
use crate::text::number;
use crate::{ExportError, remark};

/// Returns the text of the file. A standard deviation that does not exist is an empty field.
pub(crate) fn write(assembly: &Assembly) -> Result<String, ExportError> {
    let mut rows = csv::Writer::from_writer(Vec::new());
    rows.write_record(["joint", "dof", "kind", "value", "std", "unit", "verdict"])
        .map_err(io::Error::from)?;
    let bodies = assembly.bodies.iter().filter_map(|body| Some((body, body.report?)));
    for (body, report) in bodies {
        for kind in remark::kinds(report) {
            for (dof, name) in DOF_NAMES.into_iter().enumerate() {
                let value = number(kind.values[dof]);
                let std = kind.stds[dof].map_or_else(String::new, number);
                let verdict = word(kind.verdicts[dof]);
                rows.write_record([
                    &body.name,
                    name,
                    kind.name,
                    &value,
                    &std,
                    kind.units[dof],
                    verdict,
                ])
                .map_err(io::Error::from)?;
            }
        }
    }
    let text = rows.into_inner().map_err(|error| error.into_error())?;
    String::from_utf8(text).map_err(|error| io::Error::other(error).into())
}

/// Returns the word for a verdict, as in the file of `identify --json`.
fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Identified => "identified",
        Verdict::Weak => "weak",
        Verdict::NotObservable => "not_observable",
        Verdict::Fixed => "fixed",
    }
}
