//! What the records tell: the parameters, and how far to trust them.

use flexid_wire::confidence::Confidence;
use flexid_wire::messages::FromEdge;
use flexid_wire::report::Report;
use flexid_wire::text::clipped;
use serde::Serialize;

/// A report and what it leaves out. With `serde_json` it is the result file: the report, and beside its parts
/// `confidence`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The parameters.
    #[serde(flatten)]
    pub report: Report,
    /// How far to trust them.
    pub confidence: Confidence,
}

impl Finding {
    /// Says why there is no record, if it rests on static tests alone: `state` in words.
    pub(crate) fn explain(&mut self, state: &str) {
        let Report { fit, warnings, .. } = &mut self.report;
        if fit.records == 0 && !warnings.iter().any(|warning| warning == state) {
            // Warnings of records there are next to none then.
            let _ = warnings.push(clipped(format_args!("no record: {state}")));
        }
    }

    /// As it goes to clients: one right after the other.
    pub fn messages(&self) -> [FromEdge; 2] {
        [FromEdge::Report(self.report.clone()), FromEdge::Confidence(self.confidence.clone())]
    }
}
