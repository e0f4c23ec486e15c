//! Report and confidence of an estimate.

use flexid_wire::confidence::Confidence;
use flexid_wire::messages::FromEdge;
use flexid_wire::report::Report;
use flexid_wire::text::clipped;
use serde::Serialize;

/// A report and its confidence. `serde_json` writes it as the result file: the parts of the report, and `confidence` beside
/// them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Report with the parameters.
    #[serde(flatten)]
    pub report: Report,
    /// Confidence of the report.
    pub confidence: Confidence,
}

impl Finding {
    /// Adds a warning why there is no record, if the finding rests on static tests alone. `state` is the reason in words.
    pub fn explain(&mut self, state: &str) {
        let Report { fit, warnings, .. } = &mut self.report;
        if fit.records == 0 && !warnings.iter().any(|warning| warning == state) {
            // There is room: without records there are few warnings.
            let _ = warnings.push(clipped(format_args!("no record: {state}")));
        }
    }

    /// Returns the messages for clients, which are sent one right after the other.
    pub fn messages(&self) -> [FromEdge; 2] {
        [FromEdge::Report(self.report.clone()), FromEdge::Confidence(self.confidence.clone())]
    }
}
